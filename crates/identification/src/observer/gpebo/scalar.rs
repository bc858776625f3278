//! The gradient estimator of one parameter, with exponential steps.

use super::excitation::Window;
use super::filter::{Nodes, simpson};

/// Estimates theta from `M = Delta theta + d` by `theta' = gamma Delta (M - Delta theta)`, starting at `theta(0) = 0`.
///
/// The equation is linear in theta. Its rate `gamma Delta^2` may be large (stiff) or zero (no excitation). Each step is
/// divided into eight parts, in which Delta and M are parabolas through the step's nodes. In each part, the rate and
/// the drive are frozen at their means, `I_a = gamma int Delta^2 dt` and `I_b = gamma int Delta M dt` by Simpson's
/// rule. The frozen equation is solved exactly: `theta += phi_1(-I_a) I_b - (1 - e^(-I_a)) theta`,
/// `phi_1(x) = (e^x - 1) / x`.
///
/// M / Delta is never formed. The step is stable for every gamma, but exact only if M / Delta is constant over a part.
/// If gamma is so large that theta follows a fast M / Delta, an error remains, which step halving reveals. With d = 0,
/// `I_b = I_a theta` and the error is `e^(-int gamma Delta^2)` times the initial one.
#[derive(Clone, Debug)]
pub struct ScalarEstimator {
    gain: f64,
    theta: f64,
    /// theta and the integral in the middle of the last step.
    middle: (f64, f64),
    integral: f64,
    window: Window,
}

/// Parts of a step. If the rate changes much within a step, as in the stiff case, the error falls with the square of
/// this number.
const PARTS: u32 = 8;

/// The parabola through values at 0, 1/2 and 1.
struct Parabola([f64; 3]);

impl Parabola {
    #[inline]
    fn through([first, middle, last]: &Nodes) -> Self {
        let slope = 4.0 * middle - 3.0 * first - last;
        Self([*first, slope, last - first - slope])
    }

    #[inline]
    fn at(&self, s: f64) -> f64 {
        let [value, slope, curvature] = self.0;
        (curvature * s + slope) * s + value
    }
}

impl ScalarEstimator {
    /// Makes the estimator with gain gamma > 0 (1/s per squared unit of Delta).
    pub fn new(gain: f64) -> Self {
        Self {
            gain,
            theta: 0.0,
            middle: (0.0, 0.0),
            integral: 0.0,
            window: Window::new(),
        }
    }

    /// Advances one step of length h, given Delta and M at its nodes.
    #[inline]
    pub fn step(&mut self, h: f64, delta: &Nodes, mixed: &Nodes) {
        let (delta, mixed) = (Parabola::through(delta), Parabola::through(mixed));
        let part = h / f64::from(PARTS);
        for i in 0..PARTS {
            if i == PARTS / 2 {
                self.middle = (self.theta, self.integral);
            }
            let nodes = |parabola: &Parabola| {
                [0.0, 0.5, 1.0].map(|s| parabola.at((f64::from(i) + s) / f64::from(PARTS)))
            };
            self.part(part, &nodes(&delta), &nodes(&mixed));
        }
    }

    /// Advances one part of length h.
    #[inline]
    fn part(&mut self, h: f64, delta: &Nodes, mixed: &Nodes) {
        let squares = simpson(h, delta, delta);
        let rate = self.gain * squares;
        let drive = self.gain * simpson(h, delta, mixed);
        let decay = (-rate).exp_m1();
        let phi = if rate == 0.0 { 1.0 } else { -decay / rate };
        self.theta += phi * drive + decay * self.theta;
        self.integral += squares;
    }

    /// Records how much has been learnt by t, for [`Self::frozen_at`].
    #[inline]
    pub fn record(&mut self, t: f64) {
        self.window.record(t, self.gain * self.integral);
    }

    /// Returns the estimate.
    pub fn theta(&self) -> f64 {
        self.theta
    }

    /// Returns the estimate and `gamma int Delta^2 dt` at the end, or in the middle, of the last step.
    pub(super) fn state(&self, at: At) -> (f64, f64) {
        let (theta, integral) = match at {
            At::Middle => self.middle,
            At::End => (self.theta, self.integral),
        };
        (theta, self.gain * integral)
    }

    /// Returns `int Delta^2 dt` so far.
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// Returns the first recorded t from which `gamma int_t^T Delta^2 < 0.01`. `None` if that t is in the last
    /// hundredth of the horizon T. See [`super::Excitation::frozen_at`].
    pub fn frozen_at(&self, horizon: f64) -> Option<f64> {
        self.window.frozen_at(horizon)
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
            let mut estimator = ScalarEstimator::new(gain);
            estimator.theta = 0.25;
            estimator.step(1.0, &[1.0; 3], &[0.75; 3]);
            let exact = 0.25 - 0.5 * (-gain).exp_m1();
            assert!((estimator.theta() - exact).abs() < 3e-16, "{gain}");
        }
    }

    #[test]
    fn nothing_is_learnt_from_nothing() {
        let mut estimator = ScalarEstimator::new(1e300);
        estimator.step(1.0, &[0.0; 3], &[7.0; 3]);
        assert_eq!((estimator.theta(), estimator.integral()), (0.0, 0.0));
    }
}
