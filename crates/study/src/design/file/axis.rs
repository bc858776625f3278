//! One or several values of a setting: a scalar, a list, or a range.

use crate::text::folded;
use asobench_identification::text::number;
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeSet;
use std::fmt;

/// A number or a text.
#[derive(Clone, Debug, PartialEq)]
pub enum Scalar {
    /// A finite number.
    Number(f64),
    /// A text.
    Text(String),
}

impl fmt::Display for Scalar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(x) => f.write_str(&number(*x)),
            Self::Text(text) => f.write_str(text),
        }
    }
}

impl From<&str> for Scalar {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl Serialize for Scalar {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            // Whole numbers are written without a decimal point.
            Self::Number(x) if x.fract() == 0.0 && x.abs() < 1e15 => serializer.serialize_i64(*x as i64),
            Self::Number(x) => serializer.serialize_f64(*x),
            Self::Text(text) => serializer.serialize_str(text),
        }
    }
}

impl<'de> Deserialize<'de> for Scalar {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match Axis::deserialize(deserializer)? {
            Axis::One(value) => Ok(value),
            _ => Err(D::Error::custom("expected one number or text")),
        }
    }
}

impl schemars::JsonSchema for Scalar {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Scalar".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "A number or a text.",
            "type": ["number", "string"],
        })
    }
}

/// The values of one setting; several make an axis of the grid.
#[derive(Clone, Debug, PartialEq)]
pub enum Axis {
    /// One value: no axis.
    One(Scalar),
    /// A list.
    Many(Vec<Scalar>),
    /// The values of a range; settings that are counts round them to whole numbers.
    Range(Vec<f64>),
}

impl Axis {
    /// Returns the values. Those from a range are rounded to whole numbers if `count`.
    pub fn values(&self, count: bool) -> Vec<Scalar> {
        match self {
            Self::One(value) => vec![value.clone()],
            Self::Many(values) => values.clone(),
            Self::Range(values) => {
                let rounded = |x: &f64| if count { x.round() } else { *x };
                let mut values: Vec<f64> = values.iter().map(rounded).collect();
                values.dedup();
                values.into_iter().map(Scalar::Number).collect()
            }
        }
    }
}

impl Serialize for Axis {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::One(value) => value.serialize(serializer),
            Self::Many(values) => values.serialize(serializer),
            Self::Range(values) => values.serialize(serializer),
        }
    }
}

const EXPECTED: &str = "a number, a text, a list of them, or a range such as { logspace = [0.1, 100, 13] }";

/// The length of the longest list.
pub(crate) const LONGEST: usize = 10_000;

struct AxisVisitor;

