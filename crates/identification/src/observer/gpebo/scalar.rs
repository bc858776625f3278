//! The gradient estimator of one parameter, with exponential steps.

use super::excitation::Window;
use super::exponentials::decays;
use super::filter::Nodes;
use crate::real::{MOST_LANES, Real};

/// Estimates theta from `M = Delta theta + d` by `theta' = gamma Delta (M - Delta theta)`, starting at `theta(0) = 0`.
///
/// The equation is linear in theta. Its rate `gamma Delta^2` may be large (stiff) or zero (no excitation). Each step
/// is divided into eight parts, in which Delta and M are parabolas through the step's nodes. In each part, the rate
/// and the drive are frozen at their means, `I_a = gamma int Delta^2 dt` and `I_b = gamma int Delta M dt` by
/// Simpson's rule. The frozen equation is solved exactly: `theta += phi_1(-I_a) I_b - (1 - e^(-I_a)) theta`,
/// `phi_1(x) = (e^x - 1) / x`.
///
/// M / Delta is never formed. The step is stable for every gamma, but exact only if M / Delta is constant over a part.
/// If gamma is so large that theta follows a fast M / Delta, an error remains, which step halving reveals. With d = 0,
/// `I_b = I_a theta` and the error is `e^(-int gamma Delta^2)` times the initial one.
#[derive(Clone, Debug)]
pub struct ScalarEstimator<R = f64> {
    gain: f64,
    theta: R,
    /// theta and the integral in the middle of the last step.
    middle: (R, R),
    integral: R,
    window: Window<R>,
}

/// Parts of a step. If the rate changes much within a step, as in the stiff case, the error falls with the square of
/// this number.
const PARTS: usize = 8;

/// The values of a signal at the ends and in the middles of the parts of a step.
#[derive(Clone, Copy)]
struct Course<R>([R; 2 * PARTS + 1]);

impl<R: Real> Course<R> {
    /// Follows the parabola through the nodes.
    #[inline(always)]
    fn through([first, middle, last]: &Nodes<R>) -> Self {
        let slope = R::splat(4.0) * *middle - R::splat(3.0) * *first - *last;
        let curvature = *last - *first - slope;
        let mut values = [R::zero(); 2 * PARTS + 1];
        for (i, value) in values.iter_mut().enumerate() {
            let s = R::splat(i as f64 / (2 * PARTS) as f64);
            *value = (curvature * s + slope) * s + *first;
        }
        Self(values)
    }

    /// Returns the integrals of the product with another signal over each part, by Simpson's rule; `sixth` is a
    /// sixth of a part.
    #[inline(always)]
    fn integrals(&self, other: &Self, sixth: R) -> [R; PARTS] {
        let mut integrals = [R::zero(); PARTS];
        for (i, integral) in integrals.iter_mut().enumerate() {
            let first = self.0[2 * i] * other.0[2 * i];
            let middle = R::splat(4.0) * self.0[2 * i + 1] * other.0[2 * i + 1];
            let last = self.0[2 * i + 2] * other.0[2 * i + 2];
            *integral = sixth * (first + middle + last);
        }
        integrals
    }
}

/// Delta over a step, as all estimators need it that have it in common.
pub struct Excited<R> {
    sixth: R,
    delta: Course<R>,
    /// `int Delta^2` over each part.
    squares: [R; PARTS],
}

impl<R: Real> Excited<R> {
    /// Integrates Delta over the parts of a step of length h, given its nodes.
    #[inline(always)]
    pub fn new(h: R, delta: &Nodes<R>) -> Self {
        let sixth = h / R::splat(PARTS as f64) / R::splat(6.0);
        let delta = Course::through(delta);
        Self {
            sixth,
            squares: delta.integrals(&delta, sixth),
            delta,
        }
    }
}

/// `e^(-I_a) - 1` and `phi_1(-I_a)` of each part, for one gain.
pub struct Decay<R> {
    gain: f64,
    factor: [R; PARTS],
    phi: [R; PARTS],
}

impl<R: Real> Decay<R> {
    /// Computes them for a gain.
    #[inline(always)]
    fn new(gain: f64, excited: &Excited<R>) -> Self {
        let mut rates = excited.squares;
        for rate in &mut rates {
            *rate = R::splat(gain) * *rate;
        }
        let (factor, phi) = decays(&rates);
        Self { gain, factor, phi }
    }
}

