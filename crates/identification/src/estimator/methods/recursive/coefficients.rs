//! Numbers as an option: a text, since a list in an option makes one method for each value.

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

impl std::fmt::Display for Coefficients {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let texts: Vec<String> = self.0.iter().map(f64::to_string).collect();
        f.pad(&texts.join(","))
    }
}

impl Serialize for Coefficients {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(feature = "json")]
impl<'de> Deserialize<'de> for Coefficients {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(feature = "json")]
impl schemars::JsonSchema for Coefficients {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Coefficients".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back() {
        let numbers: Coefficients = "-1.5, 0.7,1e-20".parse().unwrap();
        assert_eq!(numbers.numbers(), [-1.5, 0.7, 1e-20]);
        assert_eq!(numbers.to_string().parse(), Ok(numbers));
        for (text, part) in [("1,x", "such as -1.5"), ("", "such as"), ("1,inf", "finite")] {
            let error = text.parse::<Coefficients>().unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
