//! The methods of an experiment file.

use super::FileError;
use super::limits::{LIST_LIMIT, at_most};
use crate::estimator::{IvOptions, LsOptions, Method};
use crate::names::named_enum;
use crate::observer::ObserverKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

named_enum! {
    /// An estimator of this crate.
    EstimatorName, "estimator" {
        /// Instrumental variables with least squares as iteration 0 (the default).
        InstrumentalVariables = "iv",
        /// Least squares alone.
        LeastSquares = "ls",
        /// The true plant and the mean of x(0), as what an observer achieves that knows them.
        Known = "known",
    }
}

/// The most IV passes.
pub const MOST_ITERATIONS: usize = 1000;

/// One value, or several, each of which makes a method of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected a whole number, a text, or a list of either"
)]
enum OneOrMany {
    Number(u64),
    Text(String),
    Numbers(Vec<u64>),
    Texts(Vec<String>),
}

/// A method: an estimator with its options; a list makes one method per value.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MethodTable {
    /// Name in the results; "iv" and "ls" by default, with the options that have lists.
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    /// "iv", "ls" or "known" (the true plant).
    #[serde(skip_serializing_if = "Option::is_none")]
    estimator: Option<EstimatorName>,
    /// How p is solved for: partitioned, lu, cholesky (ls only), qr, svd, dual, augmented.
    #[serde(skip_serializing_if = "Option::is_none")]
    solver: Option<OneOrMany>,
    /// IV passes: reading E11.
    #[serde(skip_serializing_if = "Option::is_none")]
    iterations: Option<OneOrMany>,
    /// Reading E2: corrected, as-printed, as-printed-2024.
    #[serde(skip_serializing_if = "Option::is_none")]
    stage10: Option<OneOrMany>,
    /// Reading E4: refresh, frozen, literal.
    #[serde(skip_serializing_if = "Option::is_none")]
    auxiliary: Option<OneOrMany>,
    /// Reading E12: model, observer.
    #[serde(skip_serializing_if = "Option::is_none")]
    drive: Option<OneOrMany>,
    /// The observer's gain where it drives the auxiliary model.
    #[serde(skip_serializing_if = "Option::is_none")]
    gain: Option<OneOrMany>,
    /// What instruments are formed from: u or r.
    #[serde(skip_serializing_if = "Option::is_none")]
    instruments: Option<OneOrMany>,
    /// The auxiliary model's poles: none (left alone), reflect (into the unit circle).
    #[serde(skip_serializing_if = "Option::is_none")]
    stabilise: Option<OneOrMany>,
    /// Stage 6: estimate, or zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    initial_state: Option<OneOrMany>,
    /// The observer of this method's outputs instead of the setting `gain`: dead-beat, scaled:RHO, poles:LIST;
    /// kalman (steady state; its noise known with "known", else identified on the window); with "known" also
    /// kalman-varying (from the covariance of x(0)).
    #[serde(skip_serializing_if = "Option::is_none")]
    observer: Option<OneOrMany>,
    /// The passes that are reported; all by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<Vec<usize>>,
}

/// The options of one method.
#[derive(Clone, Debug, PartialEq)]
enum Options {
    LeastSquares(LsOptions),
    InstrumentalVariables(IvOptions),
    Known,
}

impl MethodTable {
    /// One table per combination of the options' lists, every option written out; `index` is the place of
    /// this table in the file.
    pub(super) fn expand(&self, index: usize) -> Result<Vec<Self>, FileError> {
        let mut combinations = vec![(self.base_name(), Map::new())];
        for (key, value) in self.options(index)? {
            let Value::Array(values) = value else {
                for (_, options) in &mut combinations {
                    options.insert(key.clone(), value.clone());
                }
                continue;
            };
            if values.is_empty() {
                let place = format!("methods[{index}].{key}");
                return Err(FileError::key(
                    &place,
                    "an empty list; expected at least one value",
                ));
            }
            let several = combinations.len().saturating_mul(values.len());
            at_most(
                &format!("methods[{index}]"),
                several,
                "methods of its lists",
                LIST_LIMIT,
            )?;
            let with = |name: &str, options: &Map<String, Value>, value: &Value| {
                let mut options = options.clone();
                options.insert(key.clone(), value.clone());
                let text = value
                    .as_str()
                    .map_or_else(|| value.to_string(), str::to_owned);
                let several = values.len() > 1;
                let name = if several {
                    format!("{name} {key}={text}")
                } else {
                    name.to_owned()
                };
                (name, options)
            };
            combinations = combinations
                .iter()
                .flat_map(|(name, options)| values.iter().map(move |v| with(name, options, v)))
                .collect();
        }
        combinations
            .into_iter()
            .map(|(name, options)| self.explicit(index, &name, options))
            .collect()
    }

    fn base_name(&self) -> String {
        let estimator = self.estimator();
        self.name.clone().unwrap_or_else(|| estimator.to_string())
    }

    /// What is given beside the name and the estimator.
    fn options(&self, index: usize) -> Result<Map<String, Value>, FileError> {
        let place = format!("methods[{index}]");
        match serde_json::to_value(self) {
            Ok(Value::Object(mut options)) => {
                options.shift_remove("name");
                options.shift_remove("estimator");
                options.shift_remove("report");
                Ok(options)
            }
            Ok(_) => Err(FileError::key(&place, "not a table")),
            Err(error) => Err(FileError::key(&place, error.to_string())),
        }
    }