impl<R: Real> ScalarEstimator<R> {
    /// Makes the estimator with gain gamma > 0 (1/s per squared unit of Delta).
    pub fn new(gain: f64) -> Self {
        Self {
            gain,
            theta: R::zero(),
            middle: (R::zero(), R::zero()),
            integral: R::zero(),
            window: Window::new(),
        }
    }

    /// Starts again from zero.
    pub fn restart(&mut self) {
        (self.theta, self.integral) = (R::zero(), R::zero());
        self.middle = (R::zero(), R::zero());
        self.window.restart();
    }

    /// Advances one step of length h, given Delta and M at its nodes.
    #[inline(always)]
    pub fn step(&mut self, h: R, delta: &Nodes<R>, mixed: &Nodes<R>) {
        self.step_with(&Excited::new(h, delta), mixed, &mut None);
    }

    /// Does the same, given Delta over the step and the decay of the estimator before, which serves again if its
    /// gain is the same.
    #[inline(always)]
    pub fn step_with(&mut self, excited: &Excited<R>, mixed: &Nodes<R>, known: &mut Option<Decay<R>>) {
        let Decay { factor, phi, .. } = match known {
            Some(known) if known.gain == self.gain => &*known,
            _ => known.insert(Decay::new(self.gain, excited)),
        };
        let drives = excited.delta.integrals(&Course::through(mixed), excited.sixth);
        let gain = R::splat(self.gain);
        for i in 0..PARTS {
            if i == PARTS / 2 {
                self.middle = (self.theta, self.integral);
            }
            let drive = gain * drives[i];
            self.theta = self.theta + (phi[i] * drive + factor[i] * self.theta);
            self.integral = self.integral + excited.squares[i];
        }
    }

    /// Records how much has been learnt by the times t of the lanes, for [`Self::frozen_at`].
    #[inline(always)]
    pub fn record(&mut self, t: &[f64; MOST_LANES]) {
        self.window.record(t, R::splat(self.gain) * self.integral);
    }

    /// Returns the estimate.
    pub fn theta(&self) -> R {
        self.theta
    }

    /// Returns the estimate and `gamma int Delta^2 dt` at the end, or in the middle, of the last step.
    #[inline(always)]
    pub(super) fn state(&self, at: At) -> (R, R) {
        let (theta, integral) = match at {
            At::Middle => self.middle,
            At::End => (self.theta, self.integral),
        };
        (theta, R::splat(self.gain) * integral)
    }

    /// Returns `int Delta^2 dt` so far.
    pub fn integral(&self) -> R {
        self.integral
    }

    /// Returns the first recorded t from which `gamma int_t^T Delta^2 < 0.01`. `None` if that t is in the last
    /// hundredth of the horizon T, in one lane. See [`super::Excitation::frozen_at`].
    pub fn frozen_at(&self, horizon: f64, lane: usize) -> Option<f64> {
        self.window.frozen_at(horizon, lane)
    }
}

/// A place in a step.
#[derive(Clone, Copy, Debug)]
pub enum At {
    /// After half the step.
    Middle,
    /// After the step.
    End,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Constant Delta and M have a closed form; tested for rates from 1e-20 to 1e20 per step.
    #[test]
    fn constant_coefficients_are_exact() {
        for exponent in [-20, -8, -2, 0, 1, 3, 20] {
            let gain = 10_f64.powi(exponent);
            let mut estimator = ScalarEstimator::<f64>::new(gain);
            estimator.theta = 0.25;
            estimator.step(1.0, &[1.0; 3], &[0.75; 3]);
            let exact = 0.25 - 0.5 * (-gain).exp_m1();
            assert!((estimator.theta() - exact).abs() < 3e-16, "{gain}");
        }
    }

    #[test]
    fn nothing_is_learnt_from_nothing() {
        let mut estimator = ScalarEstimator::<f64>::new(1e300);
        estimator.step(1.0, &[0.0; 3], &[7.0; 3]);
        assert_eq!((estimator.theta(), estimator.integral()), (0.0, 0.0));
    }
}
