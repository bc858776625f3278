//! The statistics of each kind of test of a claim: a test has no statistic that its kind does not know.

use asobench_identification::metric::SlopeOf;

/// The statistic of a measure that a test of `value` looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueStatistic {
    /// The median.
    Median,
    /// The mean.
    Mean,
    /// The root mean square.
    Rms,
    /// The 5 % quantile.
    Q05,
    /// The lower quartile.
    Q25,
    /// The upper quartile.
    Q75,
    /// The 95 % quantile.
    Q95,
}

impl ValueStatistic {
    /// Their names in files, the default first.
    pub const NAMES: &[(&str, Self)] = &[
        ("median", Self::Median),
        ("mean", Self::Mean),
        ("rms", Self::Rms),
        ("q05", Self::Q05),
        ("q25", Self::Q25),
        ("q75", Self::Q75),
        ("q95", Self::Q95),
    ];

    /// Returns how a sentence begins that is about it: "the median", "the rms over trials of".
    pub const fn words(self) -> &'static str {
        match self {
            Self::Median => "the median",
            Self::Mean => "the mean",
            Self::Rms => "the rms over trials of",
            Self::Q05 => "the 5 % quantile of",
            Self::Q25 => "the lower quartile of",
            Self::Q75 => "the upper quartile of",
            Self::Q95 => "the 95 % quantile of",
        }
    }
}

/// The statistic of a coefficient that a test of `value` looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoefficientStatistic {
    /// The mean of the signed error over its standard deviation.
    Bias,
    /// The share of trials whose estimate is above the truth.
    ShareAbove,
    /// The share of trials whose 95 % interval contains the truth, among those with a standard error.
    Coverage,
}

impl CoefficientStatistic {
    /// Their names in files, the default first.
    pub const NAMES: &[(&str, Self)] = &[
        ("bias", Self::Bias),
        ("share-above", Self::ShareAbove),
        ("coverage", Self::Coverage),
    ];
}

/// How a test of `ratio` compares two outputs, or an output with theory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RatioStatistic {
    /// The median over trials of the ratio of two outputs on the same trial.
    PairedMedian,
    /// The ratio of two medians.
    Median,
    /// The ratio of two root mean squares.
    Rms,
}

impl RatioStatistic {
    /// Their names in files, the default first.
    pub const NAMES: &[(&str, Self)] = &[
        ("paired-median", Self::PairedMedian),
        ("median", Self::Median),
        ("rms", Self::Rms),
    ];
    /// The statistics of a ratio to theory, which has no trials to pair with.
    pub const OF_THEORY: &[(&str, Self)] = &[("median", Self::Median), ("rms", Self::Rms)];
}

/// The statistics whose slope a test of `slope` looks at, by their names in files, the default first.
pub const SLOPE_STATISTICS: &[(&str, SlopeOf)] = &[("median", SlopeOf::Median), ("rms", SlopeOf::Rmse)];
