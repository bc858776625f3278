//! Times of the methods, measured after the run and stored apart from the results, which contain no times.

use super::error::{Error, failed};
use crate::data::Realisation;
use crate::estimator::{Pass, Window};
use crate::files::{self, Kind, PathError};
use crate::study::Experiment;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The number of records on which each method is timed.
const RECORDS: u64 = 5;
/// The least number of repetitions on each record.
const REPETITIONS: usize = 5;
/// The time for each method on each record; exceeded if the repetitions take longer.
const BUDGET: Duration = Duration::from_millis(8);

/// Returns the approximate seconds that [`measure`] takes. `seconds_per_trial` is the time of one trial of every cell
/// on one thread.
pub(super) fn duration(experiment: &Experiment, seconds_per_trial: f64) -> f64 {
    let measured = experiment.cells.len() * experiment.methods.len();
    let least = measured as f64 * BUDGET.as_secs_f64();
    RECORDS as f64 * (least + REPETITIONS as f64 * seconds_per_trial)
}

const FOLDER: &str = "timing";

fn file(folder: &Path) -> PathBuf {
    folder.join(FOLDER).join("times.json")
}

/// Whether a folder holds the times of this design.
pub(super) fn are_there(experiment: &Experiment, folder: &Path) -> Result<bool, PathError> {
    check(folder)?;
    let text = files::read_own(&file(folder), Kind::Times)?;
    let times: Option<Value> = text.and_then(|text| serde_json::from_slice(&text).ok());
    Ok(times.is_some_and(|times| times["design"] == design(experiment)))
}

/// Checks that times can be written to a folder, which need not exist.
pub(super) fn check(folder: &Path) -> Result<(), PathError> {
    files::subfolder(folder, FOLDER)?;
    files::replaceable(&file(folder), Kind::Times)
}

fn design(experiment: &Experiment) -> String {
    format!("{:032x}", experiment.fingerprint())
}

/// Times every method in every cell on one thread while the others are idle. Writes `timing/times.json` whole. Stops
/// between two measurements if `stop` is raised.
pub(super) fn measure(
    experiment: &Experiment,
    folder: &Path,
    stop: &AtomicBool,
) -> Result<(), Error> {
    let mut times = Vec::new();
    for (index, cell) in experiment.cells.iter().enumerate() {
        let Some(process) = cell.process() else {
            continue;
        };
        let mut record = Realisation::default();
        for (method, table) in experiment.methods.iter().zip(&experiment.file.methods) {
            // `asobench test-method` times programs.
            if table.program().is_some() {
                continue;
            }
            let mut estimator = cell
                .prepare(method, experiment.file.coverage)
                .map_err(failed)?;
            let mut passes = vec![Pass::new(cell.order); method.passes()];
            let mut seconds = Vec::new();
            for trial in 0..RECORDS {
                let seed = experiment.file.seed;
                process.realise(
                    seed,
                    trial,
                    cell.eta,
                    cell.window,
                    cell.horizon,
                    &mut record,
                );
                let window = Window::with_reference(&record.u, &record.y, &record.r, cell.window);
                let begin = Instant::now();
                let mut repetition = 0;
                while repetition < REPETITIONS || begin.elapsed() < BUDGET {
                    if stop.load(Ordering::Relaxed) {
                        let message = "interrupted while times were measured; the results are \
                                       there, the same command measures the times again";
                        return Err(Error::Interrupted(message.to_owned()));
                    }
                    passes.iter_mut().for_each(Pass::clear);
                    let start = Instant::now();
                    estimator.estimate(window, &mut passes);
                    seconds.push(start.elapsed().as_secs_f64());
                    repetition += 1;
                }
            }
            seconds.sort_by(f64::total_cmp);
            let at = |q: f64| seconds[((seconds.len() - 1) as f64 * q) as usize];
            times.push(json!({
                "cell": index,
                "order": cell.order,
                "window": cell.window,
                "method": table.output_name(1),
                "passes": method.passes(),
                "median_seconds": at(0.5),
                "q25_seconds": at(0.25),
                "q75_seconds": at(0.75),
                "repetitions": seconds.len(),
            }));
        }
    }
    let content = json!({
        "design": design(experiment),
        "machine": machine(),
        "times": times,
    });
    let text = serde_json::to_string_pretty(&content).map_err(failed)?;
    files::make_subfolder(folder, FOLDER)
        .and_then(|_| files::replace(&file(folder), Kind::Times, format!("{text}\n").as_bytes()))
        .map_err(failed)
}

/// Returns the processor's name, or its architecture if the name is unknown.
#[expect(
    clippy::disallowed_methods,
    reason = "a file of the kernel, which is short"
)]
fn machine() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text
        .lines()
        .find_map(|line| line.strip_prefix("model name"));
    let name = name.and_then(|rest| rest.split_once(':'));
    name.map_or(std::env::consts::ARCH, |(_, name)| name.trim())
        .to_owned()
}
