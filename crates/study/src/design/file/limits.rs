//! Limits on the lengths of texts and lists in a file.

use crate::design::file::{FileError, wrong};

/// The largest number of entries in a list, such as methods (one for each combination of their options), bounds or
/// comparisons.
pub(crate) const LIST_LIMIT: usize = 1_000;

/// Checks a count against its limit.
pub(crate) fn at_most(key: &str, count: usize, things: &str, most: usize) -> Result<(), FileError> {
    if count <= most {
        return Ok(());
    }
    let message = format!("{count} {things}; expected at most {most}");
    wrong(key, message)
}
