//! A number that a test of a claim looks at.

use crate::claim::known::Known;

/// A number of a cell.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Number {
    /// The coefficient, if a test looks at several.
    pub(crate) name: Option<String>,
    /// The evidence about it.
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

/// Why there is no number, in words.
pub(crate) type Missing = String;

pub(crate) fn single(number: Result<impl Into<Number>, Missing>) -> Result<Vec<Number>, Missing> {
    number.map(|number| vec![number.into()])
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
