//! The worksheets of an Excel workbook (.xlsx), as the text that its program would save as CSV.

use super::quietly::quietly;
use asobench_identification::text::visible;
use calamine::{CellErrorType, DataRef, ExcelDateTime, Reader as _, SheetType, SheetVisible, Xlsx};
use jiff::SignedDuration;
use jiff::civil::{Date, date};
use std::fmt::Write as _;
use std::io::{self, Cursor, Read};
use zip::ZipArchive;

/// The bytes that may come out of one byte of the file, and those that any file may hold: worksheets of numbers are
/// packed ten to twenty times.
const UNPACKED: u64 = 100;
const LEAST: u64 = 1 << 24;
/// A serial number of days resolves some 0.3 microseconds; steps of 10 microseconds hide this.
const TICKS: f64 = 86400.0 * 1e5;
/// Rows and columns of a worksheet at most.
const ROWS: u32 = 1 << 20;
const COLUMNS: u32 = 1 << 14;
/// Bytes before the name of a part.
const HEADER: usize = 30;
const DAMAGED: &str = "a damaged workbook";

/// An Excel workbook, whose worksheets are read as CSV: a line for each row up to the last one with a cell, so that its
/// number is the row's. Numbers have all their digits and an exponent, so that a point is that of decimals; errors
/// stand as the program shows them, dates and times in ISO 8601, durations in seconds.
pub(super) struct Workbook {
    book: Xlsx<Cursor<Vec<u8>>>,
    /// The bytes that may come out of the file.
    room: u64,
}

impl Workbook {
    /// Opens a workbook.
    ///
    /// # Errors
    /// In words: if it is no workbook, or more comes out of the file than its length can hold.
    pub(super) fn open(mut from: impl Read) -> Result<Self, String> {
        let mut bytes = Vec::new();
        let read = from.read_to_end(&mut bytes);
        read.map_err(|error| error.to_string())?;
        let room = (UNPACKED * bytes.len() as u64).max(LEAST);
        let open = || {
            unpacks_to(&bytes, room)?;
            Xlsx::new(Cursor::new(bytes)).map_err(in_words)
        };
        let book = quietly(open, DAMAGED)?;
        Ok(Self { book, room })
    }

    /// Returns the names of the worksheets that may be meant: those that are visible, or the one of this name.
    ///
    /// # Errors
    /// In words: if there is no such worksheet.
    pub(super) fn worksheets(&self, name: Option<&str>) -> Result<Vec<String>, String> {
        let sheets = self.book.sheets_metadata().iter();
        let sheets = sheets.filter(|sheet| sheet.typ == SheetType::WorkSheet);
        let is_meant =
            |sheet: &&calamine::Sheet| name.map_or(sheet.visible == SheetVisible::Visible, |name| sheet.name == name);
        let meant = sheets.clone().filter(is_meant);
        let meant: Vec<String> = meant.map(|sheet| sheet.name.clone()).collect();
        match name {
            Some(name) if meant.is_empty() => {
                let found: Vec<String> = sheets.map(|sheet| format!("'{}'", visible(&sheet.name))).collect();
                let (name, found) = (visible(name), found.join(", "));
                Err(format!("no worksheet '{name}'; expected {found}"))
            }
            _ => Ok(meant),
        }
    }

    /// Returns a worksheet as text; empty if it has no cell.
    ///
    /// # Errors
    /// In words: if it is damaged, or longer than the file's length can hold.
    pub(super) fn text(&mut self, name: &str) -> Result<String, String> {
        let Self { book, room } = self;
        quietly(|| text_of(book, name, *room), DAMAGED)
    }
}

/// Refuses a file out of which more comes than this.
fn unpacks_to(bytes: &[u8], room: u64) -> Result<(), String> {
    // A workbook with a password is of an older form.
    if bytes.starts_with(&[0xd0, 0xcf, 0x11, 0xe0]) {
        return Err(
            "a workbook with a password, or of Excel 97 to 2003; expected one without, saved as .xlsx".to_owned(),
        );
    }
    let no_book = |error: &dyn std::fmt::Display| format!("no workbook: {error}");
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| no_book(&error))?;
    let mut left = room;
    for place in 0..archive.len() {
        let part = archive.by_index(place).map_err(|error| no_book(&error))?;
        // No checksum covers the names, which stand twice: before each part and in the directory at the end.
        let (at, name) = (part.header_start() as usize + HEADER, part.name_raw());
        if bytes.get(at..at + name.len()) != Some(name) {
            return Err(DAMAGED.to_owned());
        }
        let read = io::copy(&mut part.take(left + 1), &mut io::sink());
        let read = read.map_err(|error| no_book(&error))?;
        left = left.checked_sub(read).ok_or_else(|| too_long(room))?;
    }
    Ok(())
}

