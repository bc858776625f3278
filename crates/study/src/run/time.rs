//! The time that a run of a study takes, estimated from a short run of some of its cells.

use crate::design::cell::{Cell, Source};
use crate::design::experiment::Experiment;
use crate::design::file::experiment_file::Store;
use crate::outcome::rows::Rows;
use crate::outcome::summary::{CellSummary, SlopeStatistics};
use crate::outcome::tally::CellTally;
use crate::outcome::trial_table::TrialTable;
use crate::outcome::trials::Trials;
use crate::run::blocks::Content;
use crate::run::memory_and_disk::row_of;
use crate::run::runner::{Span, block_size};
use crate::run::trial_worker::{Worker, WorkerError};
use asobench_identification::metric::expected_bins;
use std::time::{Duration, Instant};
use xxhash_rust::xxh3::xxh3_128;

/// The largest number of cells that are timed.
const CELLS: usize = 40;
/// The time for the trials of a cell; exceeded if one trial takes longer.
const BUDGET: Duration = Duration::from_millis(30);
/// A trial that takes longer is run once: what a first run loads and allocates is little beside it.
const LONG: f64 = 2.0;
/// How often the other steps are timed.
const REPETITIONS: usize = 5;
/// Seconds until a block file is safely on the disk (approximate).
const DISK: f64 = 3e-4;
/// Seconds for a measure of an output in summary.parquet.
const TABLE: f64 = 4e-6;

/// Seconds on one thread.
#[derive(Clone, Debug, Default)]
struct Timed {
    /// The cells that this one represents, and their number.
    members: Vec<usize>,
    cells: f64,
    /// Trials in a full block, and in the one that was timed.
    block: u64,
    sampled: u64,
    /// Setting up the buffers of a cell.
    setup: f64,
    trial: f64,
    /// Tallying the sampled trials; encoding and decoding the tally, with the rows if they are kept.
    tally: f64,
    encode: f64,
    decode: f64,
    /// The cell's part of the results.
    summary: f64,
    /// Bytes of a row in trials.parquet, and seconds for writing it.
    row: f64,
    write_row: f64,
}

/// The cost of the trials of an experiment.
#[derive(Clone, Debug)]
pub struct Cost {
    timed: Vec<Timed>,
    outputs: f64,
    kept: bool,
}

impl Cost {
    /// Times trials of a sample of the cells, if each cell will have `trials` trials.
    ///
    /// # Errors
    /// If a cell has no worker.
    pub fn measure(experiment: &Experiment, trials: u64) -> Result<Self, WorkerError> {
        let mut timed = Vec::new();
        for members in sampled(experiment) {
            let mut found = time_cell(experiment, members.clone(), trials)?;
            if timed.is_empty() && found.trial < LONG {
                // The first run loads and allocates, so it is not counted.
                found = time_cell(experiment, members, trials)?;
            }
            timed.push(found);
        }
        Ok(Self {
            timed,
            outputs: experiment.output_count() as f64,
            kept: experiment.file.store == Store::Trials,
        })
    }

    /// Returns the seconds for one trial of every cell on one thread.
    pub fn seconds_per_trial(&self) -> f64 {
        self.timed
            .iter()
            .map(|group| group.cells * group.trial)
            .sum()
    }

    /// Returns the seconds for a trial of each cell on one thread, with its share of a block.
    pub fn seconds_of_cells(&self) -> Vec<f64> {
        let count: usize = self.timed.iter().map(|group| group.members.len()).sum();
        let mut seconds = vec![0.0; count];
        for group in &self.timed {
            let of_block = group.tally * (group.block as f64 / group.sampled as f64).max(1.0);
            let trial = group.trial + (of_block + group.encode + DISK) / group.block as f64;
            group.members.iter().for_each(|cell| seconds[*cell] = trial);
        }
        seconds
    }

    /// Returns the bytes of a row in trials.parquet.
    pub fn row(&self) -> f64 {
        let cells: f64 = self.timed.iter().map(|group| group.cells).sum();
        let bytes = self.timed.iter().map(|group| group.cells * group.row);
        bytes.sum::<f64>() / cells
    }

    /// Returns the seconds of a run with so many trials of each cell, of which the share `missing` is still to be
    /// computed. Includes the trials on all threads, the files that the calling thread writes meanwhile, and the
    /// results, which it puts together at the end.
    pub fn seconds(&self, trials: u64, missing: f64, threads: usize) -> f64 {
        let (trials, threads) = (trials as f64, threads as f64);
        let (mut parallel, mut serial, mut end) = (0.0, 0.0, 0.0);
        for group in &self.timed {
            let block = (group.block as f64).min(trials);
            let blocks = (trials / block).ceil();
            let larger = block / group.sampled as f64;
            let bins = expected_bins(block) / expected_bins(group.sampled as f64);
            // Rows grow with the number of trials, counts with the number of bins.
            let content = if self.kept { larger } else { bins }.max(1.0);
            let (encode, decode) = (group.encode * content, group.decode * content);
            let tally = group.tally * larger.max(1.0);
            parallel += group.cells
                * (group.setup * blocks.min(threads) + trials * group.trial + blocks * tally);
            serial += group.cells * blocks * (encode + DISK);
            let mut read = blocks * decode;
            if self.kept {
                read += trials * self.outputs * group.write_row;
            } else if blocks > 1.0 {
                serial += group.cells * (read + encode + DISK);
                read = decode;
            }
            end += group.cells * (read + group.summary);
        }
        missing * serial.max((parallel + serial) / threads) + end
    }
}