    /// The table with every option of its estimator.
    fn explicit(
        &self,
        index: usize,
        name: &str,
        mut options: Map<String, Value>,
    ) -> Result<Self, FileError> {
        let observer = options.shift_remove("observer");
        let place = format!("methods[{index}]");
        let wrong = |error: serde_json::Error| FileError::key(&place, error.to_string());
        let estimator = self.estimator();
        let described = match self.parse(index, options)? {
            Options::LeastSquares(options) => serde_json::to_value(options),
            Options::InstrumentalVariables(options) => serde_json::to_value(options),
            Options::Known => Ok(json!({})),
        };
        let mut table = json!({ "name": name, "estimator": estimator });
        if let Some(report) = &self.report {
            table["report"] = json!(report);
        }
        if let Some(observer) = observer {
            table["observer"] = observer;
        }
        if let (Some(table), Ok(Value::Object(options))) = (table.as_object_mut(), described) {
            table.extend(options);
        }
        serde_json::from_value(table).map_err(wrong)
    }

    fn parse(&self, index: usize, mut options: Map<String, Value>) -> Result<Options, FileError> {
        options.shift_remove("observer");
        let estimator = self.estimator();
        let place = format!("methods[{index}] ({estimator})");
        let (taken, only): (&[&str], _) = match estimator {
            EstimatorName::InstrumentalVariables => (&[], ""),
            EstimatorName::LeastSquares => (&["solver", "initial_state"], "'iv' only"),
            EstimatorName::Known => (&[], "'iv' or 'ls' only"),
        };
        let beyond = options.keys().find(|key| !taken.contains(&key.as_str()));
        if let Some(other) = beyond.filter(|_| !only.is_empty()) {
            let message = format!("'{other}' is an option of estimator {only}");
            return Err(FileError::key(&place, message));
        }
        let options = Value::Object(options);
        let parsed = match estimator {
            EstimatorName::LeastSquares => {
                serde_json::from_value(options).map(Options::LeastSquares)
            }
            EstimatorName::InstrumentalVariables => {
                serde_json::from_value(options).map(Options::InstrumentalVariables)
            }
            EstimatorName::Known => Ok(Options::Known),
        };
        let parsed = parsed.map_err(|error| FileError::key(&place, error.to_string()))?;
        if let Options::InstrumentalVariables(IvOptions { iterations, .. }) = &parsed
            && !(1..=MOST_ITERATIONS).contains(iterations)
        {
            let message = format!("{iterations} iterations; expected 1 to {MOST_ITERATIONS}");
            return Err(FileError::key(&place, message));
        }
        Ok(parsed)
    }

    /// The options of an IV method of a resolved file; `None` for another method.
    pub fn iv_options(&self) -> Option<IvOptions> {
        let options = self.options(0).and_then(|options| self.parse(0, options));
        match options {
            Ok(Options::InstrumentalVariables(options)) => Some(options),
            _ => None,
        }
    }

    /// Whose method it is.
    pub(in crate::study) fn estimator(&self) -> EstimatorName {
        self.estimator.unwrap_or_default()
    }

    /// What outputs of a pass are called: iteration 0 of "iv" is "ls".
    pub fn output_name(&self, pass: usize) -> String {
        let name = self.base_name();
        if name == "iv" && pass == 0 {
            "ls".to_owned()
        } else {
            name
        }
    }

    /// The observer of its own, if a table that [`Self::expand`] made has one.
    fn observer(&self, index: usize) -> Result<Option<ObserverKind>, FileError> {
        let place = format!("methods[{index}].observer");
        let text = match &self.observer {
            None => return Ok(None),
            Some(OneOrMany::Text(text)) => text,
            Some(_) => {
                return Err(FileError::key(
                    &place,
                    "expected a text, such as \"kalman\"",
                ));
            }
        };
        let observer = text.parse::<ObserverKind>();
        let observer = observer.map_err(|error| FileError::key(&place, error.to_string()))?;
        let known = self.estimator == Some(EstimatorName::Known);
        if observer == ObserverKind::KalmanVarying && !known {
            let message =
                "'kalman-varying' is an observer of estimator 'known' only; expected kalman";
            return Err(FileError::key(&place, message));
        }
        Ok(Some(observer))
    }

    /// The method of a table that [`Self::expand`] made; `index` is its place.
    pub(in crate::study) fn method(&self, index: usize) -> Result<Method, FileError> {
        let method = match self.parse(index, self.options(index)?)? {
            Options::LeastSquares(options) => Method::least_squares(options),
            Options::InstrumentalVariables(options) => Method::instrumental_variables(options),
            Options::Known => Method::known(),
        };
        let mut method = method.named(&self.base_name());
        if let Some(observer) = self.observer(index)? {
            method = method.observed_by(observer);
        }
        match &self.report {
            None => Ok(method),
            Some(passes) if passes.is_empty() => {
                let place = format!("methods[{index}].report");
                Err(FileError::key(
                    &place,
                    "an empty list; expected at least one pass",
                ))
            }
            Some(passes) => {
                let place = format!("methods[{index}].report");
                at_most(&place, passes.len(), "passes", MOST_ITERATIONS + 1)?;
                method
                    .reporting(passes)
                    .map_err(|beyond| FileError::key(&place, format!("there is no pass {beyond}")))
            }
        }
    }
}
