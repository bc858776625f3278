//! Methods with their settings as resolved.

use super::mechanisms::{is_of_methods, settings};
use super::part::{Part, Row, at_most, row};
use super::words::{listed, pairs, table};
use crate::results::Study;
use asobench_identification::estimator::EstimatorName;
use asobench_study::study::file::MethodTable;
use serde_json::{Map, Value};

pub(super) fn part(study: &Study) -> Part {
    let file = &study.file;
    let methods = file.methods.iter().map(|of| row(of.output_name(1), method(of)));
    let mut rows: Vec<Row> = at_most(methods.collect());
    let observers = file.observers.iter();
    let observers = observers.map(|of| row(of.label(), table(of, &["name"])));
    rows.extend(at_most(observers.collect()));
    let labels = listed(study.labels().iter().cloned(), " \u{b7} ");
    rows.push(row(
        "outputs",
        format!("{labels} (a method and its pass, or an observer)"),
    ));
    let (given, defaults) = settings(study, is_of_methods);
    rows.extend(given);
    Part::new("Methods", rows, defaults)
}

/// A method: what differs from the defaults of its estimator, then the defaults.
fn method(method: &MethodTable) -> String {
    let Ok(Value::Object(mut options)) = serde_json::to_value(method) else {
        return String::new();
    };
    options.shift_remove("name");
    let estimator = options.get("estimator").and_then(Value::as_str);
    let estimator = estimator.and_then(|name| name.parse::<EstimatorName>().ok());
    let entries = estimator.map(EstimatorName::options).unwrap_or_default();
    let is_default = |key: &str, value: &Value| {
        let mut entries = entries.iter();
        entries.any(|entry| entry.key == key && entry.default == *value)
    };
    let split: (Map<_, _>, Map<_, _>) = options.into_iter().partition(|(key, value)| !is_default(key, value));
    let (given, defaults) = split;
    let mut text = pairs(given.iter());
    if !defaults.is_empty() {
        text.push_str(&format!("; defaults: {}", pairs(defaults.iter())));
    }
    text
}
