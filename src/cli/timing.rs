//! Times of the methods, measured after the run and stored apart from the results, which contain no times.

use super::error::{Error, failed};
use super::memory;
use crate::data::Realisation;
use crate::estimator::{Estimator, Pass, Window};
use crate::files::{self, Kind, PathError};
use crate::study::{Experiment, TIMES, TIMING};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The number of records on which each method is timed.
const RECORDS: u64 = 6;
/// The number of rounds on each record. In a round every method has its turn, so that what the machine does besides
/// slows all of them alike.
const ROUNDS: usize = 4;
/// The time of a turn, over which the estimates are counted; exceeded if one takes longer.
const TURN: Duration = Duration::from_micros(800);
/// A method with one estimate as long as this has a turn in the first round of each record alone: an estimate that long
/// averages over what the machine does besides, and six turns tell the spread of one.
const LONG: Duration = Duration::from_millis(20);

/// Returns the approximate seconds that [`measure`] takes, at most: as if no estimate were [`LONG`].
/// `seconds_per_trial` is the time of one trial of every cell on one thread.
pub(super) fn duration(experiment: &Experiment, seconds_per_trial: f64) -> f64 {
    let measured = experiment.cells.len() * experiment.methods.len();
    let least = measured as f64 * TURN.as_secs_f64();
    (RECORDS as usize * ROUNDS) as f64 * (least + seconds_per_trial)
}

fn file(folder: &Path) -> PathBuf {
    folder.join(TIMING).join(TIMES)
}

/// Whether a folder holds the times of this design.
pub(super) fn are_there(experiment: &Experiment, folder: &Path) -> Result<bool, PathError> {
    check(folder)?;
    let text = files::read_own(&file(folder), Kind::Times)?;
    let times = text.and_then(|text| files::parsed(&text).ok());
    Ok(times.is_some_and(|times| times["design"] == design(experiment)))
}

/// Checks that times can be written to a folder, which need not exist.
pub(super) fn check(folder: &Path) -> Result<(), PathError> {
    files::subfolder(folder, TIMING)?;
    files::replaceable(&file(folder), Kind::Times)
}

fn design(experiment: &Experiment) -> String {
    format!("{:032x}", experiment.fingerprint())
}

/// Times every method in every cell on one thread while the others are idle. Writes `timing/times.json` whole. Stops
/// between two estimates if `stop` is raised.
pub(super) fn measure(experiment: &Experiment, folder: &Path, stop: &AtomicBool) -> Result<(), Error> {
    let mut times = Vec::new();
    for (index, cell) in experiment.cells.iter().enumerate() {
        let Some(cell) = cell.discrete() else {
            continue;
        };
        let mut timed = Vec::new();
        for (method, table) in experiment.methods.iter().zip(&experiment.file.methods) {
            // `asobench test-method` times programs.
            if table.program().is_none() {
                let estimator = cell.prepare(method, experiment.file.coverage).map_err(failed)?;
                timed.push(Timed {
                    name: table.output_name(1),
                    estimator,
                    passes: vec![Pass::new(cell.order); method.passes()],
                    rounds: Vec::new(),
                });
            }
        }
        let mut record = Realisation::default();
        for trial in 0..RECORDS {
            let seed = experiment.file.seed;
            cell.realise(seed, trial, &mut record);
            let window = Window::with_reference(&record.u, &record.y, &record.r, cell.window);
            for round in 0..ROUNDS {
                for method in &mut timed {
                    method.turn(window, round == 0, stop)?;
                }
            }
        }
        times.extend(timed.into_iter().map(|method| {
            let mut seconds: Vec<f64> = method.rounds.iter().copied().flatten().collect();
            seconds.sort_by(f64::total_cmp);
            let at = |q: f64| seconds[((seconds.len() - 1) as f64 * q) as usize];
            json!({
                "cell": index,
                "order": cell.order,
                "window": cell.window,
                "method": method.name,
                "passes": method.passes.len(),
                "median_seconds": at(0.5),
                "q25_seconds": at(0.25),
                "q75_seconds": at(0.75),
                "rounds": method.rounds,
            })
        }));
    }
    let content = json!({
        "design": design(experiment),
        "machine": machine(),
        "times": times,
    });
    let text = files::sealed(&content);
    files::make_subfolder(folder, TIMING)
        .and_then(|_| files::replace(&file(folder), Kind::Times, text.as_bytes()))
        .map_err(failed)
}

/// A method with its times.
struct Timed {
    name: String,
    estimator: Box<dyn Estimator>,
    passes: Vec<Pass>,
    /// Seconds of an estimate in each round; `None` where it had no turn.
    rounds: Vec<Option<f64>>,
}

impl Timed {
    /// Estimates until the turn is over. After the first round of a record a method with long estimates passes.
    fn turn(&mut self, window: Window<'_>, first: bool, stop: &AtomicBool) -> Result<(), Error> {
        let of_record = self.rounds.last().copied();
        let is_long = |of: Option<f64>| of.is_none_or(|seconds| seconds >= LONG.as_secs_f64());
        if !first && of_record.is_some_and(is_long) {
            self.rounds.push(None);
            return Ok(());
        }
        let begin = Instant::now();
        let mut estimates = 0;
        loop {
            if stop.load(Ordering::Relaxed) {
                let message = "interrupted while times were measured; the results are written, \
                               the same command measures the times again";
                return Err(Error::Interrupted(message.to_owned()));
            }
            self.passes.iter_mut().for_each(Pass::clear);
            self.estimator.estimate(window, &mut self.passes);
            estimates += 1;
            let spent = begin.elapsed();
            if spent >= TURN {
                let seconds = spent.as_secs_f64() / f64::from(estimates);
                self.rounds.push(Some(seconds));
                return Ok(());
            }
        }
    }
}

/// Returns the processor's name, or its architecture if the name is unknown.
fn machine() -> String {
    let text = memory::file("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name"));
    let name = name.and_then(|rest| rest.split_once(':'));
    name.map_or(std::env::consts::ARCH, |(_, name)| name.trim()).to_owned()
}
