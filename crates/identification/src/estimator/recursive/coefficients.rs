//! A list of numbers as an option: a text or an array.

#[cfg(feature = "json")]
use serde::{Deserialize, Deserializer};
use serde::{Serialize, Serializer};

/// Finite numbers, such as `-1.5,0.7,1,0.5`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coefficients(Vec<f64>);

impl Coefficients {
    /// Takes numbers.
    ///
    /// # Errors
    /// A message if one is not finite.
    pub fn new(numbers: Vec<f64>) -> Result<Self, String> {
        if numbers.iter().all(|number| number.is_finite()) {
            Ok(Self(numbers))
        } else {
            Err("expected finite numbers".to_owned())
        }
    }

    /// Returns the numbers.
    pub fn numbers(&self) -> &[f64] {
        &self.0
    }
}

impl std::str::FromStr for Coefficients {
    type Err = String;

    /// Parses numbers with commas between them.
    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split(',').map(|number| number.trim().parse());
        let numbers: Result<Vec<f64>, _> = numbers.collect();
        let message = |_| format!("'{text}'; expected numbers with commas, such as -1.5,0.7,1,0.5");
        Self::new(numbers.map_err(message)?)
    }
}

impl Serialize for Coefficients {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

#[cfg(feature = "json")]
impl<'de> Deserialize<'de> for Coefficients {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let read = match serde_json::Value::deserialize(deserializer)? {
            serde_json::Value::String(text) => text.parse(),
            list => serde_json::from_value(list)
                .map_err(|error| error.to_string())
                .and_then(Self::new),
        };
        read.map_err(serde::de::Error::custom)
    }
}

#[cfg(feature = "json")]
impl schemars::JsonSchema for Coefficients {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Coefficients".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "anyOf": [
                { "type": "string" },
                { "type": "array", "items": { "type": "number" } }
            ]
        })
    }
}
