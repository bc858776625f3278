//! Records in Parquet, as the tables that records are read from.

use super::kind::{Clock, Kind};
use super::table::{Table, Values};
use asobench_identification::text::beginning;
use jiff::Timestamp;
use std::fmt::Write as _;
use std::io::{self, Cursor, Read};
use std::ops::Range;

/// Rows that are written at once.
const ROWS: usize = 1 << 12;
/// The longest text that is read, in characters: no number and no time is longer.
const LONGEST: usize = 40;
/// The numbers that need as much memory as a text.
const TEXT: usize = 16;

/// A Parquet table as CSV with a header, written as it is read: one group of rows is in memory at a time, and no column
/// but those that are used. Numbers have all their digits and an exponent, so that a point is that of decimals; missing
/// values are `NA`.
pub struct ParquetText {
    table: Table<Cursor<Vec<u8>>>,
    used: Vec<bool>,
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
    /// Opens a table. `uses` tells by the names which columns are used.
    ///
    /// # Errors
    /// If it is no Parquet table, a column that is used has no numbers, times or texts, or it claims more than its
    /// length can hold.
    pub fn open(mut from: impl Read, uses: impl Fn(&[&str]) -> Vec<bool>) -> Result<Self, String> {
        let mut bytes = Vec::new();
        let read = from.read_to_end(&mut bytes);
        read.map_err(|error| error.to_string())?;
        let table = Table::open(Cursor::new(bytes))?;
        let names: Vec<String> = table.columns().iter().map(|column| named(&column.name)).collect();
        let used = uses(&names.iter().map(String::as_str).collect::<Vec<_>>());
        let mut columns = used.len();
        for ((column, name), used) in table.columns().iter().zip(&names).zip(&used) {
            match column.kind {
                Kind::Other(what) if *used => {
                    return Err(format!("column '{name}' has {what}; expected numbers"));
                }
                Kind::Text if *used => columns += TEXT,
                _ => {}
            }
        }
        table.fits(table.rows(), columns)?;
        let names: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
        Ok(Self {
            table,
            used,
            group: 0,
            columns: Vec::new(),
            rows: 0..0,
            text: (names.join(",") + "\n").into_bytes(),
            read: 0,
        })
    }

    /// Reads the next group of rows; false after the last, and where no column is used.
    fn next_group(&mut self) -> Result<bool, String> {
        let Some(rows) = self
            .table
            .groups()
            .nth(self.group)
            .filter(|_| self.used.contains(&true))
        else {
            return Ok(false);
        };
        self.columns.clear();
        for place in 0..self.used.len() {
            self.columns.push(if self.used[place] {
                let kind = self.table.columns()[place].kind;
                match (self.table.read(self.group, place)?, kind) {
                    (Values::Times(times), Kind::Time(clock)) => Cells::Times(times, clock),
                    (Values::Numbers(numbers), _) => Cells::Numbers(numbers),
                    (texts, _) => Cells::Texts(texts.texts().map(|text| text.map(quoted)).collect()),
                }
            } else {
                Cells::Unused
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
                // Writing to a string cannot fail.
                let written = match column {
                    Cells::Unused => Some(()),
                    Cells::Numbers(numbers) => numbers[row].map(|number| _ = write!(text, "{number:e}")),
                    Cells::Times(times, clock) => times[row].map(|time| text += &shown(time, *clock)),
                    Cells::Texts(texts) => texts[row].as_ref().map(|own| text += own),
                };
                if written.is_none() {
                    text += "NA";
                }
            }
            text.push('\n');
        }
        (self.text, self.read) = (text.into_bytes(), 0);
    }
}

/// The cells of a column in a group of rows.
enum Cells {
    Unused,
    Numbers(Vec<Option<f64>>),
    Times(Vec<Option<i64>>, Clock),
    Texts(Vec<Option<String>>),
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

fn quoted(text: &str) -> String {
    format!("\"{}\"", beginning(text, LONGEST).replace('"', "\"\""))
}

/// A column's name. A number, or what begins a comment, is no name of a header.
fn named(name: &str) -> String {
    let name = name.replace(['"', '\n', '\r'], "_");
    let name = name.trim();
    if name.parse::<f64>().is_ok() || name.starts_with('#') {
        format!("column {name}")
    } else {
        name.to_owned()
    }
}

/// A time as ISO 8601 has it; of a day beyond those as its number.
fn shown(time: i64, clock: Clock) -> String {
    let since = i128::from(time) * i128::from(clock.nanoseconds);
    match Timestamp::from_nanosecond(since) {
        Ok(time) if clock.of_day => time.strftime("%H:%M:%S%.f").to_string(),
        Ok(time) => time.to_string(),
        Err(_) => time.to_string(),
    }
}
