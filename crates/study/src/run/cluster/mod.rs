//! A study over many machines. A plan divides it into shards, independent processes compute these, and a merge puts
//! together what they left.
//!
//! A process writes into its own folder, so that no lock is needed on a file system that many machines share:
//!
//! ```text
//! NAME-shards/shard-0003/HOST-PID-SECONDS/run.json
//! NAME-shards/shard-0003/HOST-PID-SECONDS/c00000-0000000000-0000000100.block
//! ```
//!
//! A trial is a pure function of design, cell and index, and tallies merge in any order. So a shard may be computed
//! twice, at the same time or by different plans of one design: any blocks that cover all trials give the same results.

use crate::files::PathError;
use crate::run::block_file::BlockError;
use crate::run::event::CampaignError;
use crate::run::runner::RunError;
use std::path::PathBuf;

mod collect;
mod compute_shard;
mod cover;
mod merge;
mod shard_plan;
mod status;

pub use collect::{Collection, Process};
pub use compute_shard::{ShardOptions, compute_shard, shard_folder};
pub use merge::{MergeOptions, Merged, merge, next_targets};
pub use shard_plan::ShardPlan;
pub use status::{PlaceStatus, Status};

/// Why a step of a study over many machines failed.
#[derive(Debug, thiserror::Error)]
pub enum ClusterError {
    /// A file or folder failed.
    #[error(transparent)]
    File(#[from] PathError),
    /// A block file failed.
    #[error(transparent)]
    Block(#[from] BlockError),
    /// The run failed: threads, the stop flag, a worker or a block file.
    #[error(transparent)]
    Run(#[from] RunError<BlockError>),
    /// The results failed.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// A plan that cannot be used.
    #[error("{}: {reason}", .path.display())]
    Plan {
        /// The file.
        path: PathBuf,
        /// The fault, and what was expected.
        reason: String,
    },
    /// The folder holds runs of another design.
    #[error("{}: holds {what}; choose another --out", .path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// Its content.
        what: &'static str,
    },
    /// The blocks have faer's bits from different machines.
    #[error(
        "cells by faer were computed with different vector instructions, whose last bits differ \
         ({0}); compute their shards again on machines of one kind, or take them as they are with \
         --mix-instructions"
    )]
    Instructions(String),
}
