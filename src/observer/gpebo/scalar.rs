//! The gradient estimator of one parameter, with exponential steps.

use super::excitation::Window;
use super::filter::{Nodes, simpson};

/// `theta' = gamma Delta (M - Delta theta)`, the estimator of theta from `M = Delta theta + d`,
/// from `theta(0) = 0`.
///
/// The equation is linear in theta with the rate `gamma Delta^2`, which may be large (stiff) or
/// zero (no excitation): each of eight parts of a step, in which Delta and M are parabolas through
/// the step's nodes, freezes the rate and the drive at their means, `I_a = gamma int Delta^2 dt`,
/// `I_b = gamma int Delta M dt` by Simpson's rule, and solves exactly, `theta += phi_1(-I_a) I_b -
/// (1 - e^(-I_a)) theta`, `phi_1(x) = (e^x - 1) / x`. It never forms M / Delta. That is stable for
/// every gamma, but exact only where M / Delta is constant over a part: a large gamma that makes
/// theta follow a fast M / Delta leaves an error, which step halving tells. With d = 0, `I_b = I_a
/// theta` and the error is `e^(-int gamma Delta^2)` times the initial one.
#[derive(Clone, Debug)]
pub struct ScalarEstimator {
    gain: f64,
    theta: f64,
    integral: f64,
    window: Window,
}

/// Parts of a step: with rates that change much within one, which is where the equation is stiff,
/// the error is smaller by the square of their number.
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
    /// With gain gamma > 0 (1/s per squared unit of Delta).
    pub fn new(gain: f64) -> Self {
        Self {
            gain,
            theta: 0.0,
            integral: 0.0,
            window: Window::new(),
        }
    }

    /// One step of length h from Delta and M at its nodes.
    #[inline]
    pub fn step(&mut self, h: f64, delta: &Nodes, mixed: &Nodes) {
        let (delta, mixed) = (Parabola::through(delta), Parabola::through(mixed));
        let part = h / f64::from(PARTS);
        for i in 0..PARTS {
            let nodes = |parabola: &Parabola| {
                [0.0, 0.5, 1.0].map(|s| parabola.at((f64::from(i) + s) / f64::from(PARTS)))
            };
            self.part(part, &nodes(&delta), &nodes(&mixed));
        }
    }

    /// One part of length h.
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

    /// Notes what has been learnt until t, for [`Self::frozen_at`].
    #[inline]
    pub fn record(&mut self, t: f64) {
        self.window.record(t, self.gain * self.integral);
    }

    /// The estimate.
    pub fn theta(&self) -> f64 {
        self.theta
    }

    /// `int Delta^2 dt` so far.
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// The first recorded t from which `gamma int_t^T Delta^2 < 0.01`; `None` if that is in the
    /// last hundredth of the horizon T. See [`super::Excitation::frozen_at`].
    pub fn frozen_at(&self, horizon: f64) -> Option<f64> {
        self.window.frozen_at(horizon)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Constant Delta and M: the closed form, for rates from 1e-20 to 1e20 a step.
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
