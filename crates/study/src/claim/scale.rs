//! The scale on which the numbers of a test are compared.

use crate::design::file::{ClaimTest, TestKind};
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
            _ if test.kind.is_share() => Self::Share,
            TestKind::Slope(_) | TestKind::Coefficient { .. } => Self::Difference,
            _ => Self::Ratio,
        }
    }
}
