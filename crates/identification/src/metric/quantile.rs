//! Quantiles of measures over trials, with their Monte-Carlo standard errors. `sketch.rs` has those of summaries, by
//! the ranks of this file.

use super::estimate::{Z, nan_is_null};
use serde::{Deserialize, Serialize};

/// A quantile and its Monte-Carlo standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quantile {
    /// The quantile: linear between order statistics, type 7 of Hyndman and Fan (1996).
    #[serde(with = "nan_is_null")]
    pub value: f64,
    /// The larger of half the width of the 95 % order-statistic interval over 1.96 and half that of the 68 % interval,
    /// with the ranks `M q + 1/2 -+ z sqrt(M q (1 - q))`, z = 1.96 and 1. The two agree where the law is smooth; over a
    /// gap only the second is the standard error. NaN unless all ranks are within 1 ... M. This requires M >= 6 for
    /// the median, 16 for the quartiles, 92 for 5 and 95 %.
    #[serde(with = "nan_is_null")]
    pub mcse: f64,
    /// Whether the quantile falls among trials without a finite value, such as failed ones; its value is then NaN. The
    /// name is that of the key in files. Trials with an unstable model have a value, so they do not count here.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub lost: bool,
}

/// Which values are worse. Trials without a value stand at the worse end of the order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Worse {
    /// Smaller values are better.
    #[default]
    Larger,
    /// Larger values are better.
    Smaller,
}

impl Quantile {
    /// The quantile of an empty sample: NaN, in files null.
    pub const UNDEFINED: Self = Self {
        value: f64::NAN,
        mcse: f64::NAN,
        lost: false,
    };

    /// Turns a quantile over all trials that is infinite, so that of a trial without a value, into one that says so.
    pub(super) fn ranked(self) -> Self {
        if self.value.is_infinite() {
            return Self {
                lost: true,
                ..Self::UNDEFINED
            };
        }
        Self {
            mcse: if self.mcse.is_finite() { self.mcse } else { f64::NAN },
            ..self
        }
    }

    /// The 95 % interval `value -+ 1.96 mcse`.
    pub fn interval(&self) -> (f64, f64) {
        (self.value - Z * self.mcse, self.value + Z * self.mcse)
    }
}

impl Default for Quantile {
    fn default() -> Self {
        Self::UNDEFINED
    }
}

/// The correlation of the medians of two columns over the same trials, `4 p - 1`, where p is the share of trials in the
/// lower half of both. In the limit a median moves with the share of values below it, and two such shares have this
/// correlation. NaN ranks at the worse end. `None` unless both have the same number of trials, at least one.
pub fn correlation_of_medians(first: (&[f64], Worse), second: (&[f64], Worse)) -> Option<f64> {
    let [a, b] = [first, second].map(|(values, worse)| is_in_lower_half(values, worse));
    if a.len() != b.len() || a.is_empty() {
        return None;
    }
    let [of_a, of_b] = [&a, &b].map(|half| half.iter().filter(|is| **is).count() as f64);
    let both = a.iter().zip(&b).filter(|(a, b)| **a && **b).count() as f64;
    let m = a.len() as f64;
    let spread = (of_a * (m - of_a) * of_b * (m - of_b)).sqrt();
    (spread > 0.0).then(|| ((both * m - of_a * of_b) / spread).clamp(-1.0, 1.0))
}

