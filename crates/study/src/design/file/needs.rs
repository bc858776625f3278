//! The results that a run computes and keeps because of claims.

use crate::design::Measure;
use crate::design::file::table::tables;
use crate::design::file::{BoundTable, Key, Scalar, SlopeTable};

tables! {
    /// A measure of one output in two cells that differ in one setting, on the same trials.
    pub struct SeriesTable {
        /// The measure.
        #[serde(rename(serialize = "figure"), alias = "figure")]
        measure: Measure,
        /// The output.
        output: String,
        /// The setting.
        axis: Key,
        /// Its value in the cell that others are compared with.
        from: Scalar,
        /// Its value in the others.
        to: Scalar,
    }

    /// Two measures of a cell that a claim compares trial by trial: by their ratio, their medians or their capped mean
    /// squares.
    pub struct JointTable {
        /// The output in the numerator.
        output: String,
        /// Its measure.
        measure: Measure,
        /// The output in the denominator.
        to: String,
        /// Its measure.
        measure_of_to: Measure,
    }

    /// The needs of claims: the results that a run must keep for them.
    pub struct Needs: Default {
        /// Measures.
        measures?: Vec<Measure>,
        /// The signed errors of every coefficient.
        parameters?: bool,
        /// Their standard errors and 95 % intervals.
        coverage?: bool,
        /// Pairs of outputs.
        compare?: Vec<[String; 2]>,
        /// Bounds whose share of trials is counted.
        bounds?: Vec<BoundTable>,
        /// Slopes.
        slopes?: Vec<SlopeTable>,
        /// Pairs of cells.
        series?: Vec<SeriesTable>,
        /// Ratios of two measures, whose distribution is kept.
        ratios?: Vec<JointTable>,
        /// Ratios of two medians, or of capped mean squares, for which both values of every trial are kept.
        medians?: Vec<JointTable>,
        /// Times of the methods.
        timing?: bool,
    }
}

impl Needs {
    /// Whether the claims need nothing.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}
