//! When an estimator stops learning.

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
pub struct Window {
    kept: VecDeque<(f64, f64)>,
    last: f64,
}

impl Default for Window {
    fn default() -> Self {
        Self::new()
    }
}

impl Window {
    /// Makes a window with `L(0) = 0`.
    pub fn new() -> Self {
        let mut kept = VecDeque::with_capacity(RESOLUTION as usize + 4);
        kept.push_back((0.0, 0.0));
        Self { kept, last: 0.0 }
    }

    /// Records `L(t)`, which does not decrease with t.
    #[inline]
    pub fn record(&mut self, t: f64, learnt: f64) {
        self.last = learnt;
        let newest = self.kept.back().map_or(f64::NEG_INFINITY, |kept| kept.1);
        // Written so that a NaN is not kept either.
        if !(learnt - newest >= FROZEN / RESOLUTION) {
            return;
        }
        while self
            .kept
            .front()
            .is_some_and(|kept| learnt - kept.1 >= FROZEN)
        {
            self.kept.pop_front();
        }
        self.kept.push_back((t, learnt));
    }

    /// Returns the first t from which `gamma int_t^T Delta^2` is below 0.01: from then on, the error of the estimate
    /// can shrink by at most 1 %. It is 0 if there was nothing to learn at all. The threshold is met to 0.2 % of
    /// itself, t to one step.
    ///
    /// `None` if that t lies in the last hundredth of the horizon T. There the integral ends because the run ends, and
    /// the estimator was still learning.
    pub fn frozen_at(&self, horizon: f64) -> Option<f64> {
        let first = self.kept.iter().find(|kept| self.last - kept.1 < FROZEN);
        first.map(|kept| kept.0).filter(|t| *t <= 0.99 * horizon)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// L = 1 - e^-t: the remaining part at t is e^-t - e^-T.
    #[test]
    fn decaying_excitation() {
        let mut window = Window::new();
        let (steps, horizon) = (100_000, 20.0);
        for k in 1..=steps {
            let t = horizon * f64::from(k) / f64::from(steps);
            window.record(t, -(-t).exp_m1());
            assert!(window.kept.len() <= RESOLUTION as usize + 2);
        }
        let exact = -(0.01 + (-horizon).exp()).ln();
        let found = window.frozen_at(horizon).unwrap();
        assert!((found - exact).abs() < 3e-3, "{found} {exact}");
    }

    #[test]
    fn steady_or_no_excitation() {
        let mut window = Window::new();
        for k in 1..=1000 {
            window.record(f64::from(k) / 100.0, f64::from(k) / 100.0);
        }
        assert_eq!(window.frozen_at(10.0), None);
        let mut idle = Window::new();
        idle.record(1.0, 0.0);
        idle.record(2.0, 1e-9);
        assert_eq!(idle.frozen_at(2.0), Some(0.0));
    }
}
