//! The values of `--order` and `--delay`: a number, a range, or the orders of polynomials.

use std::str::FromStr;

/// A number, or a range of numbers: `4`, `1:8`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) first: usize,
    pub(super) last: usize,
}

impl Span {
    pub(super) fn is_range(self) -> bool {
        self.first < self.last
    }

    /// Reads the order of one polynomial, which may be 0.
    pub(super) fn of_orders(text: &str) -> Result<Self, String> {
        if text.trim().parse() == Ok(0_usize) {
            return Ok(Self { first: 0, last: 0 });
        }
        text.parse()
    }

    /// Reads a delay or a range of delays, from 0 on: u(k) acts on y(k).
    pub(super) fn of_delays(text: &str) -> Result<Self, String> {
        Self::from(text, 0)
    }

    /// Reads a number of at least `least`, or a range of them.
    fn from(text: &str, least: usize) -> Result<Self, String> {
        let number = |text: &str| text.parse().ok().filter(|number| *number >= least);
        let between = [":", "..", "-"].iter().find_map(|between| text.split_once(between));
        let (first, last) = between.unwrap_or((text, text));
        match (number(first), number(last)) {
            (Some(first), Some(last)) if first <= last => Ok(Self { first, last }),
            (None, _) if !text.contains(':') => Err(format!(
                "expected a whole number of at least {least}, or a range such as {least}:8"
            )),
            _ => Err(format!(
                "expected a range such as {least}:8, of whole numbers of at least {least}"
            )),
        }
    }
}

impl std::fmt::Display for Span {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { first, last } = self;
        if self.is_range() {
            write!(f, "{first}:{last}")
        } else {
            write!(f, "{first}")
        }
    }
}

impl FromStr for Span {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::from(text, 1)
    }
}

/// The value of `--order`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Given {
    /// The order n, or a range.
    Span(Span),
    /// A value for `--orders`: a list of numbers, or letters with numbers.
    Orders(String),
}

impl FromStr for Given {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.contains('=') || list(text).is_some_and(|numbers| numbers.len() > 1) {
            return Ok(Self::Orders(text.to_owned()));
        }
        let alone = text.trim().trim_start_matches('[').trim_end_matches(']');
        alone.trim().parse().map(Self::Span)
    }
}

/// Reads a list of numbers as MATLAB writes it, with brackets or without: `2,2,1`, `[2 2 1]`.
pub(super) fn list(text: &str) -> Option<Vec<usize>> {
    words(text).map(|word| word.parse().ok()).collect()
}

/// The parts of a list.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    let text = text.trim().trim_start_matches('[').trim_end_matches(']');
    let parts = text.split([',', ';', ' ', '\t']);
    parts.filter(|part| !part.is_empty())
}
