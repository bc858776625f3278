//! The orders that the flags ask for, and whether flags and estimators fit each other.

use super::arguments::{Arguments, RecordArguments, refuse};
use super::drawing::{Drawing, Kind};
use super::flags::{LETTERS, ORDERS};
use super::span::{Given, Span, list, words};
use crate::cli::error::{Error, bad_input};
use crate::data::csv::Missing;
use crate::estimator::EstimatorName;
use crate::model::Orders;
use crate::observer::Gain;

/// Orders of a single model, as they are given.
pub(super) const ORDERS_EXPECTED: &str =
    "expected --order n, or --orders na=...,nb=...,nk=... where the estimators take it";

/// Why a flag is refused that has no meaning for a table of several models.
pub(super) const ONE_MODEL: &str = "needs a single model; expected one --order and one --delay";

/// Reads the orders as they were given: those of MATLAB's order and those letter by letter become `--orders`, and
/// without
/// `--estimator` the estimators are those that take what was given.
pub(super) fn understand(arguments: &mut Arguments) -> Result<(), Error> {
    let of_order = match &arguments.record.order {
        Some(Given::Orders(text)) => Some(("--order", text.clone())),
        _ => None,
    };
    let of_orders = arguments.options.orders().map(|text| ("--orders", text.to_owned()));
    let has_orders = of_order.is_some() || of_orders.is_some() || !arguments.options.letters.is_empty();
    if arguments.estimator.is_empty() {
        // ls has no direct term.
        let direct = arguments.record.delay.is_some_and(|delay| delay.first == 0);
        // Nor does ls take parts of a record.
        let parts = !arguments.more.is_empty() || arguments.record.missing == Missing::Equations;
        let one = has_orders || direct || parts || ranges(arguments).is_some();
        arguments.estimator = if one {
            vec![EstimatorName::Arx]
        } else {
            vec![EstimatorName::LeastSquares, EstimatorName::InstrumentalVariables]
        };
    }
    let letters = &arguments.options.letters;
    if let Some((name, span)) = letters.iter().find(|(_, span)| span.is_range()) {
        let of = |names: &[&str]| {
            let mut found = letters.iter().filter(|(name, _)| names.contains(name));
            found.find(|(_, span)| span.is_range()).map(|(_, span)| *span)
        };
        let order = of(&["na", "nb", "nf", "nc", "nd"]).map_or("1:4".to_owned(), |span| span.to_string());
        let delay = letters.iter().find(|(name, _)| *name == "nk");
        let delay = delay.map_or("1:3".to_owned(), |(_, span)| span.to_string());
        return Err(Error::Input(format!(
            "--{name} {span}: models of several orders have na = nb = n: --order {order} --delay {delay}"
        )));
    }
    let all = [("--order", of_order), ("--orders", of_orders)];
    let texts: Vec<(&str, String)> = all.into_iter().filter_map(|(_, given)| given).collect();
    let both = |flag: &str| {
        Err(Error::Input(format!(
            "{flag}: the orders are given twice; expected them once"
        )))
    };
    let orders = match (texts.as_slice(), letters.as_slice()) {
        ([], []) => return Ok(()),
        ([(flag, text)], []) => read(flag, text, &arguments.estimator)?,
        ([], letters) => {
            let parts: Vec<String> = letters.iter().map(|(name, span)| format!("{name}={span}")).collect();
            let orders = parts.join(",").parse();
            orders.map_err(|error| Error::Input(format!("--{}: {error}", letters[0].0)))?
        }
        ([(flag, _)] | [_, (flag, _)], _) => return both(flag),
        _ => return both("--orders"),
    };
    let flag = texts.first().map_or("--na", |(flag, _)| *flag);
    if flag != "--orders" && matches!(arguments.record.order, Some(Given::Span(_))) {
        return Err(bad_input(
            "--order: cannot be given together with --na, --nb, --nk; expected one of the two forms",
        ));
    }
    if flag == "--order" {
        arguments.record.order = None;
    }
    arguments.options.set_orders(orders);
    Ok(())
}

