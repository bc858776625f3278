//! Hints on a record: an integrator, a start that is not at rest, a step.

use super::pictures::simulated;
use super::report::{Estimate, Report};
use crate::cli::output::note;
use crate::data::Trend;
use crate::diagnosis::Z_95;
use crate::estimator::{FailureKind, Pass, Problem, Rows, Shape, Window, initial_numbers};
use crate::metric::prediction_errors;
use crate::metric::tails::chi_square_above;
use crate::text::rounded;
use serde_json::{Value, json};

/// A pole this close to 1 may be 1 whatever its standard error is.
const NEAR_ONE: f64 = 2e-3;

/// Parts of a record whose means are compared.
const PARTS: usize = 20;

/// The level at which a record is said not to begin at rest.
const LEVEL: f64 = 1e-3;

/// Returns the hints for an estimate, as sentences without a full stop.
pub(super) fn of(estimate: &Estimate, report: &Report) -> Vec<String> {
    let hints = [
        integrator(estimate),
        of_start(estimate, report),
        offset(estimate, report),
        coloured(estimate),
        outlier(estimate, report),
        step(estimate, report),
    ];
    hints.into_iter().flatten().collect()
}

/// A real pole that may be 1.
fn integrator(estimate: &Estimate) -> Option<String> {
    let last = estimate.last();
    if last.fitted.pass.continuous.has_integrator() {
        return None;
    }
    let precision = last.precision.as_ref()?;
    let pole = precision.poles.iter().find(|root| {
        let error = root.error.modulus;
        let near = if error.is_finite() {
            NEAR_ONE.max(Z_95 * error).min(0.02)
        } else {
            NEAR_ONE
        };
        root.at.im == 0.0 && (root.at.re - 1.0).abs() <= near
    })?;
    let place = format!("{:.6}", pole.at.re);
    let mut zeros = precision.zeros.iter();
    if let Some(zero) = zeros.find(|zero| zero.at.im == 0.0 && (zero.at.re - 1.0).abs() <= 0.02) {
        return Some(format!(
            "the pole {place} and the zero {:.6} are what an offset leaves that was not subtracted: a model of one \
             order less, and --operating-point U,Y",
            zero.at.re
        ));
    }
    let offset = if last.fitted.pass.offsets.is_empty() {
        ""
    } else {
        "; an integrator has no equilibrium, and its record does not determine an offset"
    };
    Some(format!(
        "the pole {place} may be 1, an integrator: the differences y(k) - y(k-1) have a model without it, one order \
         lower{offset}"
    ))
}

/// Simulated errors that have a mean: what was subtracted from u and y is not the point about which the record moves.
fn offset(estimate: &Estimate, report: &Report) -> Option<String> {
    let [u, y] = report.subtracted()?.map(Trend::line);
    let simulated = simulated(estimate, report)?;
    let samples = report.shifted(estimate.shift());
    let errors = samples.y[..samples.window].iter().zip(&simulated);
    let errors: Vec<f64> = errors.map(|(y, simulated)| y - simulated).collect();
    let (whole, deviation) = mean_and_deviation(&errors);
    // Means of long parts are nearly independent, whatever the colour of the errors.
    let parts = errors.chunks_exact((errors.len() / PARTS).max(1));
    let means: Vec<f64> = parts.map(|part| mean_and_deviation(part).0).collect();
    let error = mean_and_deviation(&means).1 / (means.len() as f64).sqrt();
    if errors.len() < 10 * PARTS || !(whole.abs() > 5.0 * error && whole.abs() > 0.5 * deviation) {
        return None;
    }
    let whole = whole * report.unit;
    let way = if u[1] == 0.0 && y[1] == 0.0 {
        format!(
            "; --operating-point {},{} subtracts a nearer point",
            rounded(u[0], 6),
            rounded(y[0] + whole, 6)
        )
    } else {
        String::new()
    };
    Some(format!(
        "simulated errors have mean {} and standard deviation {}: the record does not move about what was \
         subtracted{way}",
        rounded(whole, 3),
        rounded(deviation * report.unit, 3)
    ))
}

/// The mean, and the standard deviation about it.
fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares = values
        .iter()
        .map(|value| (value - mean).powi(2))
        .sum::<f64>();
    (mean, (squares / count).sqrt())
}

/// Warns of an output far from zero: models without an offset do not describe it, and none was asked for. A step less
/// its mean is nothing.
pub(super) fn warn_of_offset(report: &Report, is_chosen: bool) {
    if is_chosen || report.subtracted().is_some() || is_constant(&report.record.u[..report.window])
    {
        return;
    }
    let y = &report.record.y[..report.window];
    let count = y.len() as f64;
    let mean = y.iter().sum::<f64>() / count;
    let variance = y.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / count;
    if mean.powi(2) > variance {
        note(&format!(
            "warning: y has mean {} and standard deviation {}, but the models have no offset; --detrend mean subtracts \
             the means, --offset estimate fits a constant",
            rounded(mean * report.unit, 3),
            rounded(variance.sqrt() * report.unit, 3)
        ));
    }
}

/// Standard errors for white prediction errors beside errors that are not white.
fn coloured(estimate: &Estimate) -> Option<String> {
    let white = estimate.last().residuals.as_ref()?.white?;
    // Without a choice they assume it too.
    let chosen = estimate.options.get("covariance").and_then(Value::as_str);
    let is_assumed = estimate.name.takes("covariance") && chosen.unwrap_or("white") == "white";
    let has_errors = !estimate.last().fitted.model.covariance.is_empty();
    (!white.passed && is_assumed && has_errors).then(|| {
        "the standard errors assume white prediction errors, which these are not: --covariance robust".to_owned()
    })
}

