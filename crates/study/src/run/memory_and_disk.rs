//! The forecast of memory and disk space that a run of a study needs, computed from its design alone.
//!
//! Every term is a count from the design times a size: that of a type, or of its stored form. Sizes that no type gives
//! are measured; they are the constants here.

use crate::design::cell::{Cell, Source};
use crate::design::curve_bins::curve_bytes;
use crate::design::experiment::Experiment;
use crate::design::file::engine::Engine;
use crate::design::file::experiment_file::Store;
use crate::design::file::grid::{conditions, matches};
use crate::outcome::coefficients;
use crate::outcome::coefficients::Kept;
use crate::run::runner::block_size;
use asobench_identification::metric::{
    JACKKNIFE_GROUPS, Jackknife, Paired, PairedStatistics, Sample, Statistics, expected_bins,
};
use asobench_identification::real::MOST_LANES;

/// Bytes of the program with its libraries.
const PROGRAM: f64 = 38e6;
/// Bytes of a cell's settings.
const SETTINGS: f64 = 2.5e3;
/// Bytes of a cell's process and its generators.
const PROCESS: f64 = 4e3;
/// Bytes of an output's name and counts in a summary.
const OUTPUT: f64 = 250.0;
/// Entries in a node of a map; memory is allocated for whole nodes.
const NODE: usize = 11;
/// Bytes of a bin of a sketch, in memory and in a file.
const BIN: [f64; 2] = [16.0, 2.7];
/// Bytes in a file, without the bins, of a sample (counts, extremes and four exact sums) and of a comparison.
const SAMPLE_STORED: f64 = 135.0;
const PAIRED_STORED: f64 = 420.0;
/// Bytes of a row in a block file in addition to its values.
const ROW_STORED: f64 = 1.2;
/// Bytes of a row in trials.parquet in addition to its values.
const ROW_AT_MOST: f64 = 2.0;
/// For a group of trials.parquet: bytes of a row in addition to its numbers; rows; copies in memory.
const LABELS: f64 = 60.0;
const GROUP: f64 = 65_536.0;
const COPIES: f64 = 3.0;
/// Bytes in summary.json and summary.parquet of a cell's settings, a measure of an output, a share, and a quantile of a
/// curve.
const SETTINGS_STORED: f64 = 900.0;
const STATISTICS_STORED: f64 = 720.0 + 145.0;
const SHARE_STORED: f64 = 120.0;
const QUANTILE_STORED: f64 = 13.0;
/// Bytes of a report: a line of its results.csv, and one of another table; its page, pictures (which the page has too)
/// and description, whatever the study; what these have of an output in a cell, up to the number that pictures can
/// show; of a claim, with its picture and its tables for papers; of a cell of a claim. As 33 studies have them, within
/// a factor of two.
const LINE: f64 = 240.0;
const SHORT_LINE: f64 = 90.0;
const PAGES: f64 = 1e5;
const SHOWN: f64 = 1.5e3;
const MOST_SHOWN: f64 = 150.0;
const CLAIM: f64 = 2e4;
const CLAIM_CELL: f64 = 4e2;
/// A file occupies whole blocks of the disk. On average it wastes half a block.
const CLUSTER: f64 = 2048.0;

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

/// The counts of an experiment.
struct Counts<'e> {
    experiment: &'e Experiment,
    outputs: f64,
    measures: usize,
    pairs: f64,
    slopes: f64,
    /// Measures with slopes.
    sloped: f64,
    kept: bool,
    /// The largest number of trials of a cell.
    trials: f64,
}

impl<'e> Counts<'e> {
    pub(crate) fn new(experiment: &'e Experiment, trials: u64) -> Self {
        let file = &experiment.file;
        Self {
            experiment,
            outputs: experiment.output_count() as f64,
            measures: file.measures.len(),
            pairs: experiment.compare.len() as f64,
            slopes: file.slopes.len() as f64,
            sloped: experiment.sloped_measures().len() as f64,
            kept: file.store == Store::Trials,
            trials: trials as f64,
        }
    }

    /// Returns the number of values of an output in a cell: measures, and signed errors of a and h.
    fn values(&self, cell: &Cell) -> f64 {
        self.measures as f64 + self.parameters(cell)
    }

    fn parameters(&self, cell: &Cell) -> f64 {
        coefficients::columns(&self.experiment.file, cell.order) as f64
    }

    /// Returns the number of trials in a full block.
    fn block(&self, index: usize) -> f64 {
        (block_size(self.experiment, index) as f64).min(self.trials)
    }

