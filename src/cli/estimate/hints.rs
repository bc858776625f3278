//! Hints on a record: an integrator, a start that is not at rest, a step.

use super::comparison;
use super::levels;
use super::levels::LEVEL;
use super::report::{Estimate, Report};
use crate::cli::output::note;
use crate::diagnosis::{LoopVerdict, Outlier, Residuals, Z_95};
use crate::estimator::{EstimatorName, FailureKind, Rows, initial_numbers};
use crate::metric::prediction_errors;
use crate::metric::tails::chi_square_above;
use crate::text::{listed, rounded};
use serde_json::Value;

/// A pole this close to 1 may be 1 whatever its standard error is.
const NEAR_ONE: f64 = 2e-3;

/// Returns the hints for an estimate, as sentences without a full stop; the first is that `of_start`.
pub(super) fn of(estimate: &Estimate, report: &Report, of_start: Option<String>) -> Vec<String> {
    if !report.parts.is_empty() {
        let outlier = || {
            let mut parts = report.parts.iter().zip(&estimate.parts);
            parts.find_map(|(part, of)| {
                // The constants that were subtracted are unknown, and the lines too unless each row is one.
                let [first, last] = part.lines?;
                let known = last - first + 1 == part.samples as u64;
                let line = |sample: usize| known.then(|| first + sample as u64);
                outlier(estimate, of.residuals.as_ref()?, &line, &|_| None)
            })
        };
        return of_start
            .or_else(outlier)
            .into_iter()
            .chain(coloured(estimate))
            .collect();
    }
    // A model without its start or level misses much of the record.
    let hints = [
        direct(estimate, report),
        of_start.or_else(|| {
            let line = |sample: usize| report.lines.get(sample).copied();
            let [level, slope] = report.trends[1].line();
            let y = |sample: usize| Some((report.record.y[sample] + level + slope * sample as f64) * report.unit);
            outlier(estimate, estimate.last().residuals.as_ref()?, &line, &y)
        }),
        integrator(estimate, report),
        coloured(estimate),
        step(estimate, report),
    ];
    hints.into_iter().flatten().collect()
}

/// A real pole that may be 1, or with a zero beside it stands for an offset.
fn integrator(estimate: &Estimate, report: &Report) -> Option<String> {
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
        let pair = format!("the pole {place} and the zero {:.6}", zero.at.re);
        if estimate.name.takes("offset") {
            return levels::offset_of_pair(estimate, report).map(|(flags, lead)| {
                format!("{pair} stand for an offset: one order less with {flags} has a BIC lower by {lead:.0}")
            });
        }
        return Some(format!(
            "{pair} are either a slow part of the plant or an offset: --estimator oe --offset estimate with one order \
             less tells by its BIC"
        ));
    }
    let way = if estimate.name.takes("integrator") {
        "--integrator fixes it; "
    } else {
        ""
    };
    let offset = if last.fitted.pass.offsets.is_empty() {
        ""
    } else {
        "; an integrator has no equilibrium, and its record does not determine an offset"
    };
    Some(format!(
        "the pole {place} may be 1, an integrator: {way}the differences y(k) - y(k-1) have a model without it, one \
         order lower, in coloured noise{offset}"
    ))
}

/// Prints hints to standard error, also before a refusal of which the start or the offset may be the reason.
pub(super) fn tell(hints: &[String]) {
    for hint in hints {
        note(&format!("hint: {hint}"));
    }
}

/// Warns of an output far from zero: models without an offset do not describe it. Methods that can fit one have a hint
/// where the record asks for it.
pub(super) fn warn_of_offset(report: &Report, methods: &[EstimatorName]) {
    let can_fit = methods.iter().all(|of| of.takes("offset"));
    if can_fit || report.subtracted().is_some() || is_constant(&report.record.u[..report.window]) {
        return;
    }
    let y = &report.record.y[..report.window];
    let count = y.len() as f64;
    let mean = y.iter().sum::<f64>() / count;
    let variance = y.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / count;
    if mean.powi(2) > variance {
        note(&format!(
            "warning: y has mean {} and standard deviation {}, but the models have no offset; --estimator oe --offset \
             estimate fits one",
            rounded(mean * report.unit, 3),
            rounded(variance.sqrt() * report.unit, 3)
        ));
    }
}

/// The beginning of the hint on standard errors.
pub(super) const ASSUMED: &str = "the standard errors assume white prediction errors, which these are not";

