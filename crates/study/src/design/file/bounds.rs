//! Bounds: limits that a share of trials is to meet, `[[bounds]]`.

use crate::design::Measure;
use crate::design::file::table::tables;
use asobench_identification::text::number;

tables! {
    /// A bound: of every cell, or of those whose `claim` is given.
    pub struct BoundTable {
        /// The cells' claim; all cells if absent.
        claim?: Option<String>,
        /// The measure.
        #[serde(rename(serialize = "figure"), alias = "figure")]
        measure: Measure,
        /// The bound's name in a table.
        label?: Option<String>,
        /// The measure must be below this.
        below?: Option<f64>,
        /// Or below this multiple of eps times the condition number: "zero".
        rounding?: Option<f64>,
    }
}

impl BoundTable {
    /// Whether a row's measure meets the bound; a measure that is undefined (NaN) does not.
    pub fn is_met(&self, value: f64, condition: f64) -> bool {
        let limits = [
            self.below,
            self.rounding.map(|multiple| multiple * f64::EPSILON * condition),
        ];
        let mut limits = limits.into_iter().flatten();
        limits.clone().next().is_some() && limits.all(|limit| value < limit)
    }

    /// Returns the measure and its limits, without label and claim.
    pub(crate) fn limits(&self) -> (Measure, Option<f64>, Option<f64>) {
        (self.measure, self.below, self.rounding)
    }

    /// Returns the bound as a table shows it.
    pub fn text(&self) -> String {
        let below = self.below.map(|limit| format!("< {}", number(limit)));
        match (below, self.rounding) {
            (Some(below), None) => below,
            (Some(below), Some(_)) => format!("= 0 up to rounding, and {below}"),
            (None, _) => "= 0".to_owned(),
        }
    }

    /// Returns the bound's name in a table.
    pub fn label(&self) -> &str {
        self.label.as_deref().unwrap_or(self.measure.name())
    }
}
