//! The first line of a table, and the units below its names.

use super::dialect::{Dialect, MISSING, is_data};
use super::error::RecordError;
use super::lines::Lines;
use std::io::Read;

/// The first line of a table that is no comment, with the form that it shows.
pub(super) struct First {
    pub(super) line: u64,
    pub(super) cells: Vec<String>,
    pub(super) dialect: Dialect,
    pub(super) is_header: bool,
    /// Whether every line ends with a separator.
    ends_open: bool,
    /// Whether a row of units follows.
    pub(super) has_units: bool,
}

impl First {
    /// Reads it; `None` of an empty table.
    pub(super) fn of<R: Read>(lines: &mut Lines<R>) -> Result<Option<Self>, RecordError> {
        let Some((mut line, mut text)) = lines.next()? else {
            return Ok(None);
        };
        let declared = Dialect::declared(text);
        if declared.is_some() {
            let Some(next) = lines.next()? else {
                return Ok(None);
            };
            (line, text) = next;
        }
        let dialect = declared.unwrap_or_else(|| Dialect::of(text));
        let mut cells = dialect.cells(text);
        let is_header = !is_data(&cells);
        let ends_open = is_header && cells.len() > 1 && cells.last() == Some(&"");
        if ends_open {
            cells.pop();
        }
        let cells = cells.into_iter().map(str::to_owned).collect();
        Ok(Some(Self {
            line,
            cells,
            dialect,
            is_header,
            ends_open,
            has_units: false,
        }))
    }

    /// Reads the line after the names. If it has units, they are put behind the names, `t [s]`; else it is returned.
    pub(super) fn after_units<R: Read>(
        &mut self,
        lines: &mut Lines<R>,
    ) -> Result<Option<(u64, Vec<String>)>, RecordError> {
        let next = if self.is_header { lines.next()? } else { None };
        let Some((line, text)) = next else {
            return Ok(None);
        };
        let row = self.row(line, text)?;
        let may_be_unit = |cell: &&str| !is_number(cell) && !is_absent(cell);
        let has_unit = row.iter().any(|cell| cell.contains(is_of_unit));
        if !has_unit || !row.iter().all(may_be_unit) {
            return Ok(Some((line, row.into_iter().map(str::to_owned).collect())));
        }
        for (name, unit) in self.cells.iter_mut().zip(row) {
            let unit = unit.trim_matches(['[', ']', '(', ')']);
            if !unit.is_empty() {
                *name = format!("{name} [{unit}]");
            }
        }
        self.has_units = true;
        Ok(None)
    }

    /// Returns the cells of a row.
    pub(super) fn row<'a>(&self, line: u64, text: &'a str) -> Result<Vec<&'a str>, RecordError> {
        let mut row = self.dialect.cells(text);
        let expected = self.cells.len();
        if self.ends_open && row.len() == expected + 1 && row.last() == Some(&"") {
            row.pop();
        }
        if row.len() == expected {
            return Ok(row);
        }
        Err(RecordError::RowLength {
            line,
            found: row.len(),
            expected,
            has_header: self.is_header,
        })
    }
}

/// Whether a character is one of a unit's name: the unit of a number without one, `-`, is beside others.
fn is_of_unit(c: char) -> bool {
    c.is_alphabetic() || "%°‰".contains(c)
}

/// Whether a cell is a number, be it one that no double is, such as 1e400, or one of other languages, such as 1.5D+01.
fn is_number(cell: &str) -> bool {
    let digits = cell.trim_start_matches(['+', '-', '.', ',']);
    let of_number = |c: char| c.is_ascii_digit() || "+-.,eEdD".contains(c);
    cell.parse::<f64>().is_ok()
        || digits.starts_with(|c: char| c.is_ascii_digit()) && cell.chars().all(of_number)
}

/// Whether a cell says that there is no number: no unit is called so.
fn is_absent(cell: &str) -> bool {
    const WORDS: [&str; 8] = [
        "n.v.", "n. v.", "n.a.", "n. a.", "k.a.", "missing", "invalid", "error",
    ];
    let mut words = WORDS
        .iter()
        .chain(MISSING.iter().filter(|word| !word.is_empty()));
    cell.starts_with('#') || words.any(|word| cell.eq_ignore_ascii_case(word))
}
