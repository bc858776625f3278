//! The statistics of each kind of test of a claim: a test has no statistic that its kind does not know.

use asobench_identification::names::named_enum;

named_enum! {
    /// The statistic of a measure that a test of `value` looks at.
    ValueStatistic, "statistic of this test" {
        /// The median.
        Median = "median",
        /// The mean.
        Mean = "mean",
        /// The root mean square.
        Rms = "rms",
        /// The 5 % quantile.
        Q05 = "q05",
        /// The lower quartile.
        Q25 = "q25",
        /// The upper quartile.
        Q75 = "q75",
        /// The 95 % quantile.
        Q95 = "q95",
    }
}

impl ValueStatistic {
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

named_enum! {
    /// The statistic of a coefficient that a test of `value` looks at.
    CoefficientStatistic, "statistic of this test" {
        /// The mean of the signed error over its standard deviation.
        Bias = "bias",
        /// The share of trials whose estimate is above the truth.
        ShareAbove = "share-above",
        /// The share of trials whose 95 % interval contains the truth, among those with a standard error.
        Coverage = "coverage",
    }
}

named_enum! {
    /// How a test of `ratio` compares two outputs, or an output with theory.
    RatioStatistic, "statistic of this test" {
        /// The median over trials of the ratio of two outputs on the same trial.
        PairedMedian = "paired-median",
        /// The ratio of two medians.
        Median = "median",
        /// The ratio of two root mean squares.
        Rms = "rms",
    }
}

named_enum! {
    /// The statistic of an output alone whose slope, or ratio to theory, a test looks at.
    OutputStatistic, "statistic of this test" {
        /// The median.
        Median = "median",
        /// The root mean square.
        Rms = "rms",
    }
}
