//! The first line of a table, and the units below its names.

use super::dialect::{Dialect, is_data};
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
        let mut dialect = self.dialect;
        let mut is_unit = |cell: &&str| cell.is_empty() || dialect.number(cell, line, "").is_err();
        if row.iter().all(|cell| cell.is_empty()) || !row.iter().all(&mut is_unit) {
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
