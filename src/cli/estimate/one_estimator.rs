//! Runs an estimator on the window of a record.

use super::arguments::Arguments;
use super::flags::{OptionFlags, flag_of};
use super::hints;
use super::levels::{Advice, Tried, levels};
use super::orders::delayed;
use super::report::{Clock, Estimate, Fits, Observed, PartReport, PassReport, Report, Samples, Validation};
use crate::cli::error::Error;
use crate::diagnosis::{Mode, Residuals};
use crate::estimator::{
    EstimatorName, Failure, FailureKind, Method, MethodOptions, Pass, Problem, Progress, Shape, Stage, Window,
};
use crate::model::Orders;
use crate::observer::{Gain, ObservedModel, Observer};
use crate::plant::PoleFinder;
use crate::text::rounded;
use asobench_identification::Fitted;
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
    if let Some(orders) = parsed.default_orders(order).filter(|_| !options.contains_key("orders")) {
        // From --order and --delay.
        options.insert("orders".to_owned(), json!(delayed(orders, nk)));
        parsed = parse(&options)?;
    }
    if parsed.needs().reference.is_some() && report.record.r.is_empty() {
        return Err(bad(
            "needs the reference of the loop; expected --reference COLUMN or a column named r".to_owned(),
        ));
    }
    let not_shifted = !report.parts.is_empty() || nk == 0;
    if not_shifted && name.takes("orders") && !options.contains_key("orders") {
        // Several records are not shifted, nor is one without a delay.
        options.insert("orders".to_owned(), json!(delayed(Orders::arx(order, order, 1), nk)));
        parsed = parse(&options)?;
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
    let mut found = run(arguments, options.clone(), (name, shift), report)?;
    found.start_told = start_told;
    let mut tried = Tried::default();
    let mut advice = levels(&found, report, &mut tried);
    if let Some(Advice { chance, .. }) = advice.as_ref().filter(|of| of.start && start_told) {
        let mut with_start = found.given();
        OptionFlags::estimate_start(&mut with_start);
        let mut begun = run(arguments, parse(&with_start)?, (name, shift), report)?;
        begun.start_told = true;
        begun.start_chance = Some(*chance);
        advice = levels(&begun, report, &mut tried);
        found = begun;
    }
    let of_start = advice.map(|advice| advice.sentence);
    let of_start = of_start.or_else(|| hints::fixed_start(&found, report));
    found.hints = hints::of(&found, report, of_start);
    Ok(found)
}

/// Runs an estimator with options on the window; without hints.
fn run(
    arguments: &Arguments,
    options: MethodOptions,
    (name, shift): (EstimatorName, usize),
    report: &Report,
) -> Result<Estimate, Error> {
    let samples = report.shifted(shift);
    let order = report.orders.na;
    let shape = Shape {
        order,
        window: samples.window,
    };
    let described = options.describe();
    let method = Method::named(name.name(), options);
    let lengths = report.lengths();
    let prepared = method.prepare(Problem {
        covariance: true,
        runs: &lengths,
        ..shape.into()
    });
    let mut estimator = prepared.map_err(|error| Error::Input(format!("--estimator {name}: {error}")))?;
    let mut passes = vec![Pass::new(order); method.passes()];
    let reference = samples.r.unwrap_or(samples.u);
    let window = Window::with_reference(samples.u, samples.y, reference, samples.window);
    estimator.estimate(window, &mut passes);
    // Iteration 0 may belong to another estimator, under that estimator's name.
    let numbers = method.outputs().iter().zip(passes);
    let own = numbers.filter(|(output, _)| output.estimator == name.name());
    let passes = own.map(|(output, pass)| (output.pass, pass_report(pass, report, shift)));
    let mut estimate = Estimate::new(name, described, passes.collect(), report);
    conclude(&mut estimate, &arguments.gain, report);
    Ok(estimate)
}

/// Returns a pass with its delay, loss and poles.
pub(super) fn pass_report(pass: Pass, report: &Report, shift: usize) -> PassReport {
    let has_model = pass.progress >= Progress::Parameters;
    let mut found = PassReport {
        fitted: Fitted::new(pass, shift),
        poles: Vec::new(),
        radius: None,
        precision: None,
        modes: None,
        residuals: None,
        feedback: None,
    };
    if !has_model {
        return found;
    }
    let window = report.window;
    let [u, y] = [&report.record.u, &report.record.y].map(|signal| &signal[..window]);
    let fitted = found.fitted.with_loss(&report.runs(), u, y);
    let Pass { a, unstable, .. } = &fitted.pass;
    found.radius = Some(PoleFinder::new(a.len()).spectral_radius(a, !unstable));
    found.poles = fitted.poles();
    let precision = fitted.precision();
    found.modes = report.clock.map(|Clock { step, .. }| {
        let poles = precision.poles.iter();
        poles.filter_map(|pole| Mode::of(pole, step)).collect()
    });
    found.precision = Some(precision);
    if report.parts.is_empty() {
        found.residuals = fitted.residuals(u, y, false, report.rounding);
    }
    found.feedback = report.feedback;
    found.fitted = fitted;
    found
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

/// Computes FIT and observer for the last pass.
fn conclude(estimate: &mut Estimate, gain: &Gain, report: &Report) {
    let options = estimate.name.parse(estimate.given());
    let rest = options.is_ok_and(|options| options.begins_at_rest());
    let last = estimate.passes.len() - 1;
    let (number, PassReport { fitted, .. }) = &mut estimate.passes[last];
    if fitted.pass.progress < Progress::InitialState {
        return;
    }
    if !report.parts.is_empty() {
        estimate.parts = parts(fitted, rest, report);
        let parts = estimate.parts.iter();
        let tests = parts.filter_map(|part| part.residuals.as_ref());
        estimate.white = Residuals::white_together(tests, fitted.model.orders());
        return;
    }
    estimate.fit = Some(fits(fitted, report));
    let observed = match fitted.pass.observed() {
        Some(model) => {
            let samples = report.shifted(fitted.shift);
            let y = &fitted.less_offset(samples.y);
            observe(model, gain, Samples { y, ..samples })
        }
        None => return,
    };
    match observed {
        Err(kind) => fitted.pass.fail(Failure {
            kind,
            stage: Stage::Observer,
            pass: *number,
        }),
        Ok(observed) => estimate.observer = Some(observed),
    }
}

/// Returns what a model is on each of several records: from rest, or from the state that is estimated on it.
pub(super) fn parts(fitted: &Fitted, rest: bool, report: &Report) -> Vec<PartReport> {
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
pub(super) fn fits(fitted: &Fitted, report: &Report) -> Fits {
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

/// Runs stage 12 on the whole record.
fn observe(model: ObservedModel<'_>, gain: &Gain, samples: Samples<'_>) -> Result<Observed, FailureKind> {
    let mut observer = Observer::new(gain.clone(), model.a.len());
    let (mut at_window, mut last) = (Vec::new(), model.x0.to_vec());
    observer.run(model, samples.u, samples.y, |k, x| {
        if k == samples.window {
            at_window = x.to_vec();
        }
        last.copy_from_slice(x);
    })?;
    if samples.window == samples.y.len() {
        at_window = observer.state().to_vec();
    }
    Ok(Observed {
        g: observer.g().to_vec(),
        at_window,
        last,
    })
}