/// Sorts the cells by the kind of their trials and divides them into equal parts. The middle cell of each part
/// represents it.
fn sampled(experiment: &Experiment) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..experiment.cells.len()).collect();
    let kind = |index: &usize| {
        let cell: &Cell = &experiment.cells[*index];
        let steps = match &cell.source {
            Source::Record(_) => 0,
            Source::Continuous(cell) => cell.steps(),
        };
        let engine = experiment.engine(*index).ok();
        (
            engine,
            steps,
            cell.plant_order(),
            cell.order,
            cell.horizon,
            cell.window,
        )
    };
    order.sort_by_cached_key(kind);
    let parts = CELLS.min(order.len());
    let bound = |part: usize| part * order.len() / parts;
    (0..parts)
        .map(|part| order[bound(part)..bound(part + 1)].to_vec())
        .collect()
}

/// Times some work and returns its result. Takes the shortest of a few times, because other load on the machine can
/// only add time.
fn clocked<T>(mut work: impl FnMut() -> T) -> (f64, T) {
    let mut once = || {
        let begin = Instant::now();
        let result = work();
        (begin.elapsed().as_secs_f64(), result)
    };
    let mut shortest = f64::INFINITY;
    for _ in 1..REPETITIONS {
        shortest = shortest.min(once().0);
    }
    let (seconds, result) = once();
    (shortest.min(seconds), result)
}

/// Runs trials until the time is up. Returns their number, and the median time of one.
fn run_trials(
    worker: &mut Worker<'_>,
    stride: u64,
    to: &mut Trials,
) -> Result<(u64, f64), WorkerError> {
    let begin = Instant::now();
    let (mut count, mut times) = (0, Vec::new());
    while count == 0 || begin.elapsed() < BUDGET {
        let (next, start) = (count + stride, Instant::now());
        worker.run_into(count..next, to)?;
        times.push(start.elapsed().as_secs_f64() / (next - count) as f64);
        count = next;
    }
    times.sort_by(f64::total_cmp);
    Ok((count, times[times.len() / 2]))
}

/// Returns the bytes of a row in trials.parquet, and the seconds for writing it, from the difference between many and
/// few rows.
fn cost_of_row(experiment: &Experiment, cell: usize, rows: &Rows) -> [f64; 2] {
    let Ok(table) = TrialTable::new(experiment) else {
        return [f64::NAN; 2];
    };
    let cost = |trials: usize| {
        let mut part = rows.clone();
        part.truncate(trials);
        let (seconds, bytes) = clocked(|| table.file_of(cell, part.clone()));
        [bytes.map_or(f64::NAN, |bytes| bytes.len() as f64), seconds]
    };
    let most = rows.trial_count();
    let (few, all) = (cost(most / 4), cost(most));
    let outputs = experiment.output_count();
    let row = |i: usize| (all[i] - few[i]) / ((most - most / 4) * outputs).max(1) as f64;
    [row(0).min(row_of(experiment)), row(1).max(0.0)]
}

fn time_cell(
    experiment: &Experiment,
    members: Vec<usize>,
    trials: u64,
) -> Result<Timed, WorkerError> {
    let index = members[(members.len() - 1) / 2];
    let (cell, file) = (&experiment.cells[index], &experiment.file);
    let mut found = Trials::new(experiment, cell);
    let (setup, worker) = clocked(|| Worker::new(experiment, cell));
    let mut worker = worker?;
    // A program estimates whole batches, and it keeps the last one.
    let stride = worker.stride(cell).max(experiment.batch());
    let begin = Instant::now();
    worker.run_into(stride..2 * stride, &mut found)?;
    let mut trial = begin.elapsed().as_secs_f64() / stride as f64;
    let mut count = stride;
    if trial < LONG {
        found = Trials::new(experiment, cell);
        (count, trial) = run_trials(&mut worker, stride, &mut found)?;
    }
    let block = block_size(experiment, index);
    let sampled = count.min(block).min(trials);
    found.rows.truncate(sampled as usize);
    let curves = found.curves.take();
    let (tally_time, tally) = clocked(|| {
        found.curves.clone_from(&curves);
        CellTally::from_trials(experiment, cell, &mut found)
    });
    let kept = file.store == Store::Trials;
    let content = Content {
        tally,
        rows: kept.then(|| found.rows.clone()),
    };
    let (encode, encoded) = clocked(|| {
        let mut bytes = Vec::new();
        let encoded = content.encode(experiment, cell, &mut bytes);
        (
            xxh3_128(&bytes),
            encoded.map_or_else(|_| Vec::new(), |()| bytes),
        )
    });
    let span = Span {
        cell: index,
        trials: 0..sampled,
    };
    let (decode, _) = clocked(|| {
        let read = Content::decode(&encoded.1, experiment, &span);
        let mut merged = CellTally::default();
        if let Ok(content) = &read {
            merged.merge(&content.tally);
        }
        xxh3_128(&encoded.1)
    });
    let tally = content.tally;
    let (summary, values) = clocked(|| {
        let summary = CellSummary::new(experiment, index, &tally);
        let _ = SlopeStatistics::new(experiment, &tally);
        let json = serde_json::to_value(&summary).map(|mut json| {
            crate::outcome::summary::round(&mut json);
            json.to_string().len()
        });
        json.map_or(0, |_| {
            summary
                .outputs
                .iter()
                .map(|output| output.measures.len() + output.parameters.len())
                .sum()
        })
    });
    let [row, write_row] = if kept {
        cost_of_row(experiment, index, &found.rows)
    } else {
        [0.0; 2]
    };
    Ok(Timed {
        cells: members.len() as f64,
        members,
        block,
        sampled,
        setup,
        trial,
        tally: tally_time,
        encode,
        decode,
        summary: summary + TABLE * values as f64,
        row,
        write_row,
    })
}
