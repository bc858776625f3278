//! The estimator of Eqs. (11) to (17).

use super::delay::{DelayLine, Operator, whole_steps};
use super::expansion::{Factor, HIGHEST_ORDER, regression};
use super::exponentials::exp;
use super::filter::{Filter, Nodes, no_signal};
use super::mixing::Mixer;
use super::scalar::{Excited, ScalarEstimator};
use crate::real::Real;

/// The numbers of a regression.
const NUMBERS: usize = HIGHEST_ORDER + 2;

/// The most unknowns of the second mixing.
const UNKNOWNS: usize = HIGHEST_ORDER + 1;

/// A regression at the nodes of a step, or its filtered version.
type RegressionNodes<R> = [Nodes<R>; NUMBERS];

/// One operator of the second mixing.
#[derive(Clone, Debug)]
enum Branch<R> {
    Lag(Filter<R>),
    /// The regressions of all components, one after the other.
    Delay(DelayLine<R>),
}

/// The states of one component.
#[derive(Clone, Debug)]
struct Component<R> {
    m: R,
    /// The factor g at the end of the last step.
    factor: R,
    /// The regression, through the operators too, at the nodes of a step.
    regressions: [RegressionNodes<R>; UNKNOWNS],
    /// The scalar regression there.
    delta: Nodes<R>,
    mixed: Nodes<R>,
}

/// The scalar regressions of Eq. (17), each component on its own. All filters start from zero.
#[derive(Clone, Debug)]
pub struct Proposed<R> {
    k: f64,
    order: usize,
    factor: Factor,
    smoothing: Filter<R>,
    branches: Vec<Branch<R>>,
    phi: R,
    components: Vec<Component<R>>,
    mixer: Mixer<R>,
}

impl<R: Real> Proposed<R> {
    /// Makes them from checked settings for n components; h is the first step's length, which matters to delays only.
    pub fn new(k: f64, order: usize, filters: &[Operator], n: usize, factor: Factor, h: f64) -> Self {
        let branch = |operator: &Operator| match operator {
            Operator::Lag(pole) => Some(Branch::Lag(Filter::new(*pole))),
            Operator::Delay(delay) => Some(Branch::Delay(DelayLine::new(n * NUMBERS, whole_steps(*delay, h)?))),
        };
        let component = Component {
            m: R::zero(),
            factor: R::splat(1.0),
            regressions: [[no_signal(); NUMBERS]; UNKNOWNS],
            delta: no_signal(),
            mixed: no_signal(),
        };
        Self {
            k,
            order,
            factor,
            smoothing: Filter::new(k),
            branches: filters.iter().filter_map(branch).collect(),
            phi: R::zero(),
            components: vec![component; n],
            mixer: Mixer::new(order + 1),
        }
    }

    /// Advances the scalar estimators of the components by one step of length h, given the nodes of Delta and of each
    /// mbar_i, Eq. (10), and whether they may have jumped at its start.
    #[inline(always)]
    pub fn step(&mut self, scalars: &mut [ScalarEstimator<R>], h: R, delta: &Nodes<R>, mbar: &[Nodes<R>], jump: bool) {
        self.smoothing.set_step(h);
        let mut delays = false;
        for branch in &mut self.branches {
            match branch {
                Branch::Lag(filter) => filter.set_step(h),
                Branch::Delay(_) => delays = true,
            }
        }
        // Without a jump the first node is the last one of the step before.
        let first = usize::from(!jump && !delays);
        let phi = self.smoothing.step(self.phi, delta);
        self.phi = phi[2];
        for i in 0..self.components.len() {
            let (component, mbar) = (&mut self.components[i], &mbar[i]);
            let m = self.smoothing.step(component.m, mbar);
            component.m = m[2];
            for node in 0..3 {
                if node < first {
                    for of in &mut component.regressions[0] {
                        of[0] = of[2];
                    }
                    continue;
                }
                let factor = match self.factor {
                    Factor::Keep if node == 0 => component.factor,
                    Factor::Keep => exp(m[node]),
                    Factor::Drop => R::splat(1.0),
                };
                component.factor = factor;
                let k = R::splat(self.k);
                let dm = k * (mbar[node] - m[node]);
                let dphi = k * (delta[node] - phi[node]);
                let found = regression(self.order, [m[node], dm], [phi[node], dphi], factor);
                for number in 0..NUMBERS {
                    component.regressions[0][number][node] = found[number];
                }
            }
            extend(&mut self.branches, i, &mut component.regressions);
            match self.order {
                1 => mix::<R, 2>(&mut self.mixer, component, first),
                _ => mix::<R, UNKNOWNS>(&mut self.mixer, component, first),
            }
            let excited = Excited::new(h, &component.delta);
            scalars[i].step_with(&excited, &component.mixed, &mut None);
        }
        for branch in &mut self.branches {
            if let Branch::Delay(line) = branch {
                line.advance();
            }
        }
    }
}

/// Computes the i-th component's regression through the q operators, whose states are their last nodes.
#[inline(always)]
fn extend<R: Real>(branches: &mut [Branch<R>], i: usize, regressions: &mut [RegressionNodes<R>; UNKNOWNS]) {
    let [own, filtered @ ..] = regressions;
    for (branch, out) in branches.iter_mut().zip(filtered) {
        match branch {
            Branch::Lag(filter) => {
                for number in 0..NUMBERS {
                    out[number] = filter.step(out[number][2], &own[number]);
                }
            }
            Branch::Delay(line) => {
                let delayed = &mut line.delayed_mut()[i * NUMBERS..];
                for ((out, delayed), own) in out.iter_mut().zip(delayed).zip(own.iter()) {
                    *out = *delayed;
                    *delayed = *own;
                }
            }
        }
    }
}

/// Computes the second mixing at the nodes from `first` on: the determinant and the mixed value of the first unknown.
/// The nodes before are the last of the step before.
#[inline(always)]
fn mix<R: Real, const N: usize>(mixer: &mut Mixer<R>, component: &mut Component<R>, first: usize) {
    component.delta[0] = component.delta[2];
    component.mixed[0] = component.mixed[2];
    for node in first..3 {
        let mut m = [R::zero(); UNKNOWNS * UNKNOWNS];
        let mut z = [R::zero(); UNKNOWNS];
        for i in 0..N {
            let row = &component.regressions[i];
            z[i] = row[0][node];
            for j in 0..N {
                m[i * N + j] = row[j + 1][node];
            }
        }
        let mixed = mixer.mix_first_of::<N>(&m, &z);
        (component.delta[node], component.mixed[node]) = mixed;
    }
}