    /// Returns the bytes of a tally of so many trials of a cell: in memory, and in a file.
    fn tally(&self, cell: &Cell, trials: f64) -> [f64; 2] {
        let samples = self.outputs * self.values(cell);
        let groups = self.sloped * self.outputs * JACKKNIFE_GROUPS as f64;
        let pairs = self.pairs * self.measures as f64;
        let (all, part) = (
            expected_bins(trials),
            expected_bins(trials / JACKKNIFE_GROUPS as f64),
        );
        let mut curves = [0.0; 2];
        if self.experiment.file.curves {
            // Each sample has its own histogram, 64 times coarser than a sketch.
            let bins = (2 * cell.horizon) as f64 * trials.min(all / 16.0);
            curves = [curve_bytes(cell.horizon) as f64, 5.0 * bins];
        }
        let sizes = [
            (size_of::<Sample>() as f64, size_of::<Paired>() as f64),
            (SAMPLE_STORED, PAIRED_STORED),
        ];
        [0, 1].map(|i| {
            let (sample, paired) = sizes[i];
            samples * (sample + BIN[i] * all)
                + groups * (sample + BIN[i] * part)
                + pairs * (paired + 2.0 * BIN[i] * all)
                + curves[i]
        })
    }

    /// Returns the bytes in memory of rows of trials with their signed errors.
    fn rows(&self, cell: &Cell, trials: f64) -> f64 {
        let values = self.experiment.measures_asked().len() as f64 + self.parameters(cell);
        let row = 1.0 + values * size_of::<f64>() as f64;
        trials * self.outputs * row
    }

    /// Returns the bytes of rows of trials of a cell in block files, if they are kept.
    fn rows_stored(&self, cell: &Cell, trials: f64) -> f64 {
        let file = &self.experiment.file;
        let values = file.measures.len() + coefficients::kept(file, cell.order);
        if self.kept {
            trials * self.outputs * ((size_of::<f64>() * values) as f64 + ROW_STORED)
        } else {
            0.0
        }
    }

    /// Returns the bytes of a thread's buffers for trials of a cell.
    fn record(&self, index: usize) -> f64 {
        let cell = &self.experiment.cells[index];
        let bytes = match self.experiment.engine(index) {
            Ok(Engine::Lanes) => 4 * MOST_LANES * size_of::<f64>() * cell.horizon,
            _ => cell.record_bytes(),
        };
        bytes as f64
    }

    /// Returns the bytes in memory of a cell's summary and of what the slopes keep of it.
    fn summary(&self, cell: &Cell) -> f64 {
        let map = |entry: usize| (self.measures.div_ceil(NODE) * NODE * (entry + 8)) as f64;
        let file = &self.experiment.file;
        let parameters = self.parameters(cell) * (size_of::<Statistics>() + 40) as f64;
        let outputs = self.outputs * (OUTPUT + map(size_of::<Statistics>()) + parameters);
        let pairs = self.pairs * (OUTPUT + map(size_of::<PairedStatistics>()));
        let bounds = file.bounds.len() as f64 * (OUTPUT + self.outputs * 100.0);
        let slopes = self.slopes * self.outputs * (size_of::<Option<Jackknife>>() as f64 + 8.0);
        let curves = if file.curves {
            6 * 16 * cell.horizon
        } else {
            0
        };
        SETTINGS + outputs + pairs + bounds + slopes + curves as f64
    }

    /// Returns the bytes of the same in summary.json and summary.parquet.
    fn summary_stored(&self, cell: &Cell) -> f64 {
        let file = &self.experiment.file;
        let values = self.outputs * self.values(cell) + self.pairs * self.measures as f64;
        let shares = file.bounds.len() as f64 * self.outputs + self.slopes * self.outputs;
        let curves = if file.curves { 6 * cell.horizon } else { 0 };
        SETTINGS_STORED
            + values * STATISTICS_STORED
            + shares * SHARE_STORED
            + curves as f64 * QUANTILE_STORED
    }

    /// Returns the bytes of the page of a report and of what belongs to it and to its claims.
    fn pages(&self) -> f64 {
        let cells = &self.experiment.cells;
        let shown = (cells.len() as f64 * self.outputs).min(MOST_SHOWN);
        let claims = self.experiment.file.claims.iter().map(|claim| {
            let conditions = conditions(&claim.cells);
            let judged = cells
                .iter()
                .filter(|cell| matches(&cell.settings, &conditions));
            CLAIM + CLAIM_CELL * judged.count() as f64
        });
        PAGES + SHOWN * shown + claims.sum::<f64>()
    }

    /// Returns the bytes of a cell's lines in the tables of a report.
    fn report(&self, cell: &Cell) -> f64 {
        let bounds = self.experiment.file.bounds.len() as f64;
        let pairs = 2.0 * self.pairs * self.measures as f64;
        self.outputs * self.values(cell) * LINE + (bounds * self.outputs + pairs) * SHORT_LINE
    }
}

