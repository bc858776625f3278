//! The scale on which the numbers of a test are compared.

use crate::design::file::{ClaimTest, CoefficientStatistic, TestKind};
use serde::Serialize;

/// The scale on which the numbers of a test are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// Shares of trials, printed in per cent.
    Share,
    /// By their ratio, for numbers above 0.
    Ratio,
    /// By their difference.
    Difference,
}

impl Scale {
    pub(crate) fn for_test(test: &ClaimTest) -> Self {
        match test.kind {
            TestKind::Outcome(_)
            | TestKind::Bound(_)
            | TestKind::Wins { .. }
            | TestKind::Coefficient {
                statistic: CoefficientStatistic::Coverage | CoefficientStatistic::ShareAbove,
                ..
            } => Self::Share,
            TestKind::Slope(_)
            | TestKind::Coefficient {
                statistic: CoefficientStatistic::Bias,
                ..
            } => Self::Difference,
            TestKind::Value { .. } | TestKind::Ratio { .. } | TestKind::Cells { .. } | TestKind::Time { .. } => {
                Self::Ratio
            }
        }
    }
}

/// Whether a test's numbers are shares of trials, printed in per cent.
pub(crate) fn is_share(test: &ClaimTest) -> bool {
    Scale::for_test(test) == Scale::Share
}
