//! The interval of a number by which its cell is judged: it lies on one side of a limit exactly where the test is
//! certain at the level of the cell.
//!
//! Holm's step-down rejects one p-value after the other, at level / m, level / (m - 1) and so on. It is the same to
//! compare all p-values with the level at which it stopped: those before it are smaller, those after it are larger. So
//! all cells of a claim have one level for "passes" and one for "fails", and each is the level divided by a whole
//! number.

use crate::claim::evidence::Part;
use crate::claim::known::Line;
use crate::claim::known::{Known, Range};
use crate::design::file::claim::Holds;

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
    pub(crate) fn new(
        holds: Holds,
        [passing, failing]: [usize; 2],
        judged: usize,
        among: usize,
        level: f64,
    ) -> Self {
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
    /// compared at the level over their number (Bonferroni, as in [`super::evidence::Evidence::p_values`]).
    pub(crate) fn interval(&self, says: &str, level: f64, count: usize) -> [f64; 2] {
        let known = &self.number.known;
        if says == PASS || says == LEFT_OUT {
            [-1.0, 1.0].map(|side| known.end(self.range, side, level, false))
        } else {
            let level = level / count.max(1) as f64;
            [-1.0, 1.0].map(|side| known.end(self.range, side, level, true))
        }
    }
}

impl Known {
    /// Returns an end of the interval: the lower one for the side -1, the upper one for 1. A limit beyond it is
    /// certain: its p-value is at most the level. For a number that may be `outside` a range with two ends, the p-value
    /// is that of [`Known::outside`].
    fn end(&self, range: Range, side: f64, level: f64, outside: bool) -> f64 {
        let two = range.low.is_finite() && range.high.is_finite() && outside;
        // A limit that numbers inside must exceed is one that numbers outside may equal.
        let open = range.open != outside;
        // The range of numbers above the lower end, or below the upper end.
        let beyond = |x: f64| match side {
            -1.0 => Range {
                low: x,
                high: f64::INFINITY,
                open,
            },
            _ => Range {
                low: f64::NEG_INFINITY,
                high: x,
                open,
            },
        };
        match self {
            Self::Exact(value) => *value,
            Self::Estimate {
                value,
                error,
                logarithmic,
                ..
            } => {
                let at = |s: f64| {
                    if *logarithmic {
                        value * (side * s * error / value).exp()
                    } else {
                        value + side * s * error
                    }
                };
                let p = |s: f64| {
                    let x = at(s);
                    if two {
                        self.outside(moved(range, side, x, *logarithmic))
                    } else {
                        self.inside(beyond(x))
                    }
                };
                at(largest(|s| p(s) > level))
            }
            Self::Moment {
                value,
                error,
                sides,
                ..
            } => {
                let level = if two { level / 2.0 } else { level };
                let [below, above] = &**sides;
                let test = if side < 0.0 { above } else { below };
                let at = |s: f64| match test.line {
                    Line::Logarithm => value * (side * s * error / value).exp(),
                    Line::Value | Line::Square => value + side * s * error,
                };
                at(largest(|s| !self.is_inside(beyond(at(s)), level)))
            }
            Self::Count { count, total } => {
                let level = if two { level / 2.0 } else { level };
                let share = *count as f64 / *total as f64;
                let edge = if side < 0.0 { 0.0 } else { 1.0 };
                if share == edge {
                    return edge;
                }
                // From the share towards 0 or 1, where it is certain.
                let at = |s: f64| share + s * (edge - share);
                at(crossing(|s| self.inside(beyond(at(s))) > level, 1.0))
            }
            Self::Ranks { points, .. } => {
                let level = if two { level / 2.0 } else { level };
                // What is known changes only at the points.
                let known = points.iter().map(|(x, _)| *x).filter(|x| x.is_finite());
                let certain = known.filter(|x| self.inside(beyond(*x)) <= level);
                let ends = certain.map(|x| side * x);
                side * ends.fold(f64::INFINITY, f64::min)
            }
        }
    }
}

/// Moves a range with two ends so that the nearer end is at x: the upper end for a number above it.
fn moved(range: Range, side: f64, x: f64, logarithmic: bool) -> Range {
    let Range { low, high, open } = range;
    let (low, high) = match (side < 0.0, logarithmic) {
        (true, true) => (x * (low.max(0.0) / high), x),
        (true, false) => (x - (high - low), x),
        (false, true) => (x, x * (high / low.max(0.0))),
        (false, false) => (x, x + (high - low)),
    };
    Range { low, high, open }
}

/// Returns the s from which a falling p-value is no longer above the level; infinite if there is none.
fn largest(is_above: impl Fn(f64) -> bool) -> f64 {
    const FAR: f64 = 1e9;
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
    for _ in 0..48 {
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
