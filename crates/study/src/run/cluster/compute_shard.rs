//! Computes a shard: the work of one process. Blocks that are already there are not computed again (resume).

use crate::design::Experiment;
use crate::design::file::{Engine, Store};
use crate::files;
use crate::files::Kind;
use crate::files::PathError;
use crate::run::block_file::{BlockError, BlockFolder, StoredBlock};
use crate::run::cluster::ClusterError;
use crate::run::cluster::collect::{Collection, Process, RUN, Run};
use crate::run::cluster::shard_plan::ShardPlan;
use crate::run::compute::Work;
use crate::run::event::Event;
use crate::run::resume::gaps;
use crate::run::runner::{Span, pool};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

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

/// Computes what is missing of a shard. Reads what earlier processes left in the shard's folder and counts it; writes
/// its own blocks to a folder of its own. Finished blocks stay, however the process ends. `on_note` receives what was
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
    on_note: impl FnMut(&str),
) -> Result<(), ClusterError> {
    // Makes one level only: a shared folder that is missing on this machine is not created.
    let within = folder.parent().filter(|parent| !parent.as_os_str().is_empty());
    if let Some(within) = within.filter(|parent| !files::is_there(parent)) {
        let what = "no such folder; expected one that the machines share";
        return Err(PathError::foreign(within, what).into());
    }
    let path = shard_folder(folder, index);
    files::make_folder(&path)?;
    let missing = missing(&plan.shards[index], experiment, &path, options.threads, on_note)?;
    let trials = plan.trials_of_shard(index);
    let left: u64 = missing.iter().map(Span::len).sum();
    on_event(Event::Planned {
        trials,
        done: trials - left,
    });
    if missing.is_empty() {
        return Ok(());
    }
    let own = own_folder(plan, index, &path, process)?;
    let blocks = BlockFolder::at(own, experiment);
    let mut spans: Vec<(u64, Vec<StoredBlock>)> = missing.iter().map(|span| (span.len(), Vec::new())).collect();
    let work = Work {
        experiment,
        blocks: &blocks,
        spans: &missing,
        block: options.block,
        threads: options.threads,
    };
    work.run(stop, on_event, |written, _| {
        let of_span = missing.iter().position(|span| span.holds(&written.span));
        let Some((left, own)) = of_span.and_then(|at| spans.get_mut(at)) else {
            return Ok(false);
        };
        *left -= written.span.len();
        own.push(written);
        // Files are costly on a file system that many machines share.
        if *left == 0 && own.len() > 1 && experiment.file.store == Store::Summaries {
            own.sort_by_key(|block| block.span.trials.start);
            blocks.consolidate(own)?;
        }
        Ok(*left == 0)
    })?;
    Ok(())
}

/// Returns the trials of a shard that no intact block in its folder covers.
fn missing(
    pieces: &[Span],
    experiment: &Experiment,
    folder: &PathBuf,
    threads: usize,
    on_note: impl FnMut(&str),
) -> Result<Vec<Span>, ClusterError> {
    let folders = std::slice::from_ref(folder);
    let pool = pool::<BlockError>(threads)?;
    let found = pool.install(|| Collection::from_folders(folders, experiment, true))?;
    if found.cells.iter().all(Vec::is_empty) && found.has_others {
        return Err(ClusterError::Foreign {
            path: folder.clone(),
            what: "runs of another design",
        });
    }
    found.refused.iter().map(String::as_str).for_each(on_note);
    // The last bits of faer's results depend on the vector instructions of the machine.
    let found = found.with_instructions(experiment, Engine::faer_instructions());
    let of_piece = |piece: &Span| {
        let Span { cell, trials } = piece.clone();
        let covered = found.cover(cell, &trials);
        let missing = gaps(covered.iter().map(|found| found.trials.clone()), trials);
        missing.map(|trials| Span { cell, trials }).collect::<Vec<Span>>()
    };
    Ok(pieces.iter().flat_map(of_piece).collect())
}

/// Makes the folder of this process, with its `run.json`.
fn own_folder(plan: &ShardPlan, index: usize, folder: &Path, process: &Process) -> Result<PathBuf, PathError> {
    let Process { host, pid, begin, .. } = process;
    let mut path = folder.join(format!("{host}-{pid}-{begin}"));
    // Machines may share names and process IDs.
    let mut again = 1;
    while !files::make_new_subfolder(&path)? {
        path = folder.join(format!("{host}-{pid}-{begin}-{again}"));
        again += 1;
    }
    let run = Run {
        program: "asobench".to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        git_revision: crate::revision::GIT_REVISION.map(str::to_owned),
        fingerprint: plan.fingerprint().to_owned(),
        shard: index + 1,
        faer_instructions: Engine::faer_instructions().to_owned(),
        process: process.clone(),
    };
    files::replace(&path.join(RUN), Kind::Run, files::sealed(&run).as_bytes())?;
    Ok(path)
}
