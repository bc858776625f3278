//! A results folder as a report sees it: what was asked, what came out.

use super::index::Index;
use super::shipped::Shipped;
use crate::claim::{Judged, judge};
use crate::estimator::IvOptions;
use crate::files::{self, Kind, PathError};
use crate::metric::{Quantile, Statistics};
pub use crate::study::MethodTime as Time;
use crate::study::file::{ClaimTable, ExperimentFile, Key, TrialRule};
pub use crate::study::place::{axis_label, is_error, measure_name, value_name, words};
use crate::study::{CellSummary, Measure, OutputSummary, Summary, read_manifest};
use crate::text::shell_word;
use serde::Deserialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Why results cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// The folder holds no results.
    #[error("{}: no results there (no manifest.json); run an experiment with --out {} first", .0.display(), .0.display())]
    NoResults(PathBuf),
    /// The manifest.
    #[error(transparent)]
    Folder(#[from] crate::study::FolderError),
    /// A file of the folder that cannot be opened.
    #[error(transparent)]
    Path(#[from] PathError),
    /// A file of the folder.
    #[error("{}: {reason}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// Nothing to show.
    #[error("{}: the summary has no cell", .0.display())]
    Empty(PathBuf),
}

#[derive(Default, Deserialize)]
struct Times {
    times: Vec<Time>,
    /// The machine's processor.
    machine: Option<String>,
}

/// A study with its results.
#[derive(Clone, Debug)]
pub struct Study {
    /// What the study is called: the shipped experiment's name, or the folder's.
    pub name: String,
    /// The shipped experiment that it is.
    pub shipped: Option<Shipped>,
    /// The folder.
    pub folder: PathBuf,
    /// The experiment, every default written out.
    pub file: ExperimentFile,
    /// The program's version.
    pub version: String,
    /// The revision of its source, where known.
    pub revision: Option<String>,
    /// The results.
    pub summary: Summary,
    /// Times, where they were measured.
    pub times: Vec<Time>,
    /// What they say of the claims of the experiment file.
    pub judged: Vec<Judged>,
    /// What is looked up in the summary.
    pub(super) index: Index,
}

/// What `asobench reproduce` runs.
const BUILT_IN: &str = "nikolov2023";

impl Study {
    /// Reads a results folder.
    ///
    /// # Errors
    /// [`ResultsError`], one line that names the file.
    pub fn read(folder: &Path) -> Result<Self, ResultsError> {
        let manifest = read_manifest(folder)?;
        let manifest = manifest.ok_or_else(|| ResultsError::NoResults(folder.to_owned()))?;
        let path = folder.join("summary.json");
        let summary = files::read_own(&path, Kind::Summary)?;
        let summary = summary.ok_or_else(|| ResultsError::File {
            path,
            reason: "not there".to_owned(),
        })?;
        let times = match files::subfolder(folder, "timing")? {
            Some(timing) => files::read_own(&timing.join("times.json"), Kind::Times)?,
            None => None,
        };
        Self::decode(folder, &manifest, &summary, times.as_deref())
    }

    /// A study of what its files hold, whoever wrote them: a manifest, a summary, and times where they were measured.
    ///
    /// # Errors
    /// [`ResultsError`], one line that names the file.
    pub(super) fn decode(
        folder: &Path,
        manifest: &Value,
        summary: &[u8],
        times: Option<&[u8]>,
    ) -> Result<Self, ResultsError> {
        let wrong = |name: &str, reason: String| ResultsError::File {
            path: folder.join(name),
            reason,
        };
        let file = ExperimentFile::from_json(&manifest["experiment"])
            .map_err(|error| wrong("manifest.json", error.to_string()))?;
        let parsed = |name: &str, what: &str, error: &str| {
            wrong(name, format!("not {what} of this version ({error})"))
        };
        let summary = Summary::from_json(summary)
            .map_err(|error| parsed("summary.json", "a summary", &error))?;
        if summary.cells.is_empty() {
            return Err(ResultsError::Empty(folder.to_owned()));
        }
        let Times { times, machine } = match times.map(serde_json::from_slice).transpose() {
            Ok(times) => times.unwrap_or_default(),
            Err(error) => {
                let reason = error.to_string();
                return Err(parsed("timing/times.json", "times", &reason));
            }
        };
        if !times.iter().all(|time| time.is_of(summary.cells.len())) {
            let reason = "damaged: a cell that is not there, or times that do not ascend";
            return Err(wrong("timing/times.json", reason.to_owned()));
        }
        let text = |key: &str| manifest[key].as_str().map(str::to_owned);
        let shipped = Shipped::of(&file);
        let mut judged = judge(&file, &summary, &times);
        tell_times(&mut judged, machine.as_deref());
        tell_additions(&mut judged, &file.claims, &manifest["stated"]);
        Ok(Self {
            name: shipped.map_or_else(|| name(folder), |of| of.name.to_owned()),
            shipped,
            folder: folder.to_owned(),
            version: text("version").unwrap_or_default(),
            revision: text("git_revision"),
            index: Index::of(&summary, file.continuous.is_some()),
            judged,
            file,
            summary,
            times,
        })
    }

    /// The title, or the name where there is none.
    pub fn title(&self) -> &str {
        if self.summary.title.is_empty() {
            &self.name
        } else {
            &self.summary.title
        }
    }

    /// Every output's label, in order.
    pub fn labels(&self) -> &[String] {
        &self.index.labels
    }

    /// The settings that tell cells apart, without those that follow from another one.
    pub fn varying(&self) -> Vec<Key> {
        self.index.varying.clone()
    }

    /// The values of a setting over the cells, in order: by size where all are numbers, else of appearance.
    pub fn values(&self, key: Key) -> &[String] {
        self.index.names(key)
    }

    /// The values of a setting as numbers, in order; `None` where one is not a number.
    pub fn numbers(&self, key: Key) -> Option<&[f64]> {
        self.index.numbers(key)
    }

    /// Whether every value of a setting is a number.
    pub fn is_numeric(&self, key: Key) -> bool {
        self.numbers(key).is_some()
    }

    /// The place of a cell's value among the values of a setting.
    pub fn place(&self, cell: &CellSummary, key: Key) -> usize {
        self.index.place(cell.cell, key)
    }

    /// The output of a label in a cell.
    pub fn output<'a>(&self, cell: &'a CellSummary, label: &str) -> Option<&'a OutputSummary> {
        cell.outputs.get(self.index.output(label)?)
    }

    /// Statistics of a measure of an output of a cell.
    pub fn statistics<'a>(
        &self,
        cell: &'a CellSummary,
        label: &str,
        measure: Measure,
    ) -> Option<&'a Statistics> {
        self.output(cell, label)?.measures.get(&measure)
    }

    /// Whether a cell has no noise where others have.
    pub fn is_quiet(&self, cell: &CellSummary) -> bool {
        cell.eta == 0.0 && self.index.noisy
    }

    /// The cells with these settings.
    pub fn cells(&self, wanted: &[(Key, &str)]) -> Vec<&CellSummary> {
        let place = |(key, value): &(Key, &str)| {
            let place = self.values(*key).iter().position(|other| other == value);
            Some((*key, place?))
        };
        let places: Option<Vec<(Key, usize)>> = wanted.iter().map(place).collect();
        let Some(places) = places else {
            return Vec::new();
        };
        let fits = |cell: &&CellSummary| {
            let mut places = places.iter();
            places.all(|(key, place)| self.place(cell, *key) == *place)
        };
        self.summary.cells.iter().filter(fits).collect()
    }

    /// The options of a method by its name, or those of the method whose iteration 0 is "ls".
    pub fn options(&self, method: &str) -> Option<IvOptions> {
        let named = |table: &&crate::study::file::MethodTable| table.output_name(1) == method;
        self.file.methods.iter().find(named)?.iv_options()
    }

    /// The IV output that claims are about: "iv(4)", or the fourth pass of the method with every option at its
    /// default, or its last one, else the last output.
    pub fn main_output(&self) -> Option<String> {
        let labels = self.labels();
        if self.file.continuous.is_some() {
            return labels.last().cloned();
        }
        let four = labels.iter().find(|label| *label == "iv(4)");
        let default = |label: &&String| {
            let method = label
                .rsplit_once('(')
                .map_or(label.as_str(), |(name, _)| name);
            let options = self.options(method);
            options.is_some_and(|options| apart(&options, &IvOptions::default()).is_empty())
        };
        let fourth = labels.iter().find(|of| of.ends_with("(4)") && default(of));
        let any = || labels.iter().rfind(default);
        let found = four.or(fourth).or_else(any);
        found.or_else(|| labels.last()).cloned()
    }

    /// The solver of a method by its name.
    pub fn solver(&self, method: &str) -> Option<String> {
        let table = self
            .file
            .methods
            .iter()
            .find(|table| table.output_name(1) == method)?;
        let table: Value = serde_json::to_value(table).ok()?;
        table["solver"].as_str().map(str::to_owned)
    }

    /// Trials in all.
    pub fn trials(&self) -> u64 {
        self.summary.cells.iter().map(|cell| cell.trials).sum()
    }

    /// What runs the study again, and where its results then are.
    pub fn command(&self) -> (String, String) {
        let to = format!("results/{}", self.name);
        let Some(Shipped { name, quick }) = self.shipped else {
            let manifest = self.folder.join("manifest.json");
            let (manifest, to) = (
                shell_word(manifest.display()),
                shell_word(format!("{to}-again")),
            );
            return (format!("asobench run {manifest} --out {to}"), to);
        };
        let seed = self.summary.seed;
        let trials = match self.file.trials {
            TrialRule::Fixed(trials) => format!(" --trials {trials}"),
            TrialRule::Until(_) => String::new(),
        };
        let command = if name == BUILT_IN {
            format!("asobench reproduce --paper nikolov{trials} --seed {seed} --out {to}")
        } else {
            let quick = if quick { " --quick" } else { "" };
            format!(
                "asobench run experiments/{name}.toml{quick}{trials} --set seed={seed} --out {to}"
            )
        };
        (command, to)
    }
}

