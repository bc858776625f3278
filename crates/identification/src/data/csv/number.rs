//! Numbers as programs of all countries print them, and which mark stands before their decimals.

use super::error::{Place, RecordError};
use super::options::Decimal;
use super::rows::Separator;
use crate::text::beginning;
use std::borrow::Cow;

/// A cell of a column of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Number {
    Known(f64),
    /// The sample is missing: the cell is empty, or says so.
    Missing,
}

/// Words of programs for a missing number.
const MISSING: [&str; 6] = ["", "na", "n/a", "null", "none", "<na>"];

/// Whether a cell says that a sample is missing: in words, or by an error value of a spreadsheet in any language, such
/// as `#N/A`, `#NV`, `#WERT!` or a cell that is too narrow.
pub(super) fn is_missing(cell: &str) -> bool {
    let nan = cell.trim_start_matches(['+', '-']);
    MISSING.iter().any(|text| cell.eq_ignore_ascii_case(text))
        || nan.get(..3).is_some_and(|start| start.eq_ignore_ascii_case("nan"))
            && (nan.len() == 3 || nan[3..].starts_with('('))
        || ["1.#QNAN", "1.#IND", "1.#SNAN"]
            .iter()
            .any(|text| nan.starts_with(text))
        || is_error_value(cell)
}

/// Whether a cell is an error value of a spreadsheet.
pub(super) fn is_error_value(cell: &str) -> bool {
    const WORDS: [&str; 6] = ["NV", "CALC", "BUSY", "FEHLER", "ERROR", "GETTING_DATA"];
    if let Some(code) = cell.strip_prefix("Err:").or(cell.strip_prefix("Fehler:")) {
        return code.parse::<u32>().is_ok();
    }
    let Some(word) = cell.strip_prefix('#') else {
        return false;
    };
    let one = !word.contains(|c: char| c.is_whitespace() || c.is_ascii_digit() && c != '0');
    one && (word.ends_with(['!', '?'])
        || word.starts_with(char::is_uppercase) && word.contains('/') && word.chars().count() <= 8
        || word.eq_ignore_ascii_case("n/a")
        || WORDS.iter().any(|own| word.eq_ignore_ascii_case(own))
        || !word.is_empty() && word.chars().all(|c| c == '#'))
}

/// The meaning of a number's marks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Marks {
    /// There are none.
    None,
    /// These are decimals, and the other mark, if any, divides thousands.
    Decimal(Decimal),
    /// One mark, three digits after it: either.
    Either(Decimal),
}

/// Whether so many digits, divided by a mark, are groups of thousands.
fn is_grouped(text: &str, mark: impl Fn(char) -> bool) -> bool {
    let mut groups = text.split(mark);
    let first = groups.next().unwrap_or_default();
    (1..=3).contains(&first.len()) && !first.starts_with('0') && groups.all(|group| group.len() == 3)
}

/// Whether a character divides thousands and nothing else.
fn divides(c: char) -> bool {
    " '\u{a0}\u{202f}\u{2009}\u{2019}".contains(c)
}

/// A cell with a plain sign and without the blanks or apostrophes that divide thousands.
fn plain(cell: &str) -> Cow<'_, str> {
    if cell
        .bytes()
        .all(|byte| byte.is_ascii_digit() || b".,+-eE".contains(&byte))
    {
        return Cow::Borrowed(cell);
    }
    let cell = cell.replace('\u{2212}', "-");
    let digits = cell.trim_start_matches(['+', '-']);
    let whole = &digits[..digits.find(['.', ',']).unwrap_or(digits.len())];
    let of_group = |c: char| c.is_ascii_digit() || divides(c);
    if whole.contains(divides) && whole.chars().all(of_group) && is_grouped(whole, divides) {
        return Cow::Owned(cell.replacen(whole, &whole.replace(divides, ""), 1));
    }
    Cow::Owned(cell)
}