/// Standard errors for white prediction errors beside errors that are not white.
fn coloured(estimate: &Estimate) -> Option<String> {
    let has_errors = !estimate.last().fitted.model.covariance.is_empty();
    if comparison::white(estimate)? || !has_errors {
        return None;
    }
    if estimate.name == EstimatorName::Srivc {
        return Some(format!("{ASSUMED}: --estimator rivc models the noise"));
    }
    // Without a choice they assume it too.
    let chosen = estimate.options.get("covariance").and_then(Value::as_str);
    let is_assumed = estimate.name.takes("covariance") && chosen.unwrap_or("white") == "white";
    let biased = matches!(estimate.name, EstimatorName::Arx | EstimatorName::LeastSquares);
    let model = if biased {
        "; least squares are biased then: --estimator oe or bj, or a higher order"
    } else {
        ""
    };
    let residuals = estimate.last().residuals.as_ref();
    let of_input = residuals.and_then(|of| of.free_of_past_input);
    if !biased && of_input.is_some_and(|test| !test.passed) {
        return Some(
            "past input tells the residuals, so the delay or the order is wrong, or the record drifts; until it tells \
             nothing no standard errors hold"
                .to_owned(),
        );
    }
    is_assumed.then(|| format!("{ASSUMED}: --covariance robust{model}"))
}

/// Outliers that are named beside the largest.
const NAMED: usize = 9;

/// Residuals that normal noise does not have, of a record or of a part between gaps, with the largest of them in the
/// words of the file: the line of a sample, and y there, where they are known.
fn outlier(
    estimate: &Estimate,
    residuals: &Residuals,
    line: &dyn Fn(usize) -> Option<u64>,
    y: &dyn Fn(usize) -> Option<f64>,
) -> Option<String> {
    let outliers = &residuals.outliers;
    let first = outliers.first()?;
    let line_of = |other: &Outlier| Some(line(other.sample)?.to_string());
    let line = line_of(first).map_or_else(String::new, |line| {
        let y = y(first.sample).map_or_else(String::new, |y| format!(" y = {},", rounded(y, 6)));
        format!(", line {line},{y}")
    });
    let others: Vec<String> = outliers.iter().skip(1).filter_map(line_of).collect();
    let others = match outliers.len() - 1 {
        0 => String::new(),
        count if others.is_empty() => format!("; {count} more are beyond that"),
        1 => format!("; so has line {}", others[0]),
        _ => format!("; so have lines {}", listed(&others, NAMED)),
    };
    let options = estimate.name.parse(estimate.given());
    let equations = options.is_ok_and(|options| options.takes_runs());
    let way = if equations {
        "--missing equations fits without it"
    } else {
        "--missing longest-run takes the longest part without it"
    };
    Some(format!(
        "sample k = {}{line} has a residual of {} robust standard deviations, as none of {} normal numbers has \
         (1 %){others}: an outlier, or a model that misses something there; with the cell left empty, \
         {way}",
        first.sample,
        rounded(first.deviations, 3),
        residuals.rows
    ))
}

/// The hint on a loop, where models are compared.
pub(super) const LOOP: &str = "u follows y, as a controller makes it: of a loop, models whose residuals are white are \
                               right (bj, armax); iv, moesp and n4sid are biased; with the loop's reference \
                               --estimator clriv --reference COLUMN needs no model of the noise";

/// An input that moves together with y: a direct term, where the delay of the model is the smallest one after that, or
/// a controller.
fn direct(estimate: &Estimate, report: &Report) -> Option<String> {
    let sentence = match report.feedback?.verdict() {
        LoopVerdict::AtOnce if estimate.last().fitted.model.delay == 1 => {
            "u(k) and y(k) move together: if u acts on y at once, --delay 0 fits a direct term; if a controller \
             without memory answers y, the record is of a loop"
        }
        LoopVerdict::Told => {
            "y tells u: of a loop whose setpoint stays the same no model of the plant can be told from the controller; \
             a record in which the setpoint changes has one"
        }
        _ => return None,
    };
    Some(sentence.to_owned())
}

/// Signals before the record that are not zero, for an estimator that has no other choice: its model predicts better
/// from another start, by more than chance.
pub(super) fn fixed_start(estimate: &Estimate, report: &Report) -> Option<String> {
    let chooses = ["initial", "initial_state", "rows"].map(|key| estimate.options.contains_key(key));
    let in_loop = report.in_loop();
    let failed = estimate.failure().is_some_and(|of| !of.kind.leaves_a_model());
    if chooses.contains(&true) || in_loop || estimate.shift() > 0 || failed {
        return None;
    }
    if !estimate.name.parse(estimate.given()).ok()?.begins_at_rest() {
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
