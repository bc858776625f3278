//! Errors in an experiment file, with their places.

use std::fmt::Display;

/// An error in an experiment file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FileError {
    /// A fault in the text: syntax, an unknown key, a wrong type.
    #[error("line {line}, column {column}: {message}")]
    Text {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// The fault, and the form that was expected.
        message: String,
    },
    /// A wrong value of a key.
    #[error("{key}: {message}")]
    Key {
        /// The key's path.
        key: String,
        /// The fault, and the form that was expected.
        message: String,
    },
    /// The file cannot be read.
    #[error("{0}")]
    Io(String),
    /// An error with the file's name.
    #[error("{path}: {error}")]
    In {
        /// The file.
        path: String,
        /// The error.
        error: Box<FileError>,
    },
}

impl FileError {
    /// Makes the error of a key with a wrong value.
    pub fn key(key: impl Display, message: impl Display) -> Self {
        Self::Key {
            key: key.to_string(),
            message: message.to_string(),
        }
    }

    /// Returns the error with its key inside the table at `place`; the empty key stands for the table itself.
    pub(crate) fn within(self, place: &str) -> Self {
        match self {
            Self::Key { key, message } if key.is_empty() => Self::key(place, message),
            Self::Key { key, message } => Self::key(format_args!("{place}.{key}"), message),
            other => other,
        }
    }
}

/// Refuses the value of a key.
pub(crate) fn wrong<T>(key: impl Display, message: impl Display) -> Result<T, FileError> {
    Err(FileError::key(key, message))
}

/// A result whose error does not know its place in the file.
pub(crate) trait At<T> {
    /// Returns the result with the key that the error is of.
    fn at(self, key: impl Display) -> Result<T, FileError>;
}

impl<T, E: Display> At<T> for Result<T, E> {
    fn at(self, key: impl Display) -> Result<T, FileError> {
        self.map_err(|error| FileError::key(key, error))
    }
}
