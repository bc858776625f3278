//! A results folder as a report sees it: the experiment and its results.

use super::index::Index;
use asobench_identification::metric::{Share, Statistics};
use asobench_study::claim::{Judged, judge, tested};
use asobench_study::files::{self, Kind, PathError};
pub use asobench_study::study::MethodTime as Time;
use asobench_study::study::file::{ClaimTable, ExperimentFile, FileError, Key, Store};
pub use asobench_study::study::place::{axis_label, value_name, words};
use asobench_study::study::{
    CellRows, CellSummary, Experiment, Look, Looks, Measure, OutputSummary, StoreError, StoredTrials, Summary, TIMES,
    TIMING, TheoryReference, check_result, read_current, read_results,
};
use asobench_study::text::{grouped, shell_word};
use serde::Deserialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Why results cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// There are no results, or their manifest cannot be read.
    #[error(transparent)]
    Folder(#[from] asobench_study::study::FolderError),
    /// A file of the folder cannot be opened.
    #[error(transparent)]
    Path(#[from] PathError),
    /// A file of the folder is invalid.
    #[error("{}: {reason}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The fault.
        reason: String,
    },
    /// There is nothing to show.
    #[error("{}: the summary has no cell", .0.display())]
    Empty(PathBuf),
}

impl ResultsError {
    /// An invalid file of a folder.
    fn of(folder: &Path, name: &str, reason: impl Into<String>) -> Self {
        Self::File {
            path: folder.join(name),
            reason: reason.into(),
        }
    }
}

#[derive(Default, Deserialize)]
struct Times {
    times: Vec<Time>,
    /// The machine's processor.
    machine: Option<String>,
}

const SUMMARY: &str = "summary.json";

/// The name of the file with the times.
fn times_name() -> String {
    format!("{TIMING}/{TIMES}")
}

/// Reads the times in a folder, if they were measured.
fn read_times(folder: &Path) -> Result<Option<Vec<u8>>, PathError> {
    match files::subfolder(folder, TIMING)? {
        Some(_) => read_current(folder, &times_name(), Kind::Times),
        None => Ok(None),
    }
}

impl Times {
    fn decode(folder: &Path, text: Option<&[u8]>) -> Result<Self, ResultsError> {
        let Some(text) = text else {
            return Ok(Self::default());
        };
        let of_json = |json| serde_json::from_value(json).map_err(|error| error.to_string());
        let wrong = |error| ResultsError::of(folder, &times_name(), format!("not times of this version ({error})"));
        files::parsed(text).and_then(of_json).map_err(wrong)
    }
}

/// A study with its results.
#[derive(Clone, Debug)]
pub struct Study {
    /// The name of the study, which is that of its folder.
    pub name: String,
    /// The folder.
    pub folder: PathBuf,
    /// The experiment with all defaults written out.
    pub file: ExperimentFile,
    /// The program's version.
    pub version: String,
    /// The revision of the program's source, if known.
    pub revision: Option<String>,
    /// The results.
    pub summary: Summary,
    /// The times, if they were measured.
    pub times: Vec<Time>,
    /// The processor on which they were measured.
    pub(super) machine: Option<String>,
    /// Which look at these results this is, and what it may spend of the claims' level.
    pub(super) look: Look,
    /// Whether the run has not ended.
    pub(super) unfinished: bool,
    /// The verdicts on the claims of the experiment file.
    pub judged: Vec<Judged>,
    /// The look-ups in the summary.
    pub(super) index: Index,
}

impl Study {
    /// Reads a results folder.
    ///
    /// # Errors
    /// [`ResultsError`], a message of one line that names the file.
    pub fn read(folder: &Path) -> Result<Self, ResultsError> {
        read_results(folder, |manifest| {
            let summary = read_current(folder, SUMMARY, Kind::Summary)?;
            let summary = summary.ok_or_else(|| ResultsError::of(folder, SUMMARY, "the file is missing"))?;
            check_result(folder, manifest, SUMMARY, Some(&summary))?;
            let times = read_times(folder)?;
            let looks = Looks::read(folder)?;
            Self::decode(folder, manifest, &summary, times.as_deref(), &looks)
        })
    }

    /// Returns the words by which a text can cite the results: the program, the study with the fingerprint of its
    /// design, which is the same for whoever has the same experiment file, and the source.
    pub(super) fn citation(&self) -> String {
        let design = Experiment::new(self.file.clone()).map(|of| files::checksum(of.design().to_string().as_bytes()));
        let design = design.map_or_else(|_| String::new(), |design| format!(", design {design}"));
        let source = self.revision.as_deref();
        let source = source.map_or_else(String::new, |revision| format!(", revision {revision}"));
        format!(
            "asobench {}{source}: study \"{}\"{design}, seed {}, {} trials.",
            self.version,
            self.title(),
            self.file.seed,
            grouped(self.trials())
        )
    }

