//! The needs of a study's run: time, memory and room on disk, extrapolated from a block of each kind of cell that was
//! computed, encoded, decoded and summarised.
//!
//! Rows grow with the number of trials, and tallies with the number of bins of their sketches. In
//! `tests/studies/needs.rs` a run writes and takes what was foretold to a factor of two.

use crate::design::file::Store;
use crate::design::{Cell, Experiment, Source};
use crate::outcome::nine_digits::stored;
use crate::outcome::summary::{CellPart, CellSummary};
use crate::outcome::summary_table::table_of;
use crate::outcome::tally::CellTally;
use crate::outcome::trial_table::{GROUP_ROWS, TrialTable};
use crate::outcome::trials::Trials;
use crate::run::block_file::LENGTH;
use crate::run::runner::{Block, Span, block_size};
use crate::run::trial_worker::{Worker, WorkerError};
use asobench_identification::metric::expected_bins;
use std::convert::Infallible;
use std::time::{Duration, Instant};
use xxhash_rust::xxh3::xxh3_128;

/// The largest number of cells that are sampled.
const CELLS: usize = 40;
/// So many at least are sampled, even if their trials take long; one, if they take so long.
const FEWEST: usize = 4;
const PATIENCE: Duration = Duration::from_secs(2);
/// The time for the trials of all of them. It may take twice as long; more if single trials do.
const BUDGET: Duration = Duration::from_millis(400);
/// A trial that takes longer, in seconds, is run once: what a first run loads and allocates is little beside it.
const LONG: f64 = 0.02;
/// How often the other steps are timed, unless they take longer than this.
const REPETITIONS: usize = 5;
const REPEATED: Duration = Duration::from_millis(2);
/// Where fewer trials were run, made-up ones give the sizes for so many.
const LEAST: u64 = 64;
/// A file occupies whole blocks of the disk, of 4 kB on most. On average it wastes half a block.
const WASTED: f64 = 2048.0;
/// Of rows that wait to be written to trials.parquet there are these: rows, columns, pages.
const COPIES: f64 = 3.0;
/// A report: its page and pictures, whatever the study, and its tables for each byte of summary.parquet, which has the
/// same numbers. To a factor of two and a half in 36 studies.
const PAGES: f64 = 4e5;
const TABLES: f64 = 4.0;

/// Bytes on disk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disk {
    /// The block files.
    pub blocks: f64,
    /// trials.parquet, if trials are kept.
    pub trials: f64,
    /// summary.json and summary.parquet.
    pub summary: f64,
    /// The files that `asobench report` writes.
    pub report: f64,
}

impl Disk {
    /// Returns the bytes that a run writes. It removes nothing before it has written everything.
    pub fn of_run(&self) -> f64 {
        self.blocks + self.trials + self.summary
    }
}

/// A size of the tally of some trials, and of a quarter of them.
#[derive(Clone, Copy, Debug, Default)]
struct Growing {
    few: f64,
    all: f64,
}

/// A cell that stands for others: a block of it that was computed. Seconds are of one thread.
#[derive(Clone, Debug, Default)]
struct Sampled {
    /// The cells that this one represents.
    members: Vec<usize>,
    /// Trials in a full block, and in the sample.
    block: f64,
    trials: f64,
    /// Whether the cell has one trial, however many are asked for.
    deterministic: bool,
    /// Seconds: the buffers of a cell, a trial; the sample's tally, encoding and decoding it, with the rows if they are
    /// kept; the cell's part of the results; a row of trials.parquet.
    setup: f64,
    trial: f64,
    tally: f64,
    encode: f64,
    decode: f64,
    summary: f64,
    write_row: f64,
    /// Bytes: the buffers of a thread; the tally in memory and stored; a trial's rows in memory and stored; the summary
    /// as JSON, which is about its size in memory too; a row of trials.parquet, and the file without rows.
    buffers: f64,
    tally_bytes: [Growing; 2],
    row_bytes: [f64; 2],
    summary_bytes: f64,
    parquet: [f64; 2],
}

/// The needs of a run of an experiment.
#[derive(Clone, Debug)]
pub struct Forecast {
    sampled: Vec<Sampled>,
    outputs: f64,
    kept: bool,
    /// Bytes and seconds of a cell in summary.parquet.
    table: [f64; 2],
}

impl Forecast {
    /// Runs trials of a sample of the cells, if each cell will have `trials` trials.
    ///
    /// # Errors
    /// If a cell has no worker.
    pub fn measure(experiment: &Experiment, trials: u64) -> Result<Self, WorkerError> {
        Self::new(experiment, trials, (CELLS, REPETITIONS), run_trials)
    }

