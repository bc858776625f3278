//! Why a record is refused.

use super::options::Decimal;
use crate::text::{beginning, number, rounded};

/// The longest first line that is read, so that an input without line ends cannot fill the memory.
pub(super) const LONGEST_LINE: u64 = 1 << 20;

/// A cell of a table.
#[derive(Clone, Debug)]
pub struct Place {
    /// The line, from 1.
    pub line: u64,
    /// The column's name.
    pub column: String,
    /// The text there.
    pub text: String,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "line {}, column {}: '{}'", self.line, self.column, self.text)
    }
}

/// Why a record was refused. Lines count from 1, comments and header included.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The text has no line except comments.
    #[error("the file is empty; expected a header line with the columns u and y (and perhaps k or t)")]
    Empty,
    /// The first line is data.
    #[error("line {0}: no header; expected a line with the columns u and y (and perhaps k or t) first")]
    NoHeader(u64),
    /// A column is neither k, t, u nor y, and none was chosen.
    #[error("line {line}: unknown column '{column}' among {found}; expected u and y (and perhaps k, t or time)")]
    UnknownColumn {
        /// The header's line.
        line: u64,
        /// The column's name.
        column: String,
        /// The columns of the file.
        found: String,
    },
    /// Two columns have names of one role: the header's line, the role.
    #[error("line {0}: column '{1}' appears twice")]
    RepeatedColumn(u64, &'static str),
    /// A chosen name stands above several columns: the header's line, the name.
    #[error("line {0}: several columns are named '{1}'; expected a column's number, from 1")]
    AmbiguousColumn(u64, String),
    /// One column is chosen for u and for y: the header's line, the column.
    #[error("line {0}: column '{1}' is chosen as input and as output")]
    SameColumn(u64, String),
    /// Column u or y is missing: the header's line, the column, the columns of the file.
    #[error("line {0}: no column '{1}' among {2}")]
    MissingColumn(u64, &'static str, String),
    /// A chosen column is missing.
    #[error("line {line}: no column '{column}' among {found}; expected one of these, or its number from 1")]
    NotThere {
        /// The header's line.
        line: u64,
        /// The column's name.
        column: String,
        /// The columns of the file.
        found: String,
    },
    /// A column is chosen by its name in a table without names: its first line, the choice, the number of columns.
    #[error("line {0}: no header, so no column '{1}'; expected its number, 1 to {2}")]
    NoNumber(u64, String, usize),
    /// The times have a unit that is not known: the header's line, the column's name.
    #[error("line {0}: the unit of column '{1}' is unknown; expected s, ms, us, min or h")]
    TimeUnit(u64, String),
    /// A row has too few or too many cells.
    #[error(
        "line {line}: {found} {}, but {} {expected}{}",
        if *.found == 1 { "cell" } else { "cells" },
        if *.has_header { "the header has" } else { "the first row has" },
        if *.found == 2 * expected { "; numbers with decimal commas are separated by semicolons, tabs or blanks" }
        else { "" }
    )]
    RowLength {
        /// The line.
        line: u64,
        /// Cells in the row.
        found: usize,
        /// Cells in the header.
        expected: usize,
        /// Whether there is a header.
        has_header: bool,
    },
    /// A cell is not a finite number.
    #[error("{0} is not a finite number")]
    Cell(Place),
    /// A number has a decimal comma among numbers with decimal points, or a point among commas; the mark of the others.
    #[error("{0}, but earlier numbers have decimal {1}s")]
    MixedDecimals(Place, Decimal),
    /// A mark may divide thousands or decimals.
    #[error(
        "{} may be {} or {}: three digits stand behind each such mark",
        .0, .0.text.replace(',', "."), .0.text.replace([',', '.'], "")
    )]
    Thousands(Place),
    /// A time cannot be read.
    #[error("{0} is no time in a form that is known")]
    Time(Place),
    /// Times can be read in several ways.
    #[error("column {column}: '{text}' and the times below it can be read in several ways ({forms})")]
    AmbiguousTimes {
        /// The column's name.
        column: String,
        /// The first cell.
        text: String,
        /// The ways.
        forms: String,
    },
    /// A column of times that is not used shows that the newest sample is the first.
    #[error("column '{0}' falls: the newest sample is the first")]
    Falling(String),
    /// A row looks like a comment.
    #[error("line {0}: begins with #, but has as many cells as the other rows; expected a comment or a row")]
    HashRow(u64),
    /// A quoted cell goes on over rows.
    #[error("line {0}: a quote that begins here goes on over line ends and separators; expected its end")]
    OpenQuote(u64),
    /// There is a row above the header.
    #[error("line {line}: numbers above the header in line {header}")]
    DataAbove {
        /// The row's line.
        line: u64,
        /// The header's line.
        header: u64,
    },
    /// A sample is missing.
    #[error("line {}, column {}: a sample is missing ('{}')", .0.line, .0.column, .0.text)]
    Missing(Place),
    /// The samples are not consecutive.
    #[error(
        "line {line}, column {column}: found {}, expected {}; samples must be consecutive",
        number(*.found),
        number(*.expected)
    )]
    Gap {
        /// The line.
        line: u64,
        /// The column's name.
        column: String,
        /// The k found.
        found: f64,
        /// The k expected.
        expected: f64,
    },
    /// The times of the samples are not equally spaced.
    #[error(
        "line {line}, column {column}: a step of {}, the first one is {}; samples must be equally spaced{}",
        rounded(*.found, 6),
        rounded(*.first, 6),
        if *.falls { ", and times fall: the newest sample is the first" } else { "" }
    )]
    Spacing {
        /// The line.
        line: u64,
        /// The column's name.
        column: String,
        /// The time since the sample before.
        found: f64,
        /// The time between the first two samples.
        first: f64,
        /// Whether the newest sample is the first.
        falls: bool,
    },
    /// The longest part at equal steps is a small share of the table.
    #[error(
        "the longest part at equal steps has {samples} of {rows} rows; expected at least a tenth of them: steps are \
         unequal throughout"
    )]
    ShortRun {
        /// The samples of the part.
        samples: usize,
        /// The rows of the table.
        rows: usize,
    },
    /// The file has a header and no rows.
    #[error("no samples after the header")]
    NoSamples,
    /// A line is too long for any record.
    #[error("line {0}: longer than {LONGEST_LINE} bytes")]
    LongLine(u64),
    /// The file cannot be read as a table.
    #[error("{0}")]
    File(String),
    /// The reader failed.
    #[error("line {0}: {1}")]
    Read(u64, std::io::Error),
}

/// Lists the first columns of a header.
pub(super) fn header_names(header: &[&str]) -> String {
    const SHOWN: usize = 12;
    let names = header
        .iter()
        .take(SHOWN)
        .map(|name| format!("'{}'", beginning(name, 40)));
    let mut names: Vec<String> = names.collect();
    if let more @ 1.. = header.len().saturating_sub(SHOWN) {
        names.push(format!("{more} more"));
    }
    names.join(", ")
}
