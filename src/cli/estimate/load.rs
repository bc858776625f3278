//! Reads the record of `asobench estimate`, and checks that flags, estimators and record fit each other.

use super::unit::in_own_unit;
use super::{Arguments, RecordArguments, Report, Span, hints, scan};
use crate::cli::error::Error;
use crate::data::{Trend, csv};
use crate::diagnosis::feedback_p_value;
use crate::estimator::{EstimatorName, SetupError};
use crate::files::{self, Kind};
use crate::model::Orders;
use crate::plant::ORDER_LIMIT;
use serde_json::Value;

impl Arguments {
    /// Whether all estimators take the signals before the record as zero.
    fn begins_at_rest(&self) -> bool {
        self.estimator.iter().all(|name| {
            let options = self.options.taken_by(*name);
            let given = |key: &str| options.get(key).and_then(Value::as_str);
            match name {
                EstimatorName::Oe | EstimatorName::Armax | EstimatorName::Bj => {
                    given("initial").is_none_or(|initial| initial == "zero")
                }
                EstimatorName::Sriv
                | EstimatorName::Stmcb
                | EstimatorName::Riv
                | EstimatorName::Wnsf => true,
                _ => given("rows").is_some_and(|rows| rows != "complete"),
            }
        })
    }
}

/// Returns the orders and delays of a table of models; `None` if one model is requested.
pub(super) fn ranges(arguments: &Arguments) -> Option<(Span, Span)> {
    let order = arguments.record.order?;
    let delay = arguments.record.delay.unwrap_or(Span { first: 1, last: 1 });
    (order.is_range() || delay.is_range()).then_some((order, delay))
}

/// Returns the requested orders; checks that flags and estimators fit each other.
pub(super) fn orders(arguments: &Arguments) -> Result<Orders, Error> {
    let bad = |message: String| Err(Error::Input(message));
    let Arguments {
        record: RecordArguments { order, delay, .. },
        estimator,
        options,
        ..
    } = arguments;
    if let Some(name) = estimator.iter().find(|name| **name == EstimatorName::Known) {
        return bad(format!(
            "--estimator {name}: a record has no known plant; expected one that estimates"
        ));
    }
    if let Some(message) = options.useless(estimator) {
        return bad(message);
    }
    if !options.has("orders") {
        let Some(order) = *order else {
            return bad(
                "expected --order n, or --orders na=...,nb=...,nk=... where the estimators take it"
                    .to_owned(),
            );
        };
        if let Some((order, delay)) = ranges(arguments) {
            let names: Vec<&str> = estimator.iter().map(|name| name.name()).collect();
            scan::check_estimators(&names, &["ls", "iv"])?;
            scan::refuse("--states", arguments.states.is_some())?;
            if let Some(flag) = options.first() {
                scan::refuse(&flag, true)?;
            }
            return Ok(Orders::arx(order.last, order.last, delay.last));
        }
        let delay = delay.map_or(1, |delay| delay.last);
        return Ok(Orders::arx(order.last, order.last, delay));
    }
    for (flag, given) in [("--order", order), ("--delay", delay)] {
        if given.is_some() {
            return bad(format!("{flag}: cannot be given together with --orders"));
        }
    }
    if let Some(name) = estimator.iter().find(|name| !name.takes("orders")) {
        return bad(format!(
            "--orders: estimator '{name}' takes --order and --delay instead; expected --estimator arx or another one \
             that takes orders"
        ));
    }
    let text = options.taken_by(estimator[0])["orders"].clone();
    let text = text.as_str().unwrap_or_default();
    let orders = text.parse::<Orders>();
    orders.map_err(|error| Error::Input(format!("--orders: {error}")))
}

/// Reads, checks and detrends the record.
pub(super) fn load(arguments: &Arguments, orders: Orders) -> Result<Report, Error> {
    let path = arguments.record.file.display();
    let bad = |message: String| Error::Input(format!("{path}: {message}"));
    let file = files::open_named(&arguments.record.file, Kind::Record);
    let file = file.map_err(|error| bad(error.to_string()))?;
    let mut record = csv::read(file).map_err(|error| bad(error.to_string()))?;
    let rows = record.y.len();
    // The samples that the equations look back, and one row per parameter.
    let needed = orders
        .reach()
        .saturating_add(orders.na.saturating_add(orders.nb));
    let asked = if arguments.options.has("orders") {
        format!("orders {orders}")
    } else {
        format!("order {} and delay {}", orders.na, orders.nk)
    };
    if rows < needed {
        return Err(bad(format!(
            "{rows} samples are too few for {asked}: at least {needed} are needed"
        )));
    }
    if orders.order() > ORDER_LIMIT {
        let error = SetupError::LargeOrder(orders.order());
        return Err(Error::Input(format!("--order: {error}")));
    }
    let window = arguments.record.window.unwrap_or(rows);
    if window > rows {
        return Err(Error::Input(format!(
            "--window: {window} is more than the {rows} samples of {path}"
        )));
    }
    if window < needed {
        return Err(Error::Input(format!(
            "--window: {window} is too short for {asked}: at least {needed} are needed"
        )));
    }
    if hints::is_constant(&record.y[..window]) {
        return Err(bad(
            "column y is constant over the window; nothing can be identified from it".to_owned(),
        ));
    }
    if hints::is_constant(&record.u[..window]) {
        if record.u[0] == 0.0 {
            return Err(bad(
                "column u is zero over the window; nothing can be identified from it".to_owned(),
            ));
        }
        if !arguments.begins_at_rest() {
            return Err(bad(format!(
                "column u is constant over the window; {}",
                hints::FROM_REST
            )));
        }
    }
    let unit = in_own_unit(&mut record, window).map_err(&bad)?;
    let mut trends = [Trend::default(); 2];
    let signals = [("u", &mut record.u), ("y", &mut record.y)];
    for ((name, values), trend) in signals.into_iter().zip(&mut trends) {
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let before = largest(&values[..window]);
        *trend = Trend::fit(arguments.record.detrend, &values[..window]);
        trend.subtract(values);
        if largest(&values[..window]) <= 64.0 * f64::EPSILON * before {
            return Err(bad(format!(
                "column {name} is exactly its {} trend over the window; nothing is left to identify from",
                arguments.record.detrend
            )));
        }
    }
    Ok(Report {
        file: arguments.record.file.clone(),
        unit,
        window,
        orders,
        detrend: arguments.record.detrend,
        trends,
        gain: arguments.gain.clone(),
        feedback: feedback_p_value(&record.u[..window], &record.y[..window], orders.nk),
        record,
        estimates: Vec::new(),
    })
}
