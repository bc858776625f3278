//! The lines of a table that are neither blank nor comments.

use super::dialect::is_comment;
use super::error::{LONGEST_LINE, RecordError};
use std::io::{self, BufRead, BufReader, Read};

/// Iterates over the lines, with their numbers.
pub(super) struct Lines<R> {
    reader: BufReader<R>,
    bytes: Vec<u8>,
    text: String,
    number: u64,
    /// Whether the text begins with a byte order mark.
    pub(super) has_mark: bool,
    /// Whether bytes were read as characters of Latin-1, because they are not UTF-8.
    pub(super) is_latin: bool,
}

impl<R: Read> Lines<R> {
    pub(super) fn new(reader: R) -> Self {
        Self {
            reader: BufReader::new(reader),
            bytes: Vec::new(),
            text: String::new(),
            number: 0,
            has_mark: false,
            is_latin: false,
        }
    }

    /// Returns the next line and its number; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<(u64, &str)>, RecordError> {
        loop {
            self.bytes.clear();
            self.number += 1;
            let mut line = self.reader.by_ref().take(LONGEST_LINE);
            let read = line.read_until(b'\n', &mut self.bytes);
            let read = read.map_err(|error| RecordError::Read(self.number, error))?;
            if read == 0 {
                return Ok(None);
            }
            if read as u64 == LONGEST_LINE && !self.bytes.ends_with(b"\n") {
                return Err(RecordError::LongLine(self.number));
            }
            self.decode()?;
            let text = self.text.trim();
            if !(text.is_empty() || is_comment(text)) {
                break;
            }
        }
        // A tab at an end separates an empty cell.
        let text = self.text.trim_matches([' ', '\r', '\n']);
        Ok(Some((self.number, text)))
    }

    /// Decodes a line as UTF-8, or as Latin-1 where it is text of that.
    fn decode(&mut self) -> Result<(), RecordError> {
        self.text.clear();
        if self.number == 1
            && (self.bytes.starts_with(&[0xff, 0xfe]) || self.bytes.starts_with(&[0xfe, 0xff]))
        {
            return Err(RecordError::Utf16);
        }
        if let Ok(text) = str::from_utf8(&self.bytes) {
            self.has_mark |= self.number == 1 && text.starts_with('\u{feff}');
            self.text.push_str(text.trim_start_matches('\u{feff}'));
            return Ok(());
        }
        let is_text =
            |byte: &u8| *byte >= 0xa0 || (0x20..0x7f).contains(byte) || b"\t\r\n".contains(byte);
        if !self.bytes.iter().all(is_text) {
            let error = io::Error::new(io::ErrorKind::InvalidData, "expected text in UTF-8");
            return Err(RecordError::Read(self.number, error));
        }
        self.is_latin = true;
        self.text
            .extend(self.bytes.iter().map(|byte| char::from(*byte)));
        Ok(())
    }
}
