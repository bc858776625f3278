//! In which keys the designs of two studies differ.

use crate::design::design_of;
use crate::design::file::ExperimentFile;
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// The longest value that is shown beside its key.
const LONGEST: usize = 40;

/// The keys in which the design of results differs from one of now, each with both values where they are short:
/// "seed 7 there, 9 here".
pub(crate) fn different(there: &Value, here: &Value) -> Vec<String> {
    let shown = |of: &Value, key: &str| {
        let value = of.pointer(&format!("/{}", key.replace('.', "/")))?;
        let text = (!value.is_array()).then(|| value.to_string());
        text.filter(|text| text.len() <= LONGEST)
    };
    let said = |key: String| {
        let name = key.trim_start_matches("experiment.");
        match (shown(there, &key), shown(here, &key)) {
            (Some(there), Some(here)) => format!("{name} {there} there, {here} here"),
            _ => name.to_owned(),
        }
    };
    keys(there, here).into_iter().map(said).collect()
}

/// Whether two designs with versions are the same but for methods, and what is compared among them.
pub(crate) fn same_but_for_methods(left: &Value, right: &Value) -> bool {
    const OF_METHODS: [&str; 3] = ["methods", "compare", "needed"];
    let part = |key: &str| key.split('.').nth(1).is_some_and(|key| OF_METHODS.contains(&key));
    keys(left, right)
        .iter()
        .all(|key| key.starts_with("experiment.") && part(key))
}

/// Whether two studies have the same trials: their designs differ in methods alone, if at all.
pub fn same_trials(left: &ExperimentFile, right: &ExperimentFile) -> bool {
    let [left, right] = [left, right].map(|file| {
        let file = serde_json::to_value(file).unwrap_or_default();
        json!({ "experiment": design_of(&file) })
    });
    same_but_for_methods(&left, &right)
}

/// The paths of values that differ.
fn keys(left: &Value, right: &Value) -> Vec<String> {
    let mut keys = Vec::new();
    differences("", left, right, &mut keys);
    keys
}

fn differences(path: &str, left: &Value, right: &Value, keys: &mut Vec<String>) {
    match (left, right) {
        (Value::Object(left), Value::Object(right)) => {
            let all: BTreeSet<&String> = left.keys().chain(right.keys()).collect();
            for key in all {
                let dot = if path.is_empty() { "" } else { "." };
                let null = &Value::Null;
                let (left, right) = (left.get(key).unwrap_or(null), right.get(key).unwrap_or(null));
                differences(&format!("{path}{dot}{key}"), left, right, keys);
            }
        }
        _ if left != right => keys.push(path.to_owned()),
        _ => {}
    }
}
