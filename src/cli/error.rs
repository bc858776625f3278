//! The errors that end the program early, each a line, or a line for each part of a command; `exit_code.rs` has their
//! exit codes.

/// An error that ends the program early.
#[derive(Debug, thiserror::Error)]
pub(super) enum Error {
    /// Bad input: [`super::exit_code::BAD_INPUT`]. The line names the file, key or flag and what was expected.
    #[error("{0}")]
    Input(String),
    /// As [`Error::Input`], with a line for each thing that is wrong, and perhaps what is to be written instead.
    #[error("{}", .0.join("; "))]
    Usage(Vec<String>),
    /// The run itself failed: [`super::exit_code::FAILED`].
    #[error("{0}")]
    Failed(String),
    /// Ctrl-C: [`super::exit_code::INTERRUPTED`].
    #[error("{0}")]
    Interrupted(String),
    /// Stopped before the end, or trials are missing, and the same command resumes: [`super::exit_code::AGAIN`].
    #[error("{0}")]
    Again(String),
    /// An exit code that is not 0, of which all has been said.
    #[error("exit code {0}")]
    Told(u8),
}

/// Makes the error of bad input.
pub(super) fn bad_input(error: impl std::fmt::Display) -> Error {
    Error::Input(error.to_string())
}

/// Makes the error of a file or folder that cannot be used.
pub(super) fn bad_file<E: std::fmt::Display>(path: &std::path::Path) -> impl Fn(E) -> Error {
    move |error| Error::Input(format!("{}: {error}", path.display()))
}

/// Makes the error of a failed run.
pub(super) fn failed(error: impl std::fmt::Display) -> Error {
    Error::Failed(error.to_string())
}

impl Error {
    /// The lines that are printed.
    pub(super) fn lines(&self) -> impl Iterator<Item = String> {
        match self {
            Self::Usage(lines) => lines.clone(),
            Self::Told(_) => Vec::new(),
            other => vec![other.to_string()],
        }
        .into_iter()
    }
}
