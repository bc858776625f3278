//! The tests of claims: converts a table of an experiment file to one of the kinds of test.

use crate::design::Measure;
use crate::design::file::{
    At, Axis, BoundTable, CoefficientStatistic, FileError, JointTable, Key, OutputStatistic, RatioStatistic, Scalar,
    SlopeTable, TestTable, TheoryReference, TimeOf, ValueStatistic, wrong,
};
use asobench_identification::metric::SlopeOf;
use asobench_identification::names::{UnknownName, named_enum};
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::str::FromStr;

named_enum! {
    /// How a trial of an output may end.
    Outcome, "share" {
        /// With a failure or an unstable A-hat.
        Lost = "lost",
        /// With a failure.
        Failed = "failed",
        /// With an unstable A-hat.
        Unstable = "unstable",
    }
}

/// The numbers that pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// Those below this number.
    Below(f64),
    /// Those above this number.
    Above(f64),
    /// Those from the first to the second number.
    Between(f64, f64),
    /// Those from 1 over this factor to this factor.
    Within(f64),
}

/// The quantity that a test looks at.
#[derive(Clone, Debug, PartialEq)]
pub enum TestKind {
    /// The share of trials with this outcome.
    Outcome(Outcome),
    /// The share of trials that meet a bound.
    Bound(BoundTable),
    /// The share of trials in which the output is better than another one by a measure.
    Wins {
        /// The measure.
        measure: Measure,
        /// The other output.
        to: String,
    },
    /// A statistic of a measure.
    Value {
        /// The measure.
        measure: Measure,
        /// Which statistic.
        statistic: ValueStatistic,
    },
    /// A statistic of a coefficient of a and h, or of every one.
    Coefficient {
        /// Its name, such as "a_1"; `None` for every one.
        name: Option<String>,
        /// Which statistic.
        statistic: CoefficientStatistic,
    },
    /// A ratio to another output.
    Ratio {
        /// The measure.
        measure: Measure,
        /// The other output.
        to: String,
        /// The measure of the other output.
        measure_of_to: Measure,
        /// Which ratio; never [`RatioStatistic::PairedMedian`] of theory.
        statistic: RatioStatistic,
    },
    /// The median ratio of two cells.
    Cells {
        /// The measure.
        measure: Measure,
        /// The setting in which they differ.
        axis: Key,
        /// Its value in the cell that others are compared with.
        from: Scalar,
        /// Its values in the others; if absent, every other value.
        to: Option<Vec<Scalar>>,
    },
    /// A log-log slope.
    Slope(SlopeTable),
    /// The time of a method over that of another method.
    Time {
        /// The other method.
        to: String,
    },
}

impl TestKind {
    /// Whether its numbers are shares of trials.
    pub fn is_share(&self) -> bool {
        match self {
            Self::Outcome(_) | Self::Bound(_) | Self::Wins { .. } => true,
            Self::Coefficient { statistic, .. } => match statistic {
                CoefficientStatistic::Coverage | CoefficientStatistic::ShareAbove => true,
                CoefficientStatistic::Bias => false,
            },
            Self::Value { .. } | Self::Ratio { .. } | Self::Cells { .. } | Self::Slope(_) | Self::Time { .. } => false,
        }
    }

    /// Returns the output or method with which the test compares.
    pub fn other(&self) -> Option<&String> {
        match self {
            Self::Wins { to, .. } | Self::Ratio { to, .. } | Self::Time { to } => Some(to),
            _ => None,
        }
    }

    /// Returns the same, mutable.
    pub fn other_mut(&mut self) -> Option<&mut String> {
        match self {
            Self::Wins { to, .. } | Self::Ratio { to, .. } | Self::Time { to } => Some(to),
            _ => None,
        }
    }
}

/// The assumption of a test of a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Assumption {
    /// None: larger numbers, and lost trials, count as this number.
    Cap(f64),
    /// The mean fourth power is at most this multiple of the square of the mean square.
    Kurtosis(f64),
}

