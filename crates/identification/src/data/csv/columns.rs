//! Which columns of a table are the samples' number, the input, the output and the time.

use super::error::{RecordError, header_names};
use super::options::ReadOptions;
use crate::text::listed;

/// The roles of columns: the number of a sample, the input, the output, the time, the reference of a closed loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    K,
    U,
    Y,
    T,
    R,
}

impl Role {
    pub(super) const ALL: [Self; 5] = [Self::K, Self::U, Self::Y, Self::T, Self::R];

    const fn name(self) -> &'static str {
        ["k", "u", "y", "t", "r"][self as usize]
    }

    /// The names by which a column of this role is known, in lower case.
    const fn names(self) -> &'static [&'static str] {
        match self {
            Self::K => &["k"],
            Self::U => &["u", "input", "in"],
            Self::Y => &["y", "output", "out"],
            Self::T => &["t", "time"],
            Self::R => &["r", "reference"],
        }
    }
}

/// The places of the columns in a row.
pub(super) struct Columns {
    places: [Option<usize>; 5],
    /// Their names in the file: k, u, y, t and r where it has no header.
    names: [String; 5],
    /// The columns of the header that have no role.
    unused: Vec<String>,
    /// The place of a column that has no role, but a name like times.
    pub(super) like_times: Option<usize>,
    /// Seconds in a unit of the times, if the name has none that is unknown.
    pub(super) unit: Option<f64>,
    /// Whether the name has a unit.
    pub(super) names_unit: bool,
}

impl Columns {
    /// Finds the columns in a header; `None` is a table without one.
    pub(super) fn find(
        header: Option<&[&str]>,
        count: usize,
        line: u64,
        options: &ReadOptions,
    ) -> Result<Self, RecordError> {
        let chosen = [
            None,
            options.input.as_deref(),
            options.output.as_deref(),
            options.time.as_deref(),
            options.reference.as_deref(),
        ];
        let is_chosen = [1, 2, 4].iter().any(|role| chosen[*role].is_some());
        let mut places = [None; 5];
        for role in Role::ALL {
            if let Some(column) = chosen[role as usize]
                && (role != Role::T || column != NO_TIME)
            {
                places[role as usize] = Some(place(column, header, count, line)?);
            }
        }
        if places[1].is_some() && places[1] == places[2] {
            return Err(RecordError::SameColumn(line, chosen[1].unwrap_or_default().to_owned()));
        }
        let taken = places;
        let mut unused = Vec::new();
        for (at, cell) in header.unwrap_or_default().iter().enumerate() {
            if taken.contains(&Some(at)) {
                continue;
            }
            let name = known_as(cell);
            let role = Role::ALL.into_iter().find(|role| role.names().contains(&name.as_str()));
            match role {
                // A choice leaves out what the column would be by its name.
                Some(role) if chosen[role as usize].is_some() => unused.push((*cell).to_owned()),
                Some(Role::U | Role::R) if options.alone => {}
                Some(role) => {
                    if places[role as usize].replace(at).is_some() {
                        return Err(RecordError::RepeatedColumn(line, role.name()));
                    }
                }
                None if is_chosen => unused.push((*cell).to_owned()),
                None => {
                    return Err(RecordError::UnknownColumn {
                        line,
                        column: (*cell).to_owned(),
                        found: header_names(header.unwrap_or_default()),
                    });
                }
            }
        }
        for role in [Role::U, Role::Y] {
            if places[role as usize].is_none() && !(options.alone && role == Role::U) {
                let Some(header) = header else {
                    return Err(RecordError::NoHeader(line));
                };
                return Err(RecordError::MissingColumn(line, role.name(), header_names(header)));
            }
        }
        let names = Role::ALL.map(|role| {
            let cell = places[role as usize].and_then(|place| Some(header?[place].to_owned()));
            cell.unwrap_or_else(|| role.name().to_owned())
        });
        let time = &names[Role::T as usize];
        let (unit, names_unit) = (unit(time), unit_name(time).is_some());
        Ok(Self {
            names,
            like_times: options.time.is_none().then(|| like_times(header?, &places)).flatten(),
            places,
            unused,
            unit,
            names_unit,
        })
    }

    /// Whether the column at a place is read.
    pub(super) fn has(&self, place: usize) -> bool {
        self.places.contains(&Some(place)) || self.like_times == Some(place)
    }

    /// Whether there is a column of a role.
    pub(super) fn has_role(&self, role: Role) -> bool {
        self.places[role as usize].is_some()
    }

    /// Whether a choice can be met by a column of any name.
    pub(super) fn by_number(options: &ReadOptions) -> bool {
        let is_number = |column: &Option<String>| column.as_ref().is_some_and(|column| column.parse::<usize>().is_ok());
        is_number(&options.output) && (options.alone || is_number(&options.input))
    }

