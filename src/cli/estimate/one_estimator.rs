//! Runs an estimator on the window of a record.

use super::arguments::Arguments;
use super::flags::flag_of;
use super::hints;
use super::report::{
    Clock, Estimate, Fits, Observed, PartReport, PassReport, Report, Samples, Validation,
};
use crate::cli::error::Error;
use crate::data::csv::Record;
use crate::diagnosis::{Mode, Precision, Residuals};
use crate::estimator::initial_state::InitialState;
use crate::estimator::{
    EstimatorName, Failure, FailureKind, Method, Pass, Problem, Progress, Shape, Stage, Window,
};
use crate::metric::{FitModel, fit};
use crate::model::{LinearModel, Orders};
use crate::observer::{Gain, ObservedModel, Observer};
use crate::plant::PoleFinder;
use crate::text::rounded;
use asobench_identification::complete_residuals;
use serde_json::{Map, Value, json};
use std::iter;
use std::ops::Range;

/// Runs an estimator on the window.
pub(super) fn estimate(
    arguments: &Arguments,
    name: EstimatorName,
    report: &Report,
) -> Result<Estimate, Error> {
    let bad = |message: String| Error::Input(format!("--estimator {name}: {message}"));
    let Orders { na: order, nk, .. } = report.orders;
    let mut options = arguments.options.taken_by(name);
    if name.takes("gain") {
        options.insert("gain".to_owned(), json!(arguments.gain));
    }
    if name.takes("ts") {
        let clock = report.clock.ok_or_else(|| {
            bad(
                "needs the time between samples; expected --ts SECONDS or a column of times"
                    .to_owned(),
            )
        })?;
        options.insert("ts".to_owned(), json!(clock.step));
    }
    let parse = |options: &Map<String, Value>| {
        name.parse(options.clone())
            .map_err(|error| match error.key {
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
    if let Some(orders) = parsed
        .default_orders(order)
        .filter(|_| !options.contains_key("orders"))
    {
        // From --order and --delay.
        options.insert("orders".to_owned(), json!(Orders { nk, ..orders }));
        parsed = parse(&options)?;
    }
    if parsed.needs().reference.is_some() && report.record.r.is_empty() {
        return Err(bad(
            "needs the reference of the loop; expected --reference COLUMN or a column named r"
                .to_owned(),
        ));
    }
    if !report.parts.is_empty() && name.takes("orders") && !options.contains_key("orders") {
        // Several records are not shifted.
        options.insert("orders".to_owned(), json!(Orders::arx(order, order, nk)));
        parsed = parse(&options)?;
    }
    let options = parsed;
    for (key, signal) in [
        ("input_noise", &report.record.u),
        ("output_noise", &report.record.y),
    ] {
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
    // A model without a delay of its own sees the record without the delay.
    let shift = options.model_orders(order).map_or(nk - 1, |_| 0);
    let gain = arguments.gain.check(options.order(order));
    gain.map_err(|error| Error::Input(format!("--gain: {error}")))?;
    let samples = report.shifted(shift);
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
    let mut estimator = prepared.map_err(|error| bad(error.to_string()))?;
    let mut passes = vec![Pass::new(order); method.passes()];
    let reference = samples.r.unwrap_or(samples.u);
    let window = Window::with_reference(samples.u, samples.y, reference, samples.window);
    estimator.estimate(window, &mut passes);
    // Iteration 0 may belong to another estimator, under that estimator's name.
    let numbers = method.outputs().iter().zip(passes);
    let own = numbers.filter(|(output, _)| output.estimator == name.name());
    let passes = own.map(|(output, pass)| (output.pass, pass_report(pass, report, shift)));
    let mut estimate = Estimate {
        name,
        options: described,
        shift,
        passes: passes.collect(),
        observer: None,
        fit: None,
        parts: Vec::new(),
        white: None,
        hints: Vec::new(),
    };
    conclude(&mut estimate, &arguments.gain, report);
    if report.parts.is_empty() {
        estimate.hints = hints::of(&estimate, report);
    }
    Ok(estimate)
}

/// Returns a pass with its delay, loss and poles.
pub(super) fn pass_report(mut pass: Pass, report: &Report, shift: usize) -> PassReport {
    let mut model = pass.model.clone();
    if pass.progress < Progress::Parameters {
        return PassReport {
            pass,
            model,
            poles: Vec::new(),
            radius: None,
            precision: None,
            modes: None,
            residuals: None,
            feedback: None,
        };
    }
    model.delay += shift;
    model.b.splice(0..0, iter::repeat_n(0.0, shift));
    if pass.loss.is_nan() {
        let Record { u, y, .. } = &report.record;
        let (sum, rows) = complete_residuals(&model, &report.runs(), u, y);
        let parameters = model.orders().parameters();
        pass.loss = sum / report.window as f64;
        if model.noise_variance.is_nan() && rows > parameters {
            model.noise_variance = sum / (rows - parameters) as f64;
        }
    }
    // Without the zero poles that a delay adds.
    let degree = model.a.len() + model.f.len() - 2;
    let mut finder = PoleFinder::new(pass.a.len());
    let radius = finder.spectral_radius(&pass.a, !pass.unstable);
    let poles = finder.poles(&pass.a[pass.a.len() - degree..]);
    let (u, y) = (&report.record.u, &report.record.y);
    let window = report.window;
    let precision = Precision::new(&model, &poles);
    let modes = report.clock.map(|Clock { step, .. }| {
        let poles = precision.poles.iter();
        poles.filter_map(|pole| Mode::of(pole, step)).collect()
    });
    PassReport {
        precision: Some(precision),
        modes,
        residuals: match report.parts.as_slice() {
            [] => Residuals::new(&model, &u[..window], &y[..window]),
            _ => None,
        },
        feedback: report.feedback,
        poles,
        radius: Some(radius),
        pass,
        model,
    }
}

/// Computes FIT and observer for the last pass.
fn conclude(estimate: &mut Estimate, gain: &Gain, report: &Report) {
    let samples = report.shifted(estimate.shift);
    let last = estimate.passes.len() - 1;
    let (number, PassReport { pass, .. }) = &mut estimate.passes[last];
    if pass.progress < Progress::InitialState {
        return;
    }
    if !report.parts.is_empty() {
        let rest = estimate.name.parse(estimate.options.clone());
        let rest = rest.is_ok_and(|options| options.begins_at_rest());
        let model = &estimate.passes[last].1.model;
        estimate.parts = parts(&estimate.passes[last].1.pass, model, rest, report);
        let tests = estimate
            .parts
            .iter()
            .filter_map(|part| part.residuals.as_ref());
        estimate.white = Residuals::white_together(tests, model.orders());
        return;
    }
    estimate.fit = Some(fits(pass, estimate.shift, report));
    let observed = match pass.observed() {
        Some(model) => observe(model, gain, samples),
        None => return,
    };
    match observed {
        Err(kind) => pass.fail(Failure {
            kind,
            stage: Stage::Observer,
            pass: *number,
        }),
        Ok(observed) => estimate.observer = Some(observed),
    }
}

/// Returns what a model is on each of several records: from rest, or from the state that is estimated on it.
fn parts(pass: &Pass, model: &LinearModel, rest: bool, report: &Report) -> Vec<PartReport> {
    let runs = report.runs();
    let part = |run: &Range<usize>| {
        let (u, y) = (&report.record.u[run.clone()], &report.record.y[run.clone()]);
        let x0 = if rest {
            vec![0.0; pass.a.len()]
        } else {
            start_on(pass, u, y)
        };
        let fitted = FitModel {
            model: &pass.model,
            a: &pass.a,
            b: &pass.b,
            d: pass.direct,
            x0: &x0,
        };
        PartReport {
            residuals: Residuals::new(model, u, y),
            fit: fit(fitted, u, y, y.len(), 0..y.len()),
        }
    };
    runs.iter().map(part).collect()
}

/// Returns the FIT of a pass on the window, and on the record for validation or the samples after the window.
pub(super) fn fits(pass: &Pass, shift: usize, report: &Report) -> Fits {
    let Samples { u, y, window, .. } = report.shifted(shift);
    let model = FitModel {
        model: &pass.model,
        a: &pass.a,
        b: &pass.b,
        d: pass.direct,
        x0: &pass.x0,
    };
    let validation = match &report.validation {
        Some(Validation { record, .. }) => {
            let (u, y) = (&record.u[..record.u.len() - shift], &record.y[shift..]);
            let x0 = start_on(pass, u, y);
            Some(fit(
                FitModel { x0: &x0, ..model },
                u,
                y,
                y.len(),
                0..y.len(),
            ))
        }
        None => (window < y.len()).then(|| fit(model, u, y, window, window..y.len())),
    };
    Fits {
        window: fit(model, u, y, window, 0..window),
        validation,
    }
}

/// Returns the initial state of a model on another record, by least squares of its simulated output; NaN if it
/// overflows.
fn start_on(pass: &Pass, u: &[f64], y: &[f64]) -> Vec<f64> {
    let y: Vec<f64> = y.iter().zip(u).map(|(y, u)| y - pass.direct * u).collect();
    let mut x0 = vec![0.0; pass.a.len()];
    let found = InitialState::new(x0.len()).estimate(
        &pass.a,
        &pass.b,
        Window::new(u, &y, y.len()),
        &mut x0,
    );
    found.map_or_else(|_| vec![f64::NAN; pass.a.len()], |()| x0)
}

/// Runs stage 12 on the whole record.
fn observe(
    model: ObservedModel<'_>,
    gain: &Gain,
    samples: Samples<'_>,
) -> Result<Observed, FailureKind> {
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
