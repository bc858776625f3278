//! Limits on the lengths of texts and lists in a file.

use super::{ExperimentFile, FileError};

/// The largest number of characters of a title, and of the other texts.
const TITLE_LIMIT: usize = 200;
const WORDS_LIMIT: usize = 5_000;

/// The largest number of entries in a list, such as methods (one for each combination of their options), bounds or
/// comparisons.
pub(super) const LIST_LIMIT: usize = 1_000;

/// The largest number of tables of a kind, such as plants or noises: the largest number of values of a setting.
const TABLE_LIMIT: usize = super::axis::LONGEST;

impl ExperimentFile {
    /// Checks the lengths of texts and lists.
    ///
    /// # Errors
    /// The first that is too long.
    pub(super) fn check_lengths(&self) -> Result<(), FileError> {
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
            ("noises", self.noises.len()),
            ("feedbacks", self.feedbacks.len()),
            ("continuous_plants", self.continuous_plants.len()),
            ("signals", self.signals.len()),
        ] {
            at_most(key, tables, "tables", TABLE_LIMIT)?;
        }
        Ok(())
    }
}

/// Checks a count against its limit.
pub(in crate::study) fn at_most(
    key: &str,
    count: usize,
    things: &str,
    most: usize,
) -> Result<(), FileError> {
    if count <= most {
        return Ok(());
    }
    let message = format!("{count} {things}; expected at most {most}");
    Err(FileError::key(key, message))
}
