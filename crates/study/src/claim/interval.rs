//! The interval of a number by which its cell is judged: it lies on one side of a limit exactly where the test is
//! certain at the level of the cell.
//!
//! Holm's step-down rejects one p-value after the other, at level / m, level / (m - 1) and so on. It is the same to
//! compare all p-values with the level at which it stopped: those before it are smaller, those after it are larger. So
//! all cells of a claim have one level for "passes" and one for "fails", and each is the level divided by a whole
//! number.

use crate::claim::evidence::Part;
use crate::claim::known::{Known, slope_end};
use crate::claim::one_sided::Side;
use crate::design::file::Holds;

/// The outcome of a cell that certainly passes, that certainly fails, and that is not judged.
pub(crate) const PASS: &str = "pass";
pub(crate) const FAIL: &str = "fail";
pub(crate) const LEFT_OUT: &str = "left out";

/// The levels at which the cells of a claim are compared, for "it passes" and "it fails".
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Levels {
    pass: f64,
    fail: f64,
}

impl Levels {
    /// Computes them from the numbers of certain cells among the judged ones.
    pub(crate) fn new(holds: Holds, [passing, failing]: [usize; 2], judged: usize, among: usize, level: f64) -> Self {
        // The step at which Holm's procedure stopped; if all are certain, the last one.
        let holm = |certain: usize| level / (among + 1 - (certain + 1).min(judged.max(1))) as f64;
        let of = |certain: usize, all: Holds| {
            // A claim that needs all cells compares each by itself if all are certain.
            if holds == all && certain == judged {
                level
            } else {
                holm(certain)
            }
        };
        Self {
            pass: of(passing, Holds::Everywhere),
            fail: of(failing, Holds::Somewhere),
        }
    }

    /// The level at which the mark of a cell was decided. Neither p-value of an open cell is below its level, so it is
    /// the smaller one.
    pub(crate) fn of(self, says: &str) -> Option<f64> {
        match says {
            PASS => Some(self.pass),
            FAIL => Some(self.fail),
            LEFT_OUT => None,
            _ => Some(self.pass.min(self.fail)),
        }
    }
}

impl Part {
    /// Returns the interval of the number at the level of its cell, which looks at `count` numbers.
    ///
    /// All numbers of a cell that passes are inside: each at the level. Of a cell that fails one is outside, so each is
    /// compared at the level over their number (Bonferroni, as in [`super::evidence::Evidence::p_values`]), and over 2
    /// where the range has two ends.
    pub(crate) fn interval(&self, says: &str, level: f64, count: usize) -> [f64; 2] {
        let known = &self.number.known;
        let level = if says == PASS || says == LEFT_OUT {
            level
        } else {
            level / count.max(1) as f64 / known.ends_at_once(self.range)
        };
        [Side::Above, Side::Below].map(|side| known.end(side, level))
    }
}

impl Known {
    /// Returns an end of the interval: the lower one for the side above it, the upper one for the side below it. A
    /// limit beyond it is certain: its p-value is at most the level.
    fn end(&self, side: Side, level: f64) -> f64 {
        let sign = match side {
            Side::Above => -1.0,
            Side::Below => 1.0,
        };
        let is_open = |x: f64| self.test(side, x, false).p > level;
        match self {
            Self::Exact(value) => *value,
            Self::Quantile { q, ranked, .. } => ranked.end(*q, side, level),
            Self::Slope { cells, .. } => slope_end(cells, side, level),
            Self::Share { count, total } => {
                let share = *count as f64 / *total as f64;
                let edge = if side == Side::Above { 0.0 } else { 1.0 };
                if share == edge {
                    return edge;
                }
                // From the share towards 0 or 1, where it is certain.
                let at = |s: f64| share + s * (edge - share);
                at(crossing(|s| is_open(at(s)), 1.0))
            }
            Self::Moment { .. } | Self::Medians { .. } | Self::Time { .. } => {
                let (value, error) = self.shown();
                let unit = if error > 0.0 { error } else { value.abs() };
                let at = |s: f64| value + sign * s * unit;
                at(largest(|s| is_open(at(s))))
            }
        }
    }
}

/// Returns the s from which a falling p-value is no longer above the level; infinite if there is none.
fn largest(is_above: impl Fn(f64) -> bool) -> f64 {
    const FAR: f64 = 1e4;
    let mut high = 4.0;
    while is_above(high) {
        if high > FAR {
            return f64::INFINITY;
        }
        high *= 4.0;
    }
    crossing(is_above, high)
}

/// Returns the s between 0 and `high`, where a falling p-value reaches the level, by bisection.
fn crossing(is_above: impl Fn(f64) -> bool, mut high: f64) -> f64 {
    let mut low = 0.0;
    for _ in 0..40 {
        let middle = f64::midpoint(low, high);
        if is_above(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests;
