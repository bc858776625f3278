//! A model of a record, as `asobench estimate` makes it.

use super::arrays::record;
use super::model::Native;
use super::registry::parse;
use asobench_identification::estimator::{Failure, FailureKind, MethodOptions, Runs, unit_of};
use asobench_identification::model::Orders;
use asobench_identification::{FitError, Fitted, fit, fit_records};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::{Map, Value};

/// Estimates a model of a record. `options` is JSON. Without `orders` among them the model has the order and the delay
/// that are given, and the orders that the estimator makes of these are returned too.
///
/// # Errors
/// `ValueError` of what was asked for, `EstimateFailed` where there is no model.
#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    clippy::needless_pass_by_value,
    reason = "Python passes them"
)]
pub(crate) fn estimate(
    py: Python<'_>,
    estimator: &str,
    options: &str,
    order: usize,
    delay: usize,
    u: &Bound<'_, PyAny>,
    y: &Bound<'_, PyAny>,
    lengths: Vec<usize>,
) -> PyResult<(Native, Option<String>)> {
    let (name, mut parsed) = parse(estimator, options)?;
    let several = lengths.len() > 1 && name.takes("orders") && parsed.model_orders(order).is_none();
    let made = parsed.default_orders(order);
    let made = made.or_else(|| several.then(|| Orders::arx(order, order, delay)));
    let made = made.filter(|_| order > 0);
    let made = made.map(|orders| Orders { nk: delay, ..orders }.to_string());
    if let Some(orders) = &made {
        let mut given: Map<String, Value> = serde_json::from_str(options).unwrap_or_default();
        given.insert("orders".to_owned(), orders.clone().into());
        parsed = parse(estimator, &Value::Object(given).to_string())?.1;
    }
    let (u, y) = record(u, y)?;
    let (u, y) = (u.samples()?, y.samples()?);
    let found = py.detach(|| in_unit(parsed, (order, delay), &lengths, u, y));
    let found = found.map_err(|error| match error {
        FitError::Failed(failure) => failed(py, estimator, failure),
        other => PyValueError::new_err(format!("{name}: {other}")),
    })?;
    Ok((Native(found), made))
}

/// Fits a model in the record's own unit, as `asobench estimate` does: 1 but for very large or very small numbers.
fn in_unit(
    options: MethodOptions,
    orders: (usize, usize),
    lengths: &[usize],
    u: &[f64],
    y: &[f64],
) -> Result<Fitted, FitError> {
    let unit = unit_of(&[u, y]);
    if unit == 1.0 {
        return in_delay(options, orders, lengths, u, y);
    }
    let [u, y] = [u, y].map(|signal| signal.iter().map(|x| x / unit).collect::<Vec<f64>>());
    let mut found = in_delay(options, orders, lengths, &u, &y)?;
    let lost = |kind: FailureKind| FitError::Failed(kind.into());
    found.set_unit(unit).map_err(lost)?;
    Ok(found)
}

/// Fits a model. One without a delay of its own sees the record without the delay.
fn in_delay(
    options: MethodOptions,
    (order, delay): (usize, usize),
    lengths: &[usize],
    u: &[f64],
    y: &[f64],
) -> Result<Fitted, FitError> {
    let shift = match options.model_orders(order) {
        Some(_) => 0,
        None => delay.saturating_sub(1).min(y.len()),
    };
    let (of_u, of_y) = (&u[..u.len() - shift], &y[shift..]);
    let Fitted { pass, .. } = match lengths {
        [] => fit(options, order, of_u, of_y)?,
        _ => fit_records(options, order, lengths, of_u, of_y, of_u)?,
    };
    let runs = match lengths {
        [] => Runs::new(&[y.len()]),
        _ => Runs::new(lengths),
    };
    Ok(Fitted::new(pass, shift).with_loss(&runs, u, y))
}

/// Returns the exception of an estimate without a model.
fn failed(py: Python<'_>, estimator: &str, failure: Failure) -> PyErr {
    let kind = failure.kind;
    let message = format!("{estimator}: {failure}: {}", kind.about());
    let made = py
        .import("asobench._errors")
        .and_then(|errors| errors.getattr("EstimateFailed"))
        .and_then(|class| class.call1((message, kind.name(), failure.stage as usize)));
    made.map_or_else(|error| error, PyErr::from_value)
}
