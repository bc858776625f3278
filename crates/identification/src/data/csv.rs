//! CSV text. Records of u and y have a header with the columns `u`, `y` and optionally `k` or `t`, and comment lines
//! beginning with `#`. All tables of the program are written by the one line writer here.

mod error;
mod times;

use crate::text::{beginning, number, visible, visible_lines};
use error::LONGEST_LINE;
pub use error::RecordError;
use std::io::{BufRead, BufReader, Read, Write};
use times::Times;

/// A record of input and output samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// u(k), k = 0 ... K-1.
    pub u: Vec<f64>,
    /// y(k).
    pub y: Vec<f64>,
}

const NAMES: [&str; 4] = ["k", "u", "y", "t"];
/// The positions of k, u, y and t in a row.
struct Columns {
    positions: [Option<usize>; 4],
    count: usize,
}

impl Columns {
    fn parse(header: &[&str], line: u64) -> Result<Self, RecordError> {
        if header.iter().all(|cell| cell.parse::<f64>().is_ok()) {
            return Err(RecordError::NoHeader(line));
        }
        let mut positions = [None; 4];
        for (position, cell) in header.iter().enumerate() {
            let cell = if *cell == "time" { &"t" } else { cell };
            let Some(name) = NAMES.iter().position(|name| name == cell) else {
                let column = (*cell).to_owned();
                return Err(RecordError::UnknownColumn { line, column });
            };
            if positions[name].replace(position).is_some() {
                let column = NAMES[name];
                return Err(RecordError::RepeatedColumn { line, column });
            }
        }
        for name in [1, 2] {
            if positions[name].is_none() {
                let column = NAMES[name];
                return Err(RecordError::MissingColumn { line, column });
            }
        }
        let count = header.len();
        Ok(Self { positions, count })
    }

    /// Returns the finite number in column `name` of a row; `None` if the header does not have the column.
    fn number(&self, row: &[&str], line: u64, name: usize) -> Result<Option<f64>, RecordError> {
        let Some(position) = self.positions[name] else {
            return Ok(None);
        };
        finite(row[position], line, NAMES[name]).map(Some)
    }
}

/// Parses a cell as a finite number.
fn finite(cell: &str, line: u64, column: &str) -> Result<f64, RecordError> {
    let number = cell.parse().ok().filter(|x: &f64| x.is_finite());
    number.ok_or_else(|| RecordError::Cell {
        line,
        column: column.to_owned(),
        text: beginning(cell, 40),
    })
}

/// Iterates over the lines that are neither blank nor comments, with their numbers.
struct Lines<R> {
    reader: BufReader<R>,
    text: String,
    number: u64,
}

impl<R: Read> Lines<R> {
    fn new(reader: R) -> Self {
        Self {
            reader: BufReader::new(reader),
            text: String::new(),
            number: 0,
        }
    }

    /// Returns the next line and its number; `None` at the end.
    fn next(&mut self) -> Result<Option<(u64, &str)>, RecordError> {
        loop {
            self.text.clear();
            self.number += 1;
            let mut line = self.reader.by_ref().take(LONGEST_LINE);
            let read = line.read_line(&mut self.text);
            let read = read.map_err(|error| RecordError::Read(self.number, error))?;
            if read == 0 {
                return Ok(None);
            }
            if read as u64 == LONGEST_LINE && !self.text.ends_with('\n') {
                return Err(RecordError::LongLine(self.number));
            }
            let text = self.text.trim_start_matches('\u{feff}').trim_start();
            if !(text.is_empty() || text.starts_with('#')) {
                break;
            }
        }
        let text = self.text.trim_start_matches('\u{feff}').trim();
        Ok(Some((self.number, text)))
    }
}

/// Returns a cell without surrounding blanks and double quotes.
fn unquote(cell: &str) -> &str {
    cell.trim().trim_matches('"')
}

/// Reads a record. The memory used is that of the two columns. A column t only shows that the samples are equally
/// spaced.
///
/// # Errors
/// [`RecordError`], with line and column.
pub fn read(from: impl Read) -> Result<Record, RecordError> {
    let mut lines = Lines::new(from);
    let Some((line, text)) = lines.next()? else {
        return Err(RecordError::Empty);
    };
    let header: Vec<&str> = text.split(',').map(unquote).collect();
    let columns = Columns::parse(&header, line)?;
    let mut record = Record::default();
    let mut expected = None;
    let mut times = Times::new();
    while let Some((line, text)) = lines.next()? {
        let mut row = [""; 4];
        let mut found = 0;
        for cell in text.split(',') {
            if let Some(slot) = row.get_mut(found) {
                *slot = unquote(cell);
            }
            found += 1;
        }
        if found != columns.count {
            return Err(RecordError::RowLength {
                line,
                found,
                expected: columns.count,
            });
        }
        if let Some(found) = columns.number(&row, line, 0)? {
            let expected = expected.replace(found + 1.0).unwrap_or(found);
            if found != expected {
                return Err(RecordError::Gap {
                    line,
                    found,
                    expected,
                });
            }
        }
        if let Some(time) = columns.number(&row, line, 3)? {
            let cell = columns.positions[3].map_or("", |position| row[position]);
            times.add(cell, time, line)?;
        }
        record.u.extend(columns.number(&row, line, 1)?);
        record.y.extend(columns.number(&row, line, 2)?);
    }
    if record.y.is_empty() {
        return Err(RecordError::NoSamples);
    }
    Ok(record)
}

