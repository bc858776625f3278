//! Shares of trials, and what they say about a bound.

use super::estimate::{Z, nan_is_null};
use crate::names::named_enum;
use serde::{Deserialize, Serialize};

/// A share of trials with its standard error and 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Share {
    /// Number of trials counted.
    pub count: u64,
    /// Number of all trials.
    #[serde(rename = "of")]
    pub total: u64,
    /// `count / of`; NaN without trials.
    #[serde(with = "nan_is_null")]
    pub share: f64,
    /// `sqrt(share (1 - share) / of)`. NaN unless the interval `share -+ 1.96 mcse` lies within 0 to 1 and is not a
    /// point, that is unless `of share >= 1.96^2 (1 - share)`, and the same with share and 1 - share exchanged.
    #[serde(with = "nan_is_null")]
    pub mcse: f64,
    /// Lower end of Wilson's 95 % score interval (Wilson 1927).
    #[serde(with = "nan_is_null")]
    pub low: f64,
    /// Upper end of that interval.
    #[serde(with = "nan_is_null")]
    pub high: f64,
}

impl Share {
    /// The share `count / of`.
    pub fn new(count: u64, total: u64) -> Self {
        let m = total as f64;
        let share = count as f64 / m;
        let square = Z * Z / m;
        let centre = (share + square / 2.0) / (1.0 + square);
        let known = m * share >= Z * Z * (1.0 - share) && m * (1.0 - share) >= Z * Z * share;
        let half = Z / (1.0 + square) * (share * (1.0 - share) / m + square / (4.0 * m)).sqrt();
        Self {
            count,
            total,
            share,
            mcse: if known {
                (share * (1.0 - share) / m).sqrt()
            } else {
                f64::NAN
            },
            low: (centre - half).max(0.0),
            high: (centre + half).min(1.0),
        }
    }
}

named_enum! {
    /// The verdict of a share on a bound that was printed for a single run.
    BoundVerdict, "verdict" {
        /// The 95 % interval holds 1/2.
        Undecided = "undecided",
        /// More than half of all realisations satisfy the bound.
        Typical = "typical",
        /// Less than half of them do.
        NotTypical = "not typical",
    }
}

/// Returns "typical" if the lower end of the 95 % Wilson interval is above 1/2, "not typical" if the upper end is below
/// 1/2, otherwise "undecided".
pub fn verdict(share: Share) -> BoundVerdict {
    if share.low > 0.5 {
        BoundVerdict::Typical
    } else if share.high < 0.5 {
        BoundVerdict::NotTypical
    } else {
        BoundVerdict::Undecided
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ends solve |share - p| = 1.96 sqrt(p (1 - p) / M). These references were found by bisection in another
    /// program.
    #[test]
    fn wilson_intervals() {
        let share = Share::new(10, 50);
        assert!((share.low - 0.112_437_500_157).abs() < 1e-12 && (share.high - 0.330_371_059_322).abs() < 1e-12);
        let share = Share::new(0, 10);
        assert!(share.low == 0.0 && (share.high - 0.277_532_799_862).abs() < 1e-12);
        assert!(share.mcse.is_nan() && Share::new(10, 10).mcse.is_nan());
        assert_eq!(verdict(Share::new(0, 0)), BoundVerdict::Undecided);
        assert_eq!(verdict(Share::new(55, 100)), BoundVerdict::Undecided);
        assert_eq!(verdict(Share::new(65, 100)), BoundVerdict::Typical);
        assert_eq!(verdict(Share::new(35, 100)), BoundVerdict::NotTypical);
    }

    /// A share p has an error if there are at least 1.96^2 (1 - p) / p trials: 3.84 for 1/2, 34.6 for 1/10.
    #[test]
    fn errors_begin_where_the_interval_is_within_0_and_1() {
        for (part, from) in [(2, 4), (10, 40)] {
            for count in 1..10 {
                let share = Share::new(count, count * part);
                assert_eq!(share.mcse > 0.0, count * part >= from, "{share:?}");
                assert_eq!(share.mcse.is_nan(), count * part < from, "{share:?}");
            }
        }
    }
}
