//! A model that makes instruments in every pass of instrumental variables.

use crate::model::polynomial::{self, divide, filter};
#[cfg(feature = "json")]
use serde::{Deserialize, Deserializer};
use serde::{Serialize, Serializer};
#[cfg(feature = "json")]
use serde_json::Value;

/// A model `x = B/F u` whose output is the instrument in every pass.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedModel {
    b: Vec<f64>,
    f: Vec<f64>,
}

impl FixedModel {
    /// Makes the model from polynomials in q^-1, leading coefficients included.
    ///
    /// # Errors
    /// A message if a number is not finite, B is empty, or F does not begin with 1.
    pub fn new(b: Vec<f64>, f: Vec<f64>) -> Result<Self, String> {
        if b.is_empty() || !b.iter().chain(&f).all(|value| value.is_finite()) {
            return Err("expected B and F as lists of finite numbers".to_owned());
        }
        if f.first() != Some(&1.0) {
            return Err("expected an F that begins with 1".to_owned());
        }
        Ok(Self { b, f })
    }

    /// Computes the output x of the model, from rest.
    pub(super) fn run(&self, u: &[f64], x: &mut [f64]) {
        filter(&self.b, u, x);
        divide(&self.f, x);
    }
}

impl std::str::FromStr for FixedModel {
    type Err = String;

    /// Parses `B=0,1;F=1,-0.5`; F is 1 if not given.
    fn from_str(text: &str) -> Result<Self, String> {
        let (mut b, mut f) = (Vec::new(), vec![1.0]);
        for part in text.split(';') {
            let (name, numbers) = part.split_once('=').unwrap_or((part, ""));
            let place = match name.trim() {
                "B" => &mut b,
                "F" => &mut f,
                _ => return Err(format!("'{part}'; expected a text such as B=0,1;F=1,-0.5")),
            };
            let numbers = polynomial::parse(numbers);
            *place = numbers.ok_or_else(|| format!("'{part}' is not a list of numbers"))?;
        }
        Self::new(b, f)
    }
}

impl std::fmt::Display for FixedModel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [numerator, denominator] = [&self.b, &self.f].map(|c| polynomial::text(c));
        write!(f, "B={numerator};F={denominator}")
    }
}

impl Serialize for FixedModel {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(feature = "json")]
impl<'de> Deserialize<'de> for FixedModel {
    /// Reads a text, or a table of lists.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Table {
            #[serde(rename = "B")]
            b: Vec<f64>,
            #[serde(rename = "F")]
            f: Option<Vec<f64>>,
        }
        let model = match Value::deserialize(deserializer)? {
            Value::String(text) => text.parse(),
            table => serde_json::from_value(table)
                .map_err(|error| error.to_string())
                .and_then(|Table { b, f }| Self::new(b, f.unwrap_or_else(|| vec![1.0]))),
        };
        model.map_err(serde::de::Error::custom)
    }
}

#[cfg(feature = "json")]
impl schemars::JsonSchema for FixedModel {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "FixedModel".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let list = serde_json::json!({ "type": "array", "items": { "type": "number" } });
        schemars::json_schema!({
            "anyOf": [
                { "type": "string" },
                {
                    "type": "object",
                    "properties": { "B": list, "F": list },
                    "required": ["B"],
                    "additionalProperties": false
                }
            ]
        })
    }
}

#[cfg(all(test, feature = "json"))]
mod tests {
    use super::*;

    #[test]
    fn models_are_read_as_texts_and_tables() {
        let model: FixedModel = "B=0,1; F=1,-0.5".parse().unwrap();
        let table = serde_json::from_str("{\"B\": [0, 1], \"F\": [1, -0.5]}").unwrap();
        assert_eq!(model, table);
        assert_eq!(model.to_string().parse(), Ok(model));
        for (text, part) in [
            ("0,1", "expected a text such as"),
            ("B=x", "not a list of numbers"),
            ("B=1;F=2", "begins with 1"),
            ("F=1", "finite numbers"),
        ] {
            let error = text.parse::<FixedModel>().unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
