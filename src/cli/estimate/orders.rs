//! The orders that the flags ask for, and whether flags and estimators fit each other.

use super::arguments::{Arguments, RecordArguments, Span};
use crate::cli::error::Error;
use crate::estimator::EstimatorName;
use crate::model::Orders;
use crate::names::UnknownName;
use crate::observer::Gain;

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
            let of_all = of_table(estimator)?;
            refuse("--states", arguments.states.is_some())?;
            refuse("--gain", arguments.gain != Gain::default())?;
            // The table of arx is of least squares over common equations.
            if let (EstimatorName::Arx, Some(flag)) = (of_all, options.first()) {
                refuse(&flag, true)?;
            }
            if let Some(message) = options.useless(&[of_all]) {
                return bad(message);
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

/// Refuses a flag that has no meaning for a table of several models.
pub(super) fn refuse(flag: &str, given: bool) -> Result<(), Error> {
    if given {
        return Err(Error::Input(format!(
            "{flag}: needs a single model; expected one --order and one --delay"
        )));
    }
    Ok(())
}

/// Returns the estimator of a table of several models: `arx` by default, or one that takes orders.
pub(super) fn of_table(names: &[EstimatorName]) -> Result<EstimatorName, Error> {
    use EstimatorName::{Arx, InstrumentalVariables, LeastSquares};
    match names {
        [LeastSquares, InstrumentalVariables] => Ok(Arx),
        [name] if name.takes("orders") && *name != InstrumentalVariables => Ok(*name),
        _ => {
            let takes =
                |name: &&EstimatorName| name.takes("orders") && **name != InstrumentalVariables;
            let valid: Vec<&str> = EstimatorName::ALL
                .iter()
                .filter(takes)
                .map(|name| name.name())
                .collect();
            let wrong = |name: &&EstimatorName| !takes(name);
            let name = names
                .iter()
                .find(wrong)
                .or(names.get(1))
                .map_or("", |name| name.name());
            let error = UnknownName::new("estimator for a range of orders", name, &valid);
            Err(Error::Input(format!(
                "--estimator: {error}; expected one of them"
            )))
        }
    }
}