/// Residuals that normal noise does not have, with the largest of them in the words of the file.
fn outlier(estimate: &Estimate, report: &Report) -> Option<String> {
    let outliers = &estimate.last().residuals.as_ref()?.outliers;
    let first = outliers.first()?;
    let line = report
        .lines
        .get(first.sample)
        .map_or_else(String::new, |line| {
            let [level, slope] = report.trends[1].line();
            let y = report.record.y[first.sample] + level + slope * first.sample as f64;
            format!(", line {line}, y = {},", rounded(y * report.unit, 6))
        });
    let others = match outliers.len() - 1 {
        0 => String::new(),
        1 => "; one more is beyond that".to_owned(),
        count => format!("; {count} more are beyond that"),
    };
    Some(format!(
        "sample k = {}{line} has a residual of {} robust standard deviations, as none of {} normal numbers has (1 %){others}: \
         an outlier, or a model that misses something there; with the cell left empty --missing equations fits without it",
        first.sample,
        rounded(first.deviations, 3),
        estimate.last().residuals.as_ref()?.rows
    ))
}

/// The hint on signals before the record that are not zero.
pub(super) fn of_start(estimate: &Estimate, report: &Report) -> Option<String> {
    start(estimate, report).or_else(|| fixed_start(estimate, report))
}

/// Signals before the record that are not zero, for an estimator that has no other choice: its model predicts better
/// from another start, by more than chance.
fn fixed_start(estimate: &Estimate, report: &Report) -> Option<String> {
    let chooses =
        ["initial", "initial_state", "rows"].map(|key| estimate.options.contains_key(key));
    let in_loop = report.in_loop();
    let failed = estimate
        .failure()
        .is_some_and(|of| !of.kind.leaves_a_model());
    if chooses.contains(&true) || in_loop || estimate.shift() > 0 || failed {
        return None;
    }
    let mut options = estimate.options.clone();
    options.retain(|_, value| !value.is_null());
    if !estimate.name.parse(options).ok()?.begins_at_rest() {
        return None;
    }
    let model = estimate.last().known_model()?;
    let [u, y] = [&report.record.u, &report.record.y].map(|signal| &signal[..report.window]);
    let (first, best) = prediction_errors(model, u, y, report.window)?;
    let (mut zero, mut scratch) = (vec![0.0; u.len()], vec![0.0; u.len()]);
    model.residuals(u, y, &mut zero, &mut scratch);
    let mean_square = |errors: &[f64]| {
        let errors = &errors[first..report.window];
        errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64
    };
    let [zero, best] = [mean_square(&zero), mean_square(&best)];
    let likelihood = (report.window - first) as f64 * (zero / best).ln();
    if !(chi_square_above(likelihood, initial_numbers(model.orders())) < LEVEL) {
        return None;
    }
    let unit = report.unit * report.unit;
    Some(format!(
        "the record does not begin at rest, but {} takes zero signals before it: errors of variance {}, from the best \
         start {}; --estimator oe or bj with --initial estimate fits the start",
        estimate.name,
        rounded(zero * unit, 4),
        rounded(best * unit, 4)
    ))
}

/// Signals before the record that are not zero: the same method with them fitted has a lower loss than by chance.
fn start(estimate: &Estimate, report: &Report) -> Option<String> {
    let last = estimate.last();
    // In closed loop the fit of the past takes a part of the noise.
    let in_loop = report.in_loop();
    if estimate.options.get("initial")? != "zero" || in_loop || !last.fitted.pass.loss.is_finite() {
        return None;
    }
    let (u, y) = (&report.record.u, &report.record.y);
    let window = report.window;
    let mut options = estimate.options.clone();
    options.insert("initial".to_owned(), json!("estimate"));
    options.retain(|_, value| !value.is_null());
    let order = last.fitted.pass.a.len();
    let shape = Shape { order, window };
    let problem = Problem {
        covariance: true,
        ..shape.into()
    };
    let mut method = estimate.name.parse(options).ok()?.prepare(&problem).ok()?;
    let mut passes = [Pass::new(order)];
    method.estimate(Window::new(u, y, window), &mut passes);
    let [fitted] = &passes;
    let likelihood = window as f64 * (last.fitted.pass.loss / fitted.loss).ln();
    let p = chi_square_above(likelihood, initial_numbers(last.fitted.model.orders()));
    if fitted.failure.is_some() || !(p < LEVEL) {
        return None;
    }
    let unit = report.unit * report.unit;
    Some(format!(
        "the record does not begin at rest: zero signals before it were taken, noise variance {}; with --initial \
         estimate they are fitted, noise variance {}",
        rounded(last.fitted.model.noise_variance * unit, 4),
        rounded(fitted.model.noise_variance * unit, 4)
    ))
}

/// A step at the start, which only equations with zeros before the record see.
fn step(estimate: &Estimate, report: &Report) -> Option<String> {
    let kind = estimate.failure()?.kind;
    let rows = estimate.options.get("rows").map(Value::as_str);
    let complete = rows.is_none_or(|rows| rows == Some(Rows::Complete.name()));
    let singular = matches!(
        kind,
        FailureKind::Singular | FailureKind::RankDeficient | FailureKind::NotIdentifiable
    );
    let reach = report.orders.reach().min(report.window - 1);
    if !(singular && complete && is_constant(&report.record.u[reach..report.window])) {
        return None;
    }
    Some(format!("u is a step; {FROM_REST}"))
}

/// The hint on a step from rest.
pub(super) const FROM_REST: &str = "a step from rest is identified with zeros before the record alone: --estimator \
                                    oe, or arx with --rows prewindow";

pub(super) fn is_constant(values: &[f64]) -> bool {
    values.iter().all(|value| *value == values[0])
}