/// Whether each value is at most the median, or among the lowest half where that is more.
fn is_in_lower_half(values: &[f64], worse: Worse) -> Vec<bool> {
    let last = match worse {
        Worse::Larger => f64::INFINITY,
        Worse::Smaller => f64::NEG_INFINITY,
    };
    let ranked = |x: &f64| if x.is_nan() { last } else { *x };
    let mut sorted: Vec<f64> = values.iter().map(ranked).collect();
    let Some(middle) = sorted.len().checked_sub(1).map(|most| most / 2) else {
        return Vec::new();
    };
    let (_, median, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
    let median = *median;
    values.iter().map(|x| ranked(x) <= median).collect()
}

/// The standard error of the q-quantile of M values, of which `at` gives that at a position between the order
/// statistics 0 ... M-1: see [`Quantile::mcse`]. NaN if one of the positions is outside the sample.
pub(super) fn standard_error(count: u64, q: f64, at: impl Fn(f64) -> f64) -> f64 {
    let m = count as f64;
    let (middle, deviation) = (m * q - 0.5, (m * q * (1.0 - q)).sqrt());
    let of = |z: f64| {
        let (low, high) = (middle - z * deviation, middle + z * deviation);
        let inside = low >= 0.0 && high <= m - 1.0;
        if inside {
            (at(high) - at(low)) / (2.0 * z)
        } else {
            f64::NAN
        }
    };
    let (of_95, of_68) = (of(Z), of(1.0));
    // NaN, as of positions outside and of differences of infinities, is kept.
    if of_95 < of_68 { of_68 } else { of_95 }
}

/// The q-quantile of a sample sorted in ascending order; NaN for an empty sample.
///
/// # Panics
/// In debug builds, if `sorted` is not sorted or q is not in [0, 1].
pub fn quantile(sorted: &[f64], q: f64) -> Quantile {
    debug_assert!(sorted.is_sorted_by(|a, b| a <= b) && (0.0..=1.0).contains(&q));
    if sorted.is_empty() {
        return Quantile::UNDEFINED;
    }
    // The value at a fractional position between the order statistics 0 ... M-1.
    let at = |position: f64| {
        let position = position.clamp(0.0, (sorted.len() - 1) as f64);
        let (low, share) = (position.floor() as usize, position.fract());
        let high = (low + 1).min(sorted.len() - 1);
        sorted[low] + share * (sorted[high] - sorted[low])
    };
    Quantile {
        value: at(q * (sorted.len() - 1) as f64),
        mcse: standard_error(sorted.len() as u64, q, at),
        lost: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// R: quantile(c(1, 2, 4, 8), c(0.05, 0.5, 0.95)) is 1.15, 3, 7.4.
    #[test]
    fn quantiles_are_type_seven() {
        let sample = [1.0, 2.0, 4.0, 8.0];
        for (q, expected) in [(0.0, 1.0), (0.05, 1.15), (0.5, 3.0), (0.95, 7.4), (1.0, 8.0)] {
            assert!((quantile(&sample, q).value - expected).abs() < 1e-14);
        }
        assert!(quantile(&[], 0.5).value.is_nan());
        assert_eq!(quantile(&[2.0], 0.5).value, 2.0);
    }

    /// The order statistics of the interval exist for M at least the solution of M p - 1.96 sqrt(M p (1 - p)) = 1/2,
    /// with p the smaller of q and 1 - q: M = 5.7, 15.2, 91.9. Binomial tails agree: the ends of the sample enclose the
    /// median with 95 % from M = 6 on (2 / 2^M < 0.05), the 5 % quantile from M = 72 on (0.95^M < 0.025).
    #[test]
    fn quantiles_have_errors_from_where_the_interval_is_within_the_sample() {
        for (q, from) in [(0.5, 6), (0.25, 16), (0.75, 16), (0.05, 92), (0.95, 92)] {
            for count in 1..=from + 50 {
                let sample: Vec<f64> = (0..count).map(f64::from).collect();
                let found = quantile(&sample, q);
                assert!(found.value.is_finite());
                assert_eq!(found.mcse > 0.0, count >= from, "{q} {count}");
                assert_eq!(found.mcse.is_nan(), count < from, "{q} {count}");
            }
        }
        for q in [0.0, 1.0] {
            assert!(quantile(&[1.0; 1000], q).mcse.is_nan(), "no ranks beyond");
        }
        assert_eq!(quantile(&[2.0; 6], 0.5).mcse, 0.0);
    }

    /// By hand: of 1, 2, 3, 4 the lower half is 1, 2. Equal columns have 1, reversed ones -1, and one whose lower half
    /// shares one of two has 0. NaN ranks last, or first where small values are worse.
    #[test]
    fn correlations_of_medians_by_hand() {
        use Worse::{Larger, Smaller};
        let x = [1.0, 2.0, 3.0, 4.0];
        let of = |y: [f64; 4]| correlation_of_medians((&x, Larger), (&y, Larger));
        assert_eq!(of([5.0, 6.0, 7.0, 8.0]), Some(1.0));
        assert_eq!(of([8.0, 7.0, 6.0, 5.0]), Some(-1.0));
        assert_eq!(of([1.0, 3.0, 2.0, 4.0]), Some(0.0));
        assert_eq!(of([1.0, 2.0, f64::NAN, f64::NAN]), Some(1.0));
        let nan_first = correlation_of_medians((&x, Larger), (&[f64::NAN, f64::NAN, 1.0, 2.0], Smaller));
        assert_eq!(nan_first, Some(1.0));
        assert_eq!(correlation_of_medians((&x, Larger), (&x[..2], Larger)), None);
        assert_eq!(correlation_of_medians((&[], Larger), (&[], Larger)), None);
    }

    /// Half of the values are 0 and half are 1: the median of a sample is either, so its standard deviation is 1/2.
    #[test]
    fn the_standard_error_over_a_gap() {
        let sample = [[0.0; 50], [1.0; 50]].concat();
        assert_eq!(quantile(&sample, 0.5).mcse, 0.5);
    }

    /// For uniform numbers, the q-quantile of M has standard deviation sqrt(q (1 - q) / M).
    #[test]
    fn the_standard_error_of_a_quantile_of_evenly_spaced_numbers() {
        let sample: Vec<f64> = (0..10_000).map(|i| (f64::from(i) + 0.5) / 10_000.0).collect();
        for q in [0.05, 0.5, 0.95] {
            let expected = (q * (1.0 - q) / 10_000.0_f64).sqrt();
            let found = quantile(&sample, q).mcse;
            assert!((found / expected - 1.0).abs() < 1e-3, "{q}: {found} {expected}");
        }
    }
}
