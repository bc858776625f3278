//! The statistics of a measure by name: one list, from which the columns of every table follow.

use super::{Estimate, Statistics};
use crate::names::named_table;

named_table! {
    /// A statistic of a measure over trials that has a standard error. Its name is its column in `summary.parquet`, its
    /// entry that of CSV files.
    Statistic, "statistic", &'static str {
        /// Arithmetic mean.
        Mean = "mean": "mean",
        /// Standard deviation.
        Sd = "sd": "SD",
        /// Mean of the squares.
        Mse = "mse": "MSE",
        /// Root of the mean of the squares.
        Rmse = "rmse": "RMSE",
        /// Mean without the largest and smallest 5 %.
        Trimmed = "trimmed": "trimmed mean",
        /// 5 % quantile.
        Q05 = "q05": "q05",
        /// Lower quartile.
        Q25 = "q25": "q25",
        /// Median.
        Q50 = "q50": "median",
        /// Upper quartile.
        Q75 = "q75": "q75",
        /// 95 % quantile.
        Q95 = "q95": "q95",
    }
}

impl Statistic {
    /// Returns the name of its column in CSV files.
    pub fn title(self) -> &'static str {
        self.entry()
    }

    /// Whether it is a quantile, which counts all trials, with those without the measure ranked last.
    pub const fn is_quantile(self) -> bool {
        matches!(self, Self::Q05 | Self::Q25 | Self::Q50 | Self::Q75 | Self::Q95)
    }

    /// Returns its value and its Monte-Carlo standard error.
    pub fn of(self, statistics: &Statistics) -> Estimate {
        let quantile = match self {
            Self::Mean => return statistics.mean,
            Self::Sd => return statistics.sd,
            Self::Mse => return statistics.mse,
            Self::Rmse => return statistics.rmse,
            Self::Trimmed => return statistics.trimmed,
            Self::Q05 => statistics.q05,
            Self::Q25 => statistics.q25,
            Self::Q50 => statistics.q50,
            Self::Q75 => statistics.q75,
            Self::Q95 => statistics.q95,
        };
        Estimate {
            value: quantile.value,
            mcse: quantile.mcse,
        }
    }
}
