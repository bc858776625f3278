//! The search of a dead time within a range.

use super::{ContinuousIv, MOST_STEPS, REST};
use crate::estimator::{FailureKind, Window};

impl ContinuousIv {
    /// Begins anew at the present dead time, and iterates.
    pub(super) fn settle(&mut self, window: Window<'_>, passes: &mut usize) -> Result<f64, FailureKind> {
        self.least = f64::INFINITY;
        self.start(window)?;
        self.theta.copy_from_slice(&self.best);
        self.noise.reset();
        self.iterate(window, passes)
    }

    /// Searches the dead time on a range.
    pub(super) fn search(
        &mut self,
        window: Window<'_>,
        [low, high]: [f64; 2],
        passes: &mut usize,
    ) -> Result<f64, FailureKind> {
        let mut outcome = Err(FailureKind::Singular);
        let mut best = (f64::INFINITY, low, Vec::new());
        let halves = (2.0 * low).floor() as usize..=(2.0 * high).ceil() as usize;
        for dead_time in halves.map(|i| (0.5 * i as f64).clamp(low, high)) {
            self.delay(window.u, dead_time, dead_time.floor());
            match self.settle(window, passes) {
                Err(kind) if self.least.is_infinite() => outcome = Err(kind),
                _ if self.least < best.0 => best = (self.least, dead_time, self.best.clone()),
                _ => {}
            }
        }
        let (least, from, theta) = best;
        if least.is_infinite() {
            return outcome;
        }
        let mut found = (f64::INFINITY, from, from.floor(), theta.clone());
        // A whole dead time has a sample on either side.
        let mut cells = vec![from.ceil() - 1.0, from.floor()];
        cells.dedup();
        for whole in cells {
            let ends = [whole.max(low), (whole + 1.0).min(high)];
            if ends[0] >= ends[1] {
                continue;
            }
            self.theta.copy_from_slice(&theta);
            let reached = self.approach(window, whole, ends, from, passes);
            if self.least < found.0 {
                let own = self.continuous.dead_time;
                (found, outcome) = ((self.least, own, whole, self.best.clone()), reached);
            }
        }
        let (_, dead_time, whole, theta) = found;
        self.theta.copy_from_slice(&theta);
        self.best.copy_from_slice(&theta);
        self.delay(window.u, dead_time, whole);
        if outcome.is_ok() {
            self.least = f64::INFINITY;
            outcome = self.iterate(window, passes);
            outcome = outcome.and_then(|_| self.solve(true, true));
        }
        // The end of a range that was given hides the minimum; no plant has a dead time below 0.
        let is_hidden = dead_time == high || (dead_time == low && low > 0.0);
        let has_model = outcome.err().is_none_or(FailureKind::leaves_a_model);
        if is_hidden && has_model {
            return Err(FailureKind::Boundary);
        }
        outcome
    }

    /// Goes to the dead time where the loss is least between two of them, after `whole` samples: where the step that
    /// the equation asks for is 0, or at an end beyond which it goes.
    fn approach(
        &mut self,
        window: Window<'_>,
        whole: f64,
        [mut low, mut high]: [f64; 2],
        from: f64,
        passes: &mut usize,
    ) -> Result<f64, FailureKind> {
        let (ends, mut dead_time) = ([low, high], from);
        let mut seen = [false; 2];
        for _ in 0..MOST_STEPS {
            self.delay(window.u, dead_time, whole);
            self.least = f64::INFINITY;
            self.iterate(window, passes)?;
            let condition = self.solve(true, true)?;
            let Some(stages) = &self.joint else {
                return Ok(condition);
            };
            let last = stages.theta.len() - 1;
            let step = stages.theta[last];
            let size = |(j, theta): (usize, &f64)| theta.abs() * stages.length(j);
            let size = stages.theta[..last].iter().enumerate().map(size);
            let is_small = step.abs() * stages.length(last) <= REST * size.fold(0.0, f64::max);
            let is_outside = (dead_time == ends[0] && step < 0.0) || (dead_time == ends[1] && step > 0.0);
            let (bound, other) = if step > 0.0 { (&mut low, high) } else { (&mut high, low) };
            *bound = dead_time;
            seen[usize::from(step < 0.0)] = true;
            let rounding = 4.0 * f64::EPSILON * high.max(1.0);
            if is_small || is_outside || high - low <= rounding {
                return Ok(condition);
            }
            let next = dead_time + step;
            dead_time = if low < next && next < high {
                next
            } else if seen[usize::from(step > 0.0)] {
                0.5 * (low + high)
            } else {
                other
            };
        }
        Err(FailureKind::IterationLimit)
    }
}
