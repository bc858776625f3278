//! A study in a folder: finds what is already computed (resumes), computes the rest, and writes the results.

use crate::claim;
use crate::design::Experiment;
use crate::design::file::{Engine, Store, TrialRule};
use crate::files::Kind;
use crate::outcome::folder_layout::LOOKS;
use crate::outcome::looks::Looks;
use crate::outcome::results_folder::ResultsFolder;
use crate::outcome::rows::Rows;
use crate::outcome::spent::{Spent, Watch};
use crate::outcome::stored_results::stored_design;
use crate::outcome::summary::{CellPart, Summary};
use crate::outcome::summary_table::write_summary;
use crate::outcome::tally::CellTally;
use crate::outcome::trial_table::{StoreError, TrialTable, TrialWriter};
use crate::outcome::trials::Trials;
use crate::run::block_file::{BlockFolder, StoredBlock};
use crate::run::compute::Work;
use crate::run::event::{CampaignError, Event, go_on};
use crate::run::resume::stored;
use crate::run::rounds::Rounds;
use crate::run::runner::{Block, Span, pool};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// How a study is run. No result depends on it.
#[derive(Clone, Copy, Debug, Default)]
#[expect(clippy::struct_excessive_bools, reason = "each is an option of its own")]
pub struct RunOptions {
    /// Threads.
    pub threads: usize,
    /// Trials in a block; `None`: the default.
    pub block: Option<u64>,
    /// Whether damaged blocks are computed again.
    pub repair: bool,
    /// Whether everything is computed anew, and no block is left however the run ends. Old results are replaced once
    /// the new ones are whole.
    pub fresh: bool,
    /// Whether results of another design, or of more trials, are replaced once the new ones are whole.
    pub overwrite: bool,
    /// Whether a folder in which the study had other methods is refused.
    pub same_methods: bool,
    /// The names of the figures that are written with the results.
    pub figures: &'static [&'static str],
}

/// A study in its folder.
pub struct Campaign<'e> {
    pub(crate) experiment: &'e Experiment,
    rule: TrialRule,
    options: RunOptions,
    folder: ResultsFolder,
    pub(crate) blocks: BlockFolder<'e>,
    /// The stored blocks of every cell, ascending.
    pub(crate) stored: Vec<Vec<StoredBlock>>,
    /// The statistics that the summary needs of the cells whose trials this run has computed all.
    parts: Vec<Option<CellPart>>,
    /// The origin that the results state.
    pub(crate) origin: Origin,
    /// The looks at the folder's results before this run.
    looks: Looks,
}