/// Says of verdicts on times whose they are.
fn tell_times(judged: &mut [Judged], machine: Option<&str>) {
    if let Some(machine) = machine {
        for claim in judged.iter_mut().filter(|claim| claim.timed) {
            let words = [" Measured on ", machine, ", one thread."];
            claim.line.extend(words);
        }
    }
}

/// Says which claims ask what was not asked when the results were first there: `stated` are the
/// claims of then, where these are others.
fn tell_additions(judged: &mut [Judged], claims: &[ClaimTable], stated: &Value) {
    let Some(stated) = stated.as_array() else {
        return;
    };
    let stated = stated.iter().cloned().map(serde_json::from_value);
    let stated: Vec<ClaimTable> = stated.filter_map(Result::ok).collect();
    let question = |of: &ClaimTable| ClaimTable {
        id: String::new(),
        text: String::new(),
        source: String::new(),
        ..of.clone()
    };
    for claim in claims {
        let is_old = stated.iter().any(|of| question(of) == question(claim));
        let verdict = judged.iter_mut().find(|of| of.id == claim.id);
        if let Some(verdict) = verdict.filter(|_| !is_old) {
            verdict.line.push_str(" Added or changed after the run.");
        }
    }
}

/// The folder's name.
fn name(folder: &Path) -> String {
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let name = folder.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Statistics of a measure of an output of a cell.
pub fn statistics<'a>(
    cell: &'a CellSummary,
    label: &str,
    measure: Measure,
) -> Option<&'a Statistics> {
    cell.output(label)?.measures.get(&measure)
}

