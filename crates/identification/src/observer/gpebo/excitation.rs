//! When an estimator stops learning.

use crate::real::{MOST_LANES, Mask, Real};
use std::collections::VecDeque;

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
        let mut window = Self {
            kept: vec![VecDeque::new(); R::LANES],
            newest: R::zero(),
            last: R::zero(),
        };
        window.restart();
        window
    }

    /// Forgets everything, but for `L(0) = 0`.
    pub fn restart(&mut self) {
        for kept in &mut self.kept {
            kept.clear();
            kept.push_back((0.0, 0.0));
        }
        (self.newest, self.last) = (R::zero(), R::zero());
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
