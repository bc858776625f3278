//! Faults of a folder of results.

use crate::files::PathError;
use std::path::PathBuf;

/// Why a folder cannot take the results.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// A file or folder failed.
    #[error(transparent)]
    File(#[from] PathError),
    /// The manifest cannot be read.
    #[error("{}: not a manifest of this program ({reason})", .path.display())]
    Manifest {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// The list of looks cannot be read.
    #[error("{}: not a list of looks of this program ({reason})", .path.display())]
    Looks {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// A result is not what was written.
    #[error("{}: damaged: the checksum in manifest.json differs", .0.display())]
    Damaged(PathBuf),
    /// The folder has no results, and no run began any.
    #[error(
        "{}: no results in this folder (no manifest.json); run an experiment with --out {} first",
        .0.display(), .0.display()
    )]
    NoResults(PathBuf),
    /// A run of the folder has not ended.
    #[error(
        "{}: no results yet (no manifest.json): {done}{} trials of a run that has not ended are there; the same \
        command goes on, \
        report --partial shows them",
        .path.display(), .wanted.map_or_else(String::new, |wanted| format!(" of {wanted}"))
    )]
    Unfinished {
        /// The folder.
        path: PathBuf,
        /// Trials that are there.
        done: u64,
        /// Trials that it is to have, if known.
        wanted: Option<u64>,
    },
    /// Nothing in the folder says that there are results to replace.
    #[error(
        "{}: not a folder of results of asobench (no manifest.json), and --overwrite replaces nothing else; choose \
        another folder",
        .0.display()
    )]
    NotResults(PathBuf),
    /// Another run has the folder.
    #[error("{}: another run is writing there", .0.display())]
    Busy(PathBuf),
    /// A newer version wrote the results.
    #[error(
        "{}: written by asobench {version}, which is newer than this one ({})",
        .path.display(),
        env!("CARGO_PKG_VERSION")
    )]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its version.
        version: String,
    },
    /// The folder holds results of unknown design.
    #[error(
        "{}: holds {file} without manifest.json, so its study is unknown; remove it or \
        choose another folder",
        .path.display()
    )]
    Unknown {
        /// The folder.
        path: PathBuf,
        /// The file.
        file: &'static str,
    },
    /// The folder holds results of another design.
    #[error(
        "{}: holds results of another design (different: {}); choose another folder (--out DIR), or replace them \
        (--overwrite)",
        .path.display(), .keys.join(", ")
    )]
    OtherDesign {
        /// The folder.
        path: PathBuf,
        /// The keys that differ.
        keys: Vec<String>,
    },
}