impl<'de> Visitor<'de> for AxisVisitor {
    type Value = Axis;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(EXPECTED)
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Axis, E> {
        self.visit_f64(value as f64)
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Axis, E> {
        self.visit_f64(value as f64)
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Axis, E> {
        if value.is_finite() {
            Ok(Axis::One(Scalar::Number(value)))
        } else {
            Err(E::custom(format!("{value} is not a finite number")))
        }
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Axis, E> {
        Ok(Axis::One(Scalar::Text(value.to_owned())))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Axis, A::Error> {
        let mut values = Vec::new();
        let mut seen = BTreeSet::new();
        while let Some(value) = list.next_element::<Axis>()? {
            match value {
                Axis::One(_) if values.len() == LONGEST => {
                    return Err(A::Error::custom(format!("a list of more than {LONGEST} values")));
                }
                // Results distinguish values by their texts.
                Axis::One(value) if !seen.insert(folded(&value.to_string())) => {
                    return Err(A::Error::custom(format!(
                        "{value} is given twice in the list; case, blanks and invisible characters make \
                        no difference"
                    )));
                }
                Axis::One(value) => values.push(value),
                _ => return Err(A::Error::custom("a list within a list")),
            }
        }
        if values.is_empty() {
            return Err(A::Error::custom("an empty list; expected at least one value"));
        }
        Ok(Axis::Many(values))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Axis, A::Error> {
        let range = map.next_entry::<String, (f64, f64, f64)>()?;
        let Some((kind, (from, to, count))) = range else {
            return Err(A::Error::custom(format!("an empty table; expected {EXPECTED}")));
        };
        if map.next_key::<String>()?.is_some() {
            return Err(A::Error::custom("more than one key in a range; expected one"));
        }
        let values = match kind.as_str() {
            "linspace" => range_of(from, to, count, |x| x, |x| x),
            "logspace" if !(from > 0.0 && to > 0.0) => {
                return Err(A::Error::custom("logspace needs ends above 0"));
            }
            "logspace" => range_of(from, to, count, f64::log10, |x| 10.0_f64.powf(x)),
            _ => {
                let message = format!("unknown range '{kind}'; expected linspace or logspace");
                return Err(A::Error::custom(message));
            }
        };
        let wrong = "a range needs [from, to, count] with finite ends and a whole count of 2 to 10000";
        values.map(Axis::Range).ok_or_else(|| A::Error::custom(wrong))
    }
}

/// Returns `count` values from `from` to `to`, evenly spaced under `map`. They are rounded to six significant digits,
/// so that they are the same numbers on every machine; the ends are exact.
fn range_of(from: f64, to: f64, count: f64, map: impl Fn(f64) -> f64, back: impl Fn(f64) -> f64) -> Option<Vec<f64>> {
    if !(from.is_finite() && to.is_finite() && (2.0..=10_000.0).contains(&count)) || count.fract() != 0.0 {
        return None;
    }
    let last = count as usize - 1;
    let value = |i: usize| {
        if i == 0 {
            return Some(from);
        }
        if i == last {
            return Some(to);
        }
        let share = i as f64 / last as f64;
        let x = back(map(from) + share * (map(to) - map(from)));
        format!("{x:.5e}").parse().ok()
    };
    (0..=last).map(value).collect()
}

impl<'de> Deserialize<'de> for Axis {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AxisVisitor)
    }
}

impl schemars::JsonSchema for Axis {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Axis".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let scalar = || serde_json::json!({ "type": ["number", "string"] });
        let range = || {
            let number = serde_json::json!({ "type": "number" });
            serde_json::json!({ "type": "array", "items": number, "minItems": 3, "maxItems": 3 })
        };
        schemars::json_schema!({
            "description":
                "One value, a list (an axis of the grid), or a range: [from, to, count].",
            "anyOf": [
                scalar(),
                { "type": "array", "items": scalar(), "minItems": 1, "uniqueItems": true },
                {
                    "type": "object",
                    "properties": { "linspace": range(), "logspace": range() },
                    "minProperties": 1, "maxProperties": 1, "additionalProperties": false
                },
            ],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(text: &str) -> Result<Axis, String> {
        serde_json::from_str(text).map_err(|error| error.to_string())
    }

    #[test]
    fn ranges_are_evenly_spaced_and_end_exactly() {
        let numbers = |text: &str, count| -> Vec<f64> {
            let number = |value: Scalar| match value {
                Scalar::Number(x) => x,
                Scalar::Text(text) => panic!("{text}"),
            };
            axis(text).unwrap().values(count).into_iter().map(number).collect()
        };
        assert_eq!(
            numbers(r#"{"linspace": [0, 1, 5]}"#, false),
            [0.0, 0.25, 0.5, 0.75, 1.0]
        );
        let logarithmic = [0.1, 0.316228, 1.0, 3.16228, 10.0];
        assert_eq!(numbers(r#"{"logspace": [0.1, 10, 5]}"#, false), logarithmic);
        assert_eq!(numbers(r#"{"logspace": [18, 180, 3]}"#, true), [18.0, 57.0, 180.0]);
        assert_eq!(numbers("[3, 1]", true), [3.0, 1.0]);
    }

    #[test]
    fn what_is_no_axis_is_refused_with_what_was_expected() {
        for (text, part) in [
            ("[]", "empty list"),
            ("[1, 1]", "is given twice"),
            (r#"[1, "1"]"#, "is given twice"),
            (r#"["C2", "c2"]"#, "is given twice"),
            (r#"["a b", "a  b"]"#, "is given twice"),
            ("[[1]]", "list within a list"),
            ("true", "expected a number"),
            (r#"{"linspce": [1, 2, 3]}"#, "unknown range 'linspce'"),
            (r#"{"logspace": [0, 2, 3]}"#, "above 0"),
            (r#"{"linspace": [0, 2, 2.5]}"#, "whole count"),
            ("{}", "empty table"),
        ] {
            let error = axis(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
