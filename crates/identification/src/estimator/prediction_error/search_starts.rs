//! The option `starts`: where searches begin.

use crate::estimator::method_kind::{Needs, OptionUnits};
#[cfg(feature = "json")]
use serde::{Deserialize, Deserializer};
use serde::{Serialize, Serializer};
#[cfg(feature = "json")]
use serde_json::Value;

/// Random starts besides those from linear methods: by rule up to this many samples, at least, and the largest number.
const RANDOM_STARTS: usize = 128;
const SHORT: usize = 500;
const LEAST_STARTS: usize = 8;
#[cfg(feature = "json")]
const MOST_STARTS: usize = 10_000;

/// The starts of the searches of a prediction error method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SearchStarts {
    /// Linear methods, and up to 128 random starts; from 500 samples on fewer, as 1/N^2, but 8. Long records have fewer
    /// minima that compete.
    #[default]
    Rule,
    /// Linear methods, and this number of random stable models.
    Random(usize),
    /// The true plant alone, which no user has: the remaining error is then not due to other minima.
    Truth,
}

impl SearchStarts {
    /// The true plant is needed if it is the only start.
    pub(in crate::estimator) fn needs(self) -> Needs {
        Needs {
            plant: self == Self::Truth,
            ..Needs::default()
        }
    }

    /// The true plant has a gain.
    pub(in crate::estimator) fn option_units(self) -> OptionUnits {
        OptionUnits::Gain.only_if(self == Self::Truth)
    }

    /// Returns the largest number of random starts for a record of N samples.
    pub(in crate::estimator) fn random(self, window: usize) -> usize {
        let share = SHORT as f64 / window.max(SHORT) as f64;
        match self {
            Self::Rule => ((RANDOM_STARTS as f64 * share * share) as usize).max(LEAST_STARTS),
            Self::Random(count) => count,
            Self::Truth => 0,
        }
    }
}

impl Serialize for SearchStarts {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Random(count) => serializer.serialize_u64(*count as u64),
            Self::Rule => serializer.serialize_str("rule"),
            Self::Truth => serializer.serialize_str("truth"),
        }
    }
}

#[cfg(feature = "json")]
impl<'de> Deserialize<'de> for SearchStarts {
    /// Reads a number, "rule" or "truth".
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let given = Value::deserialize(deserializer)?;
        let count = match &given {
            Value::String(text) if text == "rule" => return Ok(Self::Rule),
            Value::String(text) if text == "truth" => return Ok(Self::Truth),
            Value::String(text) => text.parse().ok(),
            other => other.as_u64().and_then(|count| usize::try_from(count).ok()),
        };
        let count = count.filter(|count| *count <= MOST_STARTS);
        count
            .map(Self::Random)
            .ok_or_else(|| serde::de::Error::custom(format!("{given}; expected 0 to {MOST_STARTS}, rule or truth")))
    }
}

#[cfg(feature = "json")]
impl schemars::JsonSchema for SearchStarts {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "SearchStarts".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "anyOf": [
                { "type": "integer", "minimum": 0, "maximum": MOST_STARTS },
                { "enum": ["rule", "truth"] }
            ]
        })
    }
}
