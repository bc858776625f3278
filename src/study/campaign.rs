//! A study in a folder: what is there already, what is missing, and the results of it all.

use super::blocks::{BlockError, BlockFolder, Content, EncodedBlock, StoredBlock, discard};
use super::engine::Engine;
use super::experiment::Experiment;
use super::file::{FileError, Store, TrialRule, Until, UntilDecided, UntilStatistic};
use super::folder::{FolderError, ResultsFolder};
use super::rows::Rows;
use super::runner::{Block, Delivery, Keep, RunError, Span, pool, run_spans};
use super::spent::{Spent, Watch};
use super::store::{StoreError, write_summary};
use super::summary::{CellSeries, CellSummary, SlopeStatistics, Summary};
use super::tally::CellTally;
use super::trial_table::{TrialTable, TrialWriter};
use crate::files::Kind;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// What happens in a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// So many trials are wanted in all, so many of them are there already.
    Planned {
        /// Wanted.
        trials: u64,
        /// There already.
        done: u64,
    },
    /// A block was computed and stored.
    Block {
        /// Trials.
        trials: u64,
        /// Rows with a failure.
        failures: u64,
        /// Where the time went.
        spent: Spent,
    },
    /// All trials of a cell are there.
    Cell,
    /// The results are there; putting them together took the threads so long.
    Concluded(Duration),
}

/// Why a campaign ended.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// The folder or a file in it.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The rule for the number of trials.
    #[error(transparent)]
    Rule(#[from] FileError),
    /// A block file.
    #[error(transparent)]
    Block(#[from] BlockError),
    /// A Parquet file.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The threads, or the stop flag.
    #[error(transparent)]
    Run(#[from] RunError<BlockError>),
    /// The `stop` flag was raised while results were put together: all trials are there, no result was written.
    #[error("interrupted while the results were put together")]
    Stopped,
    /// Fewer trials are asked for than are there.
    #[error(
        "{folder}: holds trials of cell {cell} up to trial {there}, more than {asked}; take another folder for fewer"
    )]
    Fewer {
        /// The folder.
        folder: String,
        /// The cell.
        cell: usize,
        /// The end of the last block there.
        there: u64,
        /// Trials asked for.
        asked: u64,
    },
}

/// How a study is run; no result depends on it.
#[derive(Clone, Copy, Debug, Default)]
pub struct RunOptions {
    /// Threads.
    pub threads: usize,
    /// Trials in a block.
    pub block: Option<u64>,
    /// Whether damaged blocks are computed again.
    pub repair: bool,
    /// Whether everything is computed anew, and no block is left, whatever ends the run.
    pub fresh: bool,
    /// Whether results of any design that are there are removed first.
    pub replace: bool,
    /// The names of the figures that are written with the results.
    pub figures: &'static [&'static str],
}

/// A study in its folder.
pub struct Campaign<'e> {
    experiment: &'e Experiment,
    rule: TrialRule,
    options: RunOptions,
    folder: ResultsFolder,
    blocks: BlockFolder<'e>,
    /// For every cell the blocks that are there, ascending.
    stored: Vec<Vec<StoredBlock>>,
}

impl<'e> Campaign<'e> {
    /// Opens a folder for a study, refusing one of another design.
    ///
    /// # Errors
    /// [`CampaignError`].
    pub fn open(
        path: &Path,
        experiment: &'e Experiment,
        rule: TrialRule,
        options: RunOptions,
    ) -> Result<Self, CampaignError> {
        if let TrialRule::Until(until) = &rule {
            experiment.target(until)?;
        }
        let folder = ResultsFolder::open(path)?;
        if options.replace {
            folder.clear(options.figures)?;
        }
        if options.fresh {
            folder.check_blocks()?;
        }
        let design = experiment.stamped_design();
        folder.claim_design(&design, options.figures)?;
        if options.fresh {
            folder.remove_blocks()?;
            folder.claim_design(&design, options.figures)?;
        }
        let blocks = BlockFolder::open(path, experiment)?;
        let (mut found, mut damaged) = blocks.list()?;
        if options.repair {
            // A whole file may still hold what this program cannot decode.
            found.retain(|block| match blocks.read(block) {
                Err(error @ BlockError::Damaged { .. }) => {
                    damaged.push(error);
                    false
                }
                _ => true,
            });
        }
        for error in damaged {
            match &error {
                BlockError::Damaged { path, .. } if options.repair => discard(path)?,
                _ => return Err(error.into()),
            }
        }
        let mut stored = vec![Vec::new(); experiment.cells.len()];
        for block in found {
            stored[block.span.cell].push(block);
        }
        let campaign = Self {
            experiment,
            rule,
            options,
            folder,
            blocks,
            stored,
        };
        campaign.check_extent()?;
        Ok(campaign)
    }

