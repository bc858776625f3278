//! Removal of a mean or a straight line.

use crate::names::named_enum;
use crate::signal::arithmetic::{covariance, mean, variance};
use crate::text::rounded;

named_enum! {
    /// The trend that is subtracted from u and y before estimation.
    Detrend, "detrend" {
        /// Nothing (the default).
        None = "none",
        /// The window's mean.
        Mean = "mean",
        /// The window's least-squares straight line over k.
        Linear = "linear",
        /// The first sample, as SIPPY does by default.
        First = "first",
    }
}

/// A straight line over k, fitted to a window: `level + slope k`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trend {
    level: f64,
    slope: f64,
}

impl Detrend {
    /// Returns whether nothing is subtracted.
    pub fn is_none(self) -> bool {
        self == Self::None
    }
}

impl std::fmt::Display for Trend {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", rounded(self.level, 6))?;
        match self.slope {
            0.0 => Ok(()),
            slope if slope < 0.0 => write!(f, " - {} k", rounded(-slope, 6)),
            slope => write!(f, " + {} k", rounded(slope, 6)),
        }
    }
}

impl Trend {
    /// The same number for all samples.
    pub fn constant(level: f64) -> Self {
        Self { level, slope: 0.0 }
    }

    /// Level at k = 0 and slope in a sample.
    pub fn line(self) -> [f64; 2] {
        [self.level, self.slope]
    }

    /// Fits the trend to the samples of the window.
    pub fn fit(detrend: Detrend, window: &[f64]) -> Self {
        match detrend {
            Detrend::None => Self::default(),
            Detrend::Mean => Self {
                level: mean(window),
                slope: 0.0,
            },
            Detrend::First => Self {
                level: window.first().copied().unwrap_or(0.0),
                slope: 0.0,
            },
            Detrend::Linear => {
                let k: Vec<f64> = (0..window.len()).map(|k| k as f64).collect();
                let slope = covariance(&k, window) / variance(&k);
                Self {
                    level: mean(window) - slope * mean(&k),
                    slope,
                }
            }
        }
    }

    /// The same line of a record in another unit.
    #[must_use]
    pub fn times(self, unit: f64) -> Self {
        Self {
            level: self.level * unit,
            slope: self.slope * unit,
        }
    }

    /// Subtracts the line from a whole record, including the samples after the window.
    pub fn subtract(self, record: &mut [f64]) {
        if self == Self::default() {
            return;
        }
        for (k, value) in record.iter_mut().enumerate() {
            *value -= self.slope.mul_add(k as f64, self.level);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_removed_and_extrapolated() {
        let mut record: Vec<f64> = (0..30).map(|k| 5.0 - 0.25 * f64::from(k)).collect();
        Trend::fit(Detrend::Linear, &record[..20]).subtract(&mut record);
        assert!(record.iter().all(|value| value.abs() < 1e-13));
        let mut record = vec![1.0, 2.0, 3.0, 10.0];
        Trend::fit(Detrend::Mean, &record[..3]).subtract(&mut record);
        assert_eq!(record, [-1.0, 0.0, 1.0, 8.0]);
        let mut record = vec![1.0, 2.0, 3.0, 10.0];
        Trend::fit(Detrend::First, &record[..3]).subtract(&mut record);
        assert_eq!(record, [0.0, 1.0, 2.0, 9.0]);
    }
}
