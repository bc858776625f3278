//! Reads the record of `asobench estimate`, and checks that flags, estimators and record fit each other.

use super::arguments::Arguments;
use super::hints;
use super::report::Report;
use super::unit::in_own_unit;
use crate::cli::error::Error;
use crate::data::{Trend, csv};
use crate::diagnosis::feedback_p_value;
use crate::estimator::SetupError;
use crate::files::{self, Kind};
use crate::model::Orders;
use crate::plant::ORDER_LIMIT;

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