    /// Judges the claims of another file with these results. Claims that were not part of the run are marked.
    ///
    /// # Errors
    /// If a claim is invalid, or refers to something that the study does not have.
    pub fn judge_others(&mut self, of: &ExperimentFile) -> Result<(), FileError> {
        let mut file = ExperimentFile {
            claims: of.claims.clone(),
            family: of.family,
            needed: Some(self.file.needed.clone().unwrap_or_default()),
            ..self.file.clone()
        };
        for claim in &mut file.claims {
            let known = self.file.claims.iter().find(|known| known.judges_as(claim));
            claim.added_after_run = known.is_none_or(|known| known.added_after_run);
        }
        file.check_filters()?;
        let file = Experiment::new(file)?.file;
        let timed = (&self.times[..], self.machine.as_deref());
        self.judged = judged(&file, &self.summary, timed, self.look);
        self.file.claims = file.claims;
        self.file.family = file.family;
        Ok(())
    }

    /// Builds a study from the contents of its files, which may come from anyone: a manifest, a summary, and times if
    /// they were measured.
    ///
    /// # Errors
    /// [`ResultsError`], a message of one line that names the file.
    pub(super) fn decode(
        folder: &Path,
        manifest: &Value,
        summary: &[u8],
        times: Option<&[u8]>,
        looks: &Looks,
    ) -> Result<Self, ResultsError> {
        let file = ExperimentFile::from_json(&manifest["experiment"])
            .map_err(|error| ResultsError::of(folder, "manifest.json", error.to_string()))?;
        let other = |error| ResultsError::of(folder, SUMMARY, format!("not a summary of this version ({error})"));
        let summary = Summary::from_json(summary).map_err(other)?;
        let times = Times::decode(folder, times)?;
        let text = |key: &str| manifest[key].as_str().map(str::to_owned);
        let origin = (text("version").unwrap_or_default(), text("git_revision"));
        Self::of(folder, origin, (file, summary), times, looks)
    }

    /// Returns the study of a run in a folder, from the summary that the run returned.
    ///
    /// # Errors
    /// If the summary has no cell, or the times or looks in the folder cannot be read.
    pub fn of_run(folder: &Path, file: &ExperimentFile, summary: &Summary) -> Result<Self, ResultsError> {
        // As it is stored, so that a report says the same.
        let summary = summary
            .as_stored()
            .map_err(|reason| ResultsError::of(folder, SUMMARY, reason))?;
        let times = Times::decode(folder, read_times(folder)?.as_deref())?;
        let revision = asobench_study::GIT_REVISION.map(str::to_owned);
        let origin = (env!("CARGO_PKG_VERSION").to_owned(), revision);
        let looks = Looks::read(folder)?;
        Self::of(folder, origin, (file.clone(), summary), times, &looks)
    }

    /// Returns the study of the trials that a run which has not ended left in a folder. Its claims are not judged:
    /// each look at verdicts spends of their level.
    ///
    /// # Errors
    /// As for [`Self::of_run`].
    pub fn of_part(folder: &Path, mut file: ExperimentFile, summary: &Summary) -> Result<Self, ResultsError> {
        file.claims.clear();
        let study = Self::of_run(folder, &file, summary)?;
        Ok(Self {
            unfinished: true,
            ..study
        })
    }

    fn of(
        folder: &Path,
        (version, revision): (String, Option<String>),
        (file, summary): (ExperimentFile, Summary),
        Times { times, machine }: Times,
        looks: &Looks,
    ) -> Result<Self, ResultsError> {
        if summary.cells.is_empty() {
            return Err(ResultsError::Empty(folder.to_owned()));
        }
        if times.iter().any(|time| time.cell >= summary.cells.len()) {
            let reason = "damaged: a time of a cell that does not exist";
            return Err(ResultsError::of(folder, &times_name(), reason));
        }
        let look = looks.at(summary.trials(), &file, &file.trials);
        let judged = judged(&file, &summary, (&times, machine.as_deref()), look);
        Ok(Self {
            look,
            machine,
            unfinished: false,
            name: name(folder),
            folder: folder.to_owned(),
            version,
            revision,
            index: Index::new(&summary, file.kind()),
            judged,
            file,
            summary,
            times,
        })
    }

    /// The title, or the name if there is none.
    pub fn title(&self) -> &str {
        if self.summary.title.is_empty() {
            &self.name
        } else {
            &self.summary.title
        }
    }

    /// A line about results that lack trials; `None` if none are missing.
    pub fn partial_line(&self) -> Option<String> {
        let (cells, trials) = (self.summary.cells.len(), self.trials());
        let why = if self.unfinished {
            "the run has not ended. The same command goes on; claims are judged at its end"
        } else {
            "the other trials of the study are missing"
        };
        self.summary
            .partial
            .then(|| format!("Partial results: {trials} trials in {cells} cells are there; {why}."))
    }

