//! The properties of estimators' options: keys, descriptions, defaults, schemas.

use super::EstimatorName;
use serde_json::Value;
use std::sync::LazyLock;

/// One option of some estimators.
#[derive(Clone, Debug)]
pub struct OptionEntry {
    /// Its key.
    pub key: String,
    /// Its description in one sentence.
    pub about: String,
    /// Its default; null if that follows from the setting.
    pub default: Value,
    /// Its JSON schema.
    pub schema: Value,
}

/// The options of each estimator, in the order of [`EstimatorName::ALL`]. They are read off the types once.
static OPTIONS: LazyLock<Vec<Vec<OptionEntry>>> = LazyLock::new(|| {
    let all = EstimatorName::ALL.iter();
    all.map(|estimator| estimator.read_options()).collect()
});

impl EstimatorName {
    /// Returns the options of the estimator, in their order.
    pub fn options(self) -> &'static [OptionEntry] {
        let at = Self::ALL.iter().position(|name| *name == self);
        at.map_or(&[], |at| &OPTIONS[at])
    }

    fn read_options(self) -> Vec<OptionEntry> {
        let (schema, defaults) = (self.options_schema(), self.defaults());
        let entries = defaults.as_object().into_iter().flatten();
        let entries = entries.map(|(key, default)| {
            let mut schema = schema["properties"][key].clone();
            // Its lines end where those of the comment in the code do.
            let about = schema["description"].as_str().unwrap_or_default();
            let about = about.replace('\n', " ");
            if let Some(schema) = schema.as_object_mut() {
                schema.shift_remove("description");
                schema.shift_remove("default");
            }
            OptionEntry {
                key: key.clone(),
                about,
                default: default.clone(),
                schema,
            }
        });
        entries.collect()
    }

    /// Returns whether the estimator has an option.
    pub fn takes(self, key: &str) -> bool {
        self.options().iter().any(|option| option.key == key)
    }
}

/// Returns the keys of all estimators' options, each once, in their order.
pub fn option_keys() -> &'static [String] {
    static KEYS: LazyLock<Vec<String>> = LazyLock::new(|| {
        let mut keys: Vec<String> = Vec::new();
        for estimator in EstimatorName::ALL {
            for option in estimator.options() {
                if !keys.contains(&option.key) {
                    keys.push(option.key.clone());
                }
            }
        }
        keys
    });
    &KEYS
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Map;

    /// Every option has a description, a default that reads back, and a meaning of its own.
    #[test]
    fn every_estimator_describes_its_options() {
        for estimator in EstimatorName::ALL {
            assert!(!estimator.about().is_empty());
            let options = estimator.options();
            for option in options {
                assert!(!option.about.is_empty(), "{estimator} {}", option.key);
                assert!(estimator.takes(&option.key));
                assert!(option_keys().contains(&option.key));
            }
            let read = estimator.parse(Map::new()).unwrap();
            assert_eq!(read.estimator(), *estimator);
            assert_eq!(estimator.parse(read.describe()).unwrap(), read);
            assert!(!estimator.takes("name"));
        }
    }

    #[test]
    fn mistakes_are_told() {
        let parse = |estimator: EstimatorName, text: &str| {
            let options = serde_json::from_str(text).unwrap();
            estimator.parse(options).unwrap_err().to_string()
        };
        for (estimator, text, part) in [
            (EstimatorName::Arx, "{\"orders\": \"na=1,nc=1\"}", "expected na, nb, nk"),
            (EstimatorName::Arx, "{\"orders\": \"nk=1\"}", "at least 1"),
            (
                EstimatorName::Arx,
                "{\"rows\": \"all\"}",
                "unknown choice of rows 'all'",
            ),
            (
                EstimatorName::InstrumentalVariables,
                "{\"iterations\": 0}",
                "expected 1 to",
            ),
        ] {
            let error = parse(estimator, text);
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
