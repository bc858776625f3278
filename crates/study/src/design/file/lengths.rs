//! The lengths of texts and lists in a file are limited.

use crate::design::file::{ExperimentFile, FileError, LIST_LIMIT, at_most};

/// The largest number of characters of a title, and of the other texts.
pub(crate) const TITLE_LIMIT: usize = 200;

pub(crate) const WORDS_LIMIT: usize = 5_000;

/// The largest number of tables of a kind, such as plants or noises: the largest number of values of a setting.
pub(crate) const TABLE_LIMIT: usize = crate::design::file::axis::LONGEST;

impl ExperimentFile {
    /// Checks the lengths of texts and lists.
    ///
    /// # Errors
    /// The first that is too long.
    pub(crate) fn check_lengths(&self) -> Result<(), FileError> {
        let words = [
            ("title", &self.title, TITLE_LIMIT),
            ("question", &self.question, WORDS_LIMIT),
            ("hypothesis", &self.hypothesis, WORDS_LIMIT),
            ("expected_time", &self.expected_time, WORDS_LIMIT),
        ];
        for (key, text, most) in words {
            at_most(key, text.chars().count(), "characters", most)?;
        }
        for (key, entries) in [
            ("methods", self.methods.len()),
            ("observers", self.observers.len()),
            ("compare", self.compare.len()),
            ("slopes", self.slopes.len()),
            ("bounds", self.bounds.len()),
            ("claims", self.claims.len()),
            ("exclude", self.exclude.len()),
            ("zip", self.zip.len()),
        ] {
            at_most(key, entries, "entries", LIST_LIMIT)?;
        }
        for (key, tables) in [
            ("plants", self.plants.len()),
            ("changes", self.changes.len()),
            ("inputs", self.inputs.len()),
            ("noises", self.noises.len()),
            ("covariances", self.covariances.len()),
            ("feedbacks", self.feedbacks.len()),
            ("continuous_plants", self.continuous_plants.len()),
            ("signals", self.signals.len()),
        ] {
            at_most(key, tables, "tables", TABLE_LIMIT)?;
        }
        Ok(())
    }
}