    fn extent(&self, cell: usize) -> u64 {
        self.stored[cell]
            .last()
            .map_or(0, |block| block.span.trials.end)
    }

    fn check_extent(&self) -> Result<(), CampaignError> {
        let (_, asked) = self.rule.extent();
        for cell in 0..self.stored.len() {
            let there = self.extent(cell);
            let asked = self.experiment.trials_of(cell, asked);
            if there > asked {
                let folder = self.folder.path().display().to_string();
                return Err(CampaignError::Fewer {
                    folder,
                    cell,
                    there,
                    asked,
                });
            }
        }
        Ok(())
    }

    /// Computes what is missing, then writes the results with `figures`: names and contents of more files. What is
    /// finished stays, whatever ends the run. `is_decided` tells whether results decide the claim of the rule.
    ///
    /// # Errors
    /// [`CampaignError`].
    pub fn run(
        mut self,
        stop: &AtomicBool,
        mut on_event: impl FnMut(Event),
        is_decided: impl Fn(&Summary) -> bool,
        figures: impl Fn(&Summary) -> Vec<(String, String)>,
    ) -> Result<Summary, CampaignError> {
        let mut targets = self.first_targets();
        loop {
            self.compute(&targets, stop, &mut on_event)?;
            let raised = match &self.rule {
                TrialRule::Fixed(_) => false,
                TrialRule::Until(until) => self.raise_unknown(&mut targets, until, stop)?,
                TrialRule::Decided(until) => {
                    let decided = || Ok(is_decided(&self.summary(stop)?));
                    self.raise_all(&mut targets, until, decided)?
                }
            };
            if !raised {
                break;
            }
        }
        let (threads, mut watch) = (self.options.threads.max(1), Watch::start());
        let summary = self.conclude(&targets, stop, figures)?;
        on_event(Event::Concluded(watch.lap() * threads as u32));
        Ok(summary)
    }

    /// Where each cell begins: a fixed number, or the first step of the rule that covers what is
    /// there. A step is only left behind when its target was missed, so the steps before need no
    /// second look. A deterministic cell has one trial, whatever the rule.
    fn first_targets(&self) -> Vec<u64> {
        let first = |cell: usize| match &self.rule {
            TrialRule::Fixed(trials) => self.experiment.trials_of(cell, *trials),
            TrialRule::Until(until) => {
                let mut target = self.experiment.trials_of(cell, until.minimum);
                while target < self.extent(cell) {
                    target = next_step(target, until);
                }
                target
            }
            TrialRule::Decided(until) => {
                let there = (0..self.stored.len()).map(|cell| self.extent(cell)).max();
                let mut target = until.minimum;
                while target < there.unwrap_or(0) {
                    target = until.next(target);
                }
                self.experiment.trials_of(cell, target)
            }
        };
        (0..self.stored.len()).map(first).collect()
    }

    /// Doubles the trials of every cell where a claim is not decided; false where it is, or where
    /// there are no more.
    fn raise_all(
        &self,
        targets: &mut [u64],
        until: &UntilDecided,
        is_decided: impl Fn() -> Result<bool, CampaignError>,
    ) -> Result<bool, CampaignError> {
        let most = targets.iter().max().copied().unwrap_or(0);
        let next = until.next(most);
        let raised = |cell: usize| self.experiment.trials_of(cell, next);
        let more = (0..targets.len()).any(|cell| raised(cell) > targets[cell]);
        if !more || is_decided()? {
            return Ok(false);
        }
        (0..targets.len()).for_each(|cell| targets[cell] = raised(cell));
        Ok(true)
    }

    /// The summary of what is there.
    fn summary(&self, stop: &AtomicBool) -> Result<Summary, CampaignError> {
        Ok(self.read_tallies(stop)?.summary(self.experiment))
    }

