//! The kept results of a method: for every run its d, its FIT and how many intervals hold the truth, in a few digits.

use super::competitor::Competitor;
use super::manifest::{self, Division};
use super::scenario::{Scenario, Suite, SuiteStudy};
use super::stored::{Stored, SuiteError};
use crate::design::{Experiment, Measure};
use crate::files;
use crate::outcome::folder_layout::MANIFEST;
use crate::outcome::row::Row;
use crate::outcome::rows::Rows;
use crate::run::block_file::BlockFolder;
use crate::run::runner::{Block, run};
use crate::text::visible;
use asobench_identification::metric::Z;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// The results of one method.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MethodResults {
    /// The edition of the suite.
    pub suite: String,
    /// The knowledge that methods are given.
    #[serde(default, skip_serializing_if = "Division::is_closed")]
    pub division: Division,
    /// The method's name.
    pub method: String,
    /// The seed of the records.
    pub seed: u64,
    /// The scenarios that the method is not for, since they do not give what it needs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_for: Vec<String>,
    /// The other scenarios, in the suite's order. Once they are taken for a suite, all of them: without runs where the
    /// method is not for them.
    pub scenarios: Vec<ScenarioResults>,
}

/// The results of a method in one scenario.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScenarioResults {
    /// The scenario's name.
    pub name: String,
    /// The checksum of what it is.
    pub content: String,
    /// d of every trial, to four digits; null where the run is lost. In the open division that of the response.
    pub d: Vec<Option<f64>>,
    /// Simulated FIT on fresh data in per cent, to a tenth; null where the run is lost.
    pub fit: Vec<Option<f64>>,
    /// How many of the 95 % intervals hold the truth; null without any.
    pub hits: Vec<Option<u16>>,
    /// How many intervals a run has, the most of all runs. A method that estimates more than the p free coefficients,
    /// such as those before the delay, has more than p.
    #[serde(default)]
    pub intervals: u16,
    /// How many runs were lost, by reason.
    pub lost: BTreeMap<String, u64>,
}

impl Stored for MethodResults {
    fn fault(&self) -> Option<String> {
        let of = self.scenarios.iter().find(|of| !of.is_sound())?;
        Some(format!(
            "scenario {}: d, fit and hits of other numbers of trials, or more hits than intervals",
            visible(&of.name)
        ))
    }
}

impl MethodResults {
    /// Whether it has runs in some scenario.
    pub fn has_runs(&self) -> bool {
        self.scenarios.iter().any(ScenarioResults::has_runs)
    }

    /// Returns the part that a suite has: its scenarios, and of each the first trials.
    ///
    /// # Errors
    /// If they are of another edition or seed, if a scenario is another one or missing, or if
    /// trials are missing.
    pub fn of(mut self, suite: &Suite) -> Result<Self, SuiteError> {
        let manifest = &suite.manifest;
        let other = SuiteError::of(format!("results of '{}'", self.method));
        let (found, here) = (&self.suite, &manifest.edition);
        // A later edition has the scenarios of an earlier one.
        if manifest.place_of(found) < manifest.place_of(here) {
            let known = manifest.place_of(found);
            let instead = known.map_or_else(String::new, |_| format!(", or --edition {found}"));
            return Err(other(format!("of suite {found}; expected suite {here}{instead}")));
        }
        if !manifest.is_alike(found) {
            return Err(other(format!(
                "of suite {found}, whose measure is another than that of {here}"
            )));
        }
        if self.division != suite.division {
            let (found, here) = (self.division, suite.division);
            return Err(other(format!("of contest {found}; expected {here}")));
        }
        if self.seed != manifest.seed {
            let (found, here) = (self.seed, manifest.seed);
            return Err(other(format!("of seed {found}; expected seed {here}")));
        }
        let mut scenarios = Vec::new();
        for scenario in suite.scenarios() {
            let (name, trials) = (&scenario.name, suite.trials(scenario.is_bank) as usize);
            if self.not_for.contains(name) {
                scenarios.push(ScenarioResults::of_none(scenario));
                continue;
            }
            let found = self.scenarios.iter().find(|of| of.name == *name);
            let missing = || {
                other(format!(
                    "without scenario {name}; expected those of tier {}",
                    suite.tier
                ))
            };
            let found = found.ok_or_else(missing)?;
            if found.content != scenario.content {
                return Err(other(format!("of another scenario under the name {name}")));
            }
            if found.d.len() < trials {
                let count = found.d.len();
                let message = format!(
                    "{count} trials of {name}; expected {trials}, as in tier {}, or --first {count}",
                    suite.tier
                );
                return Err(other(message));
            }
            scenarios.push(found.first(trials));
        }
        self.scenarios = scenarios;
        Ok(self)
    }
}

