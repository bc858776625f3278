//! Claims: what the results of a study should show, and the tests that decide it.

use super::super::measure::Measure;
use super::super::theory::TheoryReference;
use super::claim_test::{ClaimTest, TestKind, ValueOf};
use super::{Axis, BoundTable, ExperimentFile, FileError, Key, Scalar, SlopeTable};
use asobench_identification::names::named_enum;
use schemars::JsonSchema;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::fmt;

named_enum! {
    /// In how many cells a claim says that its test passes.
    Holds, "holds" {
        /// In all.
        Everywhere = "everywhere",
        /// In more than half.
        Typically = "typically",
        /// In at least one.
        Somewhere = "somewhere",
    }
}

named_enum! {
    /// The statistic of a measure that a test looks at.
    ClaimStatistic, "statistic" {
        /// The median.
        Median = "median",
        /// The median over trials of the ratio of two outputs on the same trial; for ratios.
        PairedMedian = "paired-median",
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
        /// The mean of the signed error over its standard deviation; for a coefficient.
        Bias = "bias",
        /// The share of trials whose 95 % interval contains the truth, among those with a standard error; for a
        /// coefficient.
        Coverage = "coverage",
    }
}

/// The one-sided error rate of a verdict if a claim names none.
pub const CLAIM_LEVEL: f64 = 0.025;

fn level() -> f64 {
    CLAIM_LEVEL
}

fn own() -> String {
    "own".to_owned()
}

/// A claim with the test that decides it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClaimTable {
    /// Its name in the file: letters, digits, ".", "-" and "_", not a number.
    pub id: String,
    /// The claim, in words.
    #[serde(default)]
    pub text: String,
    /// Who claims it: "own", or the words and the place of a paper.
    #[serde(default = "own")]
    pub source: String,
    /// "everywhere" (in every cell of `where`), "typically" (in more than half of them) or
    /// "somewhere" (in at least one).
    #[serde(default)]
    pub holds: Holds,
    /// The one-sided error rate of either verdict, above 0 and below 0.5.
    #[serde(default = "level")]
    pub level: f64,
    /// Whether it was written after results of the same kind were seen. Its error rates then mean nothing, and its
    /// verdict says so; `run --confirm` judges it by fresh trials.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub exploratory: bool,
    /// The cells to which it applies: those with one of the given values of every given setting; all
    /// cells if absent.
    #[serde(default, rename = "where", skip_serializing_if = "BTreeMap::is_empty")]
    pub cells: BTreeMap<Key, Axis>,
    /// A condition on results: only cells in which this test certainly passes are judged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub given: Option<TestTable>,
    /// The test, or a list of tests that must all pass in a cell.
    #[serde(deserialize_with = "tests_of_a_cell::deserialize")]
    #[schemars(schema_with = "tests_of_a_cell::schema")]
    pub test: Vec<TestTable>,
    /// Whether it was written after the results were there; `run` sets it in what it stores.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(skip)]
    pub added_after_run: bool,
}

impl ClaimTable {
    /// Whether two claims test the same, whatever their names, words and marks.
    pub fn judges_as(&self, other: &Self) -> bool {
        let worded = Self {
            id: other.id.clone(),
            text: other.text.clone(),
            source: other.source.clone(),
            exploratory: other.exploratory,
            added_after_run: other.added_after_run,
            ..self.clone()
        };
        worded == *other
    }

    /// Makes a claim that has only a name, as in files from before claims had tests. It is not judged.
    fn named(id: &str) -> Self {
        Self {
            id: id.to_owned(),
            text: String::new(),
            source: own(),
            holds: Holds::default(),
            level: CLAIM_LEVEL,
            exploratory: false,
            cells: BTreeMap::new(),
            given: None,
            test: Vec::new(),
            added_after_run: false,
        }
    }

