//! The degrees of freedom of a standard error.

use asobench_identification::metric::Z;

/// The degrees of freedom of a standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Freedom {
    pub(crate) now: f64,
    /// The power of the number of trials with which they grow; `None` if more trials change nothing at all.
    pub(crate) grows: Option<f64>,
}

impl Freedom {
    /// For an error that more trials do not reduce, such as that of a time.
    pub(crate) const FIXED: Self = Self {
        now: f64::INFINITY,
        grows: None,
    };

    /// So many, for any number of trials.
    pub(crate) const fn constant(now: f64) -> Self {
        Self {
            now,
            grows: Some(0.0),
        }
    }

    /// For a mean, or a function of means.
    pub(crate) fn of_mean(trials: u64) -> Self {
        Self {
            now: trials.saturating_sub(1).max(1) as f64,
            grows: Some(1.0),
        }
    }

    /// For the q-quantile of n trials. Its standard error is a multiple of the distance W between two order statistics,
    /// k = 2 * 1.96 sqrt(n q (1 - q)) ranks apart. Near a quantile W is a sum of k spacings that are nearly independent
    /// and exponential, so the relative variance of W is 1/k and that of W^2 is 4/k. For a mean square with nu degrees
    /// of freedom it is 2/nu. Hence nu = k/2 = 1.96 sqrt(n q (1 - q)). The code takes half of that: far in the tails,
    /// where many cells are judged, the density also changes between the two ranks. Without the half, a test finds the
    /// level exceeded.
    pub(crate) fn of_quantile(q: f64, trials: u64) -> Self {
        Self {
            now: (0.5 * Z * (trials as f64 * q * (1.0 - q)).sqrt()).max(1.0),
            grows: Some(0.5),
        }
    }
}