/// Reads orders with letters, or numbers in MATLAB's order: those that an estimator has of na, nb, nc, nd, nf, and nk.
fn read(flag: &str, text: &str, estimators: &[EstimatorName]) -> Result<Orders, Error> {
    let wrong = |message: String| Error::Input(format!("{flag} {text}: {message}"));
    let Some(numbers) = list(text).filter(|numbers| !numbers.is_empty()) else {
        let parts: Vec<&str> = words(text).collect();
        let orders = parts.join(",").parse::<Orders>();
        return orders.map_err(|error| Error::Input(format!("{flag}: {error}")));
    };
    let mut meant: Option<(EstimatorName, Orders)> = None;
    for &name in estimators.iter().filter(|name| name.takes(ORDERS)) {
        let letters = letters_of(name);
        // The delay, which is the last number, is 1 where it is left out.
        let numbers: Vec<_> = if numbers.len() + 1 == letters.len() {
            numbers.iter().copied().chain([1]).collect()
        } else {
            numbers.clone()
        };
        if letters.len() != numbers.len() {
            return Err(wrong(format!(
                "{name} has {}; expected {} numbers in this order, such as {}",
                letters.join(", "),
                letters.len(),
                letters.iter().map(|_| "1").collect::<Vec<_>>().join(","),
            )));
        }
        let parts = letters.iter().zip(&numbers);
        let parts: Vec<String> = parts.map(|(name, number)| format!("{name}={number}")).collect();
        let orders = parts.join(",").parse::<Orders>();
        let orders = orders.map_err(|error| wrong(error.to_string()))?;
        match meant {
            Some((other, of_other)) if of_other != orders => {
                return Err(wrong(format!(
                    "means {of_other} for {other}, but {orders} for {name}; expected one estimator, or --order n"
                )));
            }
            _ => meant = Some((name, orders)),
        }
    }
    meant.map(|(_, orders)| orders).ok_or_else(|| {
        wrong(
            "the estimators take --order n and --delay nk instead; expected --estimator arx, oe, armax or \
            bj"
            .to_owned(),
        )
    })
}

/// The letters of the orders that an estimator has.
fn letters_of(name: EstimatorName) -> Vec<&'static str> {
    let mut options = serde_json::Map::new();
    if name.takes("ts") {
        options.insert("ts".to_owned(), serde_json::json!(1.0));
    }
    let form = name.parse(options).ok().and_then(|options| options.default_orders(1));
    let form = form.unwrap_or(Orders::arx(1, 1, 1));
    let has = [form.na, form.nb, form.nc, form.nd, form.nf, 1];
    let letters = LETTERS.into_iter().zip(has);
    letters.filter(|(_, has)| *has > 0).map(|(name, _)| name).collect()
}

/// Returns the orders and delays of a table of models; `None` if one model is requested.
pub(super) fn ranges(arguments: &Arguments) -> Option<(Span, Span)> {
    let Some(Given::Span(order)) = arguments.record.order else {
        return None;
    };
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
        let Some(Given::Span(order)) = *order else {
            return bad(format!("{ORDERS_EXPECTED}; asobench estimate compares orders"));
        };
        if let Some((order, delay)) = ranges(arguments) {
            let [.., states] = arguments.drawn();
            refuse(&[states, ("--gain", arguments.gain != Gain::default())], ONE_MODEL)?;
            for Drawing { kind, .. } in &arguments.plot {
                refuse(&[(&format!("--plot {kind}"), *kind != Kind::Output)], ONE_MODEL)?;
            }
            for of_table in of_tables(estimator)? {
                // The table of arx is of least squares over common equations.
                if let (EstimatorName::Arx, Some(flag)) = (of_table, options.first()) {
                    refuse(&[(&flag, true)], ONE_MODEL)?;
                }
                if let Some(message) = options.useless(&[of_table]) {
                    return bad(message);
                }
            }
            return Ok(Orders::arx(order.last, order.last, delay.last));
        }
        let delay = delay.map_or(1, |delay| delay.last);
        return Ok(Orders::arx(order.last, order.last, delay));
    }
    let others = [("--order", order.is_some()), ("--delay", delay.is_some())];
    refuse(&others, "cannot be given together with --orders")?;
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

/// Returns orders with a delay. Without one n poles come with n + 1 coefficients of u, of which the first acts at once.
pub(super) fn delayed(orders: Orders, nk: usize) -> Orders {
    let nb = orders.nb + usize::from(nk == 0);
    Orders { nb, nk, ..orders }
}

/// Returns the estimators of tables of several models, each one once: those that take orders; the default ones are
/// `arx`.
pub(super) fn of_tables(names: &[EstimatorName]) -> Result<Vec<EstimatorName>, Error> {
    use EstimatorName::{Arx, InstrumentalVariables, LeastSquares};
    if matches!(names, [LeastSquares, InstrumentalVariables]) {
        return Ok(vec![Arx]);
    }
    let takes = |name: &EstimatorName| name.takes(ORDERS) && *name != InstrumentalVariables;
    let Some(wrong) = names.iter().find(|name| !takes(name)) else {
        let mut once: Vec<EstimatorName> = Vec::new();
        for name in names {
            if !once.contains(name) {
                once.push(*name);
            }
        }
        return Ok(once);
    };
    let all = EstimatorName::ALL.iter().copied().filter(takes);
    let all: Vec<&str> = all.map(EstimatorName::name).collect();
    Err(Error::Input(format!(
        "--estimator {wrong}: has no table of a range of orders; expected one of {}",
        all.join(", ")
    )))
}
