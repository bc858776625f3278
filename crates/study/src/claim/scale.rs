//! The scale on which the numbers of a test are compared.

use crate::design::file::claim_test::{ClaimTest, TestKind, ValueOf};
use crate::design::file::test_table::ClaimStatistic as Statistic;
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
            | TestKind::Value {
                statistic: Statistic::Coverage,
                ..
            } => Self::Share,
            TestKind::Slope(_)
            | TestKind::Value {
                what: ValueOf::Parameter(_) | ValueOf::Parameters,
                ..
            } => Self::Difference,
            _ => Self::Ratio,
        }
    }
}

/// Whether a test's numbers are shares of trials, printed in per cent.
pub(crate) fn is_share(test: &ClaimTest) -> bool {
    Scale::for_test(test) == Scale::Share
}
