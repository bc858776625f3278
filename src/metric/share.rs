//! Shares of trials, and what they say of a bound.

use super::estimate::{Z, nan_is_null};
use crate::names::named_enum;
use serde::{Deserialize, Serialize};

/// A share of trials with its standard error and 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Share {
    /// Trials that count.
    pub count: u64,
    /// Trials in all.
    pub of: u64,
    /// `count / of`; NaN of no trial.
    #[serde(with = "nan_is_null")]
    pub share: f64,
    /// `sqrt(share (1 - share) / of)`.
    #[serde(with = "nan_is_null")]
    pub mcse: f64,
    /// Lower end of Wilson's 95 % score interval (Wilson 1927).
    #[serde(with = "nan_is_null")]
    pub low: f64,
    /// Upper end.
    #[serde(with = "nan_is_null")]
    pub high: f64,
}

impl Share {
    /// The share `count / of`.
    pub fn new(count: u64, of: u64) -> Self {
        let m = of as f64;
        let share = count as f64 / m;
        let square = Z * Z / m;
        let centre = (share + square / 2.0) / (1.0 + square);
        let half = Z / (1.0 + square) * (share * (1.0 - share) / m + square / (4.0 * m)).sqrt();
        Self {
            count,
            of,
            share,
            mcse: (share * (1.0 - share) / m).sqrt(),
            low: (centre - half).max(0.0),
            high: (centre + half).min(1.0),
        }
    }
}

named_enum! {
    /// What a share says of a bound that was printed for a single run.
    Verdict, "verdict" {
        /// The interval holds 1/2.
        Undecided = "undecided",
        /// More than half of all realisations meet the bound.
        Typical = "typical",
        /// Less than half do.
        NotTypical = "not typical",
    }
}

/// "typical" where the lower end of the 95 % Wilson interval is above 1/2, "not typical" where the upper
/// end is below, else "undecided".
pub fn verdict(share: Share) -> Verdict {
    if share.low > 0.5 {
        Verdict::Typical
    } else if share.high < 0.5 {
        Verdict::NotTypical
    } else {
        Verdict::Undecided
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ends solve |share - p| = 1.96 sqrt(p (1 - p) / M), found here by bisection elsewhere.
    #[test]
    fn wilson_intervals() {
        let share = Share::new(10, 50);
        assert!(
            (share.low - 0.112_437_500_157).abs() < 1e-12
                && (share.high - 0.330_371_059_322).abs() < 1e-12
        );
        let share = Share::new(0, 10);
        assert!(share.low == 0.0 && (share.high - 0.277_532_799_862).abs() < 1e-12);
        assert_eq!(verdict(Share::new(0, 0)), Verdict::Undecided);
        assert_eq!(verdict(Share::new(55, 100)), Verdict::Undecided);
        assert_eq!(verdict(Share::new(65, 100)), Verdict::Typical);
        assert_eq!(verdict(Share::new(35, 100)), Verdict::NotTypical);
    }
}
