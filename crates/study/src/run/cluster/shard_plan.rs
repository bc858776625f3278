//! The plan of a study over many machines: which shard computes which trials, with all that a shard needs to know.

use crate::design::Experiment;
use crate::design::file::{Engine, ExperimentFile};
use crate::files;
use crate::files::Kind;
use crate::run::cluster::ClusterError;
use crate::run::runner::Span;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// About how many pieces a shard has at least, if there are enough trials, and at most. Between them it has one of
/// every cell.
const PIECES: [u64; 2] = [16, 256];

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
    /// Seconds that a shard takes on one thread of the machine that made the plan.
    pub seconds: f64,
    /// The study, fully resolved.
    experiment: Value,
    /// The shards.
    pub shards: Vec<Vec<Span>>,
}

impl ShardPlan {
    /// Makes a plan for the `missing` trials, in so many `shards`; in fewer if there are few trials. `trials` is the
    /// number wanted of each cell, `seconds` the time of all that is missing.
    pub fn new(experiment: &Experiment, trials: Vec<u64>, missing: &[Span], seconds: f64, shards: usize) -> Self {
        let shards = dealt(missing, experiment.batch(), shards);
        Self {
            plan: "asobench".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            git_revision: crate::revision::GIT_REVISION.map(str::to_owned),
            fingerprint: hexadecimal(experiment.fingerprint()),
            trials,
            seconds: seconds / shards.len().max(1) as f64,
            experiment: serde_json::to_value(&experiment.file).unwrap_or_default(),
            shards,
        }
    }

    /// Reads a plan, and rebuilds its experiment.
    ///
    /// # Errors
    /// If it is not a plan, is damaged, or is of another version or build.
    pub fn read(path: &Path) -> Result<(Self, Experiment), ClusterError> {
        let read = || -> Result<(Self, Experiment), String> {
            let text = files::read_named(path, Kind::Plan).map_err(|error| error.to_string())?;
            let no_plan = |reason: &dyn std::fmt::Display| {
                format!("not a plan of asobench ({reason}); expected what `asobench plan` writes")
            };
            let mut json: Value = serde_json::from_str(&text).map_err(|error| no_plan(&error))?;
            if json["plan"] != "asobench" {
                return Err(no_plan(&"no \"plan\" in it"));
            }
            let version = json["version"].as_str().unwrap_or("unknown");
            if version != env!("CARGO_PKG_VERSION") {
                return Err(format!(
                    "made by asobench {version}, but this is {}; plan again, or use that version",
                    env!("CARGO_PKG_VERSION")
                ));
            }
            if json["checksum"].is_null() {
                return Err("made by an older build of asobench; plan again".to_owned());
            }
            files::unseal(&mut json, text.as_bytes()).map_err(|error| format!("{error}; plan again"))?;
            let plan: Self = serde_json::from_value(json).map_err(|error| no_plan(&error))?;
            let file = ExperimentFile::from_json(&plan.experiment);
            let experiment = file.and_then(Experiment::new).map_err(|error| error.to_string())?;
            if plan.fingerprint != hexadecimal(experiment.fingerprint()) {
                let other = "its experiment is not the one for which it was made; plan again";
                return Err(other.to_owned());
            }
            Ok((plan, experiment))
        };
        read().map_err(|reason| ClusterError::Plan {
            path: path.to_owned(),
            reason,
        })
    }

    /// Writes the plan.
    ///
    /// # Errors
    /// If a plan of another design is there, or the plan cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ClusterError> {
        let there = files::read_own(path, Kind::Plan)?;
        let there = there.and_then(|text| serde_json::from_slice::<Value>(&text).ok());
        if there.is_some_and(|json| json["plan"] == "asobench" && json["fingerprint"] != *self.fingerprint) {
            return Err(ClusterError::Foreign {
                path: path.to_owned(),
                what: "the plan of another design",
            });
        }
        Ok(files::replace(path, Kind::Plan, files::sealed(self).as_bytes())?)
    }

    /// Returns the design's fingerprint, in hexadecimal digits.
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }

    /// Returns the number of trials of a shard.
    pub fn trials_of_shard(&self, index: usize) -> u64 {
        self.shards[index].iter().map(Span::len).sum()
    }

    /// Returns the name of a plan's study: `NAME` of `NAME.plan.json`.
    pub fn name_of(path: &Path) -> OsString {
        let mut name = PathBuf::from(path.file_name().unwrap_or_default());
        for form in ["json", "plan"] {
            if name.extension().is_some_and(|of| of == form) {
                name.set_extension("");
            }
        }
        name.into_os_string()
    }

    /// Returns the default folder for the results of a plan's shards: `NAME-shards` beside `NAME.plan.json`.
    pub fn default_folder(path: &Path) -> PathBuf {
        let mut name = Self::name_of(path);
        name.push("-shards");
        path.with_file_name(name)
    }
}

