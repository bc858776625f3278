//! The text of a file, whatever its encoding.

use super::error::{LONGEST_LINE, RecordError};
use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};
use std::io::{self, Read};

/// A text whose lines end in `\n`, the last one too.
pub(super) struct Text {
    pub(super) text: String,
    /// The encoding and marks that are not plain, in words.
    pub(super) marks: Vec<&'static str>,
}

impl Text {
    /// Reads and decodes all.
    pub(super) fn read(mut from: impl Read) -> Result<Self, RecordError> {
        let mut bytes = Vec::new();
        let failed = |error| RecordError::Read(1, error);
        let mut first = from.by_ref().take(LONGEST_LINE);
        first.read_to_end(&mut bytes).map_err(failed)?;
        let ends = |byte: &u8| matches!(byte, b'\n' | b'\r');
        if bytes.len() as u64 == LONGEST_LINE && !bytes.iter().any(ends) {
            return Err(RecordError::LongLine(1));
        }
        from.read_to_end(&mut bytes).map_err(failed)?;
        let (encoding, mark) = Encoding::for_bom(&bytes).unwrap_or((guess(&bytes), 0));
        let mut marks = Vec::new();
        if mark > 0 && encoding == UTF_8 {
            marks.push("a byte order mark");
        } else if encoding != UTF_8 {
            marks.push(if encoding == WINDOWS_1252 { "Latin-1" } else { "UTF-16" });
        }
        let mut text = if encoding == UTF_8 {
            bytes.drain(..mark);
            String::from_utf8(bytes).map_err(|error| {
                let at = error.utf8_error().valid_up_to();
                not_text(&error.as_bytes()[..at])
            })?
        } else {
            encoding.decode_without_bom_handling(&bytes[mark..]).0.into_owned()
        };
        let odd = |c: char| c.is_control() && !"\t\n\r\u{b}\u{c}\u{1a}\u{85}".contains(c);
        if let Some(at) = text.find(odd) {
            return Err(not_text(&text.as_bytes()[..at]));
        }
        if text.contains('\r') {
            text = text.replace("\r\n", "\n").replace('\r', "\n");
        }
        if text.contains(" \"") {
            text = closed(&text);
        }
        text.truncate(end(&text));
        text.push('\n');
        Ok(Self { text, marks })
    }
}

/// Removes the blanks between a separator and a quote, which belong to no cell.
fn closed(text: &str) -> String {
    let mut parts = text.split('"');
    let mut own = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let filled = own.trim_end_matches(' ').len();
        if own[..filled].ends_with([',', ';', '\t', '\n']) {
            own.truncate(filled);
        }
        own.push('"');
        own += part;
    }
    own
}

/// Lines of nothing but separators at the end, which spreadsheets write, are none.
fn end(text: &str) -> usize {
    let mut end = text.len();
    loop {
        let rest = text[..end].trim_end_matches(['\n', '\u{1a}']);
        let line = rest.rfind('\n').map_or(0, |at| at + 1);
        let nothing = |c: char| c.is_whitespace() || ",;\u{1a}".contains(c);
        if line == 0 || !rest[line..].chars().all(nothing) {
            return rest.len();
        }
        end = line;
    }
}

/// The encoding of bytes without a mark: every second byte of plain text in UTF-16 is zero.
fn guess(bytes: &[u8]) -> &'static Encoding {
    let head = &bytes[..bytes.len().min(1 << 10)];
    let zeros = |from: usize| head.iter().skip(from).step_by(2).filter(|byte| **byte == 0).count();
    match [zeros(0), zeros(1)] {
        [0, odd] if odd * 4 > head.len() => UTF_16LE,
        [even, 0] if even * 4 > head.len() => UTF_16BE,
        _ => match str::from_utf8(bytes) {
            Err(_) if !bytes.contains(&0) => WINDOWS_1252,
            _ => UTF_8,
        },
    }
}

fn not_text(before: &[u8]) -> RecordError {
    let line = before.split(|byte| *byte == b'\n').count() as u64;
    let error = io::Error::new(io::ErrorKind::InvalidData, "expected text in UTF-8");
    RecordError::Read(line, error)
}