impl ScenarioResults {
    /// A scenario without runs.
    fn of_none(scenario: &Scenario) -> Self {
        Self {
            name: scenario.name.clone(),
            content: scenario.content.clone(),
            ..Self::default()
        }
    }

    /// Whether every run has a d, a FIT and hits, or is lost, and no run has more hits than intervals.
    fn is_sound(&self) -> bool {
        let most = self.hits.iter().flatten().max();
        let runs = self.d.len();
        self.fit.len() == runs
            && self.hits.len() == runs
            && most.is_none_or(|most| *most <= self.intervals)
            && self.d.iter().flatten().all(|d| *d >= 0.0)
    }

    /// Whether it has runs: whether the method is for this scenario.
    pub fn has_runs(&self) -> bool {
        !self.d.is_empty()
    }

    /// The first trials.
    fn first(&self, trials: usize) -> Self {
        let mut first = self.clone();
        first.d.truncate(trials);
        first.fit.truncate(trials);
        first.hits.truncate(trials);
        if first.d.len() < self.d.len() {
            first.lost = BTreeMap::new();
        }
        first
    }

    /// The number of lost runs.
    pub fn lost_runs(&self) -> usize {
        self.d.iter().filter(|d| d.is_none()).count()
    }

    /// d of every trial, infinity where it is lost.
    pub fn distances(&self) -> impl Iterator<Item = f64> {
        self.d.iter().map(|d| d.unwrap_or(f64::INFINITY))
    }
}

/// Reads the results that the program carries, as far as a suite has them, in the order of the registry.
///
/// # Errors
/// [`SuiteError`].
pub fn shipped(suite: &Suite) -> Result<Vec<MethodResults>, SuiteError> {
    let texts = manifest::results(suite.division, suite.manifest.has_contests());
    let read = texts.map(|text| MethodResults::parse(text)?.of(suite));
    Ok(in_order(read.collect::<Result<_, _>>()?))
}

/// Reads the results in a folder of a run, in the order of the registry, others last.
///
/// # Errors
/// [`SuiteError`].
pub fn of_folder(suite: &Suite, folder: &Path) -> Result<Vec<MethodResults>, SuiteError> {
    let mut found = Vec::new();
    let methods = files::subfolder(folder, METHODS).map_err(SuiteError::new)?;
    let paths = methods.map(|methods| files::list(&methods)).transpose();
    for path in paths.map_err(SuiteError::new)?.unwrap_or_default() {
        let is_json = path.extension().is_some_and(|of| of == "json");
        if let Some(read) = is_json.then(|| MethodResults::read(&path)).transpose()?.flatten() {
            found.push(read.of(suite).map_err(SuiteError::of(path.display()))?);
        }
    }
    if found.is_empty() {
        let why = without_results(suite, folder);
        return Err(SuiteError::of(folder.display())(why));
    }
    Ok(in_order(found))
}

/// Why a folder has no results of methods.
fn without_results(suite: &Suite, folder: &Path) -> String {
    let studies = folder.join(STUDIES);
    if !files::is_there(&studies) {
        return "no results of the suite; expected a folder of suite run".to_owned();
    }
    let has_ended = |study: &&SuiteStudy| files::is_there(&studies.join(&study.name).join(MANIFEST));
    let ended = suite.studies.iter().filter(has_ended).count();
    format!(
        "no results yet: {ended} of {} studies of a run that has not ended are there; the same command goes on",
        suite.studies.len()
    )
}

/// The folder of the results of methods, within that of a run.
pub const METHODS: &str = "methods";
/// The folder of the studies, within that of a run.
pub const STUDIES: &str = "studies";

/// Those that have runs, in the order of the registry, others last.
fn in_order(mut methods: Vec<MethodResults>) -> Vec<MethodResults> {
    methods.retain(MethodResults::has_runs);
    let all = Division::ALL.iter().flat_map(|division| Competitor::of(*division));
    let names: Vec<String> = all.map(|of| of.name()).collect();
    let place = |of: &MethodResults| names.iter().position(|name| *name == of.method);
    methods.sort_by_key(|of| (place(of).unwrap_or(names.len()), of.method.clone()));
    methods
}