/// The median of a measure of an output of a cell; undefined where there is none.
pub fn median(cell: &CellSummary, label: &str, measure: Measure) -> Quantile {
    statistics(cell, label, measure).map_or(Quantile::UNDEFINED, |of| of.q50)
}

/// The values of some settings of a cell in words.
pub fn place(cell: &CellSummary, keys: &[Key]) -> String {
    cell.place().words(keys)
}

/// Whether a setting of a cell has its default.
pub fn is_default(cell: &CellSummary, key: Key) -> bool {
    cell.place().is_default(key)
}

/// "IV(4)", "IV drive=model(4)": the label of an output, or a method's name, as a reader sees it. Nothing is left out,
/// so that two labels stay two.
pub fn shown(label: &str) -> String {
    let word = label.find([' ', '(']).unwrap_or(label.len());
    match label.split_at(word) {
        (first @ ("iv" | "ls"), rest) => first.to_uppercase() + rest,
        _ => label.to_owned(),
    }
}

/// The values of a setting over some cells, in order of appearance.
pub fn distinct(cells: &[&CellSummary], key: Key) -> Vec<String> {
    let mut values = Vec::new();
    for cell in cells {
        let value = cell.setting(key);
        if !values.contains(&value) {
            values.push(value);
        }
    }
    values
}

/// The options in which two methods differ, but for the number of passes.
pub fn apart(one: &IvOptions, other: &IvOptions) -> Vec<(String, String)> {
    let [one, other] =
        [one, other].map(|options| serde_json::to_value(options).unwrap_or_default());
    let (Value::Object(one), Value::Object(other)) = (one, other) else {
        return Vec::new();
    };
    let differs = |(key, value): (&String, &Value)| {
        let same = key == "iterations" || other.get(key) == Some(value);
        (!same).then(|| {
            (
                key.clone(),
                value
                    .as_str()
                    .map_or_else(|| value.to_string(), str::to_owned),
            )
        })
    };
    one.iter().filter_map(differs).collect()
}