/// One test of a claim.
#[derive(Clone, Debug, PartialEq)]
pub struct ClaimTest {
    /// The output; the method in [`TestKind::Time`].
    pub output: String,
    /// The quantity that the test looks at.
    pub kind: TestKind,
    /// The limit that this must meet.
    pub limit: Limit,
    /// The assumption on a moment, if there is one.
    pub assumption: Option<Assumption>,
}

/// The unit of a test: a cell, two cells, or a family of cells. All tests of a claim must have the same unit.
#[derive(Clone, Debug, PartialEq)]
pub enum TestUnit {
    /// One cell.
    Cell,
    /// Two cells that differ in a setting: its value in the first, and its values in the others.
    Pair(Key, Scalar, Option<Vec<Scalar>>),
    /// Cells that differ in a setting, from this value on.
    Family(Key, f64),
}

const KINDS: [&str; 6] = ["share", "value", "ratio", "cells", "slope", "time"];
const LIMITS: [&str; 4] = ["below", "above", "between", "within"];
/// The whole of which a share of trials is taken.
const SHARES: [&str; 3] = ["bound", "rounding", "to"];
/// The keys that not all kinds of test have, with those that do.
const OPTIONS: [(&str, &[&str]); 11] = [
    ("to", &["share", "ratio", "cells", "time"]),
    ("measure_of_to", &["ratio"]),
    ("statistic", &["value", "ratio", "slope"]),
    ("bound", &["share"]),
    ("rounding", &["share"]),
    ("axis", &["cells"]),
    ("from", &["cells", "slope"]),
    ("over", &["slope"]),
    ("within", &["ratio", "cells", "time"]),
    ("cap", &["value", "ratio"]),
    ("kurtosis", &["value", "ratio"]),
];

impl TestTable {
    /// Returns the keys that are there, with their values.
    fn written(&self) -> Map<String, Value> {
        match serde_json::to_value(self) {
            Ok(Value::Object(written)) => written,
            _ => Map::new(),
        }
    }

    fn kind(&self, name: &str) -> Result<TestKind, FileError> {
        let measured = self.ratio.or(self.cells).or(self.slope);
        match (&self.share, &self.value, measured) {
            (Some(share), ..) => self.share_kind(share),
            (_, Some(value), _) => self.value_kind(value),
            (.., Some(measure)) if name == "ratio" => self.ratio_kind(measure),
            (.., Some(measure)) if name == "cells" => self.cells_kind(measure),
            (.., Some(measure)) => self.slope_kind(measure),
            _ => {
                let TimeOf::Estimate = self.time.unwrap_or_default();
                Ok(TestKind::Time { to: self.other()? })
            }
        }
    }

    fn limit(&self) -> Result<Limit, FileError> {
        let name = only_of(&self.written(), &LIMITS)?;
        let limit = match (self.below, self.above, self.between, self.within) {
            (Some(x), ..) => Limit::Below(x),
            (_, Some(x), ..) => Limit::Above(x),
            (_, _, Some([low, high]), _) if !(low < high) => {
                let message = format!("[{low}, {high}]; expected the lower limit first");
                return wrong(name, message);
            }
            (_, _, Some([low, high]), _) => Limit::Between(low, high),
            (.., factor) => match factor.unwrap_or_default() {
                factor if factor > 1.0 => Limit::Within(factor),
                factor => {
                    let message = format!("{factor}; expected a factor above 1");
                    return wrong(name, message);
                }
            },
        };
        let [low, high] = self.between.unwrap_or_default();
        let all = [self.below, self.above, self.within, Some(low), Some(high)];
        if !all.into_iter().flatten().all(f64::is_finite) {
            return wrong(name, "expected a finite number");
        }
        Ok(limit)
    }

    /// Returns the statistic, of those of a kind of test; the first by default.
    fn statistic_of<T: Default + FromStr<Err = UnknownName>>(&self) -> Result<T, FileError> {
        let given = self.statistic.as_deref();
        given.map_or_else(|| Ok(T::default()), str::parse).at("statistic")
    }

