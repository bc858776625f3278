//! The rows of the description, and values of an experiment file in words.

use asobench_study::text::number;
use serde_json::Value;

/// The most rows of one kind, such as comparisons; the manifest has the others.
pub(super) const MOST: usize = 40;

/// A term and its value.
pub(super) type Row = (String, String);

/// A part of the description.
pub(super) struct Part {
    pub(super) heading: &'static str,
    /// The settings in the file, and what follows from them.
    pub(super) rows: Vec<Row>,
    /// The settings that have their defaults.
    pub(super) defaults: Vec<Row>,
}

impl Part {
    pub(super) fn new(heading: &'static str, rows: Vec<Row>, defaults: Vec<Row>) -> Self {
        Self {
            heading,
            rows,
            defaults,
        }
    }
}

pub(super) fn row(term: impl Into<String>, value: impl Into<String>) -> Row {
    (term.into(), value.into())
}

/// Replaces what is beyond the most rows of a kind by a row that counts it.
pub(super) fn at_most(mut rows: Vec<Row>) -> Vec<Row> {
    if rows.len() > MOST {
        let left = rows.len() - MOST;
        rows.truncate(MOST);
        rows.push(row("and more", format!("{left} in manifest.json")));
    }
    rows
}

/// A value of JSON: numbers as short as they are exact, tables as "key value, key value".
pub(super) fn words(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::Bool(value) => value.to_string(),
        Value::Number(value) => value
            .as_f64()
            .filter(|_| !value.is_u64())
            .map_or_else(|| value.to_string(), number),
        Value::String(text) => text.clone(),
        Value::Array(items) => format!("[{}]", listed(items.iter().map(within), ", ")),
        Value::Object(table) => pairs(table.iter()),
    }
}

/// A value inside a list.
fn within(value: &Value) -> String {
    match value {
        Value::Object(_) => format!("({})", words(value)),
        value => words(value),
    }
}

/// "key value, key value".
pub(super) fn pairs<'a>(table: impl Iterator<Item = (&'a String, &'a Value)>) -> String {
    let pairs = table.map(|(key, value)| match value {
        Value::Object(_) => format!("{key} ({})", words(value)),
        value => format!("{key} {}", words(value)),
    });
    pairs.collect::<Vec<_>>().join(", ")
}

/// A table of the file in words; `left_out` are keys that are said elsewhere.
pub(super) fn table(table: &impl serde::Serialize, left_out: &[&str]) -> String {
    match serde_json::to_value(table) {
        Ok(Value::Object(table)) => pairs(table.iter().filter(|(key, _)| !left_out.contains(&key.as_str()))),
        Ok(value) => words(&value),
        // The file was read from JSON of the same form.
        Err(error) => error.to_string(),
    }
}

/// The items with a separator between them; of many only the first and the last.
pub(super) fn listed(items: impl Iterator<Item = String>, between: &str) -> String {
    let items: Vec<String> = items.collect();
    if items.len() <= MOST {
        return items.join(between);
    }
    let (first, last) = (&items[..MOST / 2], &items[items.len() - MOST / 2..]);
    let [first, last] = [first, last].map(|items| items.join(between));
    format!("{first}{between}...{between}{last} ({} values)", items.len())
}
