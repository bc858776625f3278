//! Records in Parquet, as the tables that records are read from.

use super::kind::Kind;
use super::table::{Table, Values};
use std::fmt::Write as _;
use std::io::{self, Cursor, Read};
use std::ops::Range;

/// Rows that are written at once.
const ROWS: usize = 1 << 12;

/// A column in a group of rows: its numbers, or what it is instead.
type Cells = Result<Vec<Option<f64>>, &'static str>;

/// A Parquet table as CSV with a header, written as it is read: one group of rows is in memory at a time. Numbers have
/// all their digits, missing ones are empty; a cell of a column that holds something else says what, which is no number.
pub struct ParquetText {
    table: Table<Cursor<Vec<u8>>>,
    /// The next group of rows.
    group: usize,
    columns: Vec<Cells>,
    /// The rows of the group that are still to be written.
    rows: Range<usize>,
    text: Vec<u8>,
    /// How much of the text has been read.
    read: usize,
}

impl ParquetText {
    /// Opens a table.
    ///
    /// # Errors
    /// If it is no Parquet table, has no column of numbers, or claims more than its length can hold.
    pub fn open(mut from: impl Read) -> Result<Self, String> {
        let mut bytes = Vec::new();
        let read = from.read_to_end(&mut bytes);
        read.map_err(|error| error.to_string())?;
        let table = Table::open(Cursor::new(bytes))?;
        let columns = table.columns();
        table.fits(table.rows(), columns.len())?;
        if !columns
            .iter()
            .any(|column| matches!(column.kind, Kind::Number(_)))
        {
            return Err("no column of numbers".to_owned());
        }
        let names: Vec<String> = columns.iter().map(|column| named(&column.name)).collect();
        Ok(Self {
            table,
            group: 0,
            columns: Vec::new(),
            rows: 0..0,
            text: (names.join(",") + "\n").into_bytes(),
            read: 0,
        })
    }

    /// Reads the next group of rows; false after the last.
    fn next_group(&mut self) -> Result<bool, String> {
        let Some(rows) = self.table.groups().nth(self.group) else {
            return Ok(false);
        };
        self.columns.clear();
        for place in 0..self.table.columns().len() {
            self.columns.push(match self.table.columns()[place].kind {
                Kind::Number(_) => match self.table.read(self.group, place)? {
                    Values::Numbers(numbers) => Ok(numbers),
                    Values::Texts(_) => Err("a text"),
                },
                Kind::Text => Err("a text"),
                Kind::Other(what) => Err(what),
            });
        }
        self.rows = 0..rows as usize;
        self.group += 1;
        Ok(true)
    }

    /// Writes the next rows of the group.
    fn write(&mut self) {
        let mut text = String::new();
        for row in self.rows.by_ref().take(ROWS) {
            for (place, column) in self.columns.iter().enumerate() {
                if place > 0 {
                    text.push(',');
                }
                match column {
                    Err(what) => text.push_str(what),
                    // Writing to a string cannot fail.
                    Ok(numbers) => _ = numbers[row].map(|number| write!(text, "{number:?}")),
                }
            }
            text.push('\n');
        }
        (self.text, self.read) = (text.into_bytes(), 0);
    }
}

impl Read for ParquetText {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        while self.read == self.text.len() {
            if self.rows.is_empty() && !self.next_group().map_err(io::Error::other)? {
                return Ok(0);
            }
            self.write();
        }
        let count = to.len().min(self.text.len() - self.read);
        to[..count].copy_from_slice(&self.text[self.read..self.read + count]);
        self.read += count;
        Ok(count)
    }
}

/// A column's name between quotes. A number is no name of a header.
fn named(name: &str) -> String {
    let name = name.replace(['"', '\n', '\r'], "_");
    match name.parse::<f64>() {
        Ok(_) => format!("\"column {name}\""),
        Err(_) => format!("\"{name}\""),
    }
}
