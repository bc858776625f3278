//! Which settings tell cells apart, and descriptions of cells in words.

use crate::design::file::{Key, StudyKind};
use crate::outcome::summary::CellSummary;
use std::collections::{BTreeMap, HashSet};

/// The place of a cell, or of a family of cells, in its study: the values of its settings as text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    values: BTreeMap<Key, String>,
    kind: StudyKind,
}

impl CellSummary {
    /// Returns the place of the cell.
    pub fn place(&self) -> Place {
        let kind = if self.settings.contains_key(&Key::Disturbance) {
            StudyKind::Continuous
        } else {
            StudyKind::Discrete
        };
        let keys = Key::ALL.iter().filter(|key| key.is_of(kind));
        Place {
            values: keys.map(|key| (*key, self.setting(*key))).collect(),
            kind,
        }
    }
}

impl Place {
    /// Returns the value of a setting; empty if there is none.
    pub fn value(&self, key: Key) -> &str {
        self.values.get(&key).map_or("", String::as_str)
    }

    /// Returns the place that all cells share which differ only in these settings.
    #[must_use]
    pub fn without(mut self, keys: &[Key]) -> Self {
        self.values.retain(|key, _| !keys.contains(key));
        self
    }

    /// Returns the values of some settings in words: "1/A noise, N = 98". Readings of the paper are named only if they
    /// are not the default.
    pub fn words(&self, keys: &[Key]) -> String {
        let shown = keys
            .iter()
            .filter(|key| self.values.contains_key(key) && !(key.entry().reading && self.is_default(**key)));
        shown
            .map(|key| words(*key, self.value(*key)))
            .collect::<Vec<_>>()
            .join(", ")
    }

    /// Whether a setting has its default.
    pub fn is_default(&self, key: Key) -> bool {
        key.default_of(self.kind)
            .is_some_and(|value| value.to_string() == self.value(key))
    }
}

/// Returns the settings that tell places apart, without those that follow from another one.
pub fn varying(all: &[Place]) -> Vec<Key> {
    let mut kept: Vec<Key> = Vec::new();
    for key in Key::telling() {
        let is_told = || kept.iter().any(|other| follows(all, key, *other));
        if values(all, key).len() > 1 && !is_told() {
            kept.push(key);
        }
    }
    kept
}

/// Whether the value of `from` determines the value of `key`.
fn follows(all: &[Place], key: Key, from: Key) -> bool {
    let mut seen: BTreeMap<&str, &str> = BTreeMap::new();
    all.iter().all(|place| {
        let value = place.value(key);
        *seen.entry(place.value(from)).or_insert(value) == value
    })
}

/// Returns the values of a setting: ordered by size if all are numbers, otherwise by first appearance.
pub fn values(all: &[Place], key: Key) -> Vec<String> {
    let mut seen = HashSet::new();
    let all = all.iter().map(|place| place.value(key));
    let mut values: Vec<String> = all.filter(|value| seen.insert(*value)).map(str::to_owned).collect();
    let number = |value: &String| value.parse::<f64>().ok();
    if values.iter().all(|value| number(value).is_some()) {
        values.sort_by(|a, b| number(a).partial_cmp(&number(b)).unwrap_or(std::cmp::Ordering::Equal));
    }
    values
}

/// Returns a setting's value in words: "N = 98", "eta = 2 %", "white noise".
pub fn words(key: Key, value: &str) -> String {
    key.words(value)
}

/// Returns a value as the tick of an axis of names.
pub fn value_name(key: Key, value: &str) -> String {
    (key.entry().tick)(value).to_owned()
}

/// Returns the label of an axis of a setting, with its unit.
pub fn axis_label(key: Key) -> String {
    key.axis_label()
}
