//! The plan of a study in shards: one file with all that a shard needs to know.

use crate::design::experiment::Experiment;
use crate::design::file::engine::Engine;
use crate::design::file::experiment_file::ExperimentFile;
use crate::files;
use crate::files::Kind;
use crate::run::cluster::ClusterError;
use crate::run::runner::Span;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The ends of a part are multiples of a power of two, at most this one.
const ROUND: u64 = 256;
/// A shard can be cut at least into so many steps.
const STEPS: f64 = 16.0;

/// A plan.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ShardPlan {
    /// "asobench".
    plan: String,
    version: String,
    git_revision: Option<String>,
    /// The design's fingerprint, in hexadecimal digits.
    fingerprint: String,
    /// Trials of each cell, including those already computed when the plan was made.
    pub trials: Vec<u64>,
    /// The engine of each cell.
    engine: Vec<Engine>,
    /// Seconds that a shard takes on one thread of the machine that made the plan.
    pub seconds: f64,
    /// The study, fully resolved.
    experiment: Value,
    /// The shards.
    pub shards: Vec<Vec<Part>>,
}

/// A part of a shard: a range of trials of one cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// The cell.
    pub cell: usize,
    /// The first trial.
    pub from: u64,
    /// The end.
    pub to: u64,
}

impl ShardPlan {
    /// Makes a plan for the `missing` trials, in about `shards` shards that take equally long. `seconds` is the time of
    /// a trial of each cell, `trials` the number wanted of each cell. There are fewer shards if there are few trials.
    ///
    /// # Errors
    /// If a cell has no engine.
    pub fn new(
        experiment: &Experiment,
        trials: Vec<u64>,
        missing: &[Span],
        seconds: &[f64],
        shards: usize,
    ) -> Result<Self, ClusterError> {
        let cells = 0..experiment.cells.len();
        let engine: Result<_, _> = cells.map(|cell| experiment.engine(cell)).collect();
        let shards = cut(missing, seconds, shards);
        let all: f64 = missing.iter().map(|span| cost(span, seconds)).sum();
        Ok(Self {
            plan: "asobench".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            git_revision: crate::revision::GIT_REVISION.map(str::to_owned),
            fingerprint: hexadecimal(experiment.fingerprint()),
            trials,
            engine: engine?,
            seconds: all / shards.len().max(1) as f64,
            experiment: serde_json::to_value(&experiment.file).unwrap_or_default(),
            shards,
        })
    }

    /// Reads a plan, and rebuilds its experiment.
    ///
    /// # Errors
    /// If it is not a plan, has another version, or is inconsistent.
    pub fn read(path: &Path) -> Result<(Self, Experiment), ClusterError> {
        let wrong = |reason: String| ClusterError::Plan {
            path: path.to_owned(),
            reason,
        };
        let no_plan = |reason: &dyn std::fmt::Display| {
            wrong(format!(
                "not a plan of asobench ({reason}); expected what `asobench plan` writes"
            ))
        };
        let text = files::read_named(path, Kind::Plan).map_err(|error| wrong(error.to_string()))?;
        let json: Value = serde_json::from_str(&text).map_err(|error| no_plan(&error))?;
        if json["plan"] != "asobench" {
            return Err(no_plan(&"no \"plan\" in it"));
        }
        let version = json["version"].as_str().unwrap_or("unknown");
        if version != env!("CARGO_PKG_VERSION") {
            return Err(wrong(format!(
                "made by asobench {version}, but this is {}; plan again, or use that version",
                env!("CARGO_PKG_VERSION")
            )));
        }
        let plan: Self = serde_json::from_value(json).map_err(|error| no_plan(&error))?;
        let file = ExperimentFile::from_json(&plan.experiment)
            .map_err(|error| wrong(error.to_string()))?;
        let experiment = Experiment::new(file).map_err(|error| wrong(error.to_string()))?;
        plan.check(&experiment).map_err(wrong)?;
        Ok((plan, experiment))
    }

    /// Checks that a plan fits its experiment.
    fn check(&self, experiment: &Experiment) -> Result<(), String> {
        if self.fingerprint != hexadecimal(experiment.fingerprint()) {
            return Err(
                "its experiment is not the one for which it was made; plan again".to_owned(),
            );
        }
        let cells = experiment.cells.len();
        if self.trials.len() != cells || self.engine.len() != cells {
            return Err(format!(
                "its trials or engines are not for {cells} cells; plan again"
            ));
        }
        let (_, most) = experiment.file.trials.extent();
        let mut counts = self.trials.iter().enumerate();
        if !counts.all(|(cell, count)| *count <= experiment.trials_of(cell, most)) {
            return Err("more trials than its experiment asks for; plan again".to_owned());
        }
        // The parts of each cell must ascend without overlap.
        let mut ends = vec![0; cells];
        let mut in_range = |part: &Part| {
            let end = ends.get_mut(part.cell);
            end.is_some_and(|end| {
                let fits = *end <= part.from && part.from < part.to;
                *end = part.to;
                fits && part.to <= self.trials[part.cell]
            })
        };
        for (i, parts) in self.shards.iter().enumerate() {
            if !parts.iter().all(&mut in_range) {
                return Err(format!(
                    "shard {} has trials that are outside the plan or given twice; plan again",
                    i + 1
                ));
            }
        }
        Ok(())
    }

