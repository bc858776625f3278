//! Iterations to a fixed point that solve a linear problem in each pass.

use super::FailureKind;

/// The largest number of passes of an iteration.
pub(super) const MOST_PASSES: usize = 400;

/// After each so many passes it is asked whether the change has become this share of what it was.
const ROUND: usize = 25;
const PROGRESS: f64 = 0.3;

/// The share of each change that an iteration takes.
pub(super) struct Damping {
    pub(super) share: f64,
    asked: f64,
}

impl Damping {
    /// All of each change.
    pub(super) const fn none() -> Self {
        Self {
            share: 1.0,
            asked: f64::INFINITY,
        }
    }

    /// Whether the iteration goes around its solution, given the relative change of a pass. If so, it is to begin again
    /// at the best model, and takes half as much of each change from now on.
    pub(super) fn goes_around(&mut self, pass: usize, change: f64) -> bool {
        if !pass.is_multiple_of(ROUND) {
            return false;
        }
        let goes_around = change > PROGRESS * self.asked;
        if goes_around {
            self.share /= 2.0;
        }
        self.asked = change;
        goes_around
    }
}

/// Changes values by a share of the way to new ones. Returns the longest way and the largest new value, each times the
/// length of its column.
pub(super) fn replace(old: &mut [f64], new: &[f64], share: f64, length: impl Fn(usize) -> f64) -> [f64; 2] {
    let (mut way, mut size) = (0.0_f64, 0.0_f64);
    for (j, (old, new)) in old.iter_mut().zip(new).enumerate() {
        way = way.max((*old - new).abs() * length(j));
        size = size.max(new.abs() * length(j));
        *old = if share < 1.0 {
            share.mul_add(new - *old, *old)
        } else {
            *new
        };
    }
    [way, size]
}

/// Returns the failure of an iteration that did not converge if the best model, of which `least` is the loss, is what
/// it found; `None` if its failure leaves none.
pub(super) fn unfinished(kind: FailureKind, least: f64) -> Option<FailureKind> {
    let ends = [FailureKind::UnstablePredictor, FailureKind::UnstableInstruments];
    if ends.contains(&kind) || least.is_infinite() {
        return None;
    }
    Some(if kind.leaves_a_model() {
        kind
    } else {
        FailureKind::IterationLimit
    })
}
