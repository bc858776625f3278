//! The number of trials that would decide a claim, in words and as numbers.

use crate::design::file::TRIAL_LIMIT;
use serde::Serialize;
use std::fmt;

/// The number of trials in every cell that would decide a claim with 80 % power. It depends on the square of an effect
/// that is known to its standard error only, so it is a range: from the number for the far end of the effect's 80 %
/// interval to that for the near end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Needed {
    /// The fewest; `None` if they are more than a study can have.
    pub from: Option<u64>,
    /// The most; `None` if the effect may be too small for any number.
    pub to: Option<u64>,
}

impl Needed {
    /// No number of trials decides the claim.
    pub(crate) const NEVER: Self = Self { from: None, to: None };

    /// Says that so many trials would decide a claim.
    pub(crate) fn sentence(self) -> String {
        match self.to {
            Some(_) => format!("{self} would decide it"),
            None => format!("{self} would be needed"),
        }
    }
}

impl fmt::Display for Needed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.from.map(two_digits), self.to.map(two_digits)) {
            (Some(from), Some(to)) if from == to => write!(f, "some {to} trials"),
            (Some(from), Some(to)) => write!(f, "some {from} to {to} trials"),
            (Some(from), None) => write!(f, "at least {from} trials, perhaps far more,"),
            (None, _) => write!(f, "more than {} trials", two_digits(TRIAL_LIMIT)),
        }
    }
}

/// Formats a number of trials, rounded up to two digits, with commas: "41,000".
fn two_digits(trials: u64) -> String {
    let mut unit = 1;
    while trials / unit >= 100 {
        unit *= 10;
    }
    crate::text::grouped(trials.div_ceil(unit) * unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_trials_in_words() {
        let words = |from, to| Needed { from, to }.sentence();
        assert_eq!(words(Some(40_321), Some(40_900)), "some 41,000 trials would decide it");
        assert_eq!(
            words(Some(1_500), Some(40_321)),
            "some 1,500 to 41,000 trials would decide it"
        );
        assert_eq!(
            words(Some(1_500), None),
            "at least 1,500 trials, perhaps far more, would be needed"
        );
        assert_eq!(
            Needed::NEVER.sentence(),
            "more than 4,000,000,000 trials would be needed"
        );
    }
}