    /// Returns a forecast of sizes alone, from made-up results of a few cells: no trial is run.
    pub fn of_sizes(experiment: &Experiment, trials: u64) -> Self {
        let none = |_: &Experiment, _: &Cell, _, _: &mut Trials| Ok::<_, Infallible>((0.0, 0.0));
        let Ok(forecast) = Self::new(experiment, trials, (CELLS / 10, 1), none);
        forecast
    }

    fn new<E>(
        experiment: &Experiment,
        trials: u64,
        (most, times): (usize, usize),
        run: impl Fn(&Experiment, &Cell, (u64, Duration), &mut Trials) -> Result<(f64, f64), E>,
    ) -> Result<Self, E> {
        let kinds = kinds(experiment, most);
        let (begin, budget) = (Instant::now(), BUDGET / kinds.len() as u32);
        // From coarse to fine, so that what is left when the time is up lies between what was sampled.
        let mut places: Vec<(usize, Vec<usize>)> = kinds.into_iter().enumerate().collect();
        places.sort_by_key(|(place, _)| (*place as u32).reverse_bits());
        let (mut sampled, mut summaries) = (Vec::<(usize, Sampled)>::new(), Vec::new());
        for (place, members) in places {
            let taken = begin.elapsed();
            let fewest = if taken > PATIENCE { 1 } else { FEWEST };
            if sampled.len() >= fewest && taken > 2 * BUDGET {
                let nearest = sampled.iter_mut().min_by_key(|(other, _)| place.abs_diff(*other));
                if let Some((_, of)) = nearest {
                    of.members.extend(members);
                }
                continue;
            }
            let index = members[(members.len() - 1) / 2];
            let cell = &experiment.cells[index];
            let mut found = Trials::new(experiment, cell);
            let wanted = block_size(experiment, index).min(experiment.trials_of(index, trials));
            let (setup, trial) = run(experiment, cell, (wanted, budget), &mut found)?;
            let (of_block, summary) = sample(experiment, index, found, wanted, times);
            let of_cells = Sampled {
                members,
                setup,
                trial,
                ..of_block
            };
            sampled.push((place, of_cells));
            summaries.push(summary);
        }
        let sampled = sampled.into_iter().map(|(_, of)| of).collect();
        let (seconds, table) = clocked(1, || table_of(experiment, &summaries));
        let table = table.map_or(0.0, |table| table.len() as f64);
        let count = summaries.len() as f64;
        Ok(Self {
            sampled,
            outputs: experiment.output_count() as f64,
            kept: experiment.file.store == Store::Trials,
            table: [table / count, seconds / count],
        })
    }

    /// Returns the seconds for one trial of every cell on one thread.
    pub fn seconds_per_trial(&self) -> f64 {
        let seconds = self.sampled.iter().map(|of| of.cells() * of.trial);
        seconds.sum()
    }

    /// Returns the seconds on one thread for the trials of some spans, with their shares of blocks.
    pub fn seconds_of(&self, spans: &[Span]) -> f64 {
        let seconds = self.sampled.iter().map(|of| {
            let spans = spans.iter().filter(|span| of.members.contains(&span.cell));
            let trials: u64 = spans.map(Span::len).sum();
            trials as f64 * (of.trial + of.tally / of.trials + of.encode / of.block)
        });
        seconds.sum()
    }

    /// Returns the seconds of a run with so many trials of each cell, of which the share `missing` is still to be
    /// computed. Includes the trials on all threads, the files that the calling thread writes meanwhile, and the
    /// results, which it puts together at the end.
    pub fn seconds(&self, trials: u64, missing: f64, threads: usize) -> f64 {
        let (mut parallel, mut serial, mut end) = (0.0, 0.0, 0.0);
        let threads = threads as f64;
        for of in &self.sampled {
            let (trials, block, blocks) = of.blocks(trials);
            let larger = (block / of.trials).max(1.0);
            // Rows grow with the number of trials, counts with the number of bins.
            let content = if self.kept {
                larger
            } else {
                of.tally_bytes[1].at(block, of.trials) / of.tally_bytes[1].all
            };
            let (encode, decode) = (of.encode * content, of.decode * content);
            parallel += of.cells() * (of.setup * blocks.min(threads) + trials * of.trial + blocks * of.tally * larger);
            serial += of.cells() * blocks * encode;
            let mut read = blocks * decode;
            if self.kept {
                read += trials * self.outputs * of.write_row;
            } else if blocks > 1.0 {
                serial += of.cells() * (read + encode);
                read = decode;
            }
            end += of.cells() * (read + of.summary + self.table[1]);
        }
        missing * serial.max((parallel + serial) / threads) + end
    }

