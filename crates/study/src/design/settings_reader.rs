//! Reads the settings of a cell, with errors that name the key.

use crate::design::file::{AUTOMATIC, At, ExperimentFile, FileError, Key, Scalar, Settings, wrong};
use asobench_identification::names::UnknownName;
use asobench_identification::text::number;
use std::collections::BTreeMap;

/// The largest order, window or record. A longer record would not fit into memory.
pub(crate) const LARGEST_COUNT: f64 = 1e7;

/// Makes a cell from its settings.
pub(crate) struct SettingsReader<'a> {
    /// The file.
    pub(crate) file: &'a ExperimentFile,
    /// The cell's settings.
    pub(crate) settings: Settings,
}

/// Returns the table that a setting names; `built_in` are further names to offer.
pub(crate) fn named<'a, T>(
    key: Key,
    name: &str,
    built_in: &[&str],
    tables: &'a BTreeMap<String, T>,
) -> Result<&'a T, FileError> {
    let names = tables.keys().map(String::as_str);
    let known = built_in.iter().copied().chain(names);
    let table = tables.get(name);
    table.ok_or_else(|| UnknownName::new(key, name, known)).at(key)
}

impl SettingsReader<'_> {
    /// Returns the value of a setting; its default if a resolved file leaves it out.
    fn value(&self, key: Key) -> Option<Scalar> {
        let given = self.settings.get(&key).cloned();
        given.or_else(|| key.default().filter(|_| key.entry().left_out))
    }

    pub(crate) fn text(&self, key: Key) -> String {
        self.value(key).map_or_else(String::new, |value| value.to_string())
    }

    pub(crate) fn number(&self, key: Key) -> Result<f64, FileError> {
        match self.value(key) {
            Some(Scalar::Number(number)) => Ok(number),
            _ => wrong(key, format!("'{}'; expected a number", self.text(key))),
        }
    }

    pub(crate) fn count(&self, key: Key) -> Result<usize, FileError> {
        let count = self.number(key)?;
        if (0.0..=LARGEST_COUNT).contains(&count) && count.fract() == 0.0 {
            Ok(count as usize)
        } else {
            let count = number(count);
            let message = format!("{count}; expected a whole number of 0 to {LARGEST_COUNT}");
            wrong(key, message)
        }
    }

    pub(crate) fn count_or(&self, key: Key, automatic: usize) -> Result<usize, FileError> {
        if self.text(key) == AUTOMATIC {
            Ok(automatic)
        } else {
            self.count(key)
        }
    }

    pub(crate) fn name<T: std::str::FromStr<Err: std::fmt::Display>>(&self, key: Key) -> Result<T, FileError> {
        self.text(key).parse::<T>().at(key)
    }
}
