//! `asobench check`: what an experiment file asks for, and what it will cost.

use super::error::{Error, failed};
use super::run::{StudyArguments, threads};
use super::{memory, print};
use crate::study::file::{Axis, Key, Store, TrialRule};
use crate::study::{Cell, CellTally, Experiment, Trials, Worker, block_size};
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
/// What a row of trials.parquet takes beside its figures.
const TABLE_ROW_BYTES: usize = 2;
/// Time given to a cell, unless one trial takes longer.
const BUDGET: Duration = Duration::from_millis(30);

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let (experiment, rule) = arguments.study.experiment()?;
    // The size comes first: the estimate takes some seconds where trials are long.
    print(&size(arguments, &experiment, &rule))?;
    memory::fits(&experiment, 0..experiment.cells.len(), 1)?;
    print(&estimates(&experiment, &rule)?)?;
    Ok(ExitCode::SUCCESS)
}

/// A line of the output.
fn line(text: &mut String, name: &str, value: &str) {
    // Writing to a string does not fail.
    let _ = writeln!(text, "{name:<9} {value}");
}

/// The fewest and the most trials of a cell.
fn extent(rule: &TrialRule) -> (u64, u64) {
    match rule {
        TrialRule::Fixed(trials) => (*trials, *trials),
        TrialRule::Until(until) => (until.minimum, until.maximum),
    }
}

/// One text, or two with "to" between them.
fn span<T: std::fmt::Display + PartialEq>((least, most): (T, T)) -> String {
    if least == most {
        least.to_string()
    } else {
        format!("{least} to {most}")
    }
}

/// What the file asks for.
fn size(arguments: &Arguments, experiment: &Experiment, rule: &TrialRule) -> String {
    let file = &experiment.file;
    let mut text = String::new();
    let title = if file.title.is_empty() {
        arguments.study.name()
    } else {
        file.title.clone()
    };
    line(&mut text, "title", &title);
    if !file.question.is_empty() {
        line(&mut text, "question", &file.question);
    }
    let cells = format!("{}{}", experiment.cells.len(), axes(experiment));
    line(&mut text, "cells", &cells);
    let outputs = experiment.outputs();
    let labels: Vec<String> = outputs
        .iter()
        .map(crate::estimator::Output::label)
        .collect();
    let outputs = format!("{}: {}", labels.len(), shortened(&labels));
    line(&mut text, "outputs", &outputs);
    let trials = format!("{} in each cell", span(extent(rule)));
    line(&mut text, "trials", &trials);
    line(&mut text, "stores", &file.store.to_string());
    text
}

/// What a run of it costs.
fn estimates(experiment: &Experiment, rule: &TrialRule) -> Result<String, Error> {
    let threads = threads(None);
    let cost = cost(experiment)?;
    let (least, most) = extent(rule);
    let seconds = |trials: u64| duration(cost.seconds_per_trial * trials as f64 / threads as f64);
    let mut text = String::new();
    let mut time = format!(
        "about {} on {threads} threads of this machine",
        span((seconds(least), seconds(most)))
    );
    if experiment.file.timing {
        let more = super::timing::duration(experiment, cost.seconds_per_trial);
        // Writing to a string does not fail.
        let _ = write!(
            time,
            ", then about {} for the times of the methods, on one",
            duration(more)
        );
    }
    line(&mut text, "time", &time);
    let memory = format!("about {}", bytes(cost.memory(threads)));
    line(&mut text, "memory", &memory);
    if experiment.file.store == Store::Trials {
        let cells = experiment.cells.len() as f64;
        let disk = |trials: u64, each: f64| bytes(cells * trials as f64 * each);
        let of = |each: f64| span((disk(least, each), disk(most, each)));
        let disk = format!(
            "at most {} in trials.parquet, about {} in blocks/",
            of(cost.table_bytes),
            of(cost.row_bytes)
        );
        line(&mut text, "disk", &disk);
    }
    Ok(text)
}

/// A size with its unit.
fn bytes(bytes: f64) -> String {
    match bytes / 1e6 {
        mega if mega < 1000.0 => format!("{:.0} MB", mega.ceil()),
        mega => format!("{:.1} GB", mega / 1e3),
    }
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
    /// The largest record with its truth, per thread.
    record_bytes: f64,
    /// A trial of a cell in the blocks, where trials are kept.
    row_bytes: f64,
    /// The same in trials.parquet, at most: equal figures of two outputs compress.
    table_bytes: f64,
}

impl Cost {
    /// Bytes: the program itself; for each thread a record and blocks under way (rows and tally, computed and
    /// encoded); two tallies being merged.
    fn memory(&self, threads: usize) -> f64 {
        const PROGRAM: f64 = 40e6;
        let thread = self.record_bytes + 3.0 * self.block_bytes;
        PROGRAM + threads as f64 * thread + 3.0 * self.tally_bytes
    }
}

fn cost(experiment: &Experiment) -> Result<Cost, Error> {
    let cells = experiment.cells.len();
    let step = cells.div_ceil(TIMED_CELLS);
    let (mut seconds, mut timed) = (0.0, 0);
    let (mut block_bytes, mut tally_bytes, mut row_bytes): (f64, f64, f64) = (0.0, 0.0, 0.0);
    // Of all cells: the largest need not be among the timed ones.
    let record_bytes = experiment.cells.iter().map(Cell::record_bytes).max();
    for (index, cell) in experiment.cells.iter().enumerate().step_by(step) {
        let mut worker = Worker::new(experiment, cell).map_err(failed)?;
        worker.run_into(0..worker.stride(), &mut Trials::default());
        let begin = Instant::now();
        let (mut count, mut trials) = (0, Trials::default());
        while count == 0 || begin.elapsed() < BUDGET {
            let next = count + worker.stride();
            worker.run_into(count..next, &mut trials);
            count = next;
        }
        seconds += begin.elapsed().as_secs_f64() / count as f64;
        timed += 1;
        let row = (size_of_val(&trials.rows[..]) + size_of_val(&trials.parameters[..])) as f64
            / count as f64;
        let encoded = postcard::to_stdvec(&trials.rows).map_or(0, |encoded| encoded.len());
        row_bytes += encoded as f64 / count as f64;
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
        record_bytes: record_bytes.unwrap_or(0) as f64,
        row_bytes: row_bytes / f64::from(timed),
        table_bytes: (experiment.outputs().len() * TABLE_ROW_BYTES
            + experiment.outputs().len() * experiment.file.measures.len() * size_of::<f64>())
            as f64,
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
