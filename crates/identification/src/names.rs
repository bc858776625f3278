//! Enumerations that a user names on the command line or in a file. Each has one list of names for parsing, which
//! suggests the nearest name, and for every output.

use crate::text::{NAME_LIMIT, beginning};
#[cfg(feature = "json")]
#[doc(hidden)]
pub use schemars;
#[doc(hidden)]
pub use serde;
use std::fmt::Display;

/// A name that is not one of the valid ones.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown {what} '{}'{}", beginning(.given, NAME_LIMIT), way_on(.given, .valid))]
pub struct UnknownName {
    /// The kind of thing to be named.
    pub what: String,
    /// The name given.
    pub given: String,
    /// The valid names.
    pub valid: Vec<String>,
}

impl UnknownName {
    /// The error for `given` if one of `valid` was expected.
    pub fn new(what: impl Display, given: impl Display, valid: impl IntoIterator<Item: Display>) -> Self {
        Self {
            what: what.to_string(),
            given: given.to_string(),
            valid: valid.into_iter().map(|name| name.to_string()).collect(),
        }
    }
}

/// A list of so many names is read whole.
const FEW: usize = 12;

/// The names here, each with its names elsewhere, in lower case but for single letters. A name elsewhere that has
/// several here is the first that is valid.
const ELSEWHERE: &str = include_str!("names/elsewhere.txt");

/// The meaning of the name here, where the one from elsewhere means something that is not equal to it.
const NOT_EQUAL: &[(&str, &str)] = &[
    (
        "snr",
        ": noise over output in per cent; an SNR of 20 dB is eta = 10, of s dB eta = 100 / 10^(s/20)",
    ),
    (
        "interpolate",
        ": the longest part without a gap; nothing is interpolated",
    ),
    ("segments", ": the longest part without a gap, one part alone"),
];

/// The valid name of what people who come from elsewhere call `given`.
pub fn here<'a>(given: &str, valid: &[&'a str]) -> Option<&'a str> {
    let folded = given.to_lowercase();
    // N and n are two things.
    let is = |other: &str| other == given || (other.len() > 1 && other == folded);
    let names = ELSEWHERE.lines().filter_map(|line| line.split_once(": "));
    let mut names = names.filter(|(_, others)| others.split(' ').any(&is));
    names.find_map(|(here, _)| valid.iter().copied().find(|name| *name == here))
}

/// The names to write instead: the name here of a thing from elsewhere, or the valid names after the nearest one, if
/// one is near.
fn way_on(given: &str, valid: &[String]) -> String {
    if valid.is_empty() {
        return "; there are none".to_owned();
    }
    // The time grows with the square of the length, and no longer text is a name.
    if given.len() > NAME_LIMIT {
        return format!("; expected {}", listed(given, valid));
    }
    let all: Vec<&str> = valid.iter().map(String::as_str).collect();
    if let Some(here) = here(given, &all) {
        let lower = given.to_lowercase();
        let meaning = NOT_EQUAL.iter().find(|(name, _)| lower.starts_with(name));
        let meaning = meaning.map_or("", |(_, meaning)| *meaning);
        return format!(", which is called '{here}' here{meaning}");
    }
    let near = valid
        .iter()
        .map(|name| (similarity(given, name), name))
        .filter(|(similarity, _)| *similarity > 0.7)
        .max_by(|(a, _), (b, _)| a.total_cmp(b))
        .map_or_else(String::new, |(_, name)| format!(", did you mean '{name}'?"));
    format!("{near}; expected {}", listed(given, valid))
}

/// How near a name is to what was given, in capitals or not.
fn similarity(given: &str, name: &str) -> f64 {
    strsim::jaro_winkler(given, name).max(strsim::jaro_winkler(&given.to_lowercase(), name))
}

/// The valid names; of many, the nearest first.
fn listed(given: &str, valid: &[String]) -> String {
    let mut names: Vec<&str> = valid.iter().map(String::as_str).collect();
    if names.len() > FEW && given.len() <= NAME_LIMIT {
        names.sort_by(|a, b| similarity(given, b).total_cmp(&similarity(given, a)));
    }
    names.join(", ")
}

