//! The events that a run tells, and why it ends early.

use crate::design::file::FileError;
use crate::files::PathError;
use crate::outcome::folder_error::FolderError;
use crate::outcome::spent::Spent;
use crate::outcome::trial_table::StoreError;
use crate::run::block_file::BlockError;
use crate::run::runner::RunError;
use std::sync::atomic::{AtomicBool, Ordering};

/// An event of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The number of trials wanted in all, and of those already computed.
    Planned {
        /// Trials wanted.
        trials: u64,
        /// Trials already computed.
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
    /// A cell has all its trials.
    Cell,
    /// The results are written. The time is that of putting them together, times the number of threads.
    Concluded(Spent),
}

/// Why a campaign ended early.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// The folder or a file in it failed.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The rule for the number of trials is wrong.
    #[error(transparent)]
    Rule(#[from] FileError),
    /// A block file failed.
    #[error(transparent)]
    Block(#[from] BlockError),
    /// A Parquet file failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The run failed: threads, the stop flag, a worker or a block file.
    #[error(transparent)]
    Run(#[from] RunError<BlockError>),
    /// The `stop` flag was raised while results were put together. All trials are stored, but no result was written.
    #[error("interrupted while the results were put together")]
    Stopped,
    /// Fewer trials are asked for than are already stored.
    #[error(
        "{folder}: holds trials of cell {cell} up to trial {there}, more than {asked}; take \
        another folder for fewer, or replace them (--overwrite)"
    )]
    Fewer {
        /// The folder.
        folder: String,
        /// The cell.
        cell: usize,
        /// The end of the last stored block.
        there: u64,
        /// Trials asked for.
        asked: u64,
    },
}

impl CampaignError {
    /// Whether the folder holds other results, which `--overwrite` replaces.
    pub(crate) fn is_of_other_results(&self) -> bool {
        matches!(
            self,
            Self::Folder(FolderError::OtherDesign { .. }) | Self::Fewer { .. } | Self::Block(BlockError::Older { .. })
        )
    }
}

impl From<PathError> for CampaignError {
    fn from(error: PathError) -> Self {
        Self::Folder(error.into())
    }
}

/// Returns an error if the flag is raised.
pub(crate) fn go_on(stop: &AtomicBool) -> Result<(), CampaignError> {
    if stop.load(Ordering::Relaxed) {
        return Err(CampaignError::Stopped);
    }
    Ok(())
}
