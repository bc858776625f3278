//! What a run of a study needs, told from its design alone: memory, and room on disk.
//!
//! Every term is a count of the design times the size of a type, or of what it is stored as. Sizes
//! that no type tells are measured ones; they stand as constants here.

use super::curves::Curves;
use super::file::Store;
use super::{Cell, Engine, Experiment, block_size, coefficients};
use crate::metric::{
    JACKKNIFE_GROUPS, Jackknife, Paired, PairedStatistics, Sample, Statistics, expected_bins,
};
use crate::real::MOST_LANES;

/// The program with its libraries.
const PROGRAM: f64 = 38e6;
/// A cell's settings.
const SETTINGS: f64 = 2.5e3;
/// A cell's process, and what draws from it.
const PROCESS: f64 = 4e3;
/// An output's name and counts in a summary.
const OUTPUT: f64 = 250.0;
/// Entries of a node of a map: whole nodes are allocated.
const NODE: usize = 11;
/// A bin of a sketch, in memory and in a file.
const BIN: [f64; 2] = [16.0, 2.7];
/// In a file without their bins: a sample (counts, extremes and four exact sums), a comparison.
const SAMPLE_STORED: f64 = 135.0;
const PAIRED_STORED: f64 = 420.0;
/// A row in a block file beside its values.
const ROW_STORED: f64 = 1.2;
/// A row in trials.parquet beside its values.
const ROW_AT_MOST: f64 = 2.0;
/// Of a group of trials.parquet: bytes of a row beside its measures, rows, and how many times they
/// are in memory.
const LABELS: f64 = 60.0;
const GROUP: f64 = 65_536.0;
const COPIES: f64 = 3.0;
/// In summary.json and summary.parquet: a cell's settings, a measure of an output, a share; of a
/// curve a quantile.
const SETTINGS_STORED: f64 = 900.0;
const STATISTICS_STORED: f64 = 720.0 + 145.0;
const SHARE_STORED: f64 = 120.0;
const QUANTILE_STORED: f64 = 13.0;
/// Of a report: a line of its results.csv, one of its other tables, its page with the values.
const LINE: f64 = 240.0;
const SHORT_LINE: f64 = 90.0;
const PAGES: f64 = 2.5e5;
/// A file takes whole blocks of the disk: half of one is lost in each.
const CLUSTER: f64 = 2048.0;

/// Bytes on disk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disk {
    /// The block files.
    pub blocks: f64,
    /// trials.parquet, where trials are kept.
    pub trials: f64,
    /// summary.json and summary.parquet.
    pub summary: f64,
    /// What `asobench report` writes.
    pub report: f64,
}

impl Disk {
    /// What a run writes; it removes nothing before all of it is there.
    pub fn of_run(&self) -> f64 {
        self.blocks + self.trials + self.summary
    }
}

/// What there is to count in an experiment.
struct Counts<'e> {
    experiment: &'e Experiment,
    outputs: f64,
    measures: usize,
    pairs: f64,
    slopes: f64,
    /// Measures that slopes are of.
    sloped: f64,
    kept: bool,
    /// The most trials of a cell.
    trials: f64,
}

