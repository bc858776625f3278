//! Maps every error to a line and an exit code.

use super::exit_code::{AGAIN, BAD_INPUT, FAILED, INTERRUPTED};
use std::process::ExitCode;

/// An error that ends the program early.
#[derive(Debug, thiserror::Error)]
pub(super) enum Error {
    /// Bad input: [`BAD_INPUT`]. The line names the file, key or flag and what was expected.
    #[error("{0}")]
    Input(String),
    /// The run itself failed: [`FAILED`].
    #[error("{0}")]
    Failed(String),
    /// Ctrl-C: [`INTERRUPTED`].
    #[error("{0}")]
    Interrupted(String),
    /// Stopped before the end, or trials are missing, and the same command resumes: [`AGAIN`].
    #[error("{0}")]
    Again(String),
    /// Standard output failed: [`FAILED`].
    #[error("cannot write to standard output: {0}")]
    Output(std::io::Error),
}

impl Error {
    pub(super) fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::Failed(_) | Self::Output(_) => FAILED,
            Self::Input(_) => BAD_INPUT,
            Self::Again(_) => AGAIN,
            Self::Interrupted(_) => INTERRUPTED,
        })
    }
}

/// Makes the error of a failed run.
pub(super) fn failed(error: impl std::fmt::Display) -> Error {
    Error::Failed(error.to_string())
}