/// Divides a number into its sign with digits and marks, and its exponent, which Fortran writes as `D+03` too.
pub(super) fn divided(cell: &str) -> (&str, Option<&str>) {
    match cell.find(['e', 'E', 'd', 'D']) {
        Some(at) => (&cell[..at], Some(&cell[at + 1..])),
        None => (cell, None),
    }
}

/// The marks of a plain cell; `None` if it is no number in any notation.
fn marks(cell: &str) -> Option<Marks> {
    let (digits, exponent) = divided(cell);
    let digits = digits.strip_prefix(['+', '-']).unwrap_or(digits);
    if let Some(exponent) = exponent {
        let exponent = exponent.strip_prefix(['+', '-']).unwrap_or(exponent);
        if exponent.is_empty() || !exponent.bytes().all(|byte| byte.is_ascii_digit()) {
            return None;
        }
    }
    let of_number = |byte: u8| byte.is_ascii_digit() || b".,".contains(&byte);
    if !digits.bytes().all(of_number) || !digits.contains(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let Some(last) = digits.rfind(['.', ',']) else {
        return Some(Marks::None);
    };
    let decimal = if digits[last..].starts_with('.') {
        Decimal::Point
    } else {
        Decimal::Comma
    };
    let (before, after) = (&digits[..last], &digits[last + 1..]);
    let grouped = |mark: char| is_grouped(before, |c| c == mark);
    if before.contains(decimal.mark()) {
        // Thousands alone: the other mark is that of decimals.
        let is = after.len() == 3 && exponent.is_none() && grouped(decimal.mark());
        return is.then_some(Marks::Decimal(decimal.other()));
    }
    if before.contains(decimal.other().mark()) {
        return grouped(decimal.other().mark()).then_some(Marks::Decimal(decimal));
    }
    let either = after.len() == 3 && exponent.is_none() && is_grouped(before, |_| false);
    Some(if either {
        Marks::Either(decimal)
    } else {
        Marks::Decimal(decimal)
    })
}

/// Whether a cell is a number in some notation.
pub(super) fn is_number(cell: &str) -> bool {
    marks(&plain(cell)).is_some()
}

/// The meanings of the marks of a column.
#[derive(Clone, Debug, Default)]
pub(super) struct Column {
    /// The first numbers whose decimals certainly have a point, or a comma.
    certain: [Option<Place>; 2],
    /// The first numbers that can be read in either way, by their mark.
    either: [Option<Place>; 2],
    /// Whether there are numbers without a mark.
    has_plain: bool,
}

impl Column {
    /// Looks at a cell.
    pub(super) fn see(&mut self, cell: &str, line: u64, column: impl FnOnce() -> String) {
        let known =
            |decimal: Decimal| self.certain[decimal as usize].is_some() && !cell.contains(decimal.other().mark());
        if known(Decimal::Point) || known(Decimal::Comma) {
            return;
        }
        if cell.bytes().all(|byte| byte.is_ascii_digit()) {
            self.has_plain |= !cell.is_empty();
            return;
        }
        let to = match marks(&plain(cell)) {
            None => return,
            Some(Marks::None) => {
                self.has_plain = true;
                return;
            }
            Some(Marks::Decimal(decimal)) => &mut self.certain[decimal as usize],
            Some(Marks::Either(decimal)) => &mut self.either[decimal as usize],
        };
        to.get_or_insert_with(|| Place {
            line,
            column: column(),
            text: beginning(cell, 40),
        });
    }
}

/// Finds the mark of decimals by the columns that are used, else by the others; `None` if there are no decimals.
///
/// # Errors
/// If numbers contradict each other, or thousands and decimals cannot be told apart.
pub(super) fn settled(
    used: &[Column],
    others: &[Column],
    separator: Separator,
) -> Result<Option<Decimal>, RecordError> {
    let first = |columns: &[Column], decimal: Decimal| {
        let places = columns
            .iter()
            .filter_map(|column| column.certain[decimal as usize].clone());
        places.min_by_key(|place| place.line)
    };
    const MARKS: [Decimal; 2] = [Decimal::Point, Decimal::Comma];
    let both = |columns: &[Column]| MARKS.map(|decimal| first(columns, decimal));
    match both(used) {
        [Some(point), Some(comma)] => {
            let (later, others) = if point.line > comma.line {
                (point, Decimal::Comma)
            } else {
                (comma, Decimal::Point)
            };
            return Err(RecordError::MixedDecimals(later, others));
        }
        [Some(_), None] => return Ok(Some(Decimal::Point)),
        [None, Some(_)] => return Ok(Some(Decimal::Comma)),
        [None, None] => {}
    }
    let either = |decimal: Decimal| used.iter().any(|column| column.either[decimal as usize].is_some());
    let mut seen = MARKS.into_iter().filter(|decimal| either(*decimal));
    let Some(mark) = seen.next() else {
        return Ok(None);
    };
    match both(others) {
        [Some(_), None] => return Ok(Some(Decimal::Point)),
        [None, Some(_)] => return Ok(Some(Decimal::Comma)),
        _ => {}
    }
    let is_both = seen.next().is_some();
    // A comma in a table that commas separate was put in quotes: commonly of thousands.
    let is_likely = mark == Decimal::Comma && separator == Separator::Comma;
    let unclear = |column: &&Column| column.has_plain || is_both || is_likely;
    let places = used.iter().filter(|column| column.either.iter().any(Option::is_some));
    match places
        .filter(unclear)
        .flat_map(|column| column.either.iter().flatten())
        .next()
    {
        Some(place) => Err(RecordError::Thousands(place.clone())),
        None => Ok(Some(mark)),
    }
}

/// How the numbers of a table are read.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Notation {
    pub(super) decimal: Option<Decimal>,
    /// Whether marks of thousands were left out.
    pub(super) has_thousands: bool,
}