    /// Writes the plan.
    ///
    /// # Errors
    /// If a plan of another design is there, or the plan cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ClusterError> {
        if let Some(stored) = files::read_own(path, Kind::Plan)? {
            let stored: Value = serde_json::from_slice(&stored).unwrap_or_default();
            if stored["plan"] == "asobench" && stored["fingerprint"] != *self.fingerprint {
                return Err(ClusterError::Foreign {
                    path: path.to_owned(),
                    what: "the plan of another design".to_owned(),
                });
            }
        }
        let text = serde_json::to_string(self).unwrap_or_default();
        Ok(files::replace(
            path,
            Kind::Plan,
            format!("{text}\n").as_bytes(),
        )?)
    }

    /// Returns the design's fingerprint, in hexadecimal digits.
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }

    /// Whether faer computes a cell.
    pub fn is_by_faer(&self, cell: usize) -> bool {
        self.engine[cell] == Engine::Faer
    }

    /// Returns the number of trials of a shard.
    pub fn trials_of_shard(&self, index: usize) -> u64 {
        self.shards[index].iter().map(Part::len).sum()
    }

    /// Returns the default folder for the results of a plan's shards: `NAME-shards` beside `NAME.plan.json`.
    pub fn default_folder(path: &Path) -> PathBuf {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let name = name.strip_suffix(".json").unwrap_or(&name);
        let name = name.strip_suffix(".plan").unwrap_or(name);
        path.with_file_name(format!("{name}-shards"))
    }
}

impl Part {
    pub(crate) fn len(&self) -> u64 {
        self.to - self.from
    }

    pub(crate) fn range(&self) -> std::ops::Range<u64> {
        self.from..self.to
    }
}

/// Formats a fingerprint.
pub(crate) fn hexadecimal(fingerprint: u128) -> String {
    format!("{fingerprint:032x}")
}

fn cost(span: &Span, seconds: &[f64]) -> f64 {
    (span.trials.end - span.trials.start) as f64 * seconds[span.cell]
}

/// Cuts spans, in their order, into shards of about equal cost.
fn cut(spans: &[Span], seconds: &[f64], shards: usize) -> Vec<Vec<Part>> {
    let seconds: Vec<f64> = seconds.iter().map(|time| time.max(1e-9)).collect();
    let all: f64 = spans.iter().map(|span| cost(span, &seconds)).sum();
    let share = all / shards as f64;
    let mut cut: Vec<Vec<Part>> = vec![Vec::new()];
    let mut given = 0.0;
    for span in spans {
        let (cell, trial) = (span.cell, seconds[span.cell]);
        let fine = (share / trial / STEPS).clamp(1.0, ROUND as f64) as u64;
        let quantum = 1 << fine.ilog2();
        let mut from = span.trials.start;
        while from < span.trials.end {
            let bound = from as f64 + (cut.len() as f64 * share - given) / trial;
            let end = (bound / quantum as f64).round().max(0.0) as u64 * quantum;
            let last = cut.len() == shards;
            let to = if last {
                span.trials.end
            } else {
                end.clamp(from, span.trials.end)
            };
            if from < to {
                given += (to - from) as f64 * trial;
                // There is always a last shard.
                if let Some(parts) = cut.last_mut() {
                    parts.push(Part { cell, from, to });
                }
                from = to;
            }
            if from < span.trials.end {
                cut.push(Vec::new());
            }
        }
    }
    cut.retain(|parts| !parts.is_empty());
    cut
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever the costs, every trial is in exactly one shard, in order, and no shard exceeds its share by much.
    #[test]
    fn every_trial_is_in_one_shard() {
        let spans: Vec<Span> = [(0, 0..1000), (1, 300..5000), (3, 0..1), (7, 10..90_000)]
            .map(|(cell, trials)| Span { cell, trials })
            .into();
        let seconds = [1e-3, 2e-5, 5.0, 0.0, 0.0, 0.0, 0.0, 1e-6];
        let all: f64 = spans.iter().map(|span| cost(span, &seconds)).sum();
        for shards in [1, 2, 3, 7, 100, 5000] {
            let cut = cut(&spans, &seconds, shards);
            assert!(cut.len() <= shards);
            let parts: Vec<Part> = cut.iter().flatten().copied().collect();
            for span in &spans {
                let mut of_cell = parts.iter().filter(|part| part.cell == span.cell);
                let end = of_cell.try_fold(span.trials.start, |end, part| {
                    (part.from == end).then_some(part.to)
                });
                assert_eq!(end, Some(span.trials.end), "{shards} shards, {span:?}");
            }
            let of_shard = |parts: &Vec<Part>| -> f64 {
                let costs = parts
                    .iter()
                    .map(|part| part.len() as f64 * seconds[part.cell]);
                costs.sum()
            };
            let most = cut.iter().map(of_shard).fold(0.0, f64::max);
            // Half a step at each end, or one trial of the longest kind.
            let allowed = all / shards as f64 * (1.0 + 2.0 / STEPS);
            assert!(
                most <= allowed.max(2e-3),
                "{shards} shards: {most} of {allowed}"
            );
        }
    }

    #[test]
    fn parts_end_at_multiples() {
        let spans = [Span {
            cell: 0,
            trials: 0..1_000_000,
        }];
        let cut = cut(&spans, &[1e-4], 7);
        assert_eq!(cut.len(), 7);
        let ends = cut.iter().flatten().map(|part| part.to);
        assert!(ends.take(6).all(|end| end % ROUND == 0));
    }
}
