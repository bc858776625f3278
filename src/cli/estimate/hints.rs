//! What a user may do about a record: an integrator, a start that is not at rest, a step.

use super::report::{Estimate, Report};
use crate::diagnosis::{Z_95, is_feedback};
use crate::estimator::{FailureKind, Pass, Problem, Rows, Shape, Window, initial_numbers};
use crate::metric::tails::chi_square_above;
use crate::text::rounded;
use serde_json::{Value, json};

/// A pole this close to 1 may be 1 whatever its standard error is.
const NEAR_ONE: f64 = 2e-3;

/// The level at which a record is said not to begin at rest.
const LEVEL: f64 = 1e-3;

/// Returns the hints for an estimate, as sentences without a full stop.
pub(super) fn of(estimate: &Estimate, report: &Report) -> Vec<String> {
    let hints = [
        integrator(estimate),
        start(estimate, report),
        step(estimate, report),
    ];
    hints.into_iter().flatten().collect()
}

/// A real pole that may be 1.
fn integrator(estimate: &Estimate) -> Option<String> {
    let last = estimate.last();
    let roots = &last.precision.as_ref()?.poles;
    let pole = roots.iter().find(|root| {
        let error = root.error.modulus;
        let near = if error.is_finite() {
            NEAR_ONE.max(Z_95 * error).min(0.02)
        } else {
            NEAR_ONE
        };
        root.at.im == 0.0 && (root.at.re - 1.0).abs() <= near
    })?;
    let place = format!("{:.6}", pole.at.re);
    Some(format!(
        "the pole {place} may be 1, an integrator: the differences y(k) - y(k-1) have a model without it, one order lower"
    ))
}

/// Signals before the record that are not zero: the same method with them fitted has a lower loss than by chance.
fn start(estimate: &Estimate, report: &Report) -> Option<String> {
    let last = estimate.last();
    // In closed loop the fit of the past takes a part of the noise.
    let in_loop = report.feedback.is_some_and(is_feedback);
    if estimate.options.get("initial")? != "zero" || in_loop || !last.pass.loss.is_finite() {
        return None;
    }
    let (u, y) = (&report.record.u, &report.record.y);
    let window = report.window;
    let mut options = estimate.options.clone();
    options.insert("initial".to_owned(), json!("estimate"));
    options.retain(|_, value| !value.is_null());
    let order = last.pass.a.len();
    let shape = Shape { order, window };
    let problem = Problem {
        covariance: true,
        ..shape.into()
    };
    let mut method = estimate.name.parse(options).ok()?.prepare(&problem).ok()?;
    let mut passes = [Pass::new(order)];
    method.estimate(Window::new(u, y, window), &mut passes);
    let [fitted] = &passes;
    let likelihood = window as f64 * (last.pass.loss / fitted.loss).ln();
    let p = chi_square_above(likelihood, initial_numbers(last.model.orders()));
    if fitted.failure.is_some() || !(p < LEVEL) {
        return None;
    }
    let unit = report.unit * report.unit;
    Some(format!(
        "the record does not begin at rest: zero signals before it were taken, noise variance {}; with --initial estimate \
         they are fitted, noise variance {}",
        rounded(last.model.noise_variance * unit, 4),
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

/// What a step from rest needs.
pub(super) const FROM_REST: &str = "a step from rest is identified with zeros before the record alone: --estimator oe, or \
                                    arx with --rows prewindow";

pub(super) fn is_constant(values: &[f64]) -> bool {
    values.iter().all(|value| *value == values[0])
}