/// The JSON schema of a [`named_enum`].
#[cfg(feature = "json")]
#[macro_export]
#[doc(hidden)]
macro_rules! name_schema {
    ($name:ident) => {
        impl $crate::names::schemars::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(_: &mut $crate::names::schemars::SchemaGenerator) -> $crate::names::schemars::Schema {
                let names: Vec<&str> = Self::ALL.iter().map(|value| value.name()).collect();
                $crate::names::schemars::json_schema!({ "type": "string", "enum": names })
            }
        }
    };
}
#[cfg(not(feature = "json"))]
#[macro_export]
#[doc(hidden)]
macro_rules! name_schema {
    ($name:ident) => {};
}
#[doc(hidden)]
pub use name_schema;

/// Defines an enumeration whose variants have names. The first variant is the default.
#[macro_export]
#[doc(hidden)]
macro_rules! named_enum {
    (
        $(#[$meta:meta])* $name:ident, $what:literal {
            $(#[$first_meta:meta])* $first:ident = $first_text:literal,
            $($(#[$variant_meta:meta])* $variant:ident = $text:literal,)*
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $name {
            $(#[$first_meta])* #[default] $first,
            $($(#[$variant_meta])* $variant,)*
        }

        impl $name {
            /// Every value, the default first.
            pub const ALL: &[Self] = &[Self::$first, $(Self::$variant,)*];

            /// The name that the command line and every output use.
            pub const fn name(self) -> &'static str {
                match self {
                    Self::$first => $first_text,
                    $(Self::$variant => $text,)*
                }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.name())
            }
        }

        impl std::str::FromStr for $name {
            type Err = $crate::names::UnknownName;

            fn from_str(given: &str) -> Result<Self, Self::Err> {
                let found = Self::ALL.iter().find(|value| value.name() == given);
                found.copied().ok_or_else(|| $crate::names::UnknownName::new($what, given, Self::ALL))
            }
        }

        impl $crate::names::serde::Serialize for $name {
            fn serialize<S: $crate::names::serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(self.name())
            }
        }

        impl<'de> $crate::names::serde::Deserialize<'de> for $name {
            fn deserialize<D: $crate::names::serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let name = String::deserialize(deserializer)?;
                name.parse().map_err($crate::names::serde::de::Error::custom)
            }
        }

        $crate::names::name_schema!($name);
    };
}
#[doc(hidden)]
pub use named_enum;

/// Defines a [`named_enum`] whose variants each have an entry of a table. A variant's doc comment is the text that
/// `about` returns. A variant without an entry does not compile.
#[macro_export]
#[doc(hidden)]
macro_rules! named_table {
    (
        $(#[$meta:meta])* $name:ident, $what:literal, $entry:ty {
            $(#[doc = $first_doc:literal])+ $first:ident = $first_text:literal: $first_entry:expr,
            $($(#[doc = $doc:literal])+ $variant:ident = $text:literal: $value:expr,)*
        }
    ) => {
        $crate::names::named_enum! {
            $(#[$meta])* $name, $what {
                $(#[doc = $first_doc])+ $first = $first_text,
                $($(#[doc = $doc])+ $variant = $text,)*
            }
        }

        impl $name {
            /// A description in one sentence.
            pub const fn about(self) -> &'static str {
                match self {
                    Self::$first => concat!($($first_doc),+).trim_ascii_start(),
                    $(Self::$variant => concat!($($doc),+).trim_ascii_start(),)*
                }
            }

            /// The entry of the table.
            pub const fn entry(self) -> $entry {
                match self {
                    Self::$first => $first_entry,
                    $(Self::$variant => $value,)*
                }
            }
        }
    };
}
#[doc(hidden)]
pub use named_table;

#[cfg(test)]
mod tests {
    use super::{ELSEWHERE, UnknownName, here};

    #[test]
    fn every_name_elsewhere_has_one_here() {
        for line in ELSEWHERE.lines() {
            let (name, others) = line.split_once(": ").expect("a name and its names elsewhere");
            for other in others.split(' ') {
                assert!(here(other, &[name]) == Some(name), "{line}");
            }
        }
    }

    #[test]
    fn where_nothing_has_a_name_none_is_expected() {
        let error = UnknownName::new("covariances", "x", [""; 0]);
        assert_eq!(error.to_string(), "unknown covariances 'x'; there are none");
    }
}