    /// Returns the cell of a role in a row; `None` if the table has no such column.
    pub(super) fn cell<'a>(&self, row: &[&'a str], role: Role) -> Option<&'a str> {
        self.places[role as usize].map(|place| row[place])
    }

    /// Returns what the file calls the column of a role.
    pub(super) fn name(&self, role: Role) -> &str {
        &self.names[role as usize]
    }

    /// Describes the columns of u, y and t where names other than these were taken.
    pub(super) fn in_words(&self, has_header: bool) -> Vec<String> {
        let words = [Role::U, Role::Y, Role::T, Role::R].into_iter().filter_map(|role| {
            let (place, name) = (self.places[role as usize]? + 1, self.name(role));
            if !has_header {
                return Some(format!("{} is column {place}", role.name()));
            }
            let plain = name == role.name() || name == "time";
            let unit = match role {
                Role::T if self.unit.is_some_and(|unit| unit != 1.0) => {
                    unit_name(name).map_or_else(String::new, |unit| format!(" in {unit}"))
                }
                _ => String::new(),
            };
            (!plain).then(|| format!("{} is column '{name}'{unit}", role.name()))
        });
        let mut words: Vec<String> = words.collect();
        if !self.unused.is_empty() {
            let unused: Vec<String> = self.unused.iter().map(|name| format!("'{name}'")).collect();
            words.push(format!("not used: {}", listed(&unused, SHOWN)));
        }
        words
    }
}

/// Unused columns that are named.
const SHOWN: usize = 4;

/// The choice that no column holds times.
const NO_TIME: &str = "none";

/// Returns the place of a column that is chosen by its name or its number. The name may be without its unit, such as
/// `Speed` for `Speed [rpm]` and `speed_rpm`, and in capitals or not, where it is the only one.
fn place(column: &str, header: Option<&[&str]>, count: usize, line: u64) -> Result<usize, RecordError> {
    let header = header.unwrap_or_default();
    let mut named = header.iter().enumerate().filter(|(_, cell)| **cell == column);
    if let Some((place, _)) = named.next() {
        if named.next().is_some() {
            return Err(RecordError::AmbiguousColumn(line, column.to_owned()));
        }
        return Ok(place);
    }
    let known = known_as(column);
    let alike = |ends: &dyn Fn(&str) -> bool| -> Vec<usize> {
        let fits = |cell: &str| known_as(cell).strip_prefix(known.as_str()).is_some_and(ends);
        (0..header.len()).filter(|place| fits(header[*place])).collect()
    };
    let mut found = alike(&str::is_empty);
    if found.is_empty() {
        found = alike(&|unit| unit.starts_with(['_', ' ', '/']));
    }
    match (column.parse(), found.as_slice()) {
        (Ok(number @ 1..), _) if number <= count => Ok(number - 1),
        (_, [place]) => Ok(*place),
        (_, [_, _, ..]) => Err(RecordError::AmbiguousColumn(line, column.to_owned())),
        _ if header.is_empty() => Err(RecordError::NoNumber(line, column.to_owned(), count)),
        _ => Err(RecordError::NotThere {
            line,
            column: column.to_owned(),
            found: header_names(header),
        }),
    }
}

/// The units of times that a column's name may end with, such as t_ms.
const ENDINGS: [&str; 3] = ["_s", "_ms", "_us"];

/// Returns a column's name in lower case, without a unit in brackets; of a column of times without one at its end
/// either.
fn known_as(cell: &str) -> String {
    let name = cell.split(['(', '[']).next().unwrap_or(cell);
    let name = name.trim().to_lowercase();
    let mut shorter = ENDINGS.iter().filter_map(|end| name.strip_suffix(end));
    match shorter.find(|name| Role::T.names().contains(name) || TIMES.contains(name)) {
        Some(time) => time.to_owned(),
        None => name,
    }
}

/// Names of times in lower case.
const TIMES: [&str; 9] = [
    "t",
    "time",
    "times",
    "timestamp",
    "zeit",
    "temps",
    "tiempo",
    "tempo",
    "seconds",
];

/// Returns the first column without a role that has a name of times, or a unit of times in brackets.
fn like_times(header: &[&str], places: &[Option<usize>; 5]) -> Option<usize> {
    if places[Role::T as usize].is_some() {
        return None;
    }
    let is_like = |cell: &str| {
        let in_brackets = cell.contains(['(', '[']) && unit(cell).is_some();
        TIMES.contains(&known_as(cell).as_str()) || in_brackets
    };
    let free = header.iter().enumerate().filter(|(at, _)| !places.contains(&Some(*at)));
    let mut like = free.filter(|(_, cell)| is_like(cell)).map(|(at, _)| at);
    like.next()
}

/// Returns the unit that a column's name has in brackets or at its end, in lower case.
fn unit_name(name: &str) -> Option<String> {
    let lower = name.trim().to_lowercase();
    if let Some((_, unit)) = lower.split_once(['(', '[']) {
        return Some(unit.trim_end_matches([')', ']', ' ']).trim().to_owned());
    }
    let ending = ENDINGS.iter().find(|end| lower.ends_with(**end))?;
    Some(ending.trim_start_matches('_').to_owned())
}

/// Returns the seconds in the unit of a column's name, 1 if it has none; `None` if the unit is unknown.
fn unit(name: &str) -> Option<f64> {
    let Some(unit) = unit_name(name) else {
        return Some(1.0);
    };
    Some(match unit.as_str() {
        "s" | "sec" | "second" | "seconds" => 1.0,
        "ms" => 1e-3,
        "us" | "\u{b5}s" | "\u{3bc}s" => 1e-6,
        "min" => 60.0,
        "h" => 3600.0,
        _ => return None,
    })
}
