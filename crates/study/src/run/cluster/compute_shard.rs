//! Computes a shard: the work of one process. What is already there is not computed again (resume).

use crate::design::experiment::Experiment;
use crate::design::file::engine::Engine;
use crate::design::file::experiment_file::Store;
use crate::files;
use crate::files::Kind;
use crate::files::PathError;
use crate::run::blocks::{BlockError, BlockFolder, StoredBlock};
use crate::run::cluster::ClusterError;
use crate::run::cluster::collect::{Collection, Found};
use crate::run::cluster::run_file::{Process, RUN, Run};
use crate::run::cluster::shard_plan::{Part, ShardPlan};
use crate::run::compute::Work;
use crate::run::event::Event;
use crate::run::rounds::gaps;
use crate::run::runner::{Span, pool};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// So many blocks of a part are merged into one while the part is computed, because files are costly on a file system
/// that many machines share.
const JOINED: usize = 64;

/// How a shard is computed. No result depends on it.
#[derive(Clone, Copy, Debug, Default)]
pub struct ShardOptions {
    /// Threads.
    pub threads: usize,
    /// Trials in a block; `None`: the default.
    pub block: Option<u64>,
}

/// Returns the folder of a shard within the folder of all shards, by its index from 0.
pub fn shard_folder(folder: &Path, index: usize) -> PathBuf {
    folder.join(format!("shard-{:04}", index + 1))
}

/// A shard being computed.
struct Shard<'a> {
    plan: &'a ShardPlan,
    experiment: &'a Experiment,
    index: usize,
    folder: PathBuf,
    options: ShardOptions,
    process: &'a Process,
    /// The folder of this process, once it has something to write.
    own: Option<PathBuf>,
}

/// Computes what is missing of a shard. Reads what earlier processes left in the shard's folder and counts it; writes
/// its own blocks to a folder of its own. What is finished stays, however the process ends. `on_note` receives what was
/// found and not used.
///
/// # Errors
/// [`ClusterError`]; [`crate::study::RunError::Interrupted`] if `stop` was raised.
#[expect(
    clippy::too_many_arguments,
    reason = "a shard is a plan, a place, a process and its listeners"
)]
pub fn compute_shard(
    plan: &ShardPlan,
    experiment: &Experiment,
    index: usize,
    folder: &Path,
    (options, process): (ShardOptions, &Process),
    stop: &AtomicBool,
    mut on_event: impl FnMut(Event),
    mut on_note: impl FnMut(&str),
) -> Result<(), ClusterError> {
    // Makes one level only: a shared folder that is missing on this machine is not created.
    let within = folder
        .parent()
        .filter(|parent| !parent.as_os_str().is_empty());
    if let Some(within) = within.filter(|parent| !files::is_there(parent)) {
        let what = "no such folder; expected one that the machines share";
        return Err(PathError::foreign(within, what).into());
    }
    let path = shard_folder(folder, index);
    files::make_folder(&path)?;
    let mut shard = Shard {
        plan,
        experiment,
        index,
        folder: path,
        options,
        process,
        own: None,
    };
    loop {
        let (there, notes) = shard.there()?;
        // Note it once. After this process has computed something, it has its own folder.
        if shard.own.is_none() {
            for line in &notes {
                on_note(line);
            }
        }
        let missing = shard.missing(&there);
        if missing.is_empty() {
            return shard.join_all(&there);
        }
        shard.compute(&missing, stop, &mut on_event)?;
    }
}

