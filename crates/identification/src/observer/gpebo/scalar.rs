//! The gradient estimator of one parameter, with exponential steps, and when it stops learning.

use super::exponentials::decays;
use super::operators::Nodes;
use crate::real::{MOST_LANES, Mask, Real};
use std::collections::VecDeque;

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
    /// `int Delta^2 dt` so far.
    pub(super) integral: R,
    /// The part that was learnt lately.
    pub(super) window: Window<R>,
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

    /// Advances one step, given Delta over the step, M at its nodes, and the decay of the estimator before, which
    /// serves again if its gain is the same.
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

    /// Records how much has been learnt by the times t of the lanes, for [`Window::frozen_at`].
    #[inline(always)]
    pub fn record(&mut self, t: &[f64; MOST_LANES]) {
        self.window.record(t, R::splat(self.gain) * self.integral);
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
}

/// A place in a step.
#[derive(Clone, Copy, Debug)]
pub enum At {
    /// After half the step.
    Middle,
    /// After the step.
    End,
}

/// An estimate counts as frozen once its error can shrink by at most this share.
pub const FROZEN: f64 = 0.01;

/// Records kept per [`FROZEN`] of growth. They resolve the threshold to 0.1 % of itself.
const RESOLUTION: f64 = 1024.0;

/// The last part of a growing integral `L(t) = int gamma Delta^2`, in bounded memory.
///
/// L(T), and with it the first t for which `L(T) - L(t) < 0.01`, is known only at the end. Until then, every t with
/// `L(now) - L(t) < 0.01` may be that one. It suffices to keep one such t per growth of 0.01 / 1024.
#[derive(Clone, Debug)]
pub struct Window<R = f64> {
    /// Of each lane.
    kept: Vec<VecDeque<(f64, f64)>>,
    newest: R,
    last: R,
}

impl<R: Real> Window<R> {
    /// Makes a window with `L(0) = 0`.
    pub fn new() -> Self {
        Self {
            kept: vec![VecDeque::from([(0.0, 0.0)]); R::LANES],
            newest: R::zero(),
            last: R::zero(),
        }
    }

    /// Records `L(t)`, which does not decrease with t; the times of the lanes.
    #[inline(always)]
    pub fn record(&mut self, t: &[f64; MOST_LANES], learnt: R) {
        self.last = learnt;
        // A NaN is not kept either.
        let grown = R::splat(FROZEN / RESOLUTION).at_most(learnt - self.newest);
        if grown.any() {
            self.keep(t, learnt, grown);
        }
    }

    fn keep(&mut self, t: &[f64; MOST_LANES], learnt: R, grown: R::Mask) {
        self.newest = R::select(grown, learnt, self.newest);
        let mut numbers = [0.0; MOST_LANES];
        learnt.store(&mut numbers);
        for lane in grown.lanes() {
            let (kept, learnt) = (&mut self.kept[lane], numbers[lane]);
            // Most often everything is old.
            if kept.back().is_some_and(|kept| learnt - kept.1 >= FROZEN) {
                kept.clear();
            }
            while kept.front().is_some_and(|kept| learnt - kept.1 >= FROZEN) {
                kept.pop_front();
            }
            kept.push_back((t[lane], learnt));
        }
    }

    /// Returns the first t from which `gamma int_t^T Delta^2` is below 0.01: from then on, the error of the estimate
    /// can shrink by at most 1 %. It is 0 if there was nothing to learn at all. The threshold is met to 0.2 % of
    /// itself, t to one step.
    ///
    /// `None` if that t lies in the last hundredth of the horizon T. There the integral ends because the run ends, and
    /// the estimator was still learning.
    pub fn frozen_at(&self, horizon: f64, lane: usize) -> Option<f64> {
        let last = self.last.lane(lane);
        let first = self.kept[lane].iter().find(|kept| last - kept.1 < FROZEN);
        first.map(|kept| kept.0).filter(|t| *t <= 0.99 * horizon)
    }
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
            estimator.step_with(&Excited::new(1.0, &[1.0; 3]), &[0.75; 3], &mut None);
            let exact = 0.25 - 0.5 * (-gain).exp_m1();
            assert!((estimator.theta - exact).abs() < 3e-16, "{gain}");
        }
    }

    #[test]
    fn nothing_is_learnt_from_nothing() {
        let mut estimator = ScalarEstimator::<f64>::new(1e300);
        estimator.step_with(&Excited::new(1.0, &[0.0; 3]), &[7.0; 3], &mut None);
        assert_eq!((estimator.theta, estimator.integral), (0.0, 0.0));
    }

    /// L = 1 - e^-t: the remaining part at t is e^-t - e^-T.
    #[test]
    fn decaying_excitation() {
        let mut window = Window::<f64>::new();
        let (steps, horizon) = (100_000, 20.0);
        for k in 1..=steps {
            let t = horizon * f64::from(k) / f64::from(steps);
            window.record(&[t; MOST_LANES], -(-t).exp_m1());
            assert!(window.kept[0].len() <= RESOLUTION as usize + 2);
        }
        let exact = -(0.01 + (-horizon).exp()).ln();
        let found = window.frozen_at(horizon, 0).unwrap();
        assert!((found - exact).abs() < 3e-3, "{found} {exact}");
    }

    #[test]
    fn steady_or_no_excitation() {
        let mut window = Window::<f64>::new();
        for k in 1..=1000 {
            let t = f64::from(k) / 100.0;
            window.record(&[t; MOST_LANES], t);
        }
        assert_eq!(window.frozen_at(10.0, 0), None);
        let mut idle = Window::<f64>::new();
        idle.record(&[1.0; MOST_LANES], 0.0);
        idle.record(&[2.0; MOST_LANES], 1e-9);
        assert_eq!(idle.frozen_at(2.0, 0), Some(0.0));
    }
}