    /// Returns `of` or `to` as the name of an output or method.
    fn name(key: &str, given: Option<&Axis>, expected: &str) -> Result<String, FileError> {
        match given {
            Some(Axis::One(Scalar::Text(label))) => Ok(label.clone()),
            Some(_) => wrong(key, "expected a name, a text, or a list of names"),
            None => Err(missing(key, expected)),
        }
    }

    fn other(&self) -> Result<String, FileError> {
        Self::name("to", self.to.as_ref(), "what it is compared with")
    }

    fn share_kind(&self, share: &str) -> Result<TestKind, FileError> {
        if let Ok(outcome) = share.parse::<Outcome>() {
            let written = self.written();
            return match SHARES.into_iter().find(|key| written.contains_key(*key)) {
                Some(name) => wrong(
                    name,
                    format!("means nothing with share = \"{outcome}\"; expected a measure there"),
                ),
                None => Ok(TestKind::Outcome(outcome)),
            };
        }
        let outcomes = Outcome::ALL.iter().map(|outcome| outcome.name());
        let measure = measure("share", share, outcomes)?;
        // A bound may have a rounding.
        let is_bound = self.bound.or(self.rounding).is_some();
        if is_bound == self.to.is_some() {
            let message = "share of a measure: expected exactly one of bound, rounding, to";
            return wrong(if is_bound { "to" } else { "" }, message);
        }
        if self.to.is_some() {
            let to = self.other()?;
            return Ok(TestKind::Wins { measure, to });
        }
        for (key, limit) in [("bound", self.bound), ("rounding", self.rounding)] {
            if let Some(limit) = limit.filter(|limit| !limit.is_finite()) {
                let message = format!("{limit} is not a finite number");
                return wrong(key, message);
            }
        }
        Ok(TestKind::Bound(BoundTable {
            claim: None,
            measure,
            label: None,
            below: self.bound,
            rounding: self.rounding,
        }))
    }

    /// Returns what a test of this kind assumes.
    fn assumption(&self, kind: &TestKind, limit: Limit) -> Result<Option<Assumption>, FileError> {
        let of_theory = |kind: &TestKind| kind.other().is_some_and(|to| TheoryReference::named(to).is_some());
        let (can_cap, can_have_kurtosis) = match kind {
            TestKind::Value { measure, statistic } => (
                !measure.may_be_negative() && matches!(statistic, ValueStatistic::Mean | ValueStatistic::Rms),
                *statistic == ValueStatistic::Rms,
            ),
            TestKind::Ratio { statistic, .. } => (
                *statistic == RatioStatistic::Rms,
                *statistic == RatioStatistic::Rms && of_theory(kind),
            ),
            _ => (false, false),
        };
        let [_, high] = limit.ends();
        match (self.cap, self.kurtosis) {
            (None, None) => Ok(None),
            (Some(_), Some(_)) => wrong("kurtosis", "with cap nothing is assumed; expected one of the two"),
            (Some(_), _) if !can_cap => wrong(
                "cap",
                "belongs to the mean or rms of an error; expected statistic = \"mean\" or \"rms\"",
            ),
            (_, Some(_)) if !can_have_kurtosis => wrong(
                "kurtosis",
                "belongs to the rms of one output; expected statistic = \"rms\"",
            ),
            (Some(cap), _) if matches!(kind, TestKind::Value { .. }) && !(cap > high.max(0.0)) && high.is_finite() => {
                let message = format!("{cap}; expected a number above the limit, {high}");
                wrong("cap", message)
            }
            (Some(cap), _) if cap > 0.0 && cap.is_finite() => Ok(Some(Assumption::Cap(cap))),
            (_, Some(most)) if most >= 1.0 && most.is_finite() => Ok(Some(Assumption::Kurtosis(most))),
            (Some(cap), _) => wrong("cap", format!("{cap}; expected a number above 0")),
            (_, Some(most)) => wrong("kurtosis", format!("{most}; expected a number of at least 1")),
        }
    }

