//! A study over many machines: a plan of shards, each computed by processes that know nothing of
//! each other, and what they left put together.
//!
//! A process writes into a folder of its own, so that no lock is needed on a file system that many
//! machines share:
//!
//! ```text
//! NAME-shards/shard-0003/HOST-PID-SECONDS/run.json
//! NAME-shards/shard-0003/HOST-PID-SECONDS/c00000-0000000000-0000000100.block
//! ```
//!
//! Trials are pure functions of design, cell and trial, and tallies merge in any order. So it does
//! no harm that a shard is computed twice, at once or by different plans of one design: any blocks
//! that cover all trials give the same results.

mod collect;
mod cover;
mod merge;
mod plan;
mod shard;
mod status;

pub use collect::{Collection, Verified};
pub use merge::{MergeOptions, Merged, merge, next_targets};
pub use plan::{Part, ShardPlan};
pub use shard::{Process, ShardOptions, compute_shard, shard_folder};
pub use status::{PlaceStatus, Status};

use super::blocks::BlockError;
use super::campaign::CampaignError;
use super::engine::WorkerError;
use super::file::FileError;
use super::runner::RunError;
use crate::files::PathError;
use std::path::PathBuf;

/// Why a step of a study over many machines ended.
#[derive(Debug, thiserror::Error)]
pub enum ClusterError {
    /// A file or folder.
    #[error(transparent)]
    File(#[from] PathError),
    /// A block.
    #[error(transparent)]
    Block(#[from] BlockError),
    /// The experiment of a plan.
    #[error(transparent)]
    Experiment(#[from] FileError),
    /// A cell has no worker.
    #[error(transparent)]
    Worker(#[from] WorkerError),
    /// The threads, or the stop flag.
    #[error(transparent)]
    Run(#[from] RunError<BlockError>),
    /// The results.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// A plan that cannot be used.
    #[error("{}: {reason}", .path.display())]
    Plan {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what was expected.
        reason: String,
    },
    /// Runs of another design.
    #[error("{}: holds {what}; choose another --out", .path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// What of.
        what: String,
    },
    /// Faer's bits of different machines.
    #[error(
        "cells by faer were computed with different vector instructions, whose last bits differ \
         ({0}); compute their shards again on machines of one kind, or take them as they are with \
         --mix-instructions"
    )]
    Instructions(String),
}