/// Where results come from.
#[derive(Clone, Debug)]
pub(crate) struct Origin {
    /// The vector instructions that faer uses.
    pub(crate) faer_instructions: String,
    /// Whether trials are missing.
    pub(crate) partial: bool,
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
        if options.overwrite && !options.fresh {
            ResultsFolder::refuse_foreign(path)?;
        }
        let mut folder = ResultsFolder::open(path)?;
        // Looks at the same trials go on counting.
        let same = stored_design(path).is_none_or(|stored| stored == experiment.design());
        let (blocks, stored) = Self::trials(&mut folder, experiment, &rule, options)?;
        let forgotten = folder.replaces() && !same;
        let looks = Looks::before_run(path, experiment, forgotten)?;
        Ok(Self {
            looks,
            experiment,
            rule,
            options,
            folder,
            blocks,
            parts: vec![None; stored.len()],
            stored,
            origin: Origin {
                faer_instructions: Engine::faer_instructions().to_owned(),
                partial: false,
            },
        })
    }

    /// Finds the trials that are there. Where the folder's are others, and these are to be replaced, those of the new
    /// study that an earlier run left.
    fn trials(
        folder: &mut ResultsFolder,
        experiment: &'e Experiment,
        rule: &TrialRule,
        options: RunOptions,
    ) -> Result<(BlockFolder<'e>, Vec<Vec<StoredBlock>>), CampaignError> {
        let design = experiment.stamped_design();
        let replaceable = |error: &CampaignError| options.overwrite && error.is_of_other_results();
        let checked = folder.check_design(&design, options.figures);
        match checked.map_err(CampaignError::from) {
            Err(error) if !replaceable(&error) => return Err(error),
            Ok(()) if !options.fresh => {}
            checked => {
                if checked.is_err() {
                    folder.check_listed()?;
                }
                folder.replace(options.figures, options.fresh)?;
            }
        }
        let find = |folder: &ResultsFolder| {
            folder.claim(&design)?;
            let blocks = BlockFolder::open(&folder.place_of_blocks(), experiment)?;
            let stored = stored(&blocks, experiment.cells.len(), options.repair)?;
            let rounds = Rounds {
                experiment,
                rule,
                blocks: &blocks,
                stored: &stored,
            };
            rounds.check_extent(folder.path())?;
            Ok((blocks, stored))
        };
        let mut found = find(folder);
        // The folder's own trials are too many or of an older build; then those of an earlier run that was to replace
        // them.
        for anew in [folder.replaces(), true] {
            if found.as_ref().is_err_and(replaceable) {
                folder.check_listed()?;
                folder.replace(options.figures, anew)?;
                found = find(folder);
            }
        }
        found
    }

    /// If results of another study are replaced, the names of what else is in the folder, and stays.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn replaced_beside(&self) -> Result<Option<Vec<String>>, CampaignError> {
        let names = self.folder.replaced_beside();
        Ok(names.transpose()?)
    }

    /// Returns how many looks at the study's claims count that were made in other folders.
    pub fn looks_elsewhere(&self) -> usize {
        self.looks.elsewhere()
    }

    /// Returns the rule with the stored blocks.
    pub(crate) fn rounds(&self) -> Rounds<'_> {
        Rounds {
            experiment: self.experiment,
            rule: &self.rule,
            blocks: &self.blocks,
            stored: &self.stored,
        }
    }

    /// Computes what is missing, then writes the results together with `figures`: names and contents of further files.
    /// Finished work stays, however the run ends.
    ///
    /// # Errors
    /// [`CampaignError`].
    pub fn run(
        mut self,
        stop: &AtomicBool,
        mut on_event: impl FnMut(Event),
        figures: impl Fn(&Summary) -> Vec<(String, String)>,
    ) -> Result<Summary, CampaignError> {
        let mut targets = self.rounds().first_targets();
        loop {
            self.compute(&targets, stop, &mut on_event)?;
            let raised = self.rounds().raise(&mut targets, stop, || self.is_decided(stop))?;
            if !raised {
                break;
            }
        }
        let (threads, mut watch) = (self.options.threads.max(1), Watch::start());
        let experiment = self.experiment;
        let before = experiment.time_of_theory();
        let summary = self.conclude(&targets, stop, figures)?;
        let theory = experiment.time_of_theory().saturating_sub(before);
        let all = watch.lap() * threads as u32;
        on_event(Event::Concluded(Spent {
            theory,
            storage: all.saturating_sub(theory),
            ..Spent::default()
        }));
        Ok(summary)
    }

    /// Whether the stored blocks decide the claim of the rule.
    pub(crate) fn is_decided(&self, stop: &AtomicBool) -> Result<bool, CampaignError> {
        let (summary, file) = (self.summary(stop)?, &self.experiment.file);
        let look = self.looks.at(summary.trials(), file, &self.rule);
        Ok(claim::decides(file, &summary, look))
    }

    /// Returns the summary of the stored blocks.
    pub(crate) fn summary(&self, stop: &AtomicBool) -> Result<Summary, CampaignError> {
        Ok(Summary::new(self.experiment, self.read_tallies(stop)?))
    }

    /// Returns the summary of the stored blocks as that of a part, and stores in the announced manifest that it was
    /// looked at.
    pub(crate) fn looked_at(mut self, mut announced: Value, stop: &AtomicBool) -> Result<Summary, CampaignError> {
        self.origin.partial = true;
        let mut summary = self.summary(stop)?;
        summary.partial = true;
        announced["seen"] = true.into();
        self.folder.announce(announced)?;
        Ok(summary)
    }

    fn compute(
        &mut self,
        targets: &[u64],
        stop: &AtomicBool,
        on_event: &mut impl FnMut(Event),
    ) -> Result<(), CampaignError> {
        let (cells, rounds) = (0..targets.len(), self.rounds());
        let missing: Vec<Span> = cells.flat_map(|cell| rounds.missing(cell, targets[cell])).collect();
        let trials: u64 = targets.iter().sum();
        if !missing.is_empty() && !self.options.fresh {
            let mut manifest = manifest(self.experiment, targets, &self.origin);
            manifest["wanted"] = trials.into();
            self.folder.announce(manifest)?;
        }
        let mut left = vec![0; targets.len()];
        for span in &missing {
            left[span.cell] += span.len();
            self.parts[span.cell] = None;
        }
        let done = trials - left.iter().sum::<u64>();
        on_event(Event::Planned { trials, done });
        left.iter()
            .filter(|left| **left == 0)
            .for_each(|_| on_event(Event::Cell));
        let keep = self.experiment.file.store == Store::Trials;
        let RunOptions { threads, block, .. } = self.options;
        let experiment = self.experiment;
        let (blocks, stored, parts) = (&self.blocks, &mut self.stored, &mut self.parts);
        let work = Work {
            experiment,
            blocks,
            spans: &missing,
            block,
            threads,
        };
        work.run(stop, on_event, |written, tally| {
            let cell = written.span.cell;
            left[cell] -= written.span.len();
            stored[cell].push(written);
            if left[cell] > 0 {
                return Ok(false);
            }
            let of_cell = &mut stored[cell];
            of_cell.sort_by_key(|block| block.span.trials.start);
            if of_cell.len() == 1 {
                parts[cell] = tally.map(|tally| CellPart::new(experiment, cell, tally));
            } else if !keep {
                *of_cell = vec![blocks.consolidate(of_cell)?];
            }
            Ok(true)
        })?;
        Ok(())
    }

    /// Writes the results, with one cell in memory at a time. Publishes nothing until all is written, so it can be
    /// stopped at any block.
    pub(crate) fn conclude(
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
        let mut summary = Summary::new(experiment, parts);
        summary.partial = self.origin.partial;
        let (file, path) = self.folder.stage("summary.parquet", Kind::Parquet)?;
        write_summary(&file, &path, experiment, &summary)?;
        self.folder.write_json("summary.json", Kind::Summary, &summary)?;
        for (name, content) in figures(&summary) {
            self.folder.write(&name, Kind::Figure, content.as_bytes())?;
        }
        self.folder
            .write_manifest(manifest(experiment, targets, &self.origin))?;
        go_on(stop)?;
        // A look counts from when its results can be read.
        let planned = experiment.file.looks;
        self.looks.add_planned(summary.trials(), planned, &self.rule);
        self.folder.write(LOOKS, Kind::Looks, self.looks.text().as_bytes())?;
        self.folder.publish(!self.options.fresh)?;
        Ok(summary)
    }

    /// Reads what the summary needs of every cell and is not known, with as many cells at a time as there are threads.
    fn read_tallies(&self, stop: &AtomicBool) -> Result<Vec<CellPart>, CampaignError> {
        let of_cell = |cell: usize| {
            if let Some(part) = &self.parts[cell] {
                return Ok(part.clone());
            }
            let mut tally = self.no_trials(cell);
            tally.merge(self.blocks.tally(&self.stored[cell])?);
            Ok(self.part(cell, tally))
        };
        read_cells(self.stored.len(), self.options.threads, stop, of_cell)
    }

    /// Returns the summary of some blocks of all cells.
    pub(crate) fn summary_of(
        experiment: &Experiment,
        blocks: &BlockFolder<'_>,
        stored: &[Vec<StoredBlock>],
        threads: usize,
        stop: &AtomicBool,
    ) -> Result<Summary, CampaignError> {
        let of_cell = |cell: usize| {
            let tally = blocks.tally(&stored[cell])?;
            Ok(CellPart::new(experiment, cell, &tally))
        };
        let parts = read_cells(stored.len(), threads, stop, of_cell)?;
        Ok(Summary::new(experiment, parts))
    }

    /// Reads every block once, for the summary, and passes on its rows.
    fn read(
        &self,
        stop: &AtomicBool,
        mut on_rows: impl FnMut(usize, Rows) -> Result<(), StoreError>,
    ) -> Result<Vec<CellPart>, CampaignError> {
        let mut parts = Vec::new();
        for (cell, blocks) in self.stored.iter().enumerate() {
            let mut tally = self.no_trials(cell);
            for block in blocks {
                go_on(stop)?;
                let Block {
                    tally: of_block, rows, ..
                } = self.blocks.read(block)?;
                tally.merge(of_block);
                on_rows(cell, rows)?;
            }
            parts.push(self.part(cell, tally));
        }
        Ok(parts)
    }

    /// Returns the tally with which a cell begins: the default. If a partial study lacks all trials of the cell, it is
    /// the tally of zero trials.
    fn no_trials(&self, cell: usize) -> CellTally {
        if self.origin.partial && self.stored[cell].is_empty() {
            let cell = &self.experiment.cells[cell];
            return CellTally::from_trials(self.experiment, cell, &mut Trials::new(self.experiment, cell));
        }
        CellTally::default()
    }

    /// Returns what the summary needs of a cell. A series with gaps is cut at the first gap, because cells are paired
    /// by trials.
    fn part(&self, cell: usize, mut tally: CellTally) -> CellPart {
        if self.origin.partial {
            for series in &mut tally.series {
                let mut next = 0;
                series.retain(|first, values| {
                    let follows = *first == next;
                    next += if follows { values.len() as u64 } else { 0 };
                    follows
                });
            }
        }
        CellPart::new(self.experiment, cell, &tally)
    }

    /// Does the same as [`Self::read`], and writes the rows to a table.
    fn write_trials(&self, file: File, path: PathBuf, stop: &AtomicBool) -> Result<Vec<CellPart>, CampaignError> {
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

/// Reads what the summary needs of every cell, of as many at a time as there are threads.
fn read_cells(
    cells: usize,
    threads: usize,
    stop: &AtomicBool,
    of_cell: impl Fn(usize) -> Result<CellPart, CampaignError> + Sync,
) -> Result<Vec<CellPart>, CampaignError> {
    let threads = threads.max(1);
    let mut parts = Vec::new();
    let pool = pool(threads)?;
    let of_cell = |cell| go_on(stop).and_then(|()| of_cell(cell));
    for first in (0..cells).step_by(threads) {
        let next = first..cells.min(first + threads);
        let found: Vec<Result<CellPart, _>> = pool.install(|| next.into_par_iter().map(of_cell).collect());
        // The error of the first cell, whichever came first.
        for part in found {
            parts.push(part?);
        }
    }
    Ok(parts)
}

impl Drop for Campaign<'_> {
    fn drop(&mut self) {
        if self.options.fresh {
            // No remedy here; the next run tries again.
            let _ = self.folder.give_up();
        }
    }
}

