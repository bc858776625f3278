//! The files of the suite, JSON with a checksum, and the one error of the suite.

use crate::files::{self, Kind};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Display;
use std::path::Path;

/// Why there is no suite, no such part of it, or a file of it cannot be used: a sentence.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct SuiteError(String);

impl SuiteError {
    /// An error in its own words.
    pub(super) fn new(error: impl Display) -> Self {
        Self(error.to_string())
    }

    /// An error in a study, a method or a file, which is named first.
    pub(super) fn of<E: Display>(name: impl Display) -> impl Fn(E) -> Self {
        move |error| Self(format!("{name}: {error}"))
    }
}

/// A file with a checksum that the suite stores or the program carries.
pub trait Stored: Serialize + DeserializeOwned {
    /// Why no run could have written it; `None` if one could.
    fn fault(&self) -> Option<String> {
        None
    }

    /// Reads the text of a file and checks its checksum, and that a run could have written it.
    ///
    /// # Errors
    /// If it is damaged or not of this kind.
    fn parse(text: impl AsRef<[u8]>) -> Result<Self, SuiteError> {
        let value = files::parsed(text.as_ref()).map_err(SuiteError::new)?;
        let own: Self = serde_json::from_value(value).map_err(SuiteError::new)?;
        own.fault().map_or(Ok(own), |fault| Err(SuiteError::new(fault)))
    }

    /// Reads a file of the program's own; `None` if it does not exist. An error names the file.
    ///
    /// # Errors
    /// If it cannot be read, is damaged or not of this kind.
    fn read(path: &Path) -> Result<Option<Self>, SuiteError> {
        let text = files::read_own(path, Kind::Suite).map_err(SuiteError::new)?;
        let read = text.map(Self::parse).transpose();
        read.map_err(SuiteError::of(path.display()))
    }

    /// Reads a text that the program carries, which is empty where there is none.
    ///
    /// # Errors
    /// If it is damaged or not of this kind.
    fn carried(text: &str) -> Result<Option<Self>, SuiteError> {
        (!text.is_empty()).then(|| Self::parse(text)).transpose()
    }

    /// Returns the text of its file, with its checksum.
    fn text(&self) -> String {
        files::sealed(self)
    }
}
