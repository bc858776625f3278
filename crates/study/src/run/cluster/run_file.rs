//! What a process records of itself.

use serde::{Deserialize, Serialize};

/// What a process records of itself in `run.json`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Run {
    /// "asobench".
    #[serde(rename = "run")]
    pub(crate) program: String,
    pub(crate) version: String,
    pub(crate) git_revision: Option<String>,
    pub(crate) fingerprint: String,
    /// The number of the shard, from 1.
    pub(crate) shard: usize,
    pub(crate) faer_instructions: String,
    #[serde(flatten)]
    pub(crate) process: Process,
}

/// A process on its machine.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Process {
    /// The machine's name.
    pub host: String,
    /// The process ID.
    pub pid: u32,
    /// Its start, in seconds since 1970.
    pub begin: u64,
    /// The number of the job, if it is one.
    pub job: Option<String>,
}

/// The file in which a process describes itself.
pub(crate) const RUN: &str = "run.json";