impl Shard<'_> {
    fn parts(&self) -> &[Part] {
        &self.plan.shards[self.index]
    }

    /// Returns the stored blocks of every part, and one line for each thing that was not used.
    fn there(&self) -> Result<(Vec<Vec<StoredBlock>>, Vec<String>), ClusterError> {
        let mut found =
            Collection::from_folders(std::slice::from_ref(&self.folder), self.experiment)?;
        if found.cells.iter().all(Vec::is_empty) && !found.refused.is_empty() {
            return Err(ClusterError::Foreign {
                path: self.folder.clone(),
                what: "runs of another design".to_owned(),
            });
        }
        let pool = pool::<BlockError>(self.options.threads)?;
        pool.install(|| found.verify(self.experiment))?;
        let notes = std::mem::take(&mut found.refused);
        // The last bits of faer's results depend on the vector instructions of the machine.
        let here = Engine::faer_instructions();
        found.retain(|cell, run| {
            !self.plan.is_by_faer(cell) || run.is_some_and(|run| run.faer_instructions == here)
        });
        let of_part = |part: &Part| {
            let covered = found.cover(part.cell, &part.range());
            let block = |block: &Found| found.block(part.cell, block);
            covered.iter().map(block).collect()
        };
        Ok((self.parts().iter().map(of_part).collect(), notes))
    }

    /// Returns the trials of the parts that no block covers.
    fn missing(&self, there: &[Vec<StoredBlock>]) -> Vec<Span> {
        let parts = self.parts().iter().zip(there);
        let of_part = |(part, blocks): (&Part, &Vec<StoredBlock>)| {
            let cell = part.cell;
            let trials = blocks.iter().map(|block| block.span.trials.clone());
            let missing = gaps(trials, part.range()).map(move |trials| Span { cell, trials });
            missing.collect::<Vec<Span>>()
        };
        parts.flat_map(of_part).collect()
    }

    /// Returns this process's folder. The first call creates it with `run.json`.
    fn own_folder(&mut self) -> Result<PathBuf, PathError> {
        if let Some(own) = &self.own {
            return Ok(own.clone());
        }
        let Process {
            host, pid, begin, ..
        } = self.process;
        let mut path = self.folder.join(format!("{host}-{pid}-{begin}"));
        // Machines may share names and process IDs.
        let mut again = 1;
        while !files::make_new_subfolder(&path)? {
            path = self.folder.join(format!("{host}-{pid}-{begin}-{again}"));
            again += 1;
        }
        let run = Run {
            program: "asobench".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            git_revision: crate::revision::GIT_REVISION.map(str::to_owned),
            fingerprint: self.plan.fingerprint().to_owned(),
            shard: self.index + 1,
            faer_instructions: Engine::faer_instructions().to_owned(),
            process: self.process.clone(),
        };
        let text = serde_json::to_string(&run).unwrap_or_default();
        files::replace(&path.join(RUN), Kind::Run, text.as_bytes())?;
        self.own = Some(path.clone());
        Ok(path)
    }

    /// Computes spans into this process's folder.
    fn compute(
        &mut self,
        missing: &[Span],
        stop: &AtomicBool,
        on_event: &mut impl FnMut(Event),
    ) -> Result<(), ClusterError> {
        let blocks = BlockFolder::at(self.own_folder()?, self.experiment);
        let trials = self.plan.trials_of_shard(self.index);
        let left: u64 = missing.iter().map(Span::len).sum();
        on_event(Event::Planned {
            trials,
            done: trials - left,
        });
        let keep = self.experiment.file.store == Store::Trials;
        let mut own: Vec<Vec<StoredBlock>> = vec![Vec::new(); missing.len()];
        let mut spans_left: Vec<u64> = missing.iter().map(Span::len).collect();
        let ShardOptions { threads, block } = self.options;
        let work = Work {
            experiment: self.experiment,
            blocks: &blocks,
            spans: missing,
            block,
            threads,
        };
        work.run(stop, on_event, |written| {
            let of_span = missing.iter().position(|span| span.holds(&written.span));
            let Some(of_span) = of_span else {
                return Ok(false);
            };
            spans_left[of_span] -= written.span.len();
            own[of_span].push(written);
            let is_whole = spans_left[of_span] == 0;
            if !keep && (own[of_span].len() >= JOINED || is_whole) {
                join_neighbours(&blocks, &mut own[of_span])?;
            }
            Ok(is_whole)
        })?;
        Ok(())
    }

    /// Merges the blocks of each part of which this process computed some. The part is then complete, whatever happens
    /// to other processes' blocks. Other processes' blocks stay.
    fn join_all(&self, there: &[Vec<StoredBlock>]) -> Result<(), ClusterError> {
        let Some(own) = &self.own else { return Ok(()) };
        if self.experiment.file.store == Store::Trials {
            return Ok(());
        }
        let blocks = BlockFolder::at(own.clone(), self.experiment);
        for of_part in there.iter().filter(|blocks| blocks.len() > 1) {
            blocks.join(of_part)?;
            for block in of_part.iter().filter(|block| block.path.starts_with(own)) {
                files::remove(&block.path, Kind::Block)?;
            }
        }
        Ok(())
    }
}

/// Merges consecutive blocks.
fn join_neighbours(blocks: &BlockFolder<'_>, own: &mut Vec<StoredBlock>) -> Result<(), BlockError> {
    own.sort_by_key(|block| block.span.trials.start);
    let follows = |a: &StoredBlock, b: &StoredBlock| a.span.trials.end == b.span.trials.start;
    let joined: Result<Vec<StoredBlock>, _> = own
        .chunk_by(follows)
        .map(|run| match run {
            [alone] => Ok(alone.clone()),
            _ => blocks.consolidate(run),
        })
        .collect();
    *own = joined?;
    Ok(())
}