    /// Returns the memory in bytes of a run with so many trials of each cell on so many threads, in addition to what
    /// the program and the experiment take.
    ///
    /// While trials are computed, each thread holds buffers, a block that it computes and encodes, and one that waits.
    /// The calling thread holds the block that it writes. While results are put together, the memory holds the
    /// summaries of all cells, two tallies of a cell that are merged, a block that is being read, and a few groups of
    /// rows of trials.parquet.
    pub fn memory(&self, trials: u64, threads: usize) -> f64 {
        let (mut computing, mut merging, mut cells, mut rows) = (0.0_f64, 0.0_f64, 0.0, 0.0);
        let mut row = 0.0_f64;
        let threads = threads as f64;
        for of in &self.sampled {
            let (trials, block, _) = of.blocks(trials);
            let [tally, stored] = of.tally_bytes.map(|size| size.at(block, of.trials));
            let encoded = stored + block * of.row_bytes[1];
            let rows_of_block = block * of.row_bytes[0];
            let thread = of.buffers + rows_of_block + tally + 2.0 * encoded;
            computing = computing.max(threads * thread + encoded);
            let merged = of.tally_bytes[0].at(trials, of.trials);
            let read = tally + encoded + if self.kept { rows_of_block } else { 0.0 };
            merging = merging.max(2.0 * merged + read);
            cells += of.cells() * of.summary_bytes;
            rows += of.cells() * trials * self.outputs;
            row = row.max(of.row_bytes[0] / self.outputs);
        }
        if self.kept {
            merging += COPIES * (threads + 2.0) * rows.min(GROUP_ROWS as f64) * row;
        }
        cells + computing.max(merging)
    }

    /// Returns the bytes on disk of a run with so many trials of each cell.
    pub fn disk(&self, trials: u64) -> Disk {
        let mut disk = Disk::default();
        for of in &self.sampled {
            let (trials, block, blocks) = of.blocks(trials);
            // Blocks without rows are merged into one when their cell is complete.
            let (block, blocks) = if self.kept { (block, blocks) } else { (trials, 1.0) };
            let tally = of.tally_bytes[1].at(block, of.trials);
            disk.blocks += of.cells() * (blocks * (tally + WASTED) + trials * of.row_bytes[1]);
            disk.trials += of.cells() * trials * self.outputs * of.parquet[0];
            disk.summary += of.cells() * (of.summary_bytes + self.table[0]);
            disk.report += of.cells() * TABLES * self.table[0];
        }
        let alone = self.sampled.iter().map(|of| of.parquet[1]);
        disk.trials += alone.fold(0.0, f64::max);
        disk.report += PAGES;
        disk
    }
}

impl Sampled {
    fn cells(&self) -> f64 {
        self.members.len() as f64
    }

    /// Returns the trials of each cell if so many are asked for, those of a block, and the number of blocks.
    fn blocks(&self, asked: u64) -> (f64, f64, f64) {
        let trials = if self.deterministic { 1.0 } else { asked as f64 };
        let block = self.block.min(trials);
        (trials, block, (trials / block).ceil())
    }
}

impl Growing {
    /// Returns the size for some trials, if that of the sample is known.
    fn at(&self, trials: f64, sample: f64) -> f64 {
        let [few, all, wanted] = [(sample / 4.0).floor(), sample, trials].map(expected_bins);
        self.all + (self.all - self.few) * ((wanted - all) / (all - few)).max(-1.0)
    }
}

/// Sorts the cells by the kind of their trials and divides them into equal parts. The middle cell of each part
/// represents it.
fn kinds(experiment: &Experiment, most: usize) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..experiment.cells.len()).collect();
    order.sort_by_cached_key(|index| {
        let cell = &experiment.cells[*index];
        let (steps, horizon, window) = match &cell.source {
            Source::Discrete(cell) => (0, cell.horizon, cell.window),
            Source::Continuous(cell) => (cell.steps(), 0, 0),
        };
        let (engine, truth) = (experiment.engine(*index).ok(), cell.plant_order());
        let alone = cell.is_deterministic();
        (alone, engine, steps, truth, cell.order(), horizon, window)
    });
    let parts = most.min(order.len());
    let bound = |part: usize| part * order.len() / parts;
    (0..parts)
        .map(|part| order[bound(part)..bound(part + 1)].to_vec())
        .collect()
}

/// Times some work and returns its result. Takes the shortest of a few times, because other load on the machine can
/// only add time.
fn clocked<T>(times: usize, mut work: impl FnMut() -> T) -> (f64, T) {
    let (begin, mut shortest, mut left) = (Instant::now(), f64::INFINITY, times);
    loop {
        let start = Instant::now();
        let result = work();
        shortest = shortest.min(start.elapsed().as_secs_f64());
        left = left.saturating_sub(1);
        if left == 0 || begin.elapsed() >= REPEATED {
            return (shortest, result);
        }
    }
}

