//! A results folder as a report sees it: what was asked, what came out.

use super::shipped::Shipped;
use crate::estimator::IvOptions;
use crate::metric::{Quantile, Statistics};
pub use crate::study::MethodTime as Time;
use crate::study::file::{ExperimentFile, Key, TrialRule};
use crate::study::place::{self, Place};
pub use crate::study::place::{axis_label, figure_name, is_error, value_name, words};
use crate::study::{CellSummary, Figure, OutputSummary, Summary, read_manifest};
use serde::Deserialize;
use serde_json::Value;
use std::fs;
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

#[derive(Deserialize)]
struct Times {
    times: Vec<Time>,
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
        let wrong = |name: &str, reason: String| ResultsError::File {
            path: folder.join(name),
            reason,
        };
        let file = ExperimentFile::from_json(&manifest["experiment"])
            .map_err(|error| wrong("manifest.json", error.to_string()))?;
        let parsed = |name: &str, what: &str, error: serde_json::Error| {
            wrong(name, format!("not {what} of this version ({error})"))
        };
        let text = fs::read_to_string(folder.join("summary.json"));
        let text = text.map_err(|error| wrong("summary.json", error.to_string()))?;
        let summary: Summary = serde_json::from_str(&text)
            .map_err(|error| parsed("summary.json", "a summary", error))?;
        if summary.cells.is_empty() {
            return Err(ResultsError::Empty(folder.to_owned()));
        }
        let times = match fs::read_to_string(folder.join("timing/times.json")) {
            Ok(text) => {
                let times: Times = serde_json::from_str(&text)
                    .map_err(|error| parsed("timing/times.json", "times", error))?;
                times.times
            }
            Err(_) => Vec::new(),
        };
        let text = |key: &str| manifest[key].as_str().map(str::to_owned);
        let shipped = Shipped::of(&file);
        Ok(Self {
            name: shipped.map_or_else(|| name(folder), |of| of.name.to_owned()),
            shipped,
            folder: folder.to_owned(),
            version: text("version").unwrap_or_default(),
            revision: text("git_revision"),
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
    pub fn labels(&self) -> Vec<String> {
        let cell = self.summary.cells.first();
        cell.map_or_else(Vec::new, |cell| {
            cell.outputs.iter().map(OutputSummary::label).collect()
        })
    }

    /// The settings that tell cells apart, without those that follow from another one.
    pub fn varying(&self) -> Vec<Key> {
        place::varying(&self.places())
    }

    /// The values of a setting over the cells, in order: by size where all are numbers, else of appearance.
    pub fn values(&self, key: Key) -> Vec<String> {
        place::values(&self.places(), key)
    }

    fn places(&self) -> Vec<Place> {
        self.summary.cells.iter().map(CellSummary::place).collect()
    }

    /// Whether every value of a setting is a number.
    pub fn is_numeric(&self, key: Key) -> bool {
        self.values(key)
            .iter()
            .all(|value| value.parse::<f64>().is_ok())
    }

    /// The cells with these settings.
    pub fn cells(&self, wanted: &[(Key, &str)]) -> Vec<&CellSummary> {
        let fits = |cell: &&CellSummary| {
            wanted
                .iter()
                .all(|(key, value)| cell.setting(*key) == *value)
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
            let command = format!("asobench run {} --out {to}-again", manifest.display());
            return (command, format!("{to}-again"));
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

/// The folder's name.
fn name(folder: &Path) -> String {
    let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    let name = folder.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Statistics of a figure of an output of a cell.
pub fn statistics<'a>(
    cell: &'a CellSummary,
    label: &str,
    figure: Figure,
) -> Option<&'a Statistics> {
    cell.output(label)?.figures.get(&figure)
}

/// The median of a figure of an output of a cell; undefined where there is none.
pub fn median(cell: &CellSummary, label: &str, figure: Figure) -> Quantile {
    statistics(cell, label, figure).map_or(Quantile::UNDEFINED, |of| of.q50)
}

/// The values of some settings of a cell in words.
pub fn place(cell: &CellSummary, keys: &[Key]) -> String {
    cell.place().words(keys)
}

/// Whether a setting of a cell has its default.
pub fn is_default(cell: &CellSummary, key: Key) -> bool {
    cell.place().is_default(key)
}

/// "IV(4)", "IV, model, frozen (4)": an output's label as a reader sees it.
pub fn shown(label: &str) -> String {
    match label.rsplit_once('(') {
        Some((name, pass)) if name.contains(' ') => format!("{} ({pass}", shown_name(name)),
        Some((name, pass)) => format!("{}({pass}", shown_name(name)),
        None => shown_name(label),
    }
}

/// A method's name as a reader sees it.
pub fn shown_name(name: &str) -> String {
    let words = name.split(' ').enumerate().map(|(i, word)| {
        let word = word.split_once('=').map_or(word, |(_, value)| value);
        match (i, word.get(..2)) {
            (0, Some(start @ ("iv" | "ls"))) => format!("{}{}", start.to_uppercase(), &word[2..]),
            _ => word.to_owned(),
        }
    });
    words.collect::<Vec<_>>().join(", ")
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
