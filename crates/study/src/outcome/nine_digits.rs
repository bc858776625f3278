//! Numbers as summaries store them: results with nine significant digits, what was asked for with all of them, since
//! claims are matched with it.

use serde::{Serialize, Serializer};
use serde_json::Value;

/// The keys of what was asked for.
const ASKED: [&str; 4] = ["settings", "eta", "bound", "of"];

/// Serializes items with numbers of nine significant digits. Works item by item, because all items of a large study
/// would not fit into memory.
pub(crate) fn rounded<T: Serialize, S: Serializer>(items: &[T], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(items.iter().map(stored))
}

/// Returns an item as it is stored.
pub(crate) fn stored(item: &impl Serialize) -> Value {
    let mut json = serde_json::to_value(item).unwrap_or_default();
    round(&mut json);
    json
}

fn round(value: &mut Value) {
    match value {
        Value::Array(values) => values.iter_mut().for_each(round),
        Value::Object(values) => {
            let found = values.iter_mut();
            let found = found.filter(|(key, _)| !ASKED.contains(&key.as_str()));
            found.for_each(|(_, value)| round(value));
        }
        Value::Number(number) if number.is_f64() => {
            let rounded = number.as_f64().and_then(|x| format!("{x:.8e}").parse::<f64>().ok());
            if let Some(rounded) = rounded.and_then(serde_json::Number::from_f64) {
                *number = rounded;
            }
        }
        _ => {}
    }
}
