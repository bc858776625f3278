//! Runs an estimator on the window of a record.

use super::arguments::Arguments;
use super::flags::{ORDERS, OptionFlags, flag_of};
use super::hints;
use super::levels::{Advice, Tried, levels};
use super::orders::delayed;
use super::report::{Clock, Estimate, Fits, Observed, PartReport, PassReport, Report, Samples, Validation};
use crate::cli::error::Error;
use crate::diagnosis::{Mode, Residuals};
use crate::estimator::{EstimatorName, Failure, Method, MethodOptions, Pass, Progress, SetupError, Stage, Window};
use crate::model::Orders;
use crate::observer::ObserverKind;
use crate::plant::PoleFinder;
use crate::text::rounded;
use asobench_identification::{Fitted, ObservationError};
use serde_json::{Map, Value, json};
use std::ops::Range;

/// Runs an estimator on the window.
pub(super) fn estimate(arguments: &Arguments, name: EstimatorName, report: &Report) -> Result<Estimate, Error> {
    let bad = |message: String| Error::Input(format!("--estimator {name}: {message}"));
    let Orders { na: order, nk, .. } = report.orders;
    let mut options = arguments.options.taken_by(name);
    if name.takes("gain") {
        options.insert("gain".to_owned(), json!(arguments.gain));
    }
    if name.takes("ts") {
        let clock = report.clock.ok_or_else(|| {
            bad("needs the time between samples; expected --ts SECONDS or a column of times".to_owned())
        })?;
        options.insert("ts".to_owned(), json!(clock.step));
    }
    let parse = |options: &Map<String, Value>| {
        name.parse(options.clone()).map_err(|error| match error.key {
            Some(key) if key == "orders" && !arguments.options.has("orders") => {
                bad(format!("of --order and --delay: {}", error.message))
            }
            Some(key) => {
                let flag = flag_of(&key);
                Error::Input(format!("{flag}: {} (estimator {name})", error.message))
            }
            None => bad(error.message),
        })
    };
    let mut parsed = parse(&options)?;
    if !options.contains_key(ORDERS) {
        // From --order and --delay. Several records are not shifted, nor is one without a delay.
        let not_shifted = (!report.parts.is_empty() || nk == 0) && name.takes(ORDERS);
        let made = parsed.default_orders(order);
        let made = made.or(not_shifted.then(|| Orders::arx(order, order, 1)));
        if let Some(orders) = made {
            options.insert(ORDERS.to_owned(), json!(delayed(orders, nk)));
            parsed = parse(&options)?;
        }
    }
    if parsed.needs().reference.is_some() && report.record.r.is_empty() {
        return Err(bad(
            "needs the reference of the loop; expected --reference COLUMN or a column named r".to_owned(),
        ));
    }
    let options = parsed;
    check_variances(&options, report)?;
    // A model without a delay of its own sees the record without the delay.
    let shift = match options.model_orders(order) {
        Some(_) => 0,
        None => nk.checked_sub(1).ok_or_else(|| {
            bad("has no direct term for --delay 0; expected --estimator arx or another one with orders".to_owned())
        })?,
    };
    let gain = arguments.gain.check(options.order(order));
    gain.map_err(|error| Error::Input(format!("--gain: {error}")))?;
    let start_told = arguments.options.start_is_free(name);
    let run_observed = |options: MethodOptions| {
        let found = run(name, options, (order, shift), report, true);
        let mut found = found.map_err(|error| bad(error.to_string()))?;
        observe(&mut found, report);
        found.start_told = start_told;
        Ok::<Estimate, Error>(found)
    };
    let mut found = run_observed(options)?;
    let mut tried = Tried::default();
    let mut advice = levels(&found, report, &mut tried);
    if let Some(Advice { chance, .. }) = advice.as_ref().filter(|of| of.start && start_told) {
        let mut with_start = found.given();
        OptionFlags::estimate_start(&mut with_start);
        found = run_observed(parse(&with_start)?)?;
        found.start_chance = Some(*chance);
        advice = levels(&found, report, &mut tried);
    }
    let of_start = advice.map(|advice| advice.sentence);
    let of_start = of_start.or_else(|| hints::fixed_start(&found, report));
    found.hints = hints::of(&found, report, of_start);
    Ok(found)
}

/// Runs an estimator with options on the window, and computes the FIT of its last pass; without observer and hints.
pub(super) fn run(
    name: EstimatorName,
    options: MethodOptions,
    (order, shift): (usize, usize),
    report: &Report,
    errors: bool,
) -> Result<Estimate, SetupError> {
    let Samples { u, y, r, window } = report.shifted(shift);
    let (described, rest) = (options.describe(), options.begins_at_rest());
    let method = Method::named(name.name(), options);
    let window = Window::with_reference(u, y, r.unwrap_or(u), window);
    let passes = method.estimate_once(order, &report.lengths(), window, errors)?;
    // Iteration 0 may belong to another estimator, under that estimator's name.
    let numbers = method.outputs().iter().zip(passes);
    let own = numbers.filter(|(output, _)| output.estimator == name.name());
    let passes = own.map(|(output, pass)| (output.pass, pass_report(pass, report, shift)));
    let mut estimate = Estimate {
        name,
        options: described,
        passes: passes.collect(),
        observer: None,
        fit: None,
        parts: Vec::new(),
        white: None,
        start_told: false,
        start_chance: None,
        hints: Vec::new(),
    };
    let fitted = &estimate.last().fitted;
    if fitted.pass.progress < Progress::InitialState {
        return Ok(estimate);
    }
    if report.parts.is_empty() {
        estimate.fit = Some(fits(fitted, report));
    } else {
        let parts = parts(fitted, rest, report);
        let tests = parts.iter().filter_map(|part| part.residuals.as_ref());
        estimate.white = Residuals::white_together(tests, fitted.model.orders());
        estimate.parts = parts;
    }
    Ok(estimate)
}

