//! How a table separates its cells and its decimals, recognised from its first lines.

use super::error::RecordError;
use crate::text::beginning;

/// What separates the cells of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Separator {
    Comma,
    Semicolon,
    Tab,
    /// Any number of blanks or tabs.
    Blanks,
}

/// What stands before the decimals of a table's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Decimal {
    /// No number had decimals so far.
    Unknown,
    Point,
    Comma,
}

/// The form of a table.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dialect {
    separator: Separator,
    decimal: Decimal,
}

/// A cell of a column of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Number {
    Known(f64),
    /// The sample is missing: the cell is empty, or says so.
    Missing,
}

/// What programs write for a missing number.
pub(super) const MISSING: [&str; 6] = ["", "nan", "na", "n/a", "null", "none"];

/// Whether a cell says that a sample is missing: in words, or by an error value of a spreadsheet.
fn is_missing(cell: &str) -> bool {
    MISSING.iter().any(|text| cell.eq_ignore_ascii_case(text)) || is_error_value(cell)
}

/// Whether a cell is an error value of a spreadsheet in any language, such as `#N/A`, `#NV`, `#DIV/0!`, `#WERT!`, or a
/// number that its cell was too narrow for.
fn is_error_value(cell: &str) -> bool {
    const WORDS: [&str; 6] = ["NV", "CALC", "BUSY", "FEHLER", "ERROR", "GETTING_DATA"];
    let Some(word) = cell.strip_prefix('#') else {
        return false;
    };
    if word.eq_ignore_ascii_case("n/a") {
        return true;
    }
    let word = word.trim_start_matches('\u{a1}');
    let is_one = !word.contains(|c: char| c.is_whitespace() || c.is_lowercase());
    let is_value = word.ends_with(['!', '?'])
        || word.contains('/') && word.chars().count() <= 8
        || WORDS.contains(&word);
    is_one && is_value && word.starts_with(char::is_uppercase)
        || word.len() > 1 && word.chars().all(|c| c == '#')
}

/// Whether a line is a comment: it begins with `#`, and not with an error value in its first cell. Where blanks may
/// separate cells or words, the cells after it are numbers.
pub(super) fn is_comment(line: &str) -> bool {
    if !line.starts_with('#') {
        return false;
    }
    if let Some((first, _)) = line.split_once([',', ';', '\t']) {
        return !is_error_value(first.trim());
    }
    let cells: Vec<&str> = line.split_whitespace().collect();
    !(is_error_value(cells[0]) && is_data(&cells))
}

impl Dialect {
    /// Recognises the form of a table from its first line.
    pub(super) fn of(line: &str) -> Self {
        let outside = outside_quotes(line);
        let has = |c: char| outside.contains(c);
        let with = |separator| Self {
            separator,
            decimal: Decimal::Unknown,
        };
        let blanks = with(Separator::Blanks);
        if has(';') {
            with(Separator::Semicolon)
        } else if has('\t') {
            with(Separator::Tab)
        } else if has(',') {
            // Numbers with decimal commas, separated by blanks?
            let comma = with(Separator::Comma);
            if is_data(&blanks.cells(line)) && !is_data(&comma.cells(line)) {
                blanks
            } else {
                comma
            }
        } else if blanks.cells(line).len() > 1 {
            blanks
        } else {
            with(Separator::Comma)
        }
    }

    /// Returns the separator that a line such as `sep=;` of a spreadsheet declares.
    pub(super) fn declared(line: &str) -> Option<Self> {
        let separator = match line.strip_prefix("sep=")? {
            "," => Separator::Comma,
            ";" => Separator::Semicolon,
            "\t" | "" => Separator::Tab,
            _ => return None,
        };
        Some(Self {
            separator,
            decimal: Decimal::Unknown,
        })
    }

    /// Returns the cells of a line, without surrounding blanks and double quotes.
    pub(super) fn cells(self, line: &str) -> Vec<&str> {
        let mut quoted = false;
        let ends = move |c: char| {
            quoted ^= c == '"';
            !quoted
                && match self.separator {
                    Separator::Comma => c == ',',
                    Separator::Semicolon => c == ';',
                    Separator::Tab => c == '\t',
                    Separator::Blanks => c == ' ' || c == '\t',
                }
        };
        let cells = line.split(ends);
        let cells = cells.filter(|cell| self.separator != Separator::Blanks || !cell.is_empty());
        cells
            .map(|cell| cell.trim().trim_matches('"').trim())
            .collect()
    }

    /// Parses a cell as a finite number, and learns what stands before decimals.
    pub(super) fn number(
        &mut self,
        cell: &str,
        line: u64,
        column: &str,
    ) -> Result<Number, RecordError> {
        let error = || RecordError::Cell {
            line,
            column: column.to_owned(),
            text: beginning(cell, 40),
        };
        let known = match (cell.contains(','), cell.contains('.')) {
            (false, false) => cell.parse(),
            (false, true) if self.decimal != Decimal::Comma => {
                let number = cell.parse::<f64>();
                if number.is_ok() {
                    self.decimal = Decimal::Point;
                }
                number
            }
            (true, false) if self.decimal != Decimal::Point => {
                let number = cell.replacen(',', ".", 1).parse::<f64>();
                if number.is_ok() {
                    self.decimal = Decimal::Comma;
                }
                number
            }
            (true, true) => return Err(error()),
            _ => {
                return Err(RecordError::MixedDecimals {
                    line,
                    column: column.to_owned(),
                    text: beginning(cell, 40),
                });
            }
        };
        match known {
            Ok(number) if number.is_finite() => Ok(Number::Known(number)),
            _ if is_missing(cell) => Ok(Number::Missing),
            _ => Err(error()),
        }
    }

    /// Describes the form where it is not the plain one: cells separated by commas, decimal points.
    pub(super) fn in_words(self) -> Vec<&'static str> {
        let separator = match self.separator {
            Separator::Comma => None,
            Separator::Semicolon => Some("separated by semicolons"),
            Separator::Tab => Some("separated by tabs"),
            Separator::Blanks => Some("separated by blanks"),
        };
        let decimal = (self.decimal == Decimal::Comma).then_some("decimal commas");
        separator.into_iter().chain(decimal).collect()
    }
}

/// Whether all cells are numbers, with decimal points or commas, or missing: the line is no header.
pub(super) fn is_data(cells: &[&str]) -> bool {
    let is_number = |cell: &str| cell.replacen(',', ".", 1).parse::<f64>().is_ok();
    cells.iter().all(|cell| is_number(cell) || is_missing(cell))
        && cells.iter().any(|cell| is_number(cell))
}

/// Returns a line without its quoted parts.
fn outside_quotes(line: &str) -> String {
    line.split('"').step_by(2).collect()
}
