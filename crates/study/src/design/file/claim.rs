//! Claims: what the results of a study should show, and the tests that decide it.

use crate::design::file::table::tables;
use crate::design::file::{Axis, ClaimTest, FileError, Key, Scalar, TestTable, wrong};
use asobench_identification::names::named_enum;
use schemars::{Schema, SchemaGenerator, json_schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
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

/// The one-sided error rate of a verdict if a claim names none.
pub const CLAIM_LEVEL: f64 = 0.025;

fn level() -> f64 {
    CLAIM_LEVEL
}

fn own() -> String {
    "own".to_owned()
}

tables! {
    /// A claim with the test that decides it.
    pub struct ClaimTable {
        /// Its name in the file: letters, digits, ".", "-" and "_", not a number.
        id: String,
        /// The claim, in words.
        #[serde(default)]
        text: String,
        /// Who claims it: "own", or the words and the place of a paper.
        #[serde(default = "own")]
        source: String,
        /// "everywhere" (in every cell of `where`), "typically" (in more than half of them) or
        /// "somewhere" (in at least one).
        #[serde(default)]
        holds: Holds,
        /// The one-sided error rate of either verdict, above 0 and below 0.5.
        #[serde(default = "level")]
        level: f64,
        /// Whether it was written after results of the same kind were seen. Its error rates then mean nothing, and its
        /// verdict says so; `run --confirm` judges it by fresh trials.
        exploratory?: bool,
        /// The cells to which it applies: those with one of the given values of every given setting; all
        /// cells if absent.
        #[serde(rename = "where")]
        cells?: BTreeMap<Key, Axis>,
        /// A condition on results: only cells in which this test certainly passes are judged.
        given?: Option<TestTable>,
        /// The test, or a list of tests that must all pass in a cell.
        #[serde(deserialize_with = "tests_of_a_cell")]
        #[schemars(schema_with = "schema_of_tests")]
        test: Vec<TestTable>,
        /// Whether it was written after the results were there; `run` sets it in what it stores.
        #[schemars(skip)]
        added_after_run?: bool,
    }
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
                    return wrong(key, message);
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
    pub(crate) fn single(&self, key: Key) -> Option<String> {
        let values = self.cells.get(&key)?.values(key.entry().count);
        let [value] = values.as_slice() else {
            return None;
        };
        Some(value.to_string())
    }

    /// Returns the tests of all cases, then the condition. A fault in any test leaves out all cases; a faulty condition
    /// is left out.
    pub fn all_tests(&self) -> Vec<ClaimTest> {
        let given = self.given.as_ref().and_then(|table| ClaimTest::from_table(table).ok());
        let cases = self.cases().unwrap_or_default();
        cases.into_iter().flatten().chain(given).collect()
    }

    /// Returns all tests, each with its key: those that must pass, then the condition.
    pub fn tests(&self) -> impl Iterator<Item = (String, &TestTable)> {
        let many = self.test.len() > 1;
        let key = move |i: usize| {
            if many { format!("test[{i}]") } else { "test".to_owned() }
        };
        let tests = self.test.iter().enumerate();
        let given = self.given.iter().map(|test| ("given".to_owned(), test));
        tests.map(move |(i, test)| (key(i), test)).chain(given)
    }
}

/// The list `claims`: tables, or only names. Names are claims that are not judged, as in files from before claims had
/// tests.
pub(crate) mod list {
    use super::{
        ClaimTable, Deserialize, Deserializer, Error, MapAccess, MapAccessDeserializer, Schema, SchemaGenerator,
        Visitor, fmt, json_schema,
    };
    use serde::{Serialize, Serializer};

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

struct TestsVisitor;

impl<'de> Visitor<'de> for TestsVisitor {
    type Value = Vec<TestTable>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a test such as { value = \"e_a\", of = \"ls\", below = 1 }, or a list of them")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        TestTable::deserialize(MapAccessDeserializer::new(map)).map(|test| vec![test])
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Self::Value, A::Error> {
        let tests = Vec::<TestTable>::deserialize(SeqAccessDeserializer::new(list))?;
        if tests.is_empty() {
            return Err(A::Error::custom("an empty list; expected at least one test"));
        }
        Ok(tests)
    }
}

/// Reads one test, or a list of tests.
fn tests_of_a_cell<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<TestTable>, D::Error> {
    from.deserialize_any(TestsVisitor)
}

fn schema_of_tests(generator: &mut SchemaGenerator) -> Schema {
    let test = generator.subschema_for::<TestTable>();
    json_schema!({
        "description": "The test, or a list of tests that must all pass in a cell.",
        "anyOf": [test.clone(), { "type": "array", "items": test, "minItems": 1 }],
    })
}