/// Runs trials of a cell until the time is up or there are so many. Returns the seconds for the buffers, and the median
/// of those for a trial.
fn run_trials(
    experiment: &Experiment,
    cell: &Cell,
    (wanted, budget): (u64, Duration),
    to: &mut Trials,
) -> Result<(f64, f64), WorkerError> {
    let (setup, worker) = clocked(1, || Worker::new(experiment, cell));
    let mut worker = worker?;
    // A program estimates whole batches, and it keeps the last one.
    let stride = worker.stride(cell).min(wanted).max(experiment.batch());
    let mut run = |from: u64, to: &mut Trials| -> Result<f64, WorkerError> {
        let begin = Instant::now();
        worker.run_into(from..from + stride, to)?;
        Ok(begin.elapsed().as_secs_f64() / stride as f64)
    };
    // The first run loads and allocates.
    let first = run(stride, to)?;
    if first >= LONG {
        return Ok((setup, first));
    }
    *to = Trials::new(experiment, cell);
    let (begin, mut times) = (Instant::now(), Vec::new());
    let mut next = 0;
    while next < wanted && (next == 0 || begin.elapsed() < budget) {
        next += stride;
        times.push(run(next - stride, to)?);
    }
    times.sort_by(f64::total_cmp);
    Ok((setup, times[times.len() / 2]))
}

/// Tallies, encodes, decodes and summarises trials of a cell.
fn sample(
    experiment: &Experiment,
    index: usize,
    mut found: Trials,
    wanted: u64,
    times: usize,
) -> (Sampled, CellSummary) {
    let (cell, kept) = (&experiment.cells[index], experiment.file.store == Store::Trials);
    found.make_up(wanted.min(LEAST));
    found.rows.truncate(wanted as usize);
    let trials = found.rows.trial_count();
    let curves = found.curves.take();
    let (tally_seconds, tally) = clocked(times, || {
        found.curves.clone_from(&curves);
        CellTally::from_trials(experiment, cell, &mut found)
    });
    let mut few = Trials::new(experiment, cell);
    few.rows = found.rows.clone();
    few.rows.truncate(trials / 4);
    // Curves have most of their bins from the start.
    few.curves.clone_from(&curves);
    let few = CellTally::from_trials(experiment, cell, &mut few);
    let span = Span {
        cell: index,
        trials: found.rows.trials(),
    };
    let mut block = Block::of_tally(span.clone(), tally.clone());
    if kept {
        block.rows = found.rows.clone();
    }
    let (encode, bytes) = clocked(times, || {
        let mut bytes = Vec::new();
        // A block that cannot be encoded ends the run; here it takes no room.
        let _ = block.encode(experiment, &mut bytes);
        (xxh3_128(&bytes), bytes).1
    });
    let (decode, _) = clocked(times, || {
        let mut merged = CellTally::default();
        if let Ok(block) = Block::decode(&bytes, experiment, span.clone()) {
            merged.merge(block.tally);
        }
        xxh3_128(&bytes)
    });
    let tally_stored =
        [&few, &tally].map(|tally| postcard::to_stdvec(tally).map_or(0.0, |bytes| (LENGTH + bytes.len()) as f64));
    let whole = [&few, &tally].map(|tally| tally.bytes() as f64);
    let (seconds, (summary, json)) = clocked(times, || {
        let summary = CellPart::new(experiment, index, &tally).cell;
        let json = stored(&summary).to_string().len();
        (summary, json)
    });
    let mut table = [0.0; 3];
    if kept && let Ok(writer) = TrialTable::new(experiment) {
        let cost = |trials: usize| {
            let mut rows = found.rows.clone();
            rows.truncate(trials);
            let (seconds, bytes) = clocked(times, || writer.file_of(index, rows.clone()));
            [bytes.map_or(0.0, |bytes| bytes.len() as f64), seconds]
        };
        let (few, all) = (cost(trials / 4), cost(trials));
        let more = ((trials - trials / 4) * experiment.output_count()).max(1) as f64;
        let [bytes, seconds] = [0, 1].map(|i| ((all[i] - few[i]) / more).max(0.0));
        let rows = bytes * found.rows.len() as f64;
        table = [bytes, (all[0] - rows).max(0.0), seconds];
    }
    let count = trials.max(1) as f64;
    let of_block = Sampled {
        block: block_size(experiment, index) as f64,
        trials: count,
        deterministic: cell.is_deterministic(),
        tally: tally_seconds,
        encode,
        decode,
        summary: seconds,
        write_row: table[2],
        buffers: experiment.thread_bytes(index) as f64,
        tally_bytes: [whole, tally_stored].map(|[few, all]| Growing { few, all }),
        row_bytes: [
            found.rows.bytes() as f64 / count,
            (bytes.len() as f64 - tally_stored[1]) / count,
        ],
        summary_bytes: json as f64,
        parquet: [table[0], table[1]],
        ..Sampled::default()
    };
    (of_block, summary)
}
