//! `asobench throughput FILE`: measures trials per second of a study's cells, without statistics and files.

use super::arguments::Arguments;
use super::rates::{Rates, ended};
use crate::cli::error::{Error, bad_file, bad_input};
use crate::cli::output::show;
use crate::cli::progress::{self, rounded, shares};
use crate::study::file::{ExperimentFile, TrialRule};
use crate::study::{Engine, Experiment, Spent, run_and_forget};
use crate::text::visible;
use serde_json::{Value, json};
use std::path::Path;

/// The times of all cells with some number of threads.
struct Timing {
    threads: usize,
    rates: Rates,
    /// The sum over all repetitions.
    spent: Spent,
}

impl Timing {
    fn json(&self) -> Value {
        let total = self.spent.total().as_secs_f64();
        let share = |part: std::time::Duration| part.as_secs_f64() / total;
        let [slowest, fastest] = self.rates.ends();
        json!({
            "threads": self.threads,
            "repetitions": self.rates.0.len(),
            "trials_per_second": self.rates.median(),
            "slowest": slowest,
            "fastest": fastest,
            "simulation": share(self.spent.simulation),
            "estimation": share(self.spent.estimation),
            "measures": share(self.spent.measures),
        })
    }
}

/// Times the cells of a file on each number of threads.
pub(super) fn time(path: &Path, arguments: &Arguments, threads: &[usize]) -> Result<(), Error> {
    let mut file = ExperimentFile::read(path).map_err(bad_input)?;
    for assignment in &arguments.set {
        let set = file.set(assignment);
        file = set.map_err(|e| Error::Input(format!("--set {e}")))?;
    }
    let (fewest, _) = file.trials.extent();
    let count = arguments.trials.unwrap_or(fewest);
    file.trials = TrialRule::Fixed(count);
    let experiment = Experiment::new(file);
    let experiment = experiment.map_err(bad_file(path))?;
    if let Some(program) = experiment.programs.first() {
        return Err(Error::Input(format!(
            "{}: method '{}' is a program; throughput times methods of asobench only: take it out of the file",
            path.display(),
            visible(&program.name)
        )));
    }
    let cells = experiment.cells.len();
    let trials: u64 = (0..cells).map(|cell| experiment.trials_of(cell, count)).sum();
    let engines = (0..cells).map(|cell| experiment.engine(cell));
    let in_lanes = engines.filter(|engine| *engine == Ok(Engine::Lanes)).count();
    let stop = progress::stop_flag()?;
    let once = |threads: usize, count: u64| run_and_forget(&experiment, count, threads, &stop).map_err(ended);
    let mut timings = Vec::new();
    for &threads in threads {
        // The first run loads and allocates, so it is not timed.
        once(threads, count.div_ceil(20))?;
        let mut spent = Spent::default();
        let rates = Rates::measure(arguments.repetitions, trials, || {
            spent += once(threads, count)?;
            Ok(())
        })?;
        timings.push(Timing { threads, rates, spent });
    }
    let text = || text(path, trials, [cells, in_lanes], &timings);
    show(arguments.format, text, || {
        json!({
            "workload": path.display().to_string(),
            "cells": cells,
            "cells_in_lanes": in_lanes,
            "trials": trials,
            "engines": timings.iter().map(Timing::json).collect::<Vec<Value>>(),
        })
    })
}

fn text(path: &Path, trials: u64, [cells, in_lanes]: [usize; 2], timings: &[Timing]) -> String {
    let lines = timings.iter().map(|timing| {
        let rates = timing.rates.ends().map(rounded);
        format!(
            "{:>7} {:>10}  {:<20} {}\n",
            timing.threads,
            rounded(timing.rates.median()),
            format!("({}, {})", rates[0], rates[1]),
            shares(&timing.spent),
        )
    });
    format!(
        "{}: {cells} cells, {in_lanes} of them in lanes, {trials} trials\n\n\
         threads   trials/s  (slowest, fastest)   of which\n{}\n\
         No statistics, no files: what `asobench run` on this file could reach at most.\n",
        visible(path.display()),
        lines.collect::<String>(),
    )
}