    /// How many claims were tested and at what rate; `None` if no claim was.
    pub fn tested(&self) -> Option<String> {
        tested(&self.file, &self.judged, self.look)
    }

    /// The label of every output, in order.
    pub fn labels(&self) -> &[String] {
        &self.index.labels
    }

    /// "20 trials in each of 22 cells."
    pub(crate) fn extent(&self) -> String {
        let trials = || self.summary.cells.iter().map(|cell| cell.trials);
        let (least, most) = (trials().min().unwrap_or(0), trials().max().unwrap_or(0));
        let text = if least < most {
            format!("{} to {}", grouped(least), grouped(most))
        } else {
            grouped(least)
        };
        let cells = self.summary.cells.len();
        match (most, cells) {
            (1, 1) => "One trial of one cell.".to_owned(),
            (_, 1) => format!("{text} trials of one cell."),
            (1, _) => format!("One trial in each of {} cells.", grouped(cells as u64)),
            _ => format!("{text} trials in each of {} cells.", grouped(cells as u64)),
        }
    }

    /// The settings that distinguish cells, without those determined by another one.
    pub fn varying(&self) -> Vec<Key> {
        self.index.varying.clone()
    }

    /// The values of a setting over the cells: sorted by size if all are numbers, otherwise in order of appearance.
    pub fn values(&self, key: Key) -> &[String] {
        &self.index.values[&key].names
    }

    /// The values of a setting as numbers, in the same order; `None` if any is not a number.
    pub fn numbers(&self, key: Key) -> Option<&[f64]> {
        self.index.values[&key].numbers.as_deref()
    }

    /// Whether every value of a setting is a number.
    pub fn is_numeric(&self, key: Key) -> bool {
        self.numbers(key).is_some()
    }

    /// The index of a cell's value among the values of a setting.
    pub fn place(&self, cell: &CellSummary, key: Key) -> usize {
        self.index.values[&key].place(cell.cell)
    }

    /// Every output of every cell.
    pub(crate) fn all_outputs(&self) -> impl Iterator<Item = (&CellSummary, &OutputSummary)> {
        let cells = self.summary.cells.iter();
        cells.flat_map(|cell| cell.outputs.iter().map(move |output| (cell, output)))
    }

    /// The output with a label in a cell.
    pub fn output<'a>(&self, cell: &'a CellSummary, label: &str) -> Option<&'a OutputSummary> {
        cell.outputs.get(*self.index.outputs.get(label)?)
    }

    /// A share of the trials of an output over all cells; `None` without such an output.
    pub(crate) fn over_cells(&self, label: &str, of: impl Fn(&OutputSummary) -> Share) -> Option<OverCells<'_>> {
        let cells = self.summary.cells.iter();
        let shares = cells.filter_map(|cell| Some((cell, of(self.output(cell, label)?))));
        let shares: Vec<(&CellSummary, Share)> = shares.collect();
        let most = shares.iter().max_by(|a, b| a.1.share.total_cmp(&b.1.share))?;
        let sum = |of: fn(&Share) -> u64| shares.iter().map(|(_, share)| of(share)).sum();
        Some(OverCells {
            all: Share::new(sum(|share| share.count), sum(|share| share.total)),
            most: *most,
        })
    }

    /// The statistics of a measure, for one output of a cell.
    pub fn statistics<'a>(&self, cell: &'a CellSummary, label: &str, measure: Measure) -> Option<&'a Statistics> {
        self.output(cell, label)?.measures.get(&measure)
    }

    /// Whether a cell has no noise while others have.
    pub fn is_quiet(&self, cell: &CellSummary) -> bool {
        cell.eta == 0.0 && self.index.noisy
    }

    /// Whether a report shows intervals of single trials, for which it reads them.
    pub(crate) fn keeps_intervals(&self) -> bool {
        self.file.store == Store::Trials && self.file.coverage
    }

    /// Where the rows of a cell are in the file of trials.
    pub(crate) fn rows_of(&self, cell: &CellSummary) -> CellRows {
        let cells = self.summary.cells.iter();
        CellRows {
            cell: cell.cell,
            first: row_count(cells.take_while(|of| of.cell < cell.cell)),
            count: row_count([cell].into_iter()),
        }
    }

    /// The trials that the study has stored.
    ///
    /// # Errors
    /// If they are damaged.
    pub(crate) fn trials_stored(&self) -> Result<Option<StoredTrials>, StoreError> {
        StoredTrials::open(&self.folder, row_count(self.summary.cells.iter()))
    }

    /// Checks the stored trials, if a report reads them.
    ///
    /// # Errors
    /// If they are damaged.
    pub fn check_trials(&self) -> Result<(), StoreError> {
        if self.keeps_intervals() {
            self.trials_stored()?;
        }
        Ok(())
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

    /// The outputs named by the claims of the file, in the order of the outputs.
    pub fn claimed(&self) -> Vec<String> {
        let labels = self.labels().iter();
        let claimed = labels.filter(|label| {
            let claims = self.file.claims.iter();
            claims.flat_map(outputs_of).any(|name| name == **label)
        });
        claimed.cloned().collect()
    }

    /// The output that sentences are about: that of the first claim, otherwise the last one.
    pub fn main_output(&self) -> Option<String> {
        let labels = self.labels();
        let mut claimed = self.file.claims.iter().flat_map(outputs_of);
        let first = claimed.find(|label| labels.contains(label));
        first.or_else(|| labels.last().cloned())
    }

    /// The total number of trials.
    pub fn trials(&self) -> u64 {
        self.summary.trials()
    }

    /// The command that repeats the study, and the folder for its results.
    pub fn command(&self) -> (String, String) {
        let manifest = shell_word(self.folder.join("manifest.json").display());
        let to = shell_word(format!("results/{}-again", self.name));
        let consent = self.consent();
        (format!("asobench run {manifest} --out {to}{consent}"), to)
    }

    /// The command that computes one trial of a cell again and prints every stage.
    pub fn replay_command(&self, cell: usize, trial: u64) -> String {
        let folder = shell_word(self.folder.display());
        let consent = self.consent();
        format!("asobench replay {folder} cell={cell}:{trial}{consent}")
    }

    /// The command that replays a trial of an output: the first failed one, if there is one.
    pub(crate) fn replay_of(&self, cell: &CellSummary, output: Option<&OutputSummary>) -> String {
        self.replay_command(cell.cell, output.and_then(first_failed_trial).unwrap_or(0))
    }

    /// The flag that lets a command start the study's programs, if it has some.
    fn consent(&self) -> &'static str {
        let mut methods = self.file.methods.iter();
        if methods.any(|method| method.program().is_some()) {
            " --allow-commands"
        } else {
            ""
        }
    }
}

