//! The registry's words on estimators, for Python's signatures and docs.

use asobench_identification::estimator::{EstimatorName, MethodOptions};
use asobench_identification::observer::Gain;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::{Map, Value, json};

/// Returns all estimators of records with their options, as JSON.
#[pyfunction]
pub(crate) fn estimators() -> String {
    let of_records = EstimatorName::ALL.iter().filter(|name| **name != EstimatorName::Known);
    let described = of_records.map(|name| {
        let options = name.options().iter().map(|option| {
            json!({ "key": option.key, "about": option.about, "default": option.default, "schema": option.schema })
        });
        json!({ "name": name, "about": name.about(), "options": options.collect::<Vec<_>>() })
    });
    described.collect::<Value>().to_string()
}

/// Returns every option of an estimator with its value, as JSON.
#[pyfunction]
pub(crate) fn describe(estimator: &str, options: &str) -> PyResult<String> {
    let (_, options) = parse(estimator, options)?;
    Ok(Value::Object(options.describe()).to_string())
}

/// Refuses what is no gain of an observer.
#[pyfunction]
pub(crate) fn check_gain(gain: &str) -> PyResult<()> {
    let gain: Result<Gain, _> = gain.parse();
    gain.map(|_| ())
        .map_err(|error| PyValueError::new_err(error.to_string()))
}

/// Reads the name of an estimator and its options.
pub(crate) fn parse(estimator: &str, options: &str) -> PyResult<(EstimatorName, MethodOptions)> {
    let name: EstimatorName = estimator
        .parse()
        .map_err(|error| PyValueError::new_err(format!("estimator: {error}")))?;
    if name == EstimatorName::Known {
        return Err(PyValueError::new_err(format!(
            "estimator '{name}': a record has no known plant; expected one that estimates"
        )));
    }
    let options: Map<String, Value> =
        serde_json::from_str(options).map_err(|error| PyValueError::new_err(format!("options: {error}")))?;
    let parsed = name.parse(options);
    let parsed = parsed.map_err(|error| PyValueError::new_err(format!("{error} (estimator {name})")))?;
    Ok((name, parsed))
}