impl<'e> Counts<'e> {
    fn new(experiment: &'e Experiment, trials: u64) -> Self {
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

    /// Figures of an output in a cell: measures, and signed errors of a and h.
    fn values(&self, cell: &Cell) -> f64 {
        self.measures as f64 + self.parameters(cell)
    }

    fn parameters(&self, cell: &Cell) -> f64 {
        coefficients::columns(&self.experiment.file, cell.order) as f64
    }

    /// Trials of a whole block.
    fn block(&self, index: usize) -> f64 {
        (block_size(self.experiment, index) as f64).min(self.trials)
    }

    /// What is counted of so many trials of a cell: bytes in memory, and in a file.
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
            // Each sample has a histogram of its own, 64 times coarser than a sketch.
            let bins = (2 * cell.horizon) as f64 * trials.min(all / 16.0);
            curves = [Curves::bytes(cell.horizon) as f64, 5.0 * bins];
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

    /// Rows of trials with their signed errors, in memory.
    fn rows(&self, cell: &Cell, trials: f64) -> f64 {
        let values = self.experiment.measures_asked().len() as f64 + self.parameters(cell);
        let row = 1.0 + values * size_of::<f64>() as f64;
        trials * self.outputs * row
    }

    /// Rows of trials in block files, where they are kept.
    fn rows_stored(&self, trials: f64) -> f64 {
        let values = size_of::<f64>() * self.experiment.file.measures.len();
        if self.kept {
            trials * self.outputs * (values as f64 + ROW_STORED)
        } else {
            0.0
        }
    }

    /// The buffers of a thread for trials of a cell.
    fn record(&self, index: usize) -> f64 {
        let cell = &self.experiment.cells[index];
        let bytes = match self.experiment.engine(index) {
            Ok(Engine::Lanes) => 4 * MOST_LANES * size_of::<f64>() * cell.horizon,
            _ => cell.record_bytes(),
        };
        bytes as f64
    }

    /// The summary of a cell, and what the slopes keep of it, in memory.
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

    /// The same in summary.json and summary.parquet.
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

    /// Its lines in the tables of a report.
    fn report(&self, cell: &Cell) -> f64 {
        let bounds = self.experiment.file.bounds.len() as f64;
        let pairs = 2.0 * self.pairs * self.measures as f64;
        self.outputs * self.values(cell) * LINE + (bounds * self.outputs + pairs) * SHORT_LINE
    }
}

/// Bytes of memory that a run of an experiment with so many trials of each cell needs at most on so
/// many threads.
///
/// While trials are computed each thread has a record, a block that it makes and encodes, and one
/// that waits; the calling thread has the one that it writes. While results are put together there
/// are the summaries of all cells, two tallies of one that are merged, a block as it is read, and a
/// few groups of rows of trials.parquet.
pub fn memory_of(experiment: &Experiment, trials: u64, threads: usize) -> f64 {
    let counts = Counts::new(experiment, trials);
    let (mut computing, mut merging, mut cells) = (0.0_f64, 0.0_f64, 0.0);
    for (index, cell) in experiment.cells.iter().enumerate() {
        let trials = counts.block(index);
        let [tally, stored] = counts.tally(cell, trials);
        let rows = counts.rows(cell, trials);
        let encoded = stored + counts.rows_stored(trials);
        let thread = counts.record(index) + rows + tally + 2.0 * encoded;
        computing = computing.max(threads as f64 * thread + encoded);
        let [merged, _] = counts.tally(cell, counts.trials);
        let read = tally + encoded + if counts.kept { rows } else { 0.0 };
        merging = merging.max(2.0 * merged + read);
        cells += SETTINGS + PROCESS + counts.summary(cell);
    }
    if counts.kept {
        let rows = experiment.cells.len() as f64 * counts.trials * counts.outputs;
        let row = size_of::<f64>() as f64 * experiment.file.measures.len() as f64 + LABELS;
        merging += COPIES * (threads + 2) as f64 * rows.min(GROUP) * row;
    }
    PROGRAM + cells + computing.max(merging)
}

/// Bytes of a row of trials.parquet at most: equal numbers are stored once.
pub fn row_of(experiment: &Experiment) -> f64 {
    ROW_AT_MOST + (size_of::<f64>() * experiment.file.measures.len()) as f64
}

/// Bytes on disk of a run with so many trials of each cell, where a row of trials.parquet takes
/// `row` bytes.
pub fn disk_of(experiment: &Experiment, trials: u64, row: f64) -> Disk {
    let counts = Counts::new(experiment, trials);
    let mut disk = Disk {
        report: PAGES,
        ..Disk::default()
    };
    for (index, cell) in experiment.cells.iter().enumerate() {
        let trials = counts.trials;
        // Blocks without rows become one when their cell is complete.
        let block = if counts.kept {
            counts.block(index)
        } else {
            trials
        };
        let [_, stored] = counts.tally(cell, block);
        disk.blocks += (trials / block).ceil() * (stored + CLUSTER) + counts.rows_stored(trials);
        if counts.kept {
            disk.trials += trials * counts.outputs * row;
        }
        disk.summary += counts.summary_stored(cell);
        disk.report += counts.report(cell);
    }
    disk
}