    fn value_kind(&self, value: &str) -> Result<TestKind, FileError> {
        let every = value == "parameters";
        if every || is_coefficient(value) {
            return Ok(TestKind::Coefficient {
                name: (!every).then(|| value.to_owned()),
                statistic: self.statistic_of()?,
            });
        }
        Ok(TestKind::Value {
            measure: measure("value", value, ["parameters", "a_1", "h_1"])?,
            statistic: self.statistic_of()?,
        })
    }

    fn ratio_kind(&self, measure: Measure) -> Result<TestKind, FileError> {
        let to = self.other()?;
        let statistic = match TheoryReference::named(&to) {
            None => self.statistic_of()?,
            // Theory has no trials to pair with.
            Some(_) => match self.statistic_of()? {
                OutputStatistic::Median => RatioStatistic::Median,
                OutputStatistic::Rms => RatioStatistic::Rms,
            },
        };
        if self.measure_of_to.is_some() && statistic == RatioStatistic::Rms {
            let message = "two different measures cannot be compared by their rms; expected statistic = \
                \"paired-median\" or \"median\"";
            return wrong("measure_of_to", message);
        }
        Ok(TestKind::Ratio {
            measure,
            to,
            measure_of_to: self.measure_of_to.unwrap_or(measure),
            statistic,
        })
    }

    fn cells_kind(&self, measure: Measure) -> Result<TestKind, FileError> {
        let axis = self.axis.ok_or_else(|| missing("axis", "a setting"))?;
        let from = self.from.clone();
        let to = self.to.as_ref().map(|to| to.values(axis.entry().count));
        Ok(TestKind::Cells {
            measure,
            axis,
            from: from.ok_or_else(|| missing("from", "a value of the axis"))?,
            to,
        })
    }

    fn slope_kind(&self, measure: Measure) -> Result<TestKind, FileError> {
        let from = match self.from {
            None => 0.0,
            Some(Scalar::Number(from)) => from,
            Some(_) => return wrong("from", "expected a number"),
        };
        Ok(TestKind::Slope(SlopeTable {
            measure,
            over: self.over.ok_or_else(|| missing("over", "a setting"))?,
            statistic: match self.statistic_of()? {
                OutputStatistic::Median => SlopeOf::Median,
                OutputStatistic::Rms => SlopeOf::Rmse,
            },
            from,
        }))
    }
}

impl ClaimTest {
    /// Converts a table to a test.
    ///
    /// # Errors
    /// The fault of the table, with the key in it.
    pub fn from_table(table: &TestTable) -> Result<Self, FileError> {
        let written = table.written();
        let name = only_of(&written, &KINDS)?;
        let stray = OPTIONS
            .iter()
            .find(|(key, kinds)| written.contains_key(*key) && !kinds.contains(&name));
        if let Some((key, kinds)) = stray {
            let message = format!(
                "means nothing in a test of '{name}'; it belongs to {}",
                kinds.join(", ")
            );
            return wrong(key, message);
        }
        let limit = table.limit()?;
        let kind = table.kind(name)?;
        let output = TestTable::name("of", table.output.as_ref(), "an output, such as \"iv(4)\"")?;
        let assumption = table.assumption(&kind, limit)?;
        let beyond = |end: f64| end.is_finite() && !(0.0..=1.0).contains(&end);
        if kind.is_share() && limit.ends().into_iter().any(beyond) {
            return wrong(name, "its limit is not a share; expected one from 0 to 1");
        }
        Ok(Self {
            output,
            kind,
            limit,
            assumption,
        })
    }

    /// Returns the two measures of a ratio that are compared trial by trial.
    pub(crate) fn joint(&self) -> JointTable {
        let measures = self.measures();
        JointTable {
            output: self.output.clone(),
            measure: measures[0],
            to: self.kind.other().cloned().unwrap_or_default(),
            measure_of_to: measures[measures.len() - 1],
        }
    }