impl Notation {
    /// Parses a cell as a finite number.
    pub(super) fn number(&mut self, cell: &str, line: u64, column: &str) -> Result<Number, RecordError> {
        let decimal = self.mark();
        let found = self.parsed(cell, decimal);
        match found {
            Some(number) if number.is_finite() => return Ok(Number::Known(number)),
            _ if is_missing(cell) => return Ok(Number::Missing),
            _ => {}
        }
        let place = Place {
            line,
            column: column.to_owned(),
            text: beginning(cell, 40),
        };
        let other = matches!(marks(&plain(cell)), Some(Marks::Decimal(own)) if own != decimal);
        Err(if other && found.is_none() {
            RecordError::MixedDecimals(place, decimal)
        } else {
            RecordError::Cell(place)
        })
    }

    fn parsed(&mut self, cell: &str, decimal: Decimal) -> Option<f64> {
        if decimal == Decimal::Point
            && !cell.contains(',')
            && let Ok(number) = cell.parse()
        {
            return Some(number);
        }
        let text = plain(cell);
        self.has_thousands |= text.chars().count() < cell.chars().count();
        let of = marks(&text)?;
        let (digits, exponent) = divided(&text);
        let (mark, other) = (decimal.mark(), decimal.other().mark());
        let mut digits = Cow::Borrowed(digits);
        if digits.contains(other) {
            // Thousands have no decimals of their own mark behind them.
            if matches!(of, Marks::Decimal(own) if own != decimal) {
                return None;
            }
            self.has_thousands = true;
            digits = digits.replace(other, "").into();
        } else if digits.matches(mark).count() > 1 {
            return None;
        }
        let digits = digits.replace(mark, ".");
        format!("{digits}e{}", exponent.unwrap_or("0")).parse().ok()
    }

    pub(super) fn mark(self) -> Decimal {
        self.decimal.unwrap_or_default()
    }

    /// Describes it where it is not the plain one.
    pub(super) fn in_words(self) -> impl Iterator<Item = &'static str> + use<> {
        let commas = (self.decimal == Some(Decimal::Comma)).then_some("decimal commas");
        commas
            .into_iter()
            .chain(self.has_thousands.then_some("marks of thousands"))
    }
}