/// The number of rows of some cells in the file of trials.
fn row_count<'a>(cells: impl Iterator<Item = &'a CellSummary>) -> u64 {
    let rows = |cell: &CellSummary| cell.trials.saturating_mul(cell.outputs.len() as u64);
    cells.map(rows).fold(0, u64::saturating_add)
}

/// Judges the claims of a file. A verdict on times names the machine.
fn judged(
    file: &ExperimentFile,
    summary: &Summary,
    (times, machine): (&[Time], Option<&str>),
    look: Look,
) -> Vec<Judged> {
    let mut judged = judge(file, summary, times, look);
    if let Some(machine) = machine {
        for claim in judged.iter_mut().filter(|claim| claim.timed) {
            let whose = format!(" Measured on {machine}, one thread.");
            claim.line.push_str(&whose);
        }
    }
    judged
}

/// The outputs or methods that a claim's tests use; the ones to compare with come last.
fn outputs_of(claim: &ClaimTable) -> Vec<String> {
    let tests = claim.all_tests();
    let others = tests.iter().filter_map(|test| test.kind.other());
    let others = others.filter(|name| TheoryReference::named(name).is_none());
    let all = tests.iter().map(|test| &test.output).chain(others);
    all.cloned().collect()
}

/// The name of a folder.
fn name(folder: &Path) -> String {
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let name = folder.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// The first failed trial of an output.
pub(crate) fn first_failed_trial(output: &OutputSummary) -> Option<u64> {
    output.outcomes.failed_trials.values().flatten().min().copied()
}

/// The values of some settings of a cell, in words.
pub fn place(cell: &CellSummary, keys: &[Key]) -> String {
    cell.place().words(keys)
}

/// Words with the place of a cell; empty where no setting varies.
pub(crate) fn placed(cell: &CellSummary, keys: &[Key], words: impl FnOnce(&str) -> String) -> String {
    match place(cell, keys).as_str() {
        "" => String::new(),
        place => words(place),
    }
}

/// " at eta = 2 %, N = 98"; empty where no setting varies.
pub(crate) fn at(cell: &CellSummary, keys: &[Key]) -> String {
    placed(cell, keys, |place| format!(" at {place}"))
}

/// The share of an output's trials that are lost: failed, or with an unstable model.
pub(crate) fn lost(output: &OutputSummary) -> Share {
    Share::new(output.outcomes.lost_trials().0, output.outcomes.trials)
}

/// A share of the trials of an output.
pub(crate) struct OverCells<'a> {
    /// Over all cells.
    pub(crate) all: Share,
    /// The cell where it is largest, and the share there.
    pub(crate) most: (&'a CellSummary, Share),
}
