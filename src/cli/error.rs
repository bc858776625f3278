//! Maps every error to a line and an exit code.

use std::process::ExitCode;

/// An error that ends the program early.
#[derive(Debug, thiserror::Error)]
pub(super) enum Error {
    /// Bad input: exit code 2. The line names the file, key or flag and what was expected.
    #[error("{0}")]
    Input(String),
    /// The run itself failed: exit code 1.
    #[error("{0}")]
    Failed(String),
    /// Ctrl-C: exit code 130.
    #[error("{0}")]
    Interrupted(String),
    /// Stopped before the end, or trials are missing, and the same command resumes: exit code 75.
    #[error("{0}")]
    Again(String),
    /// Standard output failed: exit code 1.
    #[error("cannot write to standard output: {0}")]
    Output(std::io::Error),
}

impl Error {
    pub(super) fn exit_code(&self) -> ExitCode {
        match self {
            Self::Failed(_) | Self::Output(_) => ExitCode::from(1),
            Self::Input(_) => ExitCode::from(2),
            Self::Again(_) => ExitCode::from(75),
            Self::Interrupted(_) => ExitCode::from(130),
        }
    }
}

/// Makes the error of a failed run.
pub(super) fn failed(error: impl std::fmt::Display) -> Error {
    Error::Failed(error.to_string())
}
