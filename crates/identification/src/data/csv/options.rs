//! How the columns of a table are found, and what is done about missing samples.

use crate::names::named_enum;

named_enum! {
    /// The treatment of missing samples.
    Missing, "missing" {
        /// A table with a missing sample is refused (the default).
        Refuse = "refuse",
        /// The longest run of rows without a gap is the record.
        LongestRun = "longest-run",
        /// The runs of rows between gaps are records of one plant, so that only the equations that touch a gap are left
        /// out.
        Equations = "equations",
    }
}

named_enum! {
    /// The mark before the decimals of a number.
    Decimal, "decimal mark" {
        /// 2,719.5 is two thousand.
        Point = "point",
        /// 2.719,5 is two thousand.
        Comma = "comma",
    }
}

impl Decimal {
    pub(super) const fn mark(self) -> char {
        match self {
            Self::Point => '.',
            Self::Comma => ',',
        }
    }

    pub(super) const fn other(self) -> Self {
        match self {
            Self::Point => Self::Comma,
            Self::Comma => Self::Point,
        }
    }
}

/// How the columns of a table are found, and what is done about missing samples.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// The column of u, by its name or its number from 1; otherwise the one named `u`, `input` or `in`.
    pub input: Option<String>,
    /// The column of y; otherwise the one named `y`, `output` or `out`.
    pub output: Option<String>,
    /// The column of the times, or `none`; otherwise the one named `t` or `time`, if there is one.
    pub time: Option<String>,
    /// The column of the reference of a closed loop; otherwise the one named `r` or `reference`, if there is one.
    pub reference: Option<String>,
    /// The treatment of missing samples.
    pub missing: Missing,
    /// The mark before decimals; otherwise the one that the numbers show.
    pub decimal: Option<Decimal>,
    /// Whether y alone is read, which is then u too.
    pub alone: bool,
}

impl ReadOptions {
    /// Reads one column, by its name or its number from 1.
    pub fn column(name: &str) -> Self {
        Self {
            output: Some(name.to_owned()),
            alone: true,
            ..Self::default()
        }
    }
}
