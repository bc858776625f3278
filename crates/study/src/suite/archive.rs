//! Results of others: a method's results with where they are from, in one file that can be sent, reviewed and shown.

use super::results::{METHODS, MethodResults, ResultsError, STUDIES, parsed};
use super::scenario::Suite;
use super::times::Times;
use crate::files::{self, Kind};
use crate::outcome::layout::MANIFEST;
use crate::text::{file_part, visible};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

/// The form of the file.
const FORM: u32 = 1;
/// The folder of contributions beside a page.
pub const ARCHIVE: &str = "archive";

/// The results of a method, with where they are from. Its file has the checksum of everything; every scenario of the
/// results has the checksum of what it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contribution {
    /// The edition of the suite.
    pub suite: String,
    /// The form of the file.
    pub contribution: u32,
    /// The programs that computed its studies: version, commit, engine; one for all as a rule.
    pub programs: Vec<String>,
    /// The method as its experiment file has it: an estimator with options, or a program with the version that it says.
    pub method: Value,
    /// Its times, if they were measured.
    pub times: Option<Times>,
    /// The results.
    pub results: MethodResults,
}

impl Contribution {
    /// Takes the results of a file `methods/NAME.json` with its text, within the folder of a run, whose manifests say
    /// where they are from. `times`: the name of the file with times in that folder.
    ///
    /// # Errors
    /// [`ResultsError`].
    pub fn of_run(path: &Path, text: &str, times: &str) -> Result<Self, ResultsError> {
        let missing = || {
            ResultsError::Other(format!(
                "expected {METHODS}/NAME.json within the folder of a run, whose {STUDIES} say where it is from"
            ))
        };
        let results = MethodResults::parse(text)?;
        let within = path.parent().filter(|of| of.ends_with(METHODS));
        let run = within.and_then(Path::parent).ok_or_else(missing)?;
        let (mut programs, mut method) = (BTreeSet::new(), None);
        let studies = files::subfolder(run, STUDIES)?.ok_or_else(missing)?;
        for folder in files::list(&studies)? {
            let Some(text) = text_of(&folder.join(MANIFEST), Kind::Manifest)? else {
                continue;
            };
            let manifest: Value = parsed(&text)?;
            let tables = manifest["experiment"]["methods"].as_array();
            let mut own = tables.into_iter().flatten();
            if let Some(own) = own.find(|of| is_of(of, &results.method)) {
                programs.insert(program(&manifest));
                method.get_or_insert_with(|| own.clone());
            }
        }
        let times = text_of(&run.join(times), Kind::Suite)?;
        let times = times.map(|text| Times::parse(&text)).transpose()?;
        let of_method = |mut times: Times| {
            times.methods.retain(|of| of.method == results.method);
            (!times.methods.is_empty()).then_some(times)
        };
        Ok(Self {
            suite: results.suite.clone(),
            contribution: FORM,
            programs: programs.into_iter().collect(),
            method: method.ok_or_else(missing)?,
            times: times.and_then(of_method),
            results,
        })
    }

    /// Reads the text of a file, checks its checksum and its results, and takes the part that a suite has.
    ///
    /// # Errors
    /// [`ResultsError`].
    pub fn parse(text: &str, suite: &Suite) -> Result<Self, ResultsError> {
        let value: Value = match parsed(text) {
            Err(error) if text.starts_with('{') => return Err(error),
            read => read.unwrap_or_default(),
        };
        if value["contribution"] != FORM {
            return Err(ResultsError::Other(
                "no contribution; expected a file of suite export".to_owned(),
            ));
        }
        let read = serde_json::from_value::<Self>(value);
        let mut own = read.map_err(|error| ResultsError::Damaged(error.to_string()))?;
        if own.suite != own.results.suite {
            return Err(ResultsError::Damaged(format!(
                "a file of suite {} with results of suite {}",
                visible(&own.suite),
                visible(&own.results.suite)
            )));
        }
        own.times = own.times.map(Times::checked).transpose()?;
        own.results = own.results.checked()?.of(suite)?;
        Ok(own)
    }

    /// The text of the file, with its checksum.
    pub fn text(&self) -> String {
        files::sealed(self)
    }

    /// The name of its file.
    pub fn file(&self) -> String {
        format!("{}.json", file_part(&self.results.method))
    }
}

/// The text of a file; `None` if it does not exist.
fn text_of(path: &Path, kind: Kind) -> Result<Option<String>, ResultsError> {
    let text = files::read_own(path, kind)?;
    Ok(text.map(|text| String::from_utf8_lossy(&text).into_owned()))
}

/// Whether a table of an experiment file is that of a method: by its name, or by its estimator if it has none.
fn is_of(table: &Value, method: &str) -> bool {
    let name = table["name"].as_str().or(table["estimator"].as_str());
    name.is_some_and(|name| method == name || method.starts_with(&format!("{name}[")))
}

/// The program that wrote a manifest.
fn program(manifest: &Value) -> String {
    let text = |key: &str| manifest[key].as_str().unwrap_or("unknown");
    let commit = text("git_revision");
    format!(
        "asobench {}, commit {}, engine {}",
        text("version"),
        commit.get(..12).unwrap_or(commit),
        text("engine")
    )
}
