//! Errors over the number of samples seen: `[course]`.

use crate::design::file::table::tables;
use crate::design::file::{FileError, at_most, wrong};

/// The largest number of points of a course.
const POINTS: usize = 200;

tables! {
    /// After which numbers of samples k the errors e_a(k), e_b(k) and e_x(k) are taken of every output. A recursive
    /// method or an adaptive observer runs once along the record; any other is run anew on the first k samples, or on
    /// the last of them (`last`).
    pub struct CourseTable {
        /// The numbers of samples k, ascending. A cell has those up to its window N.
        at: Vec<usize>,
        /// The bound below which errors are to stay, for `k_a`, `k_b` and `k_x`.
        #[serde(default = "bound")]
        bound: f64,
        /// The measures `e_a_course` to `k_x` are taken from this number of samples on.
        #[serde(default)]
        from: usize,
    }
}

fn bound() -> f64 {
    0.1
}

impl CourseTable {
    /// Checks the numbers.
    pub(crate) fn check(&self) -> Result<(), FileError> {
        let wrong = |key: &str, message: String| wrong(format_args!("course.{key}"), message);
        at_most("course.at", self.at.len(), "points", POINTS)?;
        let ascends = self.at.windows(2).all(|pair| pair[0] < pair[1]);
        let last = match (self.at.first(), self.at.last()) {
            (Some(first), Some(last)) if *first > 0 && ascends => *last,
            _ => {
                let message = "expected numbers of samples above 0, ascending, such as [50, 100, 200]";
                return wrong("at", message.to_owned());
            }
        };
        if !(self.bound > 0.0 && self.bound.is_finite()) {
            return wrong("bound", format!("{}; expected a number above 0", self.bound));
        }
        if self.from > last {
            let message = format!("{}; the last point of the course is {last}", self.from);
            return wrong("from", message);
        }
        Ok(())
    }

    /// Returns the points of a cell with a window of N samples.
    pub(crate) fn points(&self, window: usize) -> &[usize] {
        &self.at[..self.at.partition_point(|k| *k <= window)]
    }
}