    /// Doubles the trials of every cell whose measure is not known well enough; false where none is left.
    fn raise_unknown(
        &self,
        targets: &mut [u64],
        until: &Until,
        stop: &AtomicBool,
    ) -> Result<bool, CampaignError> {
        let mut raised = false;
        for (cell, target) in targets.iter_mut().enumerate() {
            go_on(stop)?;
            let most = self.experiment.trials_of(cell, until.maximum);
            if *target < most && !self.is_known(cell, until)? {
                *target = next_step(*target, until);
                raised = true;
            }
        }
        Ok(raised)
    }

    fn is_known(&self, cell: usize, until: &Until) -> Result<bool, CampaignError> {
        let (output, measure) = self.experiment.target(until)?;
        let tally = self.blocks.tally(&self.stored[cell])?;
        let sample = &tally.outputs[output].samples[measure];
        let (value, mcse) = match until.statistic {
            UntilStatistic::Median => {
                let quantile = sample.quantile(0.5, until.until.worse());
                (quantile.value, quantile.mcse)
            }
            UntilStatistic::Mean => (sample.mean().value, sample.mean().mcse),
            UntilStatistic::Rmse => (sample.rmse().value, sample.rmse().mcse),
        };
        Ok(mcse <= until.relative_mcse * value.abs())
    }

    /// The ranges of a cell's trials below `target` that no block covers.
    fn missing(&self, cell: usize, target: u64) -> impl Iterator<Item = Span> {
        let stored = self.stored[cell].iter().map(|block| &block.span.trials);
        let ends = std::iter::once(0).chain(stored.clone().map(|trials| trials.end));
        let starts = stored.map(|trials| trials.start).chain([target]);
        ends.zip(starts)
            .filter(|(from, to)| from < to)
            .map(move |(from, to)| Span {
                cell,
                trials: from..to,
            })
    }

    fn compute(
        &mut self,
        targets: &[u64],
        stop: &AtomicBool,
        on_event: &mut impl FnMut(Event),
    ) -> Result<(), CampaignError> {
        let cells = 0..targets.len();
        let missing: Vec<Span> = cells
            .flat_map(|cell| self.missing(cell, targets[cell]))
            .collect();
        let trials = targets.iter().sum();
        let mut left = vec![0; targets.len()];
        for span in &missing {
            left[span.cell] += span.len();
        }
        let done = trials - left.iter().sum::<u64>();
        on_event(Event::Planned { trials, done });
        left.iter()
            .filter(|left| **left == 0)
            .for_each(|_| on_event(Event::Cell));
        let keep = self.experiment.file.store == Store::Trials;
        let RunOptions { threads, block, .. } = self.options;
        let experiment = self.experiment;
        let (blocks, stored) = (&self.blocks, &mut self.stored);
        let rows_or_tally = if keep { Keep::Rows } else { Keep::Tally };
        let encode = |block: Block| Computed::of(block, keep, blocks);
        let store = |computed: Computed| {
            let (cell, trials) = (computed.span.cell, computed.span.len());
            let mut watch = Watch::start();
            let of_cell = &mut stored[cell];
            of_cell.push(computed.encoded?.write()?);
            left[cell] -= trials;
            if left[cell] == 0 {
                of_cell.sort_by_key(|block| block.span.trials.start);
                if !keep && of_cell.len() > 1 {
                    *of_cell = vec![blocks.consolidate(of_cell)?];
                }
            }
            let mut spent = computed.spent;
            spent.storage += watch.lap();
            on_event(Event::Block {
                trials,
                failures: computed.failures,
                spent,
            });
            if left[cell] == 0 {
                on_event(Event::Cell);
            }
            Ok(())
        };
        let spans = (&missing[..], block);
        run_spans(
            experiment,
            spans,
            rows_or_tally,
            threads,
            stop,
            encode,
            store,
        )?;
        Ok(())
    }

    /// Writes the results, one cell in memory at a time. Nothing is published before all of it is written, so it can
    /// be stopped at any block.
    fn conclude(
        mut self,
        targets: &[u64],
        stop: &AtomicBool,
        figures: impl Fn(&Summary) -> Vec<(String, String)>,
    ) -> Result<Summary, CampaignError> {
        let experiment = self.experiment;
        let parts = if experiment.file.store == Store::Trials {
            let (file, path) = self.folder.stage("trials.parquet", Kind::Parquet)?;
            self.write_trials(file, path, stop)?
        } else {
            self.read_tallies(stop)?
        };
        let summary = parts.summary(experiment);
        let (file, path) = self.folder.stage("summary.parquet", Kind::Parquet)?;
        write_summary(&file, &path, experiment, &summary)?;
        self.folder
            .write_json("summary.json", Kind::Summary, &summary)?;
        for (name, content) in figures(&summary) {
            self.folder.write(&name, Kind::Figure, content.as_bytes())?;
        }
        self.folder.write_manifest(&manifest(experiment, targets))?;
        go_on(stop)?;
        self.folder.publish()?;
        Ok(summary)
    }

