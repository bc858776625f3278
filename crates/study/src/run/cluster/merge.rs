//! Merges the blocks that processes left into results: the same bytes as those of one machine.

use crate::claim;
use crate::design::Experiment;
use crate::design::file::{Engine, Store, TrialRule};
use crate::files;
use crate::files::Kind;
use crate::outcome::looks::Looks;
use crate::outcome::summary::Summary;
use crate::run::block_file::{BlockFolder, StoredBlock};
use crate::run::campaign::{Campaign, Origin, RunOptions};
use crate::run::cluster::ClusterError;
use crate::run::cluster::collect::Collection;
use crate::run::cluster::shard_plan::ShardPlan;
use crate::run::cluster::status::Status;
use crate::run::event::{CampaignError, go_on};
use crate::run::rounds::Rounds;
use crate::run::runner::{Span, pool};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// How results are put together.
#[derive(Clone, Copy, Debug, Default)]
pub struct MergeOptions {
    /// Threads.
    pub threads: usize,
    /// Whether results are made even if trials are missing.
    pub partial: bool,
    /// Whether faer's bits from different machines may be mixed.
    pub mix_instructions: bool,
    /// If results of another study in the folder may be replaced: told of the folder, and what else is in it.
    pub overwrite: Option<fn(&Path, &[String])>,
}

/// The outcome of a merge.
pub enum Merged {
    /// The results.
    Done(Box<Summary>),
    /// Trials are missing: nothing was written.
    Missing(Status),
    /// All trials of the plan are there, but the file's rule asks for more in this many cells. Nothing was written.
    More(usize),
}

/// Merges blocks that were read before, once more in place, each thread holding one at a time in memory. Afterwards
/// `out` has what a run leaves in its folder; but without blocks, if the study keeps its trials.
///
/// # Errors
/// [`ClusterError`].
pub fn merge(
    (plan, experiment): (&ShardPlan, &Experiment),
    found: &Collection,
    out: &Path,
    options: MergeOptions,
    stop: &AtomicBool,
) -> Result<Merged, ClusterError> {
    let (one_kind, faer_instructions) = one_kind((plan, experiment), found, options)?;
    let found = one_kind.as_ref().unwrap_or(found);
    let status = Status::new(plan, found);
    let partial = !status.is_complete();
    if partial && !options.partial {
        return Ok(Merged::Missing(status));
    }
    let run = RunOptions {
        threads: options.threads,
        overwrite: options.overwrite.is_some(),
        ..RunOptions::default()
    };
    let rule = experiment.file.trials.clone();
    let mut campaign = Campaign::open(out, experiment, rule, run)?;
    if let (Some(tell), Some(beside)) = (options.overwrite, campaign.replaced_beside()?) {
        tell(out, &beside);
    }
    campaign.origin = Origin {
        faer_instructions,
        partial,
    };
    let chosen = found.chosen(|cell| plan.trials[cell]);
    let before = std::mem::replace(&mut campaign.stored, chosen);
    if experiment.file.store == Store::Summaries {
        campaign.stored = fold(&campaign, options.threads, stop)?;
        for block in before.iter().flatten() {
            let mut whole = campaign.stored[block.span.cell].iter();
            if whole.any(|whole| whole.path != block.path && whole.span.holds(&block.span)) {
                files::remove(&block.path, Kind::Block)?;
            }
        }
    }
    let mut targets = plan.trials.clone();
    if partial {
        let trials = |blocks: &Vec<StoredBlock>| blocks.iter().map(|block| block.span.len()).sum();
        targets = campaign.stored.iter().map(trials).collect();
    } else {
        let decided = || campaign.is_decided(stop);
        if campaign.rounds().raise(&mut targets, stop, decided)? {
            let raised = targets.iter().zip(&plan.trials).filter(|(a, b)| a > b).count();
            if !options.partial {
                return Ok(Merged::More(raised));
            }
            campaign.origin.partial = true;
            targets.clone_from(&plan.trials);
        }
    }
    let summary = campaign.conclude(&targets, stop, |_| Vec::new())?;
    Ok(Merged::Done(Box::new(summary)))
}

/// Writes to the folder of the results one block per cell and contiguous range of trials.
fn fold(campaign: &Campaign<'_>, threads: usize, stop: &AtomicBool) -> Result<Vec<Vec<StoredBlock>>, ClusterError> {
    let follows = |a: &StoredBlock, b: &StoredBlock| a.span.trials.end == b.span.trials.start;
    let of_cell = |of_cell: &Vec<StoredBlock>| -> Result<Vec<StoredBlock>, ClusterError> {
        go_on(stop)?;
        let ranges = of_cell.chunk_by(follows);
        Ok(ranges
            .map(|range| campaign.blocks.join(range))
            .collect::<Result<_, _>>()?)
    };
    let pool = pool(threads)?;
    pool.install(|| campaign.stored.par_iter().map(of_cell).collect())
}

/// Returns the vector instructions of faer's cells, and the blocks computed with them where there are others. If no
/// single kind covers all trials, nothing is left out, and it is an error unless they may be mixed.
fn one_kind(
    (plan, experiment): (&ShardPlan, &Experiment),
    found: &Collection,
    options: MergeOptions,
) -> Result<(Option<Collection>, String), ClusterError> {
    let kinds = found.instructions(experiment);
    let names: Vec<String> = kinds.keys().cloned().collect();
    match &names[..] {
        [] => return Ok((None, Engine::faer_instructions().to_owned())),
        [alone] => return Ok((None, alone.clone())),
        _ => {}
    }
    for kind in &names {
        let of_kind = found.with_instructions(experiment, kind);
        if Status::new(plan, &of_kind).is_complete() {
            return Ok((Some(of_kind), kind.clone()));
        }
    }
    if options.mix_instructions {
        return Ok((None, names.join("+")));
    }
    let counts = kinds.iter().map(|(kind, count)| format!("{count} blocks with {kind}"));
    Err(ClusterError::Instructions(counts.collect::<Vec<String>>().join(", ")))
}

/// Returns how many trials each cell should have next by the rule of the file, and which of them are missing. Reads
/// stored blocks if the rule needs them.
///
/// # Errors
/// [`ClusterError`].
pub fn next_targets(
    experiment: &Experiment,
    rule: &TrialRule,
    found: &Collection,
    (threads, stop): (usize, &AtomicBool),
) -> Result<(Vec<u64>, Vec<Span>), ClusterError> {
    if let TrialRule::Until(until) = rule {
        experiment.target(until).map_err(CampaignError::from)?;
    }
    let (_, most) = rule.extent();
    let stored = found.chosen(|cell| experiment.trials_of(cell, most));
    let blocks = BlockFolder::at(PathBuf::new(), experiment);
    let rounds = Rounds {
        experiment,
        rule,
        blocks: &blocks,
        stored: &stored,
    };
    let mut targets = rounds.first_targets();
    let decided = || {
        let summary = Campaign::summary_of(experiment, &blocks, &stored, threads, stop)?;
        let look = Looks::default().at(summary.trials(), &experiment.file, rule);
        Ok::<bool, CampaignError>(claim::decides(&experiment.file, &summary, look))
    };
    rounds.raise(&mut targets, stop, decided)?;
    let cells = 0..targets.len();
    let missing = cells.flat_map(|cell| rounds.missing(cell, targets[cell]));
    let missing = missing.collect();
    Ok((targets, missing))
}
