//! Results of others: a method's results with where they are from, in one file that can be sent, reviewed and shown.

use super::results::{METHODS, MethodResults, STUDIES};
use super::scenario::Suite;
use super::stored::{Stored, SuiteError};
use super::times::Times;
use crate::files;
use crate::outcome::stored_results::read_manifest;
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

impl Stored for Contribution {
    fn fault(&self) -> Option<String> {
        let (own, of_results) = (&self.suite, &self.results.suite);
        if own != of_results {
            let [own, of_results] = [own, of_results].map(visible);
            return Some(format!("a file of suite {own} with results of suite {of_results}"));
        }
        let times = self.times.as_ref().and_then(Times::fault);
        times.or_else(|| self.results.fault())
    }
}

impl Contribution {
    /// Takes the results of a file `methods/NAME.json` with its text, within the folder of a run, whose manifests say
    /// where they are from. `times`: the name of the file with times in that folder.
    ///
    /// # Errors
    /// If it is no such file, or one of the run's files cannot be used.
    pub fn of_run(path: &Path, text: &str, times: &str) -> Result<Self, SuiteError> {
        let missing = || {
            SuiteError::new(format!(
                "expected {METHODS}/NAME.json within the folder of a run, whose {STUDIES} say where it is from"
            ))
        };
        let results = MethodResults::parse(text)?;
        let within = path.parent().filter(|of| of.ends_with(METHODS));
        let run = within.and_then(Path::parent).ok_or_else(missing)?;
        let (mut programs, mut method) = (BTreeSet::new(), None);
        let studies = files::subfolder(run, STUDIES).map_err(SuiteError::new)?;
        for folder in files::list(&studies.ok_or_else(missing)?).map_err(SuiteError::new)? {
            let manifest = read_manifest(&folder).map_err(SuiteError::new)?.unwrap_or_default();
            let tables = manifest["experiment"]["methods"].as_array();
            let mut own = tables.into_iter().flatten();
            if let Some(own) = own.find(|of| is_of(of, &results.method)) {
                programs.insert(program(&manifest));
                method.get_or_insert_with(|| own.clone());
            }
        }
        let of_method = |mut times: Times| {
            times.methods.retain(|of| of.method == results.method);
            (!times.methods.is_empty()).then_some(times)
        };
        Ok(Self {
            suite: results.suite.clone(),
            contribution: FORM,
            programs: programs.into_iter().collect(),
            method: method.ok_or_else(missing)?,
            times: Times::read(&run.join(times))?.and_then(of_method),
            results,
        })
    }

    /// Reads the text of a file, checks it, and takes the part that a suite has.
    ///
    /// # Errors
    /// If it is damaged, no contribution, or does not belong to the suite.
    pub fn of_text(text: &str, suite: &Suite) -> Result<Self, SuiteError> {
        let value: Value = match files::parsed(text.as_bytes()) {
            Err(error) if text.starts_with('{') => return Err(SuiteError::new(error)),
            read => read.unwrap_or_default(),
        };
        if value["contribution"] != FORM {
            return Err(SuiteError::new("no contribution; expected a file of suite export"));
        }
        let mut own = Self::parse(text)?;
        own.results = own.results.of(suite)?;
        Ok(own)
    }

    /// The name of its file.
    pub fn file(&self) -> String {
        format!("{}.json", file_part(&self.results.method))
    }
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
