//! The statistics reported of a measure over trials.

use super::estimate::nan_is_null;
use super::{Estimate, Quantile};
use serde::{Deserialize, Serialize};
use std::ops::Deref;

/// Largest share of the sum of squares that a single trial may have; see [`Statistics::dominated`].
pub const DOMINANT_SHARE: f64 = 0.1;

/// Share of the trials that the trimmed mean leaves out on either side.
pub const TRIM: f64 = 0.05;

/// Quantiles of a measure, from the sketch; by default those of an empty sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Quantiles {
    /// 5 % quantile.
    pub q05: Quantile,
    /// Lower quartile.
    pub q25: Quantile,
    /// Median.
    pub q50: Quantile,
    /// Upper quartile.
    pub q75: Quantile,
    /// 95 % quantile.
    pub q95: Quantile,
}

impl Quantiles {
    /// Computes each from its q.
    pub fn of(quantile: impl Fn(f64) -> Quantile) -> Self {
        Self {
            q05: quantile(0.05),
            q25: quantile(0.25),
            q50: quantile(0.5),
            q75: quantile(0.75),
            q95: quantile(0.95),
        }
    }
}

/// The statistics reported of a measure over trials. Undefined numbers are NaN, in files null.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Number M of trials with a measure.
    pub count: u64,
    /// Trials whose measure is NaN. They enter nothing but the quantiles over all trials.
    pub undefined: u64,
    /// Trials whose value has a fourth power out of the range of doubles.
    pub overflowed: u64,
    /// Arithmetic mean.
    pub mean: Estimate,
    /// Standard deviation, divisor M - 1.
    pub sd: Estimate,
    /// Skewness: the third central moment over the cube of the standard deviation.
    #[serde(with = "nan_is_null", default = "nan")]
    pub skewness: f64,
    /// Mean square about 0: the mean square error if the measure is an error.
    pub mse: Estimate,
    /// Root mean square.
    pub rmse: Estimate,
    /// Mean without the 5 % smallest and the 5 % largest ([`TRIM`]), from the sketch.
    pub trimmed: Estimate,
    /// Quantiles over all trials, those without a measure at the worse end.
    #[serde(flatten)]
    pub quantiles: Quantiles,
    /// Quantiles over the trials with a measure; present only if some trials have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub conditional: Option<Quantiles>,
    /// Smallest value, exact.
    #[serde(with = "nan_is_null")]
    pub min: f64,
    /// Largest value, exact.
    #[serde(with = "nan_is_null")]
    pub max: f64,
    /// Whether one trial has more than [`DOMINANT_SHARE`] of the sum of squares, or the squares are out of range. Then
    /// the measure has a heavy tail, or there are fewer than about ten trials. Mean, sd, MSE and RMSE say little, and
    /// their standard errors, which rest on fourth moments, say even less. Read the quantiles and the trimmed mean
    /// instead.
    ///
    /// Of studies of exp(1.5 z), z normal, over 90 % are flagged; their 95 % intervals of the RMSE hold the truth in
    /// about 60 % (`tests/coverage.rs`). But a measure without this flag may still have a heavy tail: of studies of
    /// Student's law with 4 degrees of freedom, whose squares have no variance, 10 to 30 % are flagged, and the
    /// intervals hold the truth in 89 %.
    pub dominated: bool,
    /// The largest `x^2` over the sum of `x^2`.
    #[serde(with = "nan_is_null")]
    pub largest_share: f64,
}

/// The value of fields that older versions did not store.
fn nan() -> f64 {
    f64::NAN
}

/// Makes the quantiles over all trials available as `statistics.q50`.
impl Deref for Statistics {
    type Target = Quantiles;

    fn deref(&self) -> &Quantiles {
        &self.quantiles
    }
}

impl std::ops::DerefMut for Statistics {
    fn deref_mut(&mut self) -> &mut Quantiles {
        &mut self.quantiles
    }
}