    /// Returns what can be judged instead of a moment that nothing bounds, in words.
    pub(crate) fn instead(&self) -> &'static str {
        match &self.kind {
            TestKind::Coefficient { .. } => {
                "statistic = \"share-above\", the share of estimates above the truth, can be judged"
            }
            TestKind::Slope(_) => "the slope of medians, or a test of cells, can be judged",
            TestKind::Value { measure, .. } if measure.may_be_negative() => "a quantile or a share can be judged",
            TestKind::Value { .. } => "a quantile, a share, or the same number with a cap can be judged",
            _ => "the median ratio, or the same number with a cap, can be judged",
        }
    }

    /// Returns the unit of the test.
    pub fn unit(&self) -> TestUnit {
        match &self.kind {
            TestKind::Cells { axis, from, to, .. } => TestUnit::Pair(*axis, from.clone(), to.clone()),
            TestKind::Slope(slope) => TestUnit::Family(slope.over, slope.from),
            _ => TestUnit::Cell,
        }
    }

    /// Whether it looks at times.
    pub fn is_timed(&self) -> bool {
        matches!(self.kind, TestKind::Time { .. })
    }

    /// Returns the measures that it looks at.
    pub fn measures(&self) -> Vec<Measure> {
        match &self.kind {
            TestKind::Bound(bound) => vec![bound.measure],
            TestKind::Slope(slope) => vec![slope.measure],
            TestKind::Value { measure, .. } | TestKind::Wins { measure, .. } | TestKind::Cells { measure, .. } => {
                vec![*measure]
            }
            TestKind::Ratio {
                measure, measure_of_to, ..
            } => vec![*measure, *measure_of_to],
            TestKind::Outcome(_) | TestKind::Coefficient { .. } | TestKind::Time { .. } => Vec::new(),
        }
    }
}

impl TestUnit {
    /// Returns the values (from, to) of the setting in which two cells differ, for all pairs in a file.
    pub fn steps(&self, settings: &BTreeMap<Key, Axis>) -> Vec<(Scalar, Scalar)> {
        let Self::Pair(axis, from, to) = self else {
            return Vec::new();
        };
        let all = settings.get(axis).map(|values| values.values(axis.entry().count));
        let mut others = all.unwrap_or_default();
        if !others.contains(from) {
            return Vec::new();
        }
        let asked = |value: &Scalar| to.as_ref().is_none_or(|to| to.contains(value));
        others.retain(|value| value != from && asked(value));
        others.into_iter().map(|value| (from.clone(), value)).collect()
    }
}

impl Limit {
    /// Returns the smallest and the largest number; one of them may be infinite.
    pub fn ends(self) -> [f64; 2] {
        match self {
            Self::Below(high) => [f64::NEG_INFINITY, high],
            Self::Above(low) => [low, f64::INFINITY],
            Self::Between(low, high) => [low, high],
            Self::Within(factor) => [1.0 / factor, factor],
        }
    }
}

fn missing(key: &str, what: &str) -> FileError {
    FileError::key(key, format!("missing; expected {what}"))
}

/// Returns the only key of several that is there.
fn only_of(written: &Map<String, Value>, keys: &[&'static str]) -> Result<&'static str, FileError> {
    let mut found = keys.iter().filter(|key| written.contains_key(**key));
    let first = found.next();
    match (first, found.next()) {
        (Some(key), None) => Ok(key),
        (_, second) => {
            let message = format!("expected exactly one of {}", keys.join(", "));
            wrong(second.copied().unwrap_or_default(), message)
        }
    }
}

/// Parses the name of a measure; `others` are further names to offer.
fn measure<'a>(key: &str, name: &str, others: impl IntoIterator<Item = &'a str>) -> Result<Measure, FileError> {
    name.parse::<Measure>().map_err(|_| {
        let names = Measure::ALL.iter().map(|measure| measure.name());
        FileError::key(key, UnknownName::new(key, name, others.into_iter().chain(names)))
    })
}

/// Whether a name is that of a coefficient: "a_1", "h_2".
fn is_coefficient(name: &str) -> bool {
    let number = name.strip_prefix("a_").or_else(|| name.strip_prefix("h_"));
    number.is_some_and(|number| number.parse::<usize>().is_ok_and(|number| number > 0))
}