/// Returns an upper limit of the memory, in bytes, of a run with so many trials of each cell on so many threads.
///
/// While trials are computed, each thread holds a record, a block that it computes and encodes, and one that waits. The
/// calling thread holds the block that it writes. While results are put together, the memory holds the summaries of all
/// cells, two tallies of a cell that are merged, a block that is being read, and a few groups of rows of
/// trials.parquet.
pub fn memory_of(experiment: &Experiment, trials: u64, threads: usize) -> f64 {
    let counts = Counts::new(experiment, trials);
    let (mut computing, mut merging, mut cells) = (0.0_f64, 0.0_f64, 0.0);
    for (index, cell) in experiment.cells.iter().enumerate() {
        let trials = counts.block(index);
        let [tally, stored] = counts.tally(cell, trials);
        let rows = counts.rows(cell, trials);
        let encoded = stored + counts.rows_stored(cell, trials);
        let thread = counts.record(index) + rows + tally + 2.0 * encoded;
        computing = computing.max(threads as f64 * thread + encoded);
        let [merged, _] = counts.tally(cell, counts.trials);
        let read = tally + encoded + if counts.kept { rows } else { 0.0 };
        merging = merging.max(2.0 * merged + read);
        cells += SETTINGS + PROCESS + counts.summary(cell);
    }
    if counts.kept {
        let rows = experiment.cells.len() as f64 * counts.trials * counts.outputs;
        let row = numbers_of(experiment) + LABELS;
        merging += COPIES * (threads + 2) as f64 * rows.min(GROUP) * row;
    }
    PROGRAM + cells + computing.max(merging)
}

/// Returns the largest size in bytes of a row of trials.parquet; equal numbers are stored once.
pub fn row_of(experiment: &Experiment) -> f64 {
    ROW_AT_MOST + numbers_of(experiment)
}

/// Returns the bytes of the measures and coefficients of such a row.
fn numbers_of(experiment: &Experiment) -> f64 {
    let file = &experiment.file;
    let coefficients = Kept::new(file, &experiment.cells).width;
    (size_of::<f64>() * (file.measures.len() + coefficients)) as f64
}

/// Returns the bytes on disk of a run with so many trials of each cell, if a row of trials.parquet takes `row` bytes.
pub fn disk_of(experiment: &Experiment, trials: u64, row: f64) -> Disk {
    let counts = Counts::new(experiment, trials);
    let mut disk = Disk {
        report: counts.pages(),
        ..Disk::default()
    };
    for (index, cell) in experiment.cells.iter().enumerate() {
        let trials = counts.trials;
        // Blocks without rows are merged into one when their cell is complete.
        let block = if counts.kept {
            counts.block(index)
        } else {
            trials
        };
        let [_, stored] = counts.tally(cell, block);
        disk.blocks += (trials / block).ceil() * (stored + CLUSTER);
        disk.blocks += counts.rows_stored(cell, trials);
        if counts.kept {
            disk.trials += trials * counts.outputs * row;
        }
        disk.summary += counts.summary_stored(cell);
        disk.report += counts.report(cell);
    }
    disk
}

impl Experiment {
    /// Returns the bytes that a thread allocates for trials of a cell before it draws the first, as far as they grow
    /// with the settings: the record, the window of every method, and curves; in continuous time the disturbance.
    pub fn thread_bytes(&self, cell: usize) -> usize {
        const NUMBER: usize = size_of::<f64>();
        let (engine, cell) = (self.engine(cell), &self.cells[cell]);
        let Cell {
            order,
            window,
            horizon,
            ..
        } = *cell;
        // Stage 7's output, and the rows of stage 6 that are solved by themselves.
        let methods = self.methods.len() * window * (order + 2) * NUMBER;
        // The batch of a program's records, as it is drawn and as it is sent.
        let batches = self
            .programs
            .iter()
            .map(|program| program.options.batch as usize);
        let methods = methods + batches.sum::<usize>() * window * 3 * 2 * NUMBER;
        let curve = if self.file.curves { horizon } else { 0 };
        let (samples, lanes) = match (&cell.source, engine) {
            (Source::Continuous(of), _) => return NUMBER * of.disturbance_numbers(),
            (_, Ok(Engine::Lanes)) => (2 * horizon + window + 4 * curve, MOST_LANES),
            // The noise filter's scratch.
            _ => (cell.record_bytes() / NUMBER + horizon + curve, 1),
        };
        let curves = if curve > 0 { curve_bytes(horizon) } else { 0 };
        samples * lanes * NUMBER + methods * lanes + curves
    }
}
