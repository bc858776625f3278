//! `asobench check`: what an experiment file asks for, and what it will cost.

use super::error::{Error, failed};
use super::print;
use super::run::{StudyArguments, threads};
use crate::study::file::{Axis, Key, TrialRule};
use crate::study::{CellTally, Experiment, Trial, Trials, block_size};
use std::fmt::Write as _;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Check an experiment file; print the grid's size, and time and memory estimated from a few trials.
#[derive(clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
}

/// Cells that are timed, at most, evenly spread.
const TIMED_CELLS: usize = 40;
/// Time given to a cell, unless one trial takes longer.
const BUDGET: Duration = Duration::from_millis(30);

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let (experiment, rule) = arguments.study.experiment()?;
    let threads = threads(None);
    let cost = cost(&experiment)?;
    let file = &experiment.file;
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{name:<9} {value}");
    };
    line(
        "title",
        if file.title.is_empty() {
            arguments.study.name()
        } else {
            file.title.clone()
        },
    );
    if !file.question.is_empty() {
        line("question", file.question.clone());
    }
    line(
        "cells",
        format!("{}{}", experiment.cells.len(), axes(&experiment)),
    );
    let outputs = experiment.outputs();
    let labels: Vec<String> = outputs
        .iter()
        .map(crate::estimator::Output::label)
        .collect();
    line(
        "outputs",
        format!("{}: {}", labels.len(), shortened(&labels)),
    );
    let (least, most) = match &rule {
        TrialRule::Fixed(trials) => (*trials, *trials),
        TrialRule::Until(until) => (until.minimum, until.maximum),
    };
    let each = if least == most {
        least.to_string()
    } else {
        format!("{least} to {most}")
    };
    line("trials", format!("{each} in each cell"));
    let seconds = |trials: u64| duration(cost.seconds_per_trial * trials as f64 / threads as f64);
    let time = if least == most {
        seconds(least)
    } else {
        format!("{} to {}", seconds(least), seconds(most))
    };
    line(
        "time",
        format!("about {time} on {threads} threads of this machine"),
    );
    line("memory", format!("about {} MB", cost.megabytes(threads)));
    line("stores", file.store.to_string());
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// The axes with their lengths, zipped ones as one.
fn axes(experiment: &Experiment) -> String {
    let file = &experiment.file;
    let mut axes = Vec::new();
    for key in Key::ALL {
        let Some(Axis::Many(values)) = file.settings.get(key) else {
            continue;
        };
        let group = file.zip.iter().find(|group| group.contains(key));
        let names = match group {
            Some(group) if group.iter().min() != Some(key) => continue,
            Some(group) => group
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
                .join("+"),
            None => key.to_string(),
        };
        axes.push(format!("{names} {}", values.len()));
    }
    if axes.is_empty() {
        String::new()
    } else {
        format!(": {}", axes.join(" x "))
    }
}

fn shortened(labels: &[String]) -> String {
    const SHOWN: usize = 6;
    if labels.len() <= SHOWN {
        return labels.join(", ");
    }
    format!(
        "{}, ..., {}",
        labels[..SHOWN - 1].join(", "),
        labels[labels.len() - 1]
    )
}

/// What trials cost.
struct Cost {
    /// One trial of every cell, on one thread.
    seconds_per_trial: f64,
    /// A block under way, per thread.
    block_bytes: f64,
    /// The tally of a cell.
    tally_bytes: f64,
}

impl Cost {
    fn megabytes(&self, threads: usize) -> u64 {
        // The program itself, blocks under way (rows and tally, computed and encoded), two tallies being merged.
        const PROGRAM: f64 = 40e6;
        let bytes = PROGRAM + 3.0 * threads as f64 * self.block_bytes + 3.0 * self.tally_bytes;
        (bytes / 1e6).ceil() as u64
    }
}

fn cost(experiment: &Experiment) -> Result<Cost, Error> {
    let cells = experiment.cells.len();
    let step = cells.div_ceil(TIMED_CELLS);
    let (mut seconds, mut timed) = (0.0, 0);
    let (mut block_bytes, mut tally_bytes): (f64, f64) = (0.0, 0.0);
    for (index, cell) in experiment.cells.iter().enumerate().step_by(step) {
        let mut trial = Trial::new(experiment, cell).map_err(failed)?;
        trial.run(0);
        let begin = Instant::now();
        let (mut count, mut trials) = (0, Trials::default());
        while count == 0 || begin.elapsed() < BUDGET {
            trial.run_into(count, &mut trials);
            count += 1;
        }
        seconds += begin.elapsed().as_secs_f64() / count as f64;
        timed += 1;
        let row = (size_of_val(&trials.rows[..]) + size_of_val(&trials.parameters[..])) as f64
            / count as f64;
        let tally = CellTally::of(experiment, cell, &mut trials);
        let bytes = postcard::to_stdvec(&tally).map_or(0.0, |encoded| encoded.len() as f64);
        // Bins of a sketch are 16 bytes in memory, 3 in a file; they fill up with trials, about tenfold.
        let tally = 50.0 * bytes;
        let block = block_size(experiment, index);
        block_bytes = block_bytes.max(block as f64 * row + tally);
        tally_bytes = tally_bytes.max(tally);
    }
    Ok(Cost {
        seconds_per_trial: seconds / f64::from(timed) * cells as f64,
        block_bytes,
        tally_bytes,
    })
}

fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "a second".to_owned(),
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
