//! Why a record is refused.

use crate::text::{number, rounded};

/// The longest line that is read, so that a file without line ends cannot fill the memory.
pub(super) const LONGEST_LINE: u64 = 1 << 20;

/// Why a record was refused. Lines count from 1, comments and header included.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The text has no line except comments.
    #[error(
        "the file is empty; expected a header line with the columns u and y (and perhaps k or t)"
    )]
    Empty,
    /// The first line is data.
    #[error(
        "line {0}: no header; expected a line with the columns u and y (and perhaps k or t) first"
    )]
    NoHeader(u64),
    /// A column is neither k, t, u nor y.
    #[error(
        "line {line}: unknown column '{column}'; expected u and y (and perhaps k, t or time), separated by commas"
    )]
    UnknownColumn {
        /// The header's line.
        line: u64,
        /// The column's name.
        column: String,
    },
    /// A column is named twice.
    #[error("line {line}: column '{column}' appears twice")]
    RepeatedColumn {
        /// The header's line.
        line: u64,
        /// The column's name.
        column: &'static str,
    },
    /// Column u or y is missing.
    #[error("line {line}: no column '{column}'; expected u and y (and perhaps k or t)")]
    MissingColumn {
        /// The header's line.
        line: u64,
        /// The column's name.
        column: &'static str,
    },
    /// A row has too few or too many cells.
    #[error("line {line}: {found} cells, but the header has {expected}")]
    RowLength {
        /// The line.
        line: u64,
        /// Cells in the row.
        found: usize,
        /// Cells in the header.
        expected: usize,
    },
    /// A requested column is missing.
    #[error("line {line}: no column '{column}'; the header line must name it")]
    NoColumn {
        /// The header's line.
        line: u64,
        /// The column's name.
        column: String,
    },
    /// A cell is not a finite number.
    #[error("line {line}, column {column}: '{text}' is not a finite number")]
    Cell {
        /// The line.
        line: u64,
        /// The column's name.
        column: String,
        /// The cell.
        text: String,
    },
    /// The samples are not consecutive.
    #[error(
        "line {line}, column k: found {}, expected {}; samples must be consecutive",
        number(*.found),
        number(*.expected)
    )]
    Gap {
        /// The line.
        line: u64,
        /// The k found.
        found: f64,
        /// The k expected.
        expected: f64,
    },
    /// The times of the samples are not equally spaced.
    #[error(
        "line {line}, column t: a step of {}, the first one is {}; samples must be equally spaced",
        rounded(*.found, 6),
        rounded(*.first, 6)
    )]
    Spacing {
        /// The line.
        line: u64,
        /// The time since the sample before.
        found: f64,
        /// The time between the first two samples.
        first: f64,
    },
    /// The file has a header and no rows.
    #[error("no samples after the header")]
    NoSamples,
    /// A line is too long for any record.
    #[error("line {0}: longer than {LONGEST_LINE} bytes")]
    LongLine(u64),
    /// The reader failed.
    #[error("line {0}: {1}")]
    Read(u64, std::io::Error),
}
