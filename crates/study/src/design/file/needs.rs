//! The results that a run computes and keeps because of claims.

use crate::design::file::axis::Scalar;
use crate::design::file::bounds::BoundTable;
use crate::design::file::key::Key;
use crate::design::file::tables::SlopeTable;
use crate::design::measure::Measure;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A measure of one output in two cells that differ in one setting, on the same trials.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SeriesTable {
    /// The measure.
    #[serde(rename(serialize = "figure"), alias = "figure")]
    pub measure: Measure,
    /// The output.
    pub output: String,
    /// The setting.
    pub axis: Key,
    /// Its value in the cell that others are compared with.
    pub from: Scalar,
    /// Its value in the others.
    pub to: Scalar,
}

/// Two measures of a cell that a claim compares trial by trial: by their medians, or by capped mean squares.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MediansTable {
    /// The output in the numerator.
    pub output: String,
    /// Its measure.
    pub measure: Measure,
    /// The output in the denominator.
    pub to: String,
    /// Its measure.
    pub measure_of_to: Measure,
}

/// What claims need of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Needs {
    /// Measures.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub measures: Vec<Measure>,
    /// The signed errors of every coefficient.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub parameters: bool,
    /// Their standard errors and 95 % intervals.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub coverage: bool,
    /// Pairs of outputs.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub compare: Vec<[String; 2]>,
    /// Bounds whose share of trials is counted.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bounds: Vec<BoundTable>,
    /// Slopes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub slopes: Vec<SlopeTable>,
    /// Pairs of cells.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub series: Vec<SeriesTable>,
    /// Ratios of two medians.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub medians: Vec<MediansTable>,
    /// Times of the methods.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub timing: bool,
}

impl Needs {
    /// Whether the claims need nothing.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}