/// Returns the manifest: what made the results. It has no times or threads, and of the host only what faer's bits
/// depend on.
fn manifest(experiment: &Experiment, targets: &[u64], origin: &Origin) -> Value {
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
    let mut manifest = json!({
        "program": "asobench",
        "version": env!("CARGO_PKG_VERSION"),
        "git_revision": crate::revision::GIT_REVISION,
        "trials": trials,
        "engine": engines,
        "faer_instructions": by_faer.then_some(&origin.faer_instructions),
        "experiment": experiment.file,
    });
    if origin.partial {
        manifest["partial"] = true.into();
    }
    manifest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::file::experiment_file::ExperimentFile;
    use std::sync::atomic::Ordering;

    /// Raising the flag while results are put together leaves the trials and no results.
    #[test]
    fn putting_results_together_can_be_stopped() {
        let text = "trials = 4\nstore = \"trials\"\n[settings]\neta = [0, 5]\nwindow = 18";
        let experiment = Experiment::new(ExperimentFile::parse(text).unwrap()).unwrap();
        let place = tempfile::tempdir().unwrap();
        let files = || std::fs::read_dir(place.path()).unwrap().count();
        let stop = AtomicBool::new(false);
        let run = |stop_at_the_end: bool| {
            let rule = experiment.file.trials.clone();
            let campaign = Campaign::open(place.path(), &experiment, rule, RunOptions::default()).unwrap();
            let mut cells = 0;
            let on_event = |event| {
                cells += usize::from(event == Event::Cell);
                if stop_at_the_end && cells == 2 {
                    stop.store(true, Ordering::Relaxed);
                }
            };
            campaign.run(&stop, on_event, |_| Vec::new())
        };
        let error = run(true).unwrap_err();
        assert!(matches!(error, CampaignError::Stopped), "{error}");
        assert_eq!(files(), 3, "the lock, the blocks and what is to be");
        // All trials are stored; only the results are missing.
        stop.store(false, Ordering::Relaxed);
        assert_eq!(run(false).unwrap().cells.len(), 2);
        assert_eq!(files(), 2 + 5, "the manifest, two summaries, trials and looks");
    }

    #[test]
    fn a_rule_for_what_is_not_there_is_refused() {
        let experiment = Experiment::new(ExperimentFile::parse("trials = 4").unwrap()).unwrap();
        let place = tempfile::tempdir().unwrap();
        let rule = "trials = { until = \"e_a\", output = \"iv(9)\", relative_mcse = 1, \
                    minimum = 1, maximum = 2 }";
        let rule = ExperimentFile::parse(rule).unwrap().trials;
        let opened = Campaign::open(place.path(), &experiment, rule, RunOptions::default());
        let error = opened.err().map(|error| error.to_string());
        assert!(error.is_some_and(|error| error.contains("trials.output") && error.contains("iv(9)")));
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