/// Returns a pass with its delay, loss and poles.
fn pass_report(pass: Pass, report: &Report, shift: usize) -> PassReport {
    let fitted = Fitted::new(pass, shift);
    if fitted.pass.progress < Progress::Parameters {
        return PassReport {
            fitted,
            radius: None,
            precision: None,
            modes: None,
            residuals: None,
        };
    }
    let [u, y] = [&report.record.u, &report.record.y].map(|signal| &signal[..report.window]);
    let fitted = fitted.with_loss(&report.runs(), u, y);
    let Pass { a, unstable, .. } = &fitted.pass;
    let precision = fitted.precision();
    let is_one = report.parts.is_empty();
    PassReport {
        radius: Some(PoleFinder::new(a.len()).spectral_radius(a, !unstable)),
        modes: report.clock.map(|Clock { step, .. }| {
            let poles = precision.poles.iter();
            poles.filter_map(|pole| Mode::of(pole, step)).collect()
        }),
        precision: Some(precision),
        residuals: is_one.then(|| fitted.residuals(u, y, false, report.rounding)).flatten(),
        fitted,
    }
}

/// Refuses a variance of noise that is not below the mean square of its signal.
fn check_variances(options: &MethodOptions, report: &Report) -> Result<(), Error> {
    for (key, signal) in [("input_noise", &report.record.u), ("output_noise", &report.record.y)] {
        let given = options.describe().get(key).and_then(Value::as_f64);
        let unit = report.unit * report.unit;
        let square = signal.iter().map(|x| x * x).sum::<f64>() / signal.len() as f64 * unit;
        if let Some(given) = given.filter(|given| *given >= square) {
            let flag = flag_of(key);
            return Err(Error::Input(format!(
                "{flag}: {given}; the signal itself has a mean square of {}, noise and all",
                rounded(square, 6)
            )));
        }
    }
    Ok(())
}

/// Returns what a model is on each of several records: from rest, or from the state that is estimated on it.
fn parts(fitted: &Fitted, rest: bool, report: &Report) -> Vec<PartReport> {
    let horizon = report.horizon;
    let part = |(i, run): (usize, &Range<usize>)| {
        let fitted = fitted.of_record(i);
        let (u, y) = (&report.record.u[run.clone()], &report.record.y[run.clone()]);
        let at_rest = vec![0.0; fitted.pass.a.len()];
        PartReport {
            residuals: fitted.residuals(u, y, false, report.rounding),
            fit: if rest {
                fitted.compare_from(&at_rest, u, y, y.len(), 0..y.len(), horizon)
            } else {
                fitted.compare_on(u, y, horizon)
            },
        }
    };
    report.runs().iter().enumerate().map(part).collect()
}

/// Returns the FIT of a pass on the window, and on the record for validation or the samples after the window.
fn fits(fitted: &Fitted, report: &Report) -> Fits {
    let Samples { u, y, window, .. } = report.shifted(fitted.shift);
    let horizon = report.horizon;
    let validation = match &report.validation {
        Some(Validation { record, .. }) => {
            let [u, y] = fitted.shifted(&record.u, &record.y);
            Some(fitted.compare_on(u, y, horizon))
        }
        None => (window < y.len()).then(|| fitted.compare(u, y, window, window..y.len(), horizon)),
    };
    Fits {
        window: fitted.compare(u, y, window, 0..window, horizon),
        validation,
    }
}

/// Runs stage 12 on the whole record, where there is one record and u does not act at once.
fn observe(estimate: &mut Estimate, report: &Report) {
    let last = estimate.passes.len() - 1;
    let (number, PassReport { fitted, .. }) = &mut estimate.passes[last];
    if !report.parts.is_empty() || fitted.pass.observed().is_none() {
        return;
    }
    let kind = ObserverKind::Luenberger(report.gain.clone());
    let (u, y) = (&report.record.u, &report.record.y);
    let observer = fitted.observer(&kind, None, u, y);
    match observer.and_then(|observer| Ok((observer.run(u, y)?, observer.gain))) {
        Err(ObservationError::Failed(kind)) => fitted.pass.fail(Failure {
            kind,
            stage: Stage::Observer,
            pass: *number,
        }),
        // --gain was checked.
        Err(_) => {}
        Ok((found, g)) => {
            estimate.observer = Some(Observed {
                g,
                states: found.states,
                window: report.window - fitted.shift,
            });
        }
    }
}
