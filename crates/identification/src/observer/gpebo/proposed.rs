//! The estimator of Eqs. (11) to (17), and its regression, Eq. (17), of the expanded exponential.

use super::exponentials::exp;
use super::mixing::Mixer;
use super::operators::{DelayLine, Filter, Nodes, Operator, no_signal, whole_steps};
use super::scalar::{Excited, ScalarEstimator};
use crate::real::Real;

/// The treatment of the factor `g = e^m`. It cancels from the identity of Eq. (16) but weights its terms in time.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub enum Factor {
    /// Kept, as the paper's gains assume.
    #[default]
    Keep,
    /// Replaced by 1, which needs gains of its own.
    Drop,
}

/// Highest order of the expansion.
pub const HIGHEST_ORDER: usize = 2;

/// The regression of one component at one time: `values[0]` is zeta, `values[1 ..= q+1]` is psi.
pub type Regression<R = f64> = [R; HIGHEST_ORDER + 2];

/// Computes Eq. (17) for one component from m, m', phi, phi' and the factor g, [`Factor`], with `e^d`,
/// `d = m - phi theta`, expanded to order q (1 or 2):
/// `zeta - psi'(theta, ..., theta^(q+1)) = (g / q!) (m - phi theta)^q (m' - phi' theta)`.
///
/// From Eq. (12), `g' = g m'`. From Eq. (15) with `E_q(d) = 1 + d + ... + d^q / q!`, multiplied by E_q,
/// `E_q g' = E_q phi' theta g + E_(q-1) d' g`. The difference of the two is the right-hand side above. It is what the
/// expansion neglects, and the estimator takes it for zero. The paper prints further terms in psi_1, which do not
/// belong there (erratum E10).
///
/// An order above 2 is taken as 2, and 0 as 1. Unused entries are zero.
#[inline(always)]
pub fn regression<R: Real>(order: usize, [m, dm]: [R; 2], [phi, dphi]: [R; 2], g: R) -> Regression<R> {
    if order < 2 {
        let first = g * m * dm;
        return [first, g * (m * dphi + phi * dm), -g * phi * dphi, R::zero()];
    }
    // Division by a power of two is multiplication by its inverse.
    let half = R::splat(0.5);
    [
        g * m * m * dm * half,
        g * (phi * m * dm + m * m * dphi * half),
        -g * (m * phi * dphi + phi * phi * dm * half),
        g * phi * phi * dphi * half,
    ]
}

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
        let mixed = mixer.mix_first::<N>(&m, &z);
        (component.delta[node], component.mixed[node]) = mixed;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: [f64; 4] = [-2.0, -1.0, 1.0, 3.0];

    /// Calls `check(m, dm, phi, dphi, theta)` on a grid that has more points per variable than the polynomials'
    /// degree (3 at most), so polynomials that agree there are equal. All numbers are small multiples of 1/2, so f64
    /// is exact.
    fn on_grid(check: impl Fn(f64, f64, f64, f64, f64)) {
        for k in 0..4_usize.pow(5) {
            let at = |digit: u32| GRID[k / 4_usize.pow(digit) % 4];
            check(at(0), at(1), at(2), at(3), at(4));
        }
    }

    fn residual(r: &Regression, theta: f64) -> f64 {
        r[0] - (r[1] * theta + r[2] * theta.powi(2) + r[3] * theta.powi(3))
    }

    #[test]
    fn residual_is_the_neglected_term() {
        on_grid(|m, dm, phi, dphi, theta| {
            let (d, dd) = (m - phi * theta, dm - dphi * theta);
            let first = regression(1, [m, dm], [phi, dphi], 1.0);
            assert_eq!(residual(&first, theta), d * dd);
            let second = regression(2, [m, dm], [phi, dphi], 1.0);
            assert_eq!(residual(&second, theta), d * d * dd / 2.0);
        });
    }

    /// Eq. (15) differentiated gives Eq. (16); `g' = g m'` is subtracted from it.
    #[test]
    fn residual_is_equation_16() {
        on_grid(|m, dm, phi, dphi, theta| {
            let (d, dd) = (m - phi * theta, dm - dphi * theta);
            let e = [1.0, 1.0 + d, 1.0 + d + d * d / 2.0];
            for q in 1..=2 {
                let left = e[q] * dm;
                let right = e[q] * dphi * theta + e[q - 1] * dd;
                let r = regression(q, [m, dm], [phi, dphi], 1.0);
                assert_eq!(residual(&r, theta), left - right);
            }
        });
    }

    #[test]
    fn g_is_a_common_factor() {
        let (m, dm, phi, dphi) = (0.3, -0.7, 1.1, 0.4);
        for q in 1..=2 {
            let kept = regression(q, [m, dm], [phi, dphi], 0.3_f64.exp());
            let dropped = regression(q, [m, dm], [phi, dphi], 1.0);
            for (k, d) in kept.iter().zip(dropped) {
                assert!((k - d * 0.3_f64.exp()).abs() < 1e-15);
            }
        }
    }
}