    /// What the summary takes of every cell, of as many at a time as there are threads.
    fn read_tallies(&self, stop: &AtomicBool) -> Result<Parts, CampaignError> {
        let threads = self.options.threads.max(1);
        let mut parts = Parts::default();
        let of_cell = |cell: usize| {
            go_on(stop)?;
            let tally = self.blocks.tally(&self.stored[cell])?;
            Ok(Part::of(self.experiment, cell, &tally))
        };
        let pool = pool(threads)?;
        for first in (0..self.stored.len()).step_by(threads) {
            let cells = first..self.stored.len().min(first + threads);
            let found: Vec<Result<Part, CampaignError>> =
                pool.install(|| cells.into_par_iter().map(of_cell).collect());
            for part in found {
                parts.add(part?);
            }
        }
        Ok(parts)
    }

    /// Reads every block once: what the summary takes of it, and its rows, where they are kept.
    fn read(
        &self,
        stop: &AtomicBool,
        mut on_rows: impl FnMut(usize, Rows) -> Result<(), StoreError>,
    ) -> Result<Parts, CampaignError> {
        let mut parts = Parts::default();
        for (cell, blocks) in self.stored.iter().enumerate() {
            let mut tally = CellTally::default();
            for block in blocks {
                go_on(stop)?;
                let content = self.blocks.read(block)?;
                tally.merge(&content.tally);
                if let Some(rows) = content.rows {
                    on_rows(cell, rows)?;
                }
            }
            parts.add(Part::of(self.experiment, cell, &tally));
        }
        Ok(parts)
    }

    /// The same, and writes the rows to a table.
    fn write_trials(
        &self,
        file: File,
        path: PathBuf,
        stop: &AtomicBool,
    ) -> Result<Parts, CampaignError> {
        let threads = self.options.threads.max(1);
        let table = TrialTable::new(self.experiment).map_err(|source| StoreError::Parquet {
            path: path.clone(),
            source,
        })?;
        pool(threads)?.in_place_scope(|scope| {
            let mut writer = TrialWriter::new(&table, file, path, threads)?;
            let parts = self.read(stop, |cell, rows| writer.write(scope, cell, rows))?;
            writer.finish(scope)?;
            Ok(parts)
        })
    }
}

/// A block on its way from the thread that computed it to its file.
struct Computed {
    span: Span,
    failures: u64,
    spent: Spent,
    encoded: Result<EncodedBlock, BlockError>,
}

impl Computed {
    fn of(block: Block, keep: bool, blocks: &BlockFolder<'_>) -> Self {
        let mut watch = Watch::start();
        let Block {
            span,
            rows,
            tally,
            mut spent,
        } = block;
        let outputs = tally.outputs.iter();
        let failures = outputs.map(|output| output.outcomes.failed()).sum();
        let rows = keep.then_some(rows);
        let encoded = blocks.encode(span.clone(), &Content { tally, rows });
        spent.storage += watch.lap();
        Self {
            span,
            failures,
            spent,
            encoded,
        }
    }
}

impl Delivery for Computed {
    fn trials(&self) -> u64 {
        self.span.len()
    }
}

/// What the summary takes of every cell.
#[derive(Default)]
struct Parts {
    cells: Vec<CellSummary>,
    slopes: Vec<SlopeStatistics>,
    series: Vec<CellSeries>,
}

/// The same of one cell.
struct Part {
    cell: CellSummary,
    slopes: SlopeStatistics,
    series: CellSeries,
}

impl Part {
    fn of(experiment: &Experiment, cell: usize, tally: &CellTally) -> Self {
        Self {
            cell: CellSummary::of(experiment, cell, tally),
            slopes: SlopeStatistics::of(experiment, tally),
            series: tally.whole_series(),
        }
    }
}

