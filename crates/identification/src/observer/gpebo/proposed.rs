//! The estimator of Eqs. (11) to (17).

use super::delay::{DelayLine, Operator, whole_steps};
use super::expansion::{Factor, HIGHEST_ORDER, Regression, regression};
use super::filter::{Filter, Nodes};
use super::mixing::Mixer;
use super::scalar::ScalarEstimator;

/// A regression at the nodes of a step, or its filtered version.
type RegressionNodes = [Nodes; HIGHEST_ORDER + 2];

/// One operator of the second mixing.
#[derive(Clone, Debug)]
enum Branch {
    Lag(Filter),
    /// The regressions of all components, one after the other.
    Delay(DelayLine),
}

/// The states of one component.
#[derive(Clone, Debug)]
struct Component {
    m: f64,
    /// Through each lag.
    filtered: [Regression; HIGHEST_ORDER],
    scalar: ScalarEstimator,
}

/// Estimates theta from Eq. (17), each component on its own. All filters start from zero.
#[derive(Clone, Debug)]
pub struct Proposed {
    k: f64,
    order: usize,
    factor: Factor,
    smoothing: Filter,
    branches: Vec<Branch>,
    phi: f64,
    components: Vec<Component>,
    mixer: Mixer,
}

impl Proposed {
    /// Makes the estimator from checked settings; h is the first step's length, which matters to delays only.
    pub fn new(
        k: f64,
        order: usize,
        filters: &[Operator],
        gains: &[f64],
        factor: Factor,
        h: f64,
    ) -> Self {
        let branch = |operator: &Operator| match operator {
            Operator::Lag(pole) => Some(Branch::Lag(Filter::new(*pole))),
            Operator::Delay(delay) => Some(Branch::Delay(DelayLine::new(
                gains.len() * (HIGHEST_ORDER + 2),
                whole_steps(*delay, h)?,
            ))),
        };
        let component = |gain: &f64| Component {
            m: 0.0,
            filtered: [[0.0; HIGHEST_ORDER + 2]; HIGHEST_ORDER],
            scalar: ScalarEstimator::new(*gain),
        };
        Self {
            k,
            order,
            factor,
            smoothing: Filter::new(k),
            branches: filters.iter().filter_map(branch).collect(),
            phi: 0.0,
            components: gains.iter().map(component).collect(),
            mixer: Mixer::new(order + 1),
        }
    }

    /// Advances one step of length h, given the nodes of Delta and of each mbar_i, Eq. (10).
    pub fn step(&mut self, h: f64, delta: &Nodes, mbar: &[Nodes]) {
        self.smoothing.set_step(h);
        for branch in &mut self.branches {
            if let Branch::Lag(filter) = branch {
                filter.set_step(h);
            }
        }
        let phi = self.smoothing.step(self.phi, delta);
        self.phi = phi[2];
        for (i, (component, mbar)) in self.components.iter_mut().zip(mbar).enumerate() {
            let m = self.smoothing.step(component.m, mbar);
            component.m = m[2];
            let mut own: RegressionNodes = Default::default();
            for node in 0..3 {
                let dm = self.k * (mbar[node] - m[node]);
                let dphi = self.k * (delta[node] - phi[node]);
                let r = regression(self.order, m[node], dm, phi[node], dphi, self.factor);
                for (own, r) in own.iter_mut().zip(r) {
                    own[node] = r;
                }
            }
            let filtered = extend(&mut self.branches, i, &mut component.filtered, &own);
            let (delta, mixed) = mix(&mut self.mixer, self.order, &own, &filtered);
            component.scalar.step(h, &delta, &mixed);
        }
        for branch in &mut self.branches {
            if let Branch::Delay(line) = branch {
                line.advance();
            }
        }
    }

    /// Returns the scalar estimators, in the order of theta.
    pub fn scalars(&self) -> impl Iterator<Item = &ScalarEstimator> {
        self.components.iter().map(|component| &component.scalar)
    }

    /// Returns the scalar estimators mutably, to record what they have learnt.
    pub fn scalars_mut(&mut self) -> impl Iterator<Item = &mut ScalarEstimator> {
        self.components
            .iter_mut()
            .map(|component| &mut component.scalar)
    }
}

/// Returns the i-th component's regression through the q operators, whose states are updated.
#[inline]
fn extend(
    branches: &mut [Branch],
    i: usize,
    states: &mut [Regression; HIGHEST_ORDER],
    own: &RegressionNodes,
) -> [RegressionNodes; HIGHEST_ORDER] {
    let mut out: [RegressionNodes; HIGHEST_ORDER] = Default::default();
    for ((branch, states), out) in branches.iter_mut().zip(states).zip(&mut out) {
        match branch {
            Branch::Lag(filter) => {
                for ((state, own), out) in states.iter_mut().zip(own).zip(out) {
                    *out = filter.step(*state, own);
                    *state = out[2];
                }
            }
            Branch::Delay(line) => {
                let delayed = &mut line.delayed_mut()[i * own.len()..];
                for ((delayed, own), out) in delayed.iter_mut().zip(own).zip(out) {
                    *out = std::mem::replace(delayed, *own);
                }
            }
        }
    }
    out
}

/// Returns the second mixing at each node: the determinant and the mixed value of the first unknown.
#[inline]
fn mix(
    mixer: &mut Mixer,
    order: usize,
    own: &RegressionNodes,
    filtered: &[RegressionNodes; HIGHEST_ORDER],
) -> (Nodes, Nodes) {
    let unknowns = order + 1;
    let (mut delta, mut mixed) = ([0.0; 3], [0.0; 3]);
    for node in 0..3 {
        let mut m = [0.0; (HIGHEST_ORDER + 1) * (HIGHEST_ORDER + 1)];
        let mut z = [0.0; HIGHEST_ORDER + 1];
        for (i, row) in std::iter::once(own)
            .chain(filtered)
            .take(unknowns)
            .enumerate()
        {
            z[i] = row[0][node];
            for j in 0..unknowns {
                m[i * unknowns + j] = row[j + 1][node];
            }
        }
        (delta[node], mixed[node]) = mixer.mix_first(&m, &z);
    }
    (delta, mixed)
}