/// Whether the bits of a cell depend on the machine's vector instructions.
pub(crate) fn is_by_faer(experiment: &Experiment, cell: usize) -> bool {
    experiment.engine(cell) == Ok(Engine::Faer)
}

/// Formats a fingerprint.
pub(crate) fn hexadecimal(fingerprint: u128) -> String {
    format!("{fingerprint:032x}")
}

/// Deals spans to shards like cards. A piece ends at a multiple of its size, which is one of `batch`. The shard with
/// which a round begins follows multiples of the golden ratio, so that no axis of the grid is in step with the shards.
fn dealt(spans: &[Span], batch: u64, shards: usize) -> Vec<Vec<Span>> {
    let trials: u64 = spans.iter().map(Span::len).sum();
    let [least, most] = PIECES;
    let of_shard = (spans.len() as u64).clamp(least, most);
    let piece = trials.div_ceil(of_shard * shards as u64).max(1);
    let piece = piece.next_multiple_of(batch);
    let mut dealt = vec![Vec::new(); shards];
    let mut pieces = 0;
    for Span { cell, trials } in spans {
        let mut from = trials.start;
        while from < trials.end {
            let to = trials.end.min((from / piece + 1) * piece);
            let (cell, trials) = (*cell, from..to);
            dealt[(pieces + first(pieces / shards, shards)) % shards].push(Span { cell, trials });
            (from, pieces) = (to, pieces + 1);
        }
    }
    dealt.retain(|pieces| !pieces.is_empty());
    dealt
}

/// The shard with which a round begins: the fractional part of the round times the golden ratio, times the shards.
fn first(round: usize, shards: usize) -> usize {
    const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
    let fraction = (round as u64).wrapping_mul(GOLDEN);
    ((u128::from(fraction) * shards as u128) >> 64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spans<const N: usize>(spans: [(usize, std::ops::Range<u64>); N]) -> Vec<Span> {
        spans.map(|(cell, trials)| Span { cell, trials }).into()
    }

    /// Every trial is in exactly one shard, in whole batches, and the shards have about equally many.
    #[test]
    fn every_trial_is_in_one_shard() {
        let spans = spans([(0, 0..1000), (1, 300..5000), (3, 0..1), (7, 10..90_000)]);
        let all: u64 = spans.iter().map(Span::len).sum();
        for (shards, batch) in [1, 2, 3, 7, 100, 5000].into_iter().zip([1, 1, 100, 1, 7, 1]) {
            let dealt = dealt(&spans, batch, shards);
            assert!(dealt.len() <= shards);
            let mut pieces: Vec<&Span> = dealt.iter().flatten().collect();
            pieces.sort_by_key(|piece| (piece.cell, piece.trials.start));
            for span in &spans {
                let mut of_cell = pieces.iter().filter(|piece| piece.cell == span.cell);
                let end = of_cell.try_fold(span.trials.start, |end, piece| {
                    let whole = piece.trials.end % batch == 0 || piece.trials.end == span.trials.end;
                    (piece.trials.start == end && whole).then_some(piece.trials.end)
                });
                assert_eq!(end, Some(span.trials.end), "{shards} shards, {span:?}");
            }
            let most = dealt.iter().map(|shard| shard.iter().map(Span::len).sum::<u64>()).max();
            let share = all as f64 / shards as f64;
            // A piece of 16 or so more than the others.
            assert!(
                most.unwrap() as f64 <= 1.2 * share + 2.0 * batch as f64,
                "{shards}: {most:?} of {share}"
            );
        }
    }

    /// Where the trials of some windows take ten times as long, no shard gets many more of them than its share.
    #[test]
    fn long_and_short_cells_are_mixed() {
        for (windows, levels) in [(2, 40), (4, 10), (5, 8), (8, 25), (4, 100), (3, 200)] {
            for shards in [2, 4, 5, 8, 10, 16] {
                let cells = (0..windows * levels).map(|cell| Span {
                    cell,
                    trials: 0..10_000,
                });
                let cells: Vec<Span> = cells.collect();
                let cost =
                    |piece: &Span| piece.len() as f64 * if piece.cell.is_multiple_of(windows) { 10.0 } else { 1.0 };
                let all: f64 = cells.iter().map(cost).sum();
                let dealt = dealt(&cells, 1, shards);
                let costs = dealt.iter().map(|shard| shard.iter().map(cost).sum::<f64>());
                let worst = costs.fold(0.0, f64::max) / (all / shards as f64);
                assert!(worst < 1.35, "{windows} windows, {shards} shards: {worst}");
            }
        }
    }
}
