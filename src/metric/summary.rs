//! Summaries of figures over trials, each with its Monte-Carlo standard error (MCSE).

use crate::names::named_enum;
use serde::Serialize;

/// The standard normal 97.5 % point.
const Z: f64 = 1.959_963_984_540_054;

/// A quantile and its Monte-Carlo standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quantile {
    /// The quantile: linear between order statistics, type 7 of Hyndman and Fan (1996).
    pub value: f64,
    /// Half the width of the 95 % order-statistic interval over 1.96: ranks
    /// `M q +- 1.96 sqrt(M q (1 - q))`, clamped to the sample.
    pub mcse: f64,
}

/// The q-quantile of a sample sorted in ascending order; NaN for an empty one.
///
/// # Panics
/// In debug builds, if `sorted` is not sorted or q is not in [0, 1].
pub fn quantile(sorted: &[f64], q: f64) -> Quantile {
    debug_assert!(sorted.is_sorted_by(|a, b| a <= b) && (0.0..=1.0).contains(&q));
    if sorted.is_empty() {
        return Quantile {
            value: f64::NAN,
            mcse: f64::NAN,
        };
    }
    // The value at a fractional position between the order statistics 0 ... M-1.
    let at = |position: f64| {
        let position = position.clamp(0.0, (sorted.len() - 1) as f64);
        let (low, share) = (position.floor() as usize, position.fract());
        let high = (low + 1).min(sorted.len() - 1);
        sorted[low] + share * (sorted[high] - sorted[low])
    };
    let count = sorted.len() as f64;
    let half = Z * (count * q * (1.0 - q)).sqrt();
    let middle = count * q - 0.5;
    Quantile {
        value: at(q * (count - 1.0)),
        mcse: (at(middle + half) - at(middle - half)) / (2.0 * Z),
    }
}

/// A share of trials with its standard error and 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Share {
    /// Trials that count.
    pub count: u64,
    /// Trials in all.
    pub of: u64,
    /// `count / of`; NaN of no trial.
    pub share: f64,
    /// `sqrt(share (1 - share) / of)`.
    pub mcse: f64,
    /// Lower end of Wilson's 95 % score interval (Wilson 1927).
    pub low: f64,
    /// Upper end.
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

    /// R: quantile(c(1, 2, 4, 8), c(0.05, 0.5, 0.95)) is 1.15, 3, 7.4.
    #[test]
    fn quantiles_are_type_seven() {
        let sample = [1.0, 2.0, 4.0, 8.0];
        for (q, expected) in [
            (0.0, 1.0),
            (0.05, 1.15),
            (0.5, 3.0),
            (0.95, 7.4),
            (1.0, 8.0),
        ] {
            assert!((quantile(&sample, q).value - expected).abs() < 1e-14);
        }
        assert!(quantile(&[], 0.5).value.is_nan());
        assert_eq!(quantile(&[2.0], 0.5).value, 2.0);
    }

    /// For uniform numbers the q-quantile of M has standard deviation sqrt(q (1 - q) / M).
    #[test]
    fn the_standard_error_of_a_quantile_of_evenly_spaced_numbers() {
        let sample: Vec<f64> = (0..10_000)
            .map(|i| (f64::from(i) + 0.5) / 10_000.0)
            .collect();
        for q in [0.05, 0.5, 0.95] {
            let expected = (q * (1.0 - q) / 10_000.0_f64).sqrt();
            let found = quantile(&sample, q).mcse;
            assert!(
                (found / expected - 1.0).abs() < 1e-3,
                "{q}: {found} {expected}"
            );
        }
    }

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