/// Reads one column of a table with a header line; other columns are ignored.
///
/// # Errors
/// [`RecordError`], with line and column.
pub fn read_column(from: impl Read, name: &str) -> Result<Vec<f64>, RecordError> {
    let mut lines = Lines::new(from);
    let no_column = |line| RecordError::NoColumn {
        line,
        column: name.to_owned(),
    };
    let (line, text) = lines.next()?.ok_or_else(|| no_column(1))?;
    let header: Vec<&str> = text.split(',').map(unquote).collect();
    let mut places = (0..header.len()).filter(|place| header[*place] == name);
    let place = places.next().ok_or_else(|| no_column(line))?;
    let expected = header.len();
    let mut samples = Vec::new();
    while let Some((line, text)) = lines.next()? {
        let found = text.split(',').count();
        let cell = text.split(',').nth(place).filter(|_| found == expected);
        let cell = cell.ok_or(RecordError::RowLength {
            line,
            found,
            expected,
        })?;
        samples.push(finite(unquote(cell), line, name)?);
    }
    if samples.is_empty() {
        return Err(RecordError::NoSamples);
    }
    Ok(samples)
}

/// Writes a record with all digits, preceded by `comments`, one per line.
///
/// # Errors
/// If the writer fails.
pub fn write(to: impl Write, comments: &[String], u: &[f64], y: &[f64]) -> std::io::Result<()> {
    write_columns(to, comments, &[("u", u), ("y", y)])
}

/// Writes columns of one length under their names, after a column k.
///
/// # Errors
/// If the writer fails.
pub fn write_columns(
    mut to: impl Write,
    comments: &[String],
    columns: &[(&str, &[f64])],
) -> std::io::Result<()> {
    for text in comments {
        writeln!(to, "{}", comment(text))?;
    }
    let names = columns.iter().map(|(name, _)| Cell::Text(name));
    writeln!(
        to,
        "{}",
        line(std::iter::once(Cell::Text("k")).chain(names))
    )?;
    for k in 0..columns.first().map_or(0, |(_, column)| column.len()) {
        let numbers = columns.iter().map(|(_, column)| column[k]);
        let numbers = std::iter::once(k as f64).chain(numbers);
        writeln!(to, "{}", line(numbers.map(Cell::Number)))?;
    }
    to.flush()
}

/// The content of a table's cell.
#[derive(Clone, Copy, Debug)]
pub enum Cell<'a> {
    /// A text.
    Text(&'a str),
    /// A number, written with all digits.
    Number(f64),
    /// The digits of a number, perhaps with its standard error in parentheses; never a formula.
    Rounded(&'a str),
}

/// Returns a comment line without its line end.
pub fn comment(text: &str) -> String {
    format!("# {}", visible(text))
}

/// Returns a line of a table without its line end, as in RFC 4180, with quotes around texts that need them.
///
/// No text is a formula to a spreadsheet: wherever a cell could begin, `=`, `+`, `-` and `@` get an apostrophe before
/// them. So does an apostrophe itself, so that removing one apostrophe restores the text.
pub fn line<'a>(cells: impl IntoIterator<Item = Cell<'a>>) -> String {
    let text = |cell: Cell<'_>| match cell {
        Cell::Number(value) => number(value),
        Cell::Rounded(digits) => digits.to_owned(),
        Cell::Text(text) => quoted(&no_formula(text)),
    };
    let cells: Vec<String> = cells.into_iter().map(text).collect();
    cells.join(",")
}

/// Returns a text with an apostrophe before every character that a spreadsheet could read as the start of a formula.
/// This can be at the beginning, or after a character that separates cells elsewhere (semicolon, line end), with or
/// without blanks and quotes between.
fn no_formula(text: &str) -> String {
    const SIGNS: &str = "=+-@\u{ff1d}\u{ff0b}\u{ff0d}\u{ff20}";
    if text == "-" {
        return text.to_owned();
    }
    let mut safe = String::with_capacity(text.len());
    let mut begins = true;
    for c in visible_lines(text).chars() {
        if begins && (SIGNS.contains(c) || c == '\'') {
            safe.push('\'');
        }
        let blank = c.is_whitespace() || c == '"';
        begins = matches!(c, ';' | '\n') || (begins && blank);
        safe.push(c);
    }
    safe
}