fn too_long(room: u64) -> String {
    format!(
        "too much for so short a file; expected at most {} MiB unpacked",
        room >> 20
    )
}

/// An error of the library, by its first line.
fn in_words(error: impl std::fmt::Display) -> String {
    let text = error.to_string();
    format!("no workbook: {}", visible(text.lines().next().unwrap_or_default()))
}

/// Writes a worksheet as text; empty if it has no cell.
fn text_of(book: &mut Xlsx<Cursor<Vec<u8>>>, name: &str, room: u64) -> Result<String, String> {
    let epoch = if book.has_1904_epoch() {
        date(1904, 1, 1)
    } else {
        // Excel counts a 29th of February 1900.
        date(1899, 12, 30)
    };
    let mut cells = book.worksheet_cells_reader(name).map_err(in_words)?;
    // Each row's text, its cells, and how many there are.
    let mut rows: Vec<(String, usize)> = Vec::new();
    let (mut width, mut written) = (0, 0);
    while let Some(cell) = cells.next_cell().map_err(in_words)? {
        if *cell.get_value() == DataRef::Empty {
            continue;
        }
        let (row, column) = cell.get_position();
        if row >= ROWS || column >= COLUMNS {
            let last = format!("{ROWS} rows of {COLUMNS} columns");
            return Err(format!(
                "a cell in row {}, column {}; expected at most {last}",
                row + 1,
                column + 1
            ));
        }
        let (row, column) = (row as usize, column as usize);
        let is_next = row + 1 > rows.len() || row + 1 == rows.len() && column >= rows[row].1;
        if !is_next {
            return Err(format!("row {}: cells are not in order", row + 1));
        }
        rows.resize_with(row + 1, Default::default);
        let (text, count) = &mut rows[row];
        let before = text.len();
        for _ in (*count).max(1)..=column {
            text.push(',');
        }
        write_cell(text, cell.get_value(), epoch);
        *count = column + 1;
        width = width.max(*count);
        written += (text.len() - before) as u64;
        // Each row is filled up to the longest one.
        if written + (width * rows.len()) as u64 > room {
            return Err(too_long(room));
        }
    }
    let mut all = String::with_capacity(written as usize + width * rows.len());
    let above = rows.iter().take_while(|row| row.1 == 0).count();
    for (place, (text, count)) in rows.into_iter().enumerate() {
        all += &text;
        // As in a CSV file, a row without a cell has separators only; above the table it is left out.
        if place >= above {
            all.extend(std::iter::repeat_n(',', width - count.max(1)));
        }
        all.push('\n');
    }
    Ok(all)
}

fn write_cell(text: &mut String, value: &DataRef, epoch: Date) {
    // Writing to a string cannot fail.
    let _ = match value {
        DataRef::Empty => Ok(()),
        DataRef::Int(number) => write!(text, "{number}"),
        DataRef::Float(number) => write!(text, "{number:e}"),
        DataRef::Bool(truth) => write!(text, "{truth}"),
        DataRef::Error(CellErrorType::GettingData) => write!(text, "#N/A"),
        DataRef::Error(error) => write!(text, "{error}"),
        DataRef::DateTime(time) => write!(text, "{}", shown(*time, epoch)),
        DataRef::DateTimeIso(own) | DataRef::DurationIso(own) | DataRef::String(own) => {
            write!(text, "\"{}\"", own.replace('"', "\"\""))
        }
        DataRef::SharedString(own) => write!(text, "\"{}\"", own.replace('"', "\"\"")),
    };
}

/// Days since the epoch as ISO 8601 has them; of less than a day the time alone; a duration in seconds; a number beyond
/// all days as it is.
fn shown(time: ExcelDateTime, epoch: Date) -> String {
    let days = time.as_f64();
    let ticks = (days * TICKS).round();
    if time.is_duration() {
        return format!("{:e}", ticks / 1e5);
    }
    let since = (ticks as i64).saturating_mul(10);
    let at = SignedDuration::from_micros(since);
    match epoch.at(0, 0, 0, 0).checked_add(at) {
        Ok(at) if days < 1.0 => at.strftime("%H:%M:%S%.f").to_string(),
        Ok(at) => at.to_string(),
        Err(_) => format!("{days:e}"),
    }
}

#[cfg(test)]
mod tests;
