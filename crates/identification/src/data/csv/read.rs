//! Reads records and columns of tables.

use super::clock::Form;
use super::collect::Rows;
use super::columns::Columns;
use super::error::RecordError;
use super::layout::Layout;
use super::number::settled;
use super::options::ReadOptions;
use super::seen::Seen;
use super::table::{Record, Table};
use super::text::Text;
use std::io::Read;

/// Reads a record from a table with columns named u and y: [`read_table`] with the default options.
///
/// # Errors
/// [`RecordError`], with line and column.
pub fn read(from: impl Read) -> Result<Record, RecordError> {
    read_table(from, &ReadOptions::default()).map(|table| table.record)
}

/// Reads one column of a table; of the others only the numbers of samples and their times are used, which must be those
/// of consecutive samples.
///
/// # Errors
/// [`RecordError`], with line and column.
pub fn read_column(from: impl Read, name: &str) -> Result<Vec<f64>, RecordError> {
    read_table(from, &ReadOptions::column(name)).map(|table| table.record.y)
}

/// Returns which columns of a header are read; none if those that must be there are not.
pub fn uses(header: &[&str], options: &ReadOptions) -> Vec<bool> {
    let columns = Columns::find(Some(header), header.len(), 1, options);
    let used = |place| columns.as_ref().is_ok_and(|columns| columns.has(place));
    (0..header.len()).map(used).collect()
}

/// Reads a record from a table. Cells are separated by commas, semicolons, tabs or blanks, and decimals by points or
/// commas, as all its lines show. The memory used is that of the text, the columns and times. A column of times shows
/// that the samples are equally spaced, up to the rounding of the printed times and a hundredth of the step.
///
/// # Errors
/// [`RecordError`], with line and column.
pub fn read_table(from: impl Read, options: &ReadOptions) -> Result<Table, RecordError> {
    let Text { text, marks } = Text::read(from)?;
    let layout = Layout::of(&text, options)?;
    let seen = Seen::of(&text, &layout)?;
    let decimal = match options.decimal {
        Some(decimal) => Some(decimal),
        None => settled(&seen.used, &seen.others, layout.separator)?,
    };
    let of_dates = seen
        .times
        .dates
        .clone()
        .map_or(vec![None], |dates| dates.into_iter().map(Some).collect());
    let attempt = |form: Option<Form>| Rows::new(&layout, &seen, options, decimal, form).table(&text, &marks, &seen);
    let mut tables = of_dates.into_iter().map(attempt);
    let mut best = tables.next().unwrap_or(Err(RecordError::Empty));
    // Of several ways to read dates one may show equal steps.
    for table in tables {
        let gaps = |table: &Result<Table, _>| {
            table
                .as_ref()
                .map_or(2, |table| i32::from(table.kept.is_some() || !table.segments.is_empty()))
        };
        let same = |one: &Table, other: &Table| (&one.record, one.times) == (&other.record, other.times);
        match (&best, &table) {
            (Ok(one), Ok(other)) if gaps(&best) == gaps(&table) && !same(one, other) => {
                return Err(seen.ambiguous(&layout));
            }
            _ if gaps(&table) < gaps(&best) => best = table,
            _ => {}
        }
    }
    best
}

#[cfg(test)]
mod tests;
