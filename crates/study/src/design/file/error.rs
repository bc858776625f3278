//! Errors in an experiment file, with their places.

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
        /// What is wrong.
        message: String,
    },
    /// A wrong value of a key.
    #[error("{key}: {message}")]
    Key {
        /// The key's path.
        key: String,
        /// What is wrong.
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
    pub fn key(key: &str, message: impl Into<String>) -> Self {
        Self::Key {
            key: key.to_owned(),
            message: message.into(),
        }
    }

    /// Returns the error with its key inside the table at `place`; the empty key stands for the table itself.
    pub(crate) fn within(self, place: &str) -> Self {
        match self {
            Self::Key { key, message } if key.is_empty() => Self::key(place, message),
            Self::Key { key, message } => Self::key(&format!("{place}.{key}"), message),
            other => other,
        }
    }
}