impl Parts {
    /// Adds the next cell.
    fn add(&mut self, part: Part) {
        self.cells.push(part.cell);
        self.slopes.push(part.slopes);
        self.series.push(part.series);
    }

    fn summary(self, experiment: &Experiment) -> Summary {
        Summary::of(experiment, self.cells, &self.slopes, &self.series)
    }
}

impl Drop for Campaign<'_> {
    fn drop(&mut self) {
        if self.options.fresh {
            // Nothing more can be done here; the next run tries again.
            let _ = self.folder.remove_blocks();
        }
    }
}

/// An error where the flag is raised.
fn go_on(stop: &AtomicBool) -> Result<(), CampaignError> {
    if stop.load(Ordering::Relaxed) {
        return Err(CampaignError::Stopped);
    }
    Ok(())
}

fn next_step(trials: u64, until: &Until) -> u64 {
    trials.saturating_mul(2).min(until.maximum)
}

/// What made the results: nothing of the time or the threads, and of the host only what faer's bits depend on.
fn manifest(experiment: &Experiment, targets: &[u64]) -> Value {
    let trials = match targets {
        [first, rest @ ..] if rest.iter().all(|other| other == first) => json!(first),
        _ => json!(targets),
    };
    let engines = (0..experiment.cells.len()).map(|cell| experiment.engine(cell));
    let engines: Vec<Engine> = engines.flatten().collect();
    let by_faer = engines.contains(&Engine::Faer);
    let engines = match &engines[..] {
        [first, rest @ ..] if rest.iter().all(|other| other == first) => json!(first),
        _ => json!(engines),
    };
    json!({
        "program": "asobench",
        "version": env!("CARGO_PKG_VERSION"),
        "git_revision": option_env!("ASOBENCH_GIT_REVISION"),
        "trials": trials,
        "engine": engines,
        "faer_instructions": by_faer.then(Engine::faer_instructions),
        "experiment": experiment.file,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::file::ExperimentFile;

    /// The flag that is raised while results are put together leaves none, and the trials.
    #[test]
    fn putting_results_together_can_be_stopped() {
        let text = "trials = 4\nstore = \"trials\"\n[settings]\neta = [0, 5]\nwindow = 18";
        let experiment = Experiment::new(ExperimentFile::parse(text).unwrap()).unwrap();
        let place = tempfile::tempdir().unwrap();
        let files = || std::fs::read_dir(place.path()).unwrap().count();
        let stop = AtomicBool::new(false);
        let run = |stop_at_the_end: bool| {
            let rule = experiment.file.trials.clone();
            let campaign =
                Campaign::open(place.path(), &experiment, rule, RunOptions::default()).unwrap();
            let mut cells = 0;
            let on_event = |event| {
                cells += usize::from(event == Event::Cell);
                if stop_at_the_end && cells == 2 {
                    stop.store(true, Ordering::Relaxed);
                }
            };
            campaign.run(&stop, on_event, |_| true, |_| Vec::new())
        };
        let error = run(true).unwrap_err();
        assert!(matches!(error, CampaignError::Stopped), "{error}");
        assert_eq!(files(), 2, "the lock and the blocks");
        // All trials are there, so only the results are missing.
        stop.store(false, Ordering::Relaxed);
        assert_eq!(run(false).unwrap().cells.len(), 2);
        assert_eq!(files(), 2 + 4);
    }

    #[test]
    fn a_rule_for_what_is_not_there_is_refused() {
        let experiment = Experiment::new(ExperimentFile::parse("trials = 4").unwrap()).unwrap();
        let place = tempfile::tempdir().unwrap();
        let rule = "trials = { until = \"e_a\", output = \"iv(9)\", relative_mcse = 1, minimum = 1, maximum = 2 }";
        let rule = ExperimentFile::parse(rule).unwrap().trials;
        let opened = Campaign::open(place.path(), &experiment, rule, RunOptions::default());
        let error = opened.err().map(|error| error.to_string());
        assert!(
            error.is_some_and(|error| error.contains("trials.output") && error.contains("iv(9)"))
        );
        assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 0);
    }

    #[test]
    fn fewer_trials_than_there_are() {
        let error = CampaignError::Fewer {
            folder: "out".to_owned(),
            cell: 0,
            there: 40,
            asked: 20,
        };
        assert!(
            error
                .to_string()
                .contains("trials of cell 0 up to trial 40, more than 20")
        );
    }
}