/// Takes the results of a study's methods from its folder, one for each output, with the scenarios of the study.
///
/// # Errors
/// [`SuiteError`].
pub fn collect(
    study: &SuiteStudy,
    experiment: &Experiment,
    folder: &Path,
) -> Result<Vec<(String, Vec<ScenarioResults>)>, SuiteError> {
    let blocks = BlockFolder::open(folder, experiment).map_err(SuiteError::new)?;
    let (stored, _) = blocks.list().map_err(SuiteError::new)?;
    let outputs = experiment.outputs();
    let mut all: Vec<(String, Vec<ScenarioResults>)> = Vec::new();
    for output in &outputs {
        let empty = study.scenarios.iter().map(ScenarioResults::of_none);
        all.push((output.estimator.clone(), empty.collect()));
    }
    for block in &stored {
        let rows = blocks.read(block).map_err(SuiteError::new)?.rows;
        if rows.is_empty() {
            continue;
        }
        let cell = block.span.cell;
        for (output, (_, scenarios)) in all.iter_mut().enumerate() {
            append(&rows, output, study, &mut scenarios[cell]);
        }
    }
    Ok(all)
}

/// The rows of a cell in the order of the trials, each with the errors of the coefficients.
pub(super) type CellRuns = Vec<(Row, Vec<f64>)>;

/// The runs of each cell of an experiment with one output.
///
/// # Errors
/// If the run fails.
pub(super) fn runs_of(experiment: &Experiment, runs: u64, threads: usize) -> Result<Vec<CellRuns>, SuiteError> {
    let mut found = vec![CellRuns::new(); experiment.cells.len()];
    run::<Infallible>(experiment, runs, threads, &AtomicBool::new(false), |block: Block| {
        let places = 0..block.rows.trial_count();
        let all = places.map(|place| (block.rows.row(place, 0), block.rows.parameters(place, 0)));
        found[block.span.cell].extend(all);
        Ok(())
    })
    .map_err(SuiteError::new)?;
    for rows in &mut found {
        rows.sort_by_key(|(row, _)| row.trial);
    }
    Ok(found)
}

impl SuiteStudy {
    /// Why a run of the study is lost; `None` if it is not.
    pub fn why_lost<'a>(&self, row: &'a Row) -> Option<&'a str> {
        if !row.is_lost() {
            (!row[self.distance()].is_finite()).then_some("other orders")
        } else if row.failure.is_some() {
            Some(row.status())
        } else {
            Some("unstable")
        }
    }
}

/// Appends the runs of an output.
fn append(rows: &Rows, output: usize, study: &SuiteStudy, to: &mut ScenarioResults) {
    for place in 0..rows.trial_count() {
        let row = rows.row(place, output);
        let (d, fit) = (row[study.distance()], row[Measure::FreshFit]);
        if let Some(reason) = study.why_lost(&row) {
            *to.lost.entry(reason.to_owned()).or_default() += 1;
            to.d.push(None);
            to.fit.push(None);
            to.hits.push(None);
            continue;
        }
        to.d.push(Some(rounded(d, 4)));
        to.fit.push(fit.is_finite().then(|| (10.0 * fit).round() / 10.0));
        let (held, count) = hits(&rows.parameters(place, output));
        to.hits.push((count > 0).then_some(held));
        to.intervals = to.intervals.max(count);
    }
}

/// How many intervals hold the truth, of how many, from errors and standard errors.
fn hits(parameters: &[f64]) -> (u16, u16) {
    let (errors, rest) = parameters.split_at(parameters.len().min(2 * (parameters.len() / 4)));
    let both = errors.iter().zip(rest);
    let known = both.filter(|(_, se)| **se > 0.0 && se.is_finite());
    known.fold((0, 0), |(held, count), (error, se)| {
        (held + u16::from(error.abs() <= Z * se), count + 1)
    })
}

/// A number to some significant digits.
pub(super) fn rounded(x: f64, digits: usize) -> f64 {
    format!("{x:.*e}", digits - 1).parse().unwrap_or(x)
}

/// A method that declined a study: all its runs there are lost.
pub fn declined(study: &SuiteStudy, trials: u64) -> Vec<ScenarioResults> {
    let scenarios = study.scenarios.iter();
    let of = scenarios.map(|scenario| ScenarioResults {
        d: vec![None; trials as usize],
        fit: vec![None; trials as usize],
        hits: vec![None; trials as usize],
        lost: BTreeMap::from([("declined".to_owned(), trials)]),
        ..ScenarioResults::of_none(scenario)
    });
    of.collect()
}