    /// Returns the tests of every case: one list of tests for each output, or pair of outputs, that the claim lists. A
    /// claim without lists is one case.
    ///
    /// # Errors
    /// A faulty test or list, with its key in the claim.
    pub fn cases(&self) -> Result<Vec<Vec<ClaimTest>>, FileError> {
        let lists = |part: fn(&TestTable) -> Option<&Axis>| -> Result<Vec<Scalar>, FileError> {
            let mut found: Option<Vec<Scalar>> = None;
            for (key, table) in self.tests() {
                let Some(Axis::Many(names)) = part(table) else {
                    continue;
                };
                if names.is_empty() || found.as_ref().is_some_and(|found| found != names) {
                    let message = "the lists of a claim's tests must be the same, and not empty";
                    return Err(FileError::key(&key, message));
                }
                found = Some(names.clone());
            }
            Ok(found.unwrap_or_default())
        };
        let outputs = lists(|table| table.output.as_ref())?;
        let to = lists(TestTable::compared_with)?;
        let choices = |list: &[Scalar]| -> Vec<Option<Scalar>> {
            match list {
                [] => vec![None],
                list => list.iter().cloned().map(Some).collect(),
            }
        };
        let mut cases = Vec::new();
        for output in choices(&outputs) {
            for to in choices(&to) {
                let tests = self.tests().take(self.test.len());
                let case = tests.map(|(key, table)| {
                    let test = ClaimTest::from_table(&table.chosen(output.as_ref(), to.as_ref()));
                    test.map_err(|error| error.within(&key))
                });
                cases.push(case.collect::<Result<Vec<ClaimTest>, FileError>>()?);
            }
        }
        Ok(cases)
    }

    /// Returns the value that the claim wants of a setting; `None` unless it names exactly one.
    fn single(&self, key: Key) -> Option<String> {
        let values = self.cells.get(&key)?.values(key.is_count());
        let [value] = values.as_slice() else {
            return None;
        };
        Some(value.to_string())
    }

    /// Returns the tests of all cases, then the condition. A fault in any test leaves out all cases; a faulty condition
    /// is left out.
    pub fn all_tests(&self) -> Vec<ClaimTest> {
        let given = self
            .given
            .as_ref()
            .and_then(|table| ClaimTest::from_table(table).ok());
        let cases = self.cases().unwrap_or_default();
        cases.into_iter().flatten().chain(given).collect()
    }

    /// Returns all tests, each with its key: those that must pass, then the condition.
    pub fn tests(&self) -> impl Iterator<Item = (String, &TestTable)> {
        let many = self.test.len() > 1;
        let key = move |i: usize| {
            if many {
                format!("test[{i}]")
            } else {
                "test".to_owned()
            }
        };
        let tests = self.test.iter().enumerate();
        let given = self.given.iter().map(|test| ("given".to_owned(), test));
        tests.map(move |(i, test)| (key(i), test)).chain(given)
    }
}

/// A test of one cell. Exactly one of `share`, `value`, `ratio`, `cells`, `slope` and `time` says
/// its kind, exactly one of `below`, `above`, `between` and `within` its limit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TestTable {
    /// Share of the trials of `of`: "failed", "unstable" or "lost" (either), or a measure: the
    /// trials whose measure is below `bound` or `rounding`, or in which `of` is better in it than
    /// `to`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share: Option<String>,
    /// A statistic of a measure of `of`, or the bias or coverage of "parameters" (every coefficient), "a_1",
    /// "h_2", ...
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<String>,
    /// A measure of `of` over that of `to`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ratio: Option<Measure>,
    /// A measure of `of` in the cell with `axis` at `to` over that at `from`, on the same trials.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cells: Option<Measure>,
    /// The log-log slope of a measure of `of` over a setting.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slope: Option<Measure>,
    /// "estimate": the median time of method `of` over that of `to`; it needs timing = true.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<TimeOf>,
    /// The output, such as "iv(4)"; of `time` the method. A list: each of them is judged by itself.
    #[serde(rename = "of", skip_serializing_if = "Option::is_none")]
    pub output: Option<Axis>,
    /// The output or method that it is compared with, or a list, as for `of`; of `ratio` also "theory"
    /// (the output's own), "bound:shared" or "bound:separate" (Cramer-Rao); of `cells` the value of
    /// `axis`, or a list (every other value if absent).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to: Option<Axis>,
    /// ratio: the measure of `to`, if it differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measure_of_to: Option<Measure>,
    /// value: "median" (default), "mean", "rms", "q05", "q25", "q75", "q95"; of a coefficient "bias" (default),
    /// "coverage"; ratio: "paired-median"
    /// (default; of theory "median"), "median" (of two medians), "rms"; slope: "median" (default), "rms".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub statistic: Option<ClaimStatistic>,
    /// share: the measure must be below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bound: Option<f64>,
    /// share: or below this multiple of eps times the condition number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rounding: Option<f64>,
    /// cells: the setting in which the two cells differ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<Key>,
    /// cells: the value of `axis` that the others are compared with; slope: the first value of
    /// `over` that is taken.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from: Option<Scalar>,
    /// slope: the setting.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over: Option<Key>,
    /// It must be below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub below: Option<f64>,
    /// It must be above this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub above: Option<f64>,
    /// It must be from the first to the second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub between: Option<[f64; 2]>,
    /// ratio, cells, time: it must be the same within this factor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within: Option<f64>,
}

