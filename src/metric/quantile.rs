//! Quantiles of figures over trials.

use super::estimate::{Z, nan_is_null};
use serde::{Deserialize, Serialize};

/// A quantile and its Monte-Carlo standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quantile {
    /// The quantile: linear between order statistics, type 7 of Hyndman and Fan (1996).
    #[serde(with = "nan_is_null")]
    pub value: f64,
    /// Half the width of the 95 % order-statistic interval over 1.96: ranks
    /// `M q +- 1.96 sqrt(M q (1 - q))`, clamped to the sample.
    #[serde(with = "nan_is_null")]
    pub mcse: f64,
}

impl Quantile {
    /// The quantile of an empty sample: NaN, in files null.
    pub const UNDEFINED: Self = Self {
        value: f64::NAN,
        mcse: f64::NAN,
    };

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

/// The q-quantile of a sample sorted in ascending order; NaN for an empty one.
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
    let count = sorted.len() as f64;
    let half = Z * (count * q * (1.0 - q)).sqrt();
    let middle = count * q - 0.5;
    Quantile {
        value: at(q * (count - 1.0)),
        mcse: (at(middle + half) - at(middle - half)) / (2.0 * Z),
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
}
