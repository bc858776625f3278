//! The number of trials that would decide a claim, in words and as numbers.

use super::power::Needed;
use super::sentence::grouped;
use std::fmt;

impl Needed {
    /// Returns the fewest and the most trials of every cell that it names; `None` if a study cannot have so many.
    pub fn extent(self) -> Option<[u64; 2]> {
        match self {
            Self::Trials(trials) => Some([trials; 2]),
            Self::MoreThan(_) => None,
        }
    }
}

impl fmt::Display for Needed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Trials(trials) => write!(f, "some {} trials", grouped(*trials)),
            Self::MoreThan(most) => write!(f, "more than {} trials", grouped(*most)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_trials_in_words() {
        assert_eq!(Needed::Trials(40_321).to_string(), "some 41,000 trials");
        assert_eq!(Needed::Trials(40_321).extent(), Some([40_321; 2]));
        let beyond = Needed::MoreThan(4_000_000_000);
        assert_eq!(beyond.to_string(), "more than 4,000,000,000 trials");
        assert_eq!(beyond.extent(), None);
    }
}