impl TestTable {
    /// Returns what the test compares with, if that is an output or a method.
    pub(super) fn compared_with(&self) -> Option<&Axis> {
        self.to.as_ref().filter(|_| self.cells.is_none())
    }

    /// Returns the table with one name instead of each list.
    fn chosen(&self, output: Option<&Scalar>, to: Option<&Scalar>) -> Self {
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
    /// What part of a method is timed.
    TimeOf, "time" {
        /// The whole estimate, with all passes.
        Estimate = "estimate",
    }
}

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

/// Two medians of a cell whose ratio a claim looks at.
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

    fn add(&mut self, claim: &ClaimTable, test: &ClaimTest, file: &ExperimentFile) {
        let output = || test.output.clone();
        match &test.kind {
            TestKind::Outcome(_) => {}
            TestKind::Bound(bound) => {
                push(&mut self.measures, &file.measures, bound.measure);
                // A bound of the file may apply to the cells of one claim only.
                let claim = claim.single(Key::Claim);
                let counted = |table: &BoundTable| {
                    table.limits() == bound.limits()
                        && (table.claim.is_none() || table.claim == claim)
                };
                if !file.bounds.iter().any(counted) {
                    let claim = claim.clone();
                    push(
                        &mut self.bounds,
                        &[],
                        BoundTable {
                            claim,
                            ..bound.clone()
                        },
                    );
                }
            }
            TestKind::Wins { measure, to } => {
                push(&mut self.measures, &file.measures, *measure);
                push(&mut self.compare, &file.compare, [output(), to.clone()]);
            }
            TestKind::Value { what, statistic } => match what {
                ValueOf::Measure(measure) => push(&mut self.measures, &file.measures, *measure),
                _ if *statistic == ClaimStatistic::Coverage => self.coverage |= !file.coverage,
                ValueOf::Parameters | ValueOf::Parameter(_) => self.parameters |= !file.parameters,
            },
            TestKind::Ratio {
                measure,
                to,
                measure_of_to,
                statistic,
            } => {
                push(&mut self.measures, &file.measures, *measure);
                push(&mut self.measures, &file.measures, *measure_of_to);
                let of_theory = TheoryReference::named(to).is_some();
                if *statistic == ClaimStatistic::Median && !of_theory {
                    let medians = MediansTable {
                        output: output(),
                        measure: *measure,
                        to: to.clone(),
                        measure_of_to: *measure_of_to,
                    };
                    push(&mut self.medians, &[], medians);
                } else if !of_theory {
                    push(&mut self.compare, &file.compare, [output(), to.clone()]);
                }
            }
            TestKind::Cells { measure, axis, .. } => {
                push(&mut self.measures, &file.measures, *measure);
                for (from, to) in test.unit().steps(file) {
                    let series = SeriesTable {
                        measure: *measure,
                        output: output(),
                        axis: *axis,
                        from,
                        to,
                    };
                    push(&mut self.series, &[], series);
                }
            }
            TestKind::Slope(slope) => {
                push(&mut self.measures, &file.measures, slope.measure);
                if slope.check(file).is_ok() {
                    push(&mut self.slopes, &file.slopes, slope.clone());
                }
            }
            TestKind::Time { .. } => self.timing |= !file.timing,
        }
    }
}

/// Adds the items that the list does not have yet.
fn extend<T: Clone + PartialEq>(list: &mut Vec<T>, items: &[T]) {
    for item in items {
        if !list.contains(item) {
            list.push(item.clone());
        }
    }
}

/// Adds an item that is in neither list.
fn push<T: PartialEq>(list: &mut Vec<T>, known: &[T], item: T) {
    if !known.contains(&item) && !list.contains(&item) {
        list.push(item);
    }
}

