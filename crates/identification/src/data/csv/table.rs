//! A record, and what its table shows besides.

use super::runs::{Kept, Segment};

/// A record of input and output samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// u(k), k = 0 ... K-1.
    pub u: Vec<f64>,
    /// y(k).
    pub y: Vec<f64>,
    /// r(k), the reference of a closed loop; empty in a table without one.
    pub r: Vec<f64>,
}

/// A record as it stood in a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The samples.
    pub record: Record,
    /// The line of each sample.
    pub lines: Vec<u64>,
    /// The time of the first sample (of dates 0) and the time between samples, seconds; `None` without a column of
    /// times, or with a single sample.
    pub times: Option<[f64; 2]>,
    /// The form of the table and the names of its columns where they are not the plain ones: cells separated by commas,
    /// decimal points, columns named u, y and t.
    pub form: Vec<String>,
    /// The part that was kept of a table with missing samples.
    pub kept: Option<Kept>,
    /// The runs between gaps, which follow each other in the record; empty if there is one.
    pub segments: Vec<Segment>,
    /// A column that was not used, but has a name like times and steps as times have.
    pub like_times: Option<LikeTimes>,
}

/// A column that is not used, but has a name and steps as times have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LikeTimes {
    /// Its name.
    pub column: String,
    /// How many of its steps are longer than the others, and the line after the first of them: samples are missing
    /// there.
    pub gaps: Option<(usize, u64)>,
}
