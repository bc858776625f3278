//! `asobench merge`: merges what the shards of a plan left into results.

use super::cluster::{self, refused, word};
use super::error::Error;
use super::execute::{Overwrite, replaces, results, threads};
use super::output::{note, print_with_verdicts};
use super::progress;
use super::study_arguments::mark_added;
use crate::study::cluster::{MergeOptions, Merged, ShardPlan, merge};
use std::path::{Path, PathBuf};

/// Merge the shards' results: the same bytes as `run` on one machine. Any
/// folders, in any order, twice the same: all that is damaged or of another experiment is named and
/// not taken. Where trials are missing they are named, and it ends with exit code 75.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The plan, as `asobench plan` writes it
    plan: PathBuf,
    /// Folders of the shards' results, at any depth [default: NAME-shards beside the plan]
    folders: Vec<PathBuf>,
    /// Folder of the results [default: results/NAME of NAME.plan.json]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Make results, marked as partial, even if trials are missing
    #[arg(long)]
    partial: bool,
    /// Accept faer's cells that were computed with different vector instructions
    #[arg(long)]
    mix_instructions: bool,
    #[command(flatten)]
    overwrite: Overwrite,
    /// Threads [default: one per processor]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let path = &arguments.plan;
    let (plan, mut experiment) = ShardPlan::read(path).map_err(refused)?;
    let out = arguments.out.clone();
    let out = out.unwrap_or_else(|| Path::new("results").join(ShardPlan::name_of(path)));
    mark_added(&mut experiment.file, &out);
    let stop = progress::stop_flag()?;
    let options = MergeOptions {
        threads: threads(arguments.threads),
        partial: arguments.partial,
        mix_instructions: arguments.mix_instructions,
        overwrite: arguments.overwrite.overwrite.then_some(replaces),
    };
    let found = cluster::collected((path, &arguments.folders), &experiment, true, false)?;
    let merged = merge((&plan, &experiment), &found, &out, options, &stop);
    let merged = merged.map_err(refused)?;
    note(&format!("{} blocks, {} bytes", found.read.0, found.read.1));
    match merged {
        Merged::Done(summary) => {
            if experiment.file.timing {
                note(&format!(
                    "the methods are not timed; to time them without a new run: asobench run {} --out {}",
                    word(path),
                    word(&out)
                ));
            }
            let (text, verdicts) = results(&out, &experiment.file, &summary, false)?;
            print_with_verdicts(&text, &verdicts)
        }
        Merged::Missing(status) => {
            for span in status.missing.iter().take(cluster::LINES) {
                let (from, last) = (span.trials.start, span.trials.end - 1);
                note(&format!("missing: cell {}, trials {from} to {last}", span.cell));
            }
            if let Some(more @ 1..) = status.missing.len().checked_sub(cluster::LINES) {
                note(&format!("missing: {more} more ranges of trials"));
            }
            cluster::again(path, &plan, &status).lines().for_each(note);
            let missing: u64 = status.cells.iter().map(|cell| cell.missing).sum();
            Err(Error::Again(format!(
                "{missing} trials are missing, nothing was written; --partial makes results of the \
                others"
            )))
        }
        Merged::More(cells) => Err(Error::Again(format!(
            "all trials of the plan are there, but by the rule 'trials' {cells} cells need \
             more; plan the next round with the command that made the plan, or: asobench plan {} \
             --out {}",
            word(path),
            word(path)
        ))),
    }
}