impl ExperimentFile {
    /// Returns what the claims need of a run beyond what a resolved file asks for itself. Faulty tests need nothing.
    pub fn needs(&self) -> Needs {
        let mut needs = Needs::default();
        for claim in &self.claims {
            for test in claim.cases().unwrap_or_default().iter().flatten() {
                needs.add(claim, test, self);
            }
            if let Some(Ok(given)) = claim.given.as_ref().map(ClaimTest::from_table) {
                needs.add(claim, &given, self);
            }
        }
        needs.measures.sort_unstable();
        needs
    }

    /// Adds what the claims need. If `needed` is given already, adds exactly that.
    pub(super) fn add_needs(&mut self) {
        let needs = self.needed.take().unwrap_or_else(|| self.needs());
        extend(&mut self.measures, &needs.measures);
        extend(&mut self.compare, &needs.compare);
        extend(&mut self.bounds, &needs.bounds);
        extend(&mut self.slopes, &needs.slopes);
        self.parameters |= needs.parameters;
        self.coverage |= needs.coverage;
        self.timing |= needs.timing;
        self.needed = Some(needs).filter(|needs| !needs.is_empty());
    }
}

/// The list `claims`: tables, or only names. Names are claims that are not judged, as in files from before claims had
/// tests.
pub(super) mod list {
    use super::{
        ClaimTable, Deserialize, Deserializer, Error, MapAccess, MapAccessDeserializer, Serialize,
        Serializer, Visitor, fmt,
    };
    use schemars::{Schema, SchemaGenerator, json_schema};

    struct Entry(ClaimTable);

    struct EntryVisitor;

    impl<'de> Visitor<'de> for EntryVisitor {
        type Value = Entry;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a table [[claims]], or the name of a claim")
        }

        fn visit_str<E: Error>(self, name: &str) -> Result<Entry, E> {
            Ok(Entry(ClaimTable::named(name)))
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Entry, A::Error> {
            ClaimTable::deserialize(MapAccessDeserializer::new(map)).map(Entry)
        }
    }

    impl<'de> Deserialize<'de> for Entry {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            deserializer.deserialize_any(EntryVisitor)
        }
    }

    #[derive(Serialize)]
    #[serde(untagged)]
    enum Written<'a> {
        Name(&'a str),
        Table(&'a ClaimTable),
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<ClaimTable>, D::Error> {
        let entries = Vec::<Entry>::deserialize(from)?;
        Ok(entries.into_iter().map(|entry| entry.0).collect())
    }

    pub fn serialize<S: Serializer>(claims: &[ClaimTable], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(claims.iter().map(|claim| {
            if claim.test.is_empty() {
                Written::Name(&claim.id)
            } else {
                Written::Table(claim)
            }
        }))
    }

    pub fn schema(generator: &mut SchemaGenerator) -> Schema {
        let table = generator.subschema_for::<ClaimTable>();
        json_schema!({
            "description": "Claims with the tests that decide them; a name alone is not judged.",
            "type": "array",
            "items": { "anyOf": [table, { "type": "string" }] },
        })
    }
}

/// One test, or a list of tests.
mod tests_of_a_cell {
    use super::{
        Deserialize, Deserializer, Error, MapAccess, MapAccessDeserializer, SeqAccess,
        SeqAccessDeserializer, TestTable, Visitor, fmt,
    };
    use schemars::{Schema, SchemaGenerator, json_schema};

    struct TestsVisitor;

    impl<'de> Visitor<'de> for TestsVisitor {
        type Value = Vec<TestTable>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str(
                "a test such as { value = \"e_a\", of = \"ls\", below = 1 }, or a list of them",
            )
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
            TestTable::deserialize(MapAccessDeserializer::new(map)).map(|test| vec![test])
        }

        fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Self::Value, A::Error> {
            let tests = Vec::<TestTable>::deserialize(SeqAccessDeserializer::new(list))?;
            if tests.is_empty() {
                return Err(A::Error::custom(
                    "an empty list; expected at least one test",
                ));
            }
            Ok(tests)
        }
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<TestTable>, D::Error> {
        from.deserialize_any(TestsVisitor)
    }

    pub fn schema(generator: &mut SchemaGenerator) -> Schema {
        let test = generator.subschema_for::<TestTable>();
        json_schema!({
            "description": "The test, or a list of tests that must all pass in a cell.",
            "anyOf": [test.clone(), { "type": "array", "items": test, "minItems": 1 }],
        })
    }
}