fn quoted(text: &str) -> String {
    if text.contains([',', ';', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        read(text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn a_record_survives_writing_and_reading() {
        let record = Record {
            u: vec![1.0, -0.1, 1e-300],
            y: vec![std::f64::consts::PI, -1.0 / 3.0, 12345.678],
        };
        let mut text = Vec::new();
        write(&mut text, &["truth".to_owned()], &record.u, &record.y).unwrap();
        assert_eq!(read(text.as_slice()).unwrap(), record);
    }

    /// No cell begins a formula, whatever separates cells, and removing one apostrophe restores the text.
    #[test]
    fn texts_are_no_formulas_and_numbers_stay_numbers() {
        for (text, cell) in [
            ("=1+2", "'=1+2"),
            ("=cmd|' /C calc'!A0", "'=cmd|' /C calc'!A0"),
            ("+1", "'+1"),
            ("-2+3", "'-2+3"),
            ("@SUM(A1)", "'@SUM(A1)"),
            (" =1", " '=1"),
            ("\"=1\"", "\"\"\"'=1\"\"\""),
            ("a;=1", "\"a;'=1\""),
            ("a\n=1", "\"a\n'=1\""),
            ("\t=1", "\\t=1"),
            ("\r=1", "\\r=1"),
            ("\u{ff1d}1", "'\u{ff1d}1"),
            ("\u{200b}=1", "\\u{200b}=1"),
            ("'=1", "''=1"),
            ("it's", "it's"),
            ("a=b, c-d", "\"a=b, c-d\""),
            ("-", "-"),
            ("iv(4)", "iv(4)"),
        ] {
            assert_eq!(line([Cell::Text(text)]), cell);
        }
        let numbers = [-1.5, 1e-300, -1e300].map(Cell::Number);
        assert_eq!(line(numbers), "-1.5,1e-300,-1e300");
        assert_eq!(comment("a\n1,2\u{1b}"), "# a\\n1,2\\u{1b}");
    }

    #[test]
    fn columns_may_stand_in_any_order_and_k_may_start_anywhere() {
        let record = read("# a\ny, u ,k\n1,2,7\n# b\n\n3,4,8\r\n".as_bytes()).unwrap();
        assert_eq!((record.u, record.y), (vec![2.0, 4.0], vec![1.0, 3.0]));
        let record = read("time,u,y\n0.03,1,2\n0.07,3,4\n0.1,5,6\n".as_bytes()).unwrap();
        assert_eq!(record.u, [1.0, 3.0, 5.0]);
        let record = read("\u{feff}u,y\n1,2\n".as_bytes()).unwrap();
        assert_eq!(record.y, [2.0]);
    }

    #[test]
    fn one_column_of_any_table() {
        let table = "# a\nt, in ,out\n0,1,x\n\n1,-2.5,y\n";
        let column = |name: &str| read_column(table.as_bytes(), name);
        assert_eq!(column("in").unwrap(), [1.0, -2.5]);
        for (text, message) in [
            ("", "line 1: no column 'u'; the header line must name it"),
            (
                "1,2\n",
                "line 1: no column 'u'; the header line must name it",
            ),
            ("y,u\n", "no samples after the header"),
            ("y,u\n1\n", "line 2: 1 cells, but the header has 2"),
            (
                "y,u\n1,nan\n",
                "line 2, column u: 'nan' is not a finite number",
            ),
        ] {
            assert_eq!(
                read_column(text.as_bytes(), "u").unwrap_err().to_string(),
                message
            );
        }
    }

    #[test]
    fn refusals_name_line_and_column() {
        assert!(error("").starts_with("the file is empty"));
        assert!(error("# only\n").starts_with("the file is empty"));
        assert!(error("1,2\n3,4\n").starts_with("line 1: no header"));
        assert!(error("# c\nu,z\n1,2\n").starts_with("line 2: unknown column 'z'"));
        assert!(error("u;y\n1;2\n").starts_with("line 1: unknown column 'u;y'"));
        assert!(error("u,u,y\n").starts_with("line 1: column 'u' appears twice"));
        assert!(error("k,y\n").starts_with("line 1: no column 'u'"));
        assert!(error("u,y\n").starts_with("no samples"));
        for last in ["0.4", "0.2", "0.1"] {
            let message = error(&format!("t,u,y\n0,1,2\n0.1,1,2\n0.2,1,3\n{last},1,2\n"));
            assert!(
                message.starts_with("line 5, column t: a step of "),
                "{message}"
            );
        }
        assert!(error("t,time,u,y\n").starts_with("line 1: column 't' appears twice"));
        let long = "\0".repeat(LONGEST_LINE as usize + 1);
        assert!(error(&format!("u,y\n{long}")).starts_with("line 2: longer than"));
        assert!(error("u,y\n1,2\n3\n").starts_with("line 3: 1 cells, but the header has 2"));
        for cell in ["abc", "NaN", "inf", "-infinity", "1e999", ""] {
            let message = error(&format!("# c\nu,y\n1,2\n3,{cell}\n"));
            assert_eq!(
                message,
                format!("line 4, column y: '{cell}' is not a finite number")
            );
        }
        assert!(
            error("k,u,y\n0,1,1\n2,1,1\n").starts_with("line 3, column k: found 2, expected 1")
        );
    }
}
