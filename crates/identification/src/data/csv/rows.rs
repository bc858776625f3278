//! The rows of a table, split by one separator.

use super::error::RecordError;
use std::io;

/// The separators of cells in a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    Semicolon,
    Tab,
    Comma,
    /// Any number of blanks or tabs.
    Blanks,
}

impl Separator {
    /// All, in the order in which they are tried.
    pub(super) const ALL: [Self; 4] = [Self::Semicolon, Self::Tab, Self::Comma, Self::Blanks];

    /// Returns the separator that a line such as `sep=;` of a spreadsheet declares.
    pub(super) fn declared(line: &str) -> Option<Self> {
        match line.trim_matches([' ', '"']).strip_prefix("sep=")? {
            "," => Some(Self::Comma),
            ";" => Some(Self::Semicolon),
            "\t" => Some(Self::Tab),
            "" => Some(Self::Blanks),
            _ => None,
        }
    }

    pub(super) const fn in_words(self) -> Option<&'static str> {
        match self {
            Self::Comma => None,
            Self::Semicolon => Some("separated by semicolons"),
            Self::Tab => Some("separated by tabs"),
            Self::Blanks => Some("separated by blanks"),
        }
    }

    /// Whether a cell holds this separator.
    fn is_in(self, cell: &str) -> bool {
        cell.contains(match self {
            Self::Comma => ',',
            Self::Semicolon => ';',
            Self::Tab => '\t',
            Self::Blanks => ' ',
        })
    }
}

/// The cells of a line, and its number from 1.
pub(super) struct Row<'a> {
    pub(super) line: u64,
    pub(super) cells: Vec<&'a str>,
    /// Whether a quoted cell goes on over line ends, and holds what separates cells elsewhere.
    pub(super) runs_on: bool,
    /// The lines over which it goes on.
    pub(super) more: u64,
}

/// Iterates over the lines that are not empty.
pub(super) struct Rows<'a> {
    reader: csv::Reader<&'a [u8]>,
    record: csv::StringRecord,
    separator: Separator,
    before: u64,
}

impl<'a> Rows<'a> {
    /// Of a text before which so many lines are left out.
    pub(super) fn new(text: &'a str, separator: Separator, before: u64) -> Self {
        let mut form = csv::ReaderBuilder::new();
        let delimiter = match separator {
            Separator::Comma => b',',
            Separator::Semicolon => b';',
            Separator::Tab => b'\t',
            Separator::Blanks => b' ',
        };
        form.has_headers(false).flexible(true).delimiter(delimiter);
        Self {
            reader: form.from_reader(text.as_bytes()),
            record: csv::StringRecord::new(),
            separator,
            before,
        }
    }

    /// Bytes read so far.
    pub(super) fn at(&self) -> u64 {
        self.reader.position().byte()
    }

    /// Lines read so far, and those before.
    pub(super) fn lines(&self) -> u64 {
        self.before + self.reader.position().line() - 1
    }

    pub(super) fn next(&mut self) -> Result<Option<Row<'_>>, RecordError> {
        let blanks = self.separator == Separator::Blanks;
        let mut runs_on = false;
        loop {
            let read = self.reader.read_record(&mut self.record);
            let error = |error: csv::Error| RecordError::Read(self.lines() + 1, io::Error::other(error));
            if !read.map_err(error)? {
                return Ok(None);
            }
            let is_filled = self.record.as_slice().contains(|c: char| !c.is_whitespace());
            // An empty cell in quotes is a cell.
            let is_quoted = self.record.as_slice().is_empty();
            if is_filled || !blanks && (self.record.len() > 1 || is_quoted) {
                break;
            }
        }
        let mut more = 0;
        if self.record.as_slice().contains('\n') {
            for cell in &self.record {
                let ends = cell.matches('\n').count() as u64;
                runs_on |= ends > 0 && self.separator.is_in(cell);
                more += ends;
            }
        }
        let line = self.lines() - more;
        let cells = self.record.iter().flat_map(|cell| {
            // Tabs are blanks where blanks separate, except in quotes that hold both.
            let parts = if blanks { cell.split('\t') } else { cell.split('\0') };
            parts.map(|cell| cell.trim().trim_matches('"').trim())
        });
        let cells = cells.filter(|cell| !blanks || !cell.is_empty()).collect();
        Ok(Some(Row {
            line,
            cells,
            runs_on,
            more,
        }))
    }
}
