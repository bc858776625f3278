//! A part of the description, and its rows.

/// The most rows of one kind, such as comparisons; the manifest has the others.
pub(super) const MOST: usize = 40;

/// A term and its value.
pub(super) type Row = (String, String);

/// A part of the description.
pub(super) struct Part {
    pub(super) heading: &'static str,
    /// The settings in the file, and what follows from them.
    pub(super) rows: Vec<Row>,
    /// The settings that have their defaults.
    pub(super) defaults: Vec<Row>,
}

impl Part {
    pub(super) fn new(heading: &'static str, rows: Vec<Row>, defaults: Vec<Row>) -> Self {
        Self {
            heading,
            rows,
            defaults,
        }
    }
}

pub(super) fn row(term: impl Into<String>, value: impl Into<String>) -> Row {
    (term.into(), value.into())
}

/// Replaces what is beyond the most rows of a kind by a row that counts it.
pub(super) fn at_most(mut rows: Vec<Row>) -> Vec<Row> {
    if rows.len() > MOST {
        let left = rows.len() - MOST;
        rows.truncate(MOST);
        rows.push(row("and more", format!("{left} in manifest.json")));
    }
    rows
}
