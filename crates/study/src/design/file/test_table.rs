//! A test of a claim as it is written in a file.

use crate::design::Measure;
use crate::design::file::lists::each_once;
use crate::design::file::table::tables;
use crate::design::file::{Axis, CoefficientStatistic, Key, RatioStatistic, Scalar, ValueStatistic};
use asobench_identification::names::named_enum;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use std::borrow::Cow;

tables! {
    /// A test of one cell. Exactly one of `share`, `value`, `ratio`, `cells`, `slope` and `time` says
    /// its kind, exactly one of `below`, `above`, `between` and `within` its limit.
    pub struct TestTable: Default {
        /// Share of the trials of `of`: "failed", "unstable" or "lost" (either), or a measure: the
        /// trials whose measure is below `bound` or `rounding`, or in which `of` is better in it than
        /// `to`.
        share?: Option<String>,
        /// A statistic of a measure of `of`, or the bias or coverage of "parameters" (every coefficient), "a_1",
        /// "h_2", ...
        value?: Option<String>,
        /// A measure of `of` over that of `to`.
        ratio?: Option<Measure>,
        /// A measure of `of` in the cell with `axis` at `to` over that at `from`, on the same trials.
        cells?: Option<Measure>,
        /// The log-log slope of a measure of `of` over a setting.
        slope?: Option<Measure>,
        /// "estimate": the median time of method `of` over that of `to`; it needs timing = true.
        time?: Option<TimeOf>,
        /// The output, such as "iv(4)"; of `time` the method. A list: each of them is judged by itself.
        #[serde(rename = "of")]
        output?: Option<Axis>,
        /// The output or method that it is compared with, or a list, as for `of`; of `ratio` also "theory"
        /// (the output's own), "bound:shared" or "bound:separate" (Cramer-Rao); of `cells` the value of
        /// `axis`, or a list (every other value if absent).
        to?: Option<Axis>,
        /// ratio: the measure of `to`, if it differs.
        measure_of_to?: Option<Measure>,
        /// value: "median" (default), "mean", "rms", "q05", "q25", "q75", "q95"; of a coefficient "bias" (default),
        /// "share-above" (of trials with an estimate above the truth), "coverage"; ratio: "paired-median" (default; of
        /// theory "median"), "median" (of two medians), "rms"; slope: "median" (default), "rms".
        #[schemars(with = "Option<StatisticName>")]
        statistic?: Option<String>,
        /// share: the measure must be below this.
        bound?: Option<f64>,
        /// share: or below this multiple of eps times the condition number.
        rounding?: Option<f64>,
        /// cells: the setting in which the two cells differ.
        axis?: Option<Key>,
        /// cells: the value of `axis` that the others are compared with; slope: the first value of
        /// `over` that is taken.
        from?: Option<Scalar>,
        /// slope: the setting.
        over?: Option<Key>,
        /// It must be below this.
        below?: Option<f64>,
        /// It must be above this.
        above?: Option<f64>,
        /// It must be from the first to the second.
        between?: Option<[f64; 2]>,
        /// ratio, cells, time: it must be the same within this factor.
        within?: Option<f64>,
        /// mean, rms: errors above this number, and lost trials, count as this number. Without it no number of trials
        /// tells that a mean is small.
        cap?: Option<f64>,
        /// rms of an output: the mean fourth power is assumed to be at most this multiple of the square of the mean
        /// square (3 for the norm of a normal error).
        kurtosis?: Option<f64>,
    }
}

impl TestTable {
    /// Returns what the test compares with, if that is an output or a method.
    pub(crate) fn compared_with(&self) -> Option<&Axis> {
        self.to.as_ref().filter(|_| self.cells.is_none())
    }

    /// Returns the table with one name instead of each list.
    pub(crate) fn chosen(&self, output: Option<&Scalar>, to: Option<&Scalar>) -> Self {
        let name = |list: Option<&Axis>, name: Option<&Scalar>| match (list, name) {
            (Some(Axis::Many(_)), Some(name)) => Some(Axis::One(name.clone())),
            (list, _) => list.cloned(),
        };
        let compared = self.compared_with().is_some();
        Self {
            output: name(self.output.as_ref(), output),
            to: name(self.to.as_ref(), to.filter(|_| compared)),
            ..self.clone()
        }
    }
}

named_enum! {
    /// The part of a method that is timed.
    TimeOf, "time" {
        /// The whole estimate, with all passes.
        Estimate = "estimate",
    }
}

/// The names of all statistics, for the schema.
struct StatisticName;

impl JsonSchema for StatisticName {
    fn schema_name() -> Cow<'static, str> {
        "ClaimStatistic".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let values = ValueStatistic::ALL.iter().map(|of| of.name());
        let coefficients = CoefficientStatistic::ALL.iter().map(|of| of.name());
        let ratios = RatioStatistic::ALL.iter().map(|of| of.name());
        let names = each_once(values.chain(coefficients).chain(ratios));
        json_schema!({ "type": "string", "enum": names })
    }
}
