//! A number that a test of a claim looks at.

use crate::claim::freedom::Freedom;
use crate::claim::known::Known;
use crate::claim::moment::Caution;
use crate::outcome::summary::CellSummary;
use asobench_identification::metric::Estimate;

/// A number of a cell.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Number {
    /// The coefficient, if a test looks at several.
    pub(crate) name: Option<String>,
    /// What is known of it.
    pub(crate) known: Known,
    /// The share of trials that it covers, if not all of them.
    pub(crate) kept: Option<f64>,
    /// Why it cannot be certain on one side of a limit or on both, in words.
    pub(crate) caution: Option<String>,
}

impl From<Known> for Number {
    fn from(known: Known) -> Self {
        Self {
            name: None,
            known,
            kept: None,
            caution: None,
        }
    }
}

impl Number {
    /// Makes a number of a moment; without error it is exact.
    pub(crate) fn of_moment((known, caution): (Known, Caution)) -> Result<Self, Missing> {
        let (value, error) = known.shown();
        if !value.is_finite() {
            return Err("the number is undefined".to_owned());
        }
        if error == 0.0 {
            return Ok(Known::Exact(value).into());
        }
        if !(error > 0.0 && error.is_finite()) {
            return Err("there are too few trials for a standard error".to_owned());
        }
        Ok(Self {
            caution,
            ..known.into()
        })
    }
}

/// Why there is no number, in words.
pub(crate) type Missing = String;

pub(crate) fn single(known: Result<Known, Missing>) -> Result<Vec<Number>, Missing> {
    known.map(|known| vec![known.into()])
}

pub(crate) fn not_kept(what: &str) -> Missing {
    format!("the run did not keep {what}; a new run of the file keeps what its claims need")
}

/// Makes the numbers of a cell without randomness exact: one trial stands for all.
pub(crate) fn exact(mut numbers: Vec<Number>) -> Vec<Number> {
    for number in &mut numbers {
        number.known = Known::Exact(number.known.shown().0);
        number.caution = None;
    }
    numbers
}

/// Returns an estimate; its error is 0 if nothing is random.
pub(crate) fn estimated(cell: &CellSummary, estimate: Estimate) -> Estimate {
    Estimate {
        mcse: if cell.deterministic {
            0.0
        } else {
            estimate.mcse
        },
        ..estimate
    }
}

/// The largest relative error with which a ratio is judged. Beyond it, the logarithm is not nearly normal.
pub(crate) const MOST_RELATIVE_ERROR: f64 = 0.5;

/// Returns an estimate with its standard error; without error it is exact.
pub(crate) fn known(
    (value, error): (f64, f64),
    freedom: Freedom,
    logarithmic: bool,
) -> Result<Known, Missing> {
    if !value.is_finite() || logarithmic && value <= 0.0 {
        Err("the number is undefined".to_owned())
    } else if logarithmic && error > MOST_RELATIVE_ERROR * value {
        Err("its standard error is more than half its value".to_owned())
    } else if error == 0.0 {
        Ok(Known::Exact(value))
    } else if error > 0.0 && error.is_finite() {
        Ok(Known::Estimate {
            value,
            error,
            freedom,
            logarithmic,
        })
    } else {
        Err("there are too few trials for a standard error".to_owned())
    }
}
