//! Words about a model, shared by the text and the page.

use super::report::{Clock, Estimate, MOST_EXCITED, Report, Validation};
use crate::cli::output::wrapped;
use crate::diagnosis::{Cancellation, FeedbackTest, LoopVerdict, Precision, Residuals, Whiteness};
use crate::estimator::{EstimatorName, FailureKind, Offset, Pass, Progress};
use crate::model::polynomial::multiply;
use crate::model::{ContinuousModel, LinearModel};
use crate::number::plus_minus;
use crate::plant::PoleFinder;
use crate::plant::canonical::reverse_negated;
use crate::text::{rounded, visible};
use asobench_identification::Fitted;
use faer::c64;
use std::borrow::Cow;

/// Returns, in a line, what an estimator does and after which pass.
pub(super) fn heading(estimate: &Estimate) -> String {
    let number = estimate.passes.last().map_or(0, |(number, _)| *number);
    let about = estimate.name.about();
    // Marks in brackets end nothing.
    let mut depth = 0;
    let ends = |c: char| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        depth == 0 && ".,:;".contains(c)
    };
    let about = about.split(ends).next().unwrap_or(about);
    let pass = match number {
        0 => String::new(),
        number => format!(", after pass {number}"),
    };
    format!("{}: {about}{pass}", estimate.name)
}

/// Returns lines on what was left out of the record, on its time, and on the record for validation; nothing where
/// there is nothing to say.
pub(super) fn record(report: &Report) -> String {
    let mut lines = Vec::new();
    if report.skipped > 0 {
        lines.push(format!("the first {} samples are left out", report.skipped));
    }
    if let Some([u, y]) = report.subtracted() {
        lines.push(format!("{u} subtracted from u, {y} from y"));
    }
    if let Some(Clock { step, .. }) = report.clock {
        lines.push(format!("{} s between samples", rounded(step, 6)));
    }
    if report.excitation < MOST_EXCITED {
        let order = report.excitation;
        lines.push(format!(
            "u excites order {order}: without zeros before the record it tells {order} parameters apart at most"
        ));
    }
    if let Some(Validation { file, record }) = &report.validation {
        lines.push(format!(
            "validation: {}, {} samples",
            visible(file.display()),
            record.y.len()
        ));
    }
    if lines.is_empty() {
        return String::new();
    }
    wrapped(&lines.join("; "), "")
}

/// Returns how a model begins, of a method that can begin in two ways; `None` of others, or without a start.
pub(super) fn start(estimate: &Estimate) -> Option<String> {
    let fitted = &estimate.last().fitted;
    let known = fitted.pass.progress == Progress::InitialState;
    (known && estimate.options.contains_key("initial")).then(|| {
        match (fitted.begins_at_rest(), estimate.start_chance) {
            (true, _) if estimate.start_told => "at rest: the record tells no other".to_owned(),
            (true, _) => "at rest: zero signals before the record".to_owned(),
            (false, None) => "estimated".to_owned(),
            (false, Some(p)) => format!(
                "estimated: the record does not begin at rest ({}); --initial zero takes it so",
                chance(p)
            ),
        }
    })
}

/// Returns the static gain with its standard error.
pub(super) fn static_gain(precision: &Precision) -> String {
    if precision.static_gain.is_finite() {
        plus_minus(precision.static_gain, precision.static_gain_se)
    } else {
        "none: an integrator (a pole at 1)".to_owned()
    }
}

/// Returns the dead time with its standard error.
pub(super) fn dead_time(model: &ContinuousModel) -> String {
    let value = model.dead_time * model.step;
    match model.dead_time_error() {
        Some(error) if error.is_nan() => format!(
            "{} s, without a standard error: here it acts as the numerator does; one coefficient of B(s) less tells it",
            rounded(value, 6)
        ),
        error => plus_minus(value, error.unwrap_or(f64::NAN)) + " s",
    }
}

/// Capitalises a sentence.
pub(super) fn capitalised(sentence: &str) -> String {
    let mut characters = sentence.chars();
    let first = characters.next().map(|first| first.to_ascii_uppercase());
    first.into_iter().chain(characters).collect()
}

/// Returns each parameter of a model, then the offset of each record, with its name and its standard error, NaN where
/// there is none.
pub(super) fn parameters(fitted: &Fitted) -> Vec<(String, f64, f64)> {
    let Fitted { pass, model, .. } = fitted;
    let orders = model.orders();
    let names = [
        ("a", 1, orders.na),
        ("b", orders.nk, orders.nb),
        ("c", 1, orders.nc),
        ("d", 1, orders.nd),
        ("f", 1, orders.nf),
    ];
    let names = names
        .into_iter()
        .flat_map(|(name, first, count)| (first..first + count).map(move |i| format!("{name}_{i}")));
    let errors = model.standard_errors();
    let error = |i: usize| errors.as_ref().map_or(f64::NAN, |errors| errors[i]);
    let parameters = names.zip(model.parameters()).enumerate();
    let parameters = parameters.map(|(i, (name, theta))| (name, theta, error(i)));
    parameters
        .chain(offsets(pass).map(|(name, Offset { value, se })| (name, value, se)))
        .collect()
}

/// Returns the offset of each record with its name.
pub(super) fn offsets(pass: &Pass) -> impl Iterator<Item = (String, Offset)> {
    let several = pass.offsets.len() > 1;
    let offsets = pass.offsets.iter().enumerate();
    offsets.map(move |(i, offset)| {
        let of_record = if several {
            format!(" of record {}", i + 1)
        } else {
            String::new()
        };
        (format!("offset{of_record}"), *offset)
    })
}

/// Zeros outside the circle of this radius are said to be on the unit circle.
const ON_THE_CIRCLE: f64 = 0.999;

/// Returns what is known of a model that a search left without coming to a minimum, with advice; `None` for others.
pub(super) fn unfinished(estimate: &Estimate) -> Option<String> {
    let (name, model) = (estimate.name, &estimate.last().fitted.model);
    let why = match estimate.failure()?.kind {
        FailureKind::Boundary if largest_zero(&model.c) > ON_THE_CIRCLE && model.a.len() > 1 => {
            "a zero of C lies on the unit circle: lower nc, or use oe"
        }
        FailureKind::Boundary if largest_zero(&model.c) > ON_THE_CIRCLE => {
            "a zero of C lies on the unit circle: lower nc"
        }
        FailureKind::Boundary if name.takes("dead_time") => {
            "the dead time lies at an end of its range, beyond which the loss falls: a wider --dead-time LOW:HIGH"
        }
        FailureKind::Boundary => "a zero of F lies on the unit circle: lower nf, or take differences of the record",
        FailureKind::Implausible if name == EstimatorName::Bels => {
            "a variance of noise below 0: more --earlier inputs, or --input-noise"
        }
        FailureKind::Implausible => {
            "the response has not decayed at its last tap, so the model is too fast and its gain too small: a longer \
             record, more --taps or --high-order, or oe"
        }
        FailureKind::IterationLimit if name.takes("long") => {
            "the iteration does not converge; this is its best model: lower the orders; an unstable plant in a stable \
             loop needs armax, pem, ssarx or indirect"
        }
        FailureKind::IterationLimit if !name.takes("starts") => {
            "the iteration does not converge; this is its best model: lower the orders, or use oe or bj"
        }
        FailureKind::IterationLimit => "the best model so far, not at a minimum: lower the orders, or raise --starts",
        _ => return None,
    };
    Some(format!("{why}; there are no standard errors"))
}

/// Returns how an estimate ended that failed, or, with a model, came to no minimum.
pub(super) fn status(estimate: &Estimate, report: &Report) -> Option<Result<String, String>> {
    let failure = estimate.failure()?;
    if let Some(sentence) = unfinished(estimate) {
        return Some(Ok(format!("{}: {sentence}", failure.kind)));
    }
    let cause = cause(failure.kind, report).map_or(String::new(), |cause| format!(": {cause}"));
    Some(Err(format!("{failure}{cause}")))
}

/// Returns why an estimate has no model, with advice; `None` where the kind's name says it.
fn cause(kind: FailureKind, report: &Report) -> Option<Cow<'static, str>> {
    let cause = match kind {
        FailureKind::RankDeficient | FailureKind::NotIdentifiable if report.excitation < MOST_EXCITED => {
            return Some(Cow::Owned(format!(
                "u excites order {}, too few for the parameters: lower the orders, or excite the plant more",
                report.excitation
            )));
        }
        FailureKind::NonFinite => "a number of the calculation overflowed or is none",
        FailureKind::Singular => "the equations are singular: a signal that they need is zero",
        FailureKind::RankDeficient | FailureKind::NotIdentifiable => {
            "the record does not distinguish the parameters: lower the orders, or excite the plant more"
        }
        FailureKind::UnstablePredictor => "the model's predictor is unstable: try --stabilise reflect, or oe",
        FailureKind::UnstableInstruments => {
            "the model whose output makes the instruments is unstable: try --stabilise reflect, or oe"
        }
        _ => return None,
    };
    Some(Cow::Borrowed(cause))
}

/// Returns the largest modulus of the zeros of `1 + d_1 q^-1 + ...`; 0 without zeros.
fn largest_zero(polynomial: &[f64]) -> f64 {
    let mut a = vec![0.0; polynomial.len() - 1];
    reverse_negated(&polynomial[1..], &mut a);
    let zeros = PoleFinder::new(a.len()).poles(&a);
    zeros.iter().map(|zero| zero.norm()).fold(0.0, f64::max)
}

/// Why there are no residual tests.
pub(super) const NOT_TESTED: &str = "not tested: fewer than 4 residuals, all of them zero, or an unstable predictor";

/// Says that there is nothing to test.
const EXACT: &str = "fit to the rounding of the record's numbers: nothing to test";

/// Returns the verdict of each residual test, with its p-value. The last is that of the record.
pub(super) fn residual_tests(residuals: &Residuals, feedback: Option<FeedbackTest>) -> Vec<String> {
    let verdict = |test: Whiteness, good: &str, bad: &str| {
        let verdict = if test.passed { good } else { bad };
        let p = chance(test.p_value);
        format!("{verdict} ({p})")
    };
    let Some(white) = residuals.white else {
        return vec![EXACT.to_owned()];
    };
    vec![
        verdict(white, "white", "NOT white: check noise model, order, offset"),
        residuals.free_of_past_input.map_or_else(
            || "past input: cannot be tested with this input".to_owned(),
            |test| {
                verdict(
                    test,
                    "not correlated with past input",
                    "correlated with past input: B, F or delay is wrong",
                )
            },
        ),
        feedback.map_or_else(|| "feedback: cannot be tested with this input".to_owned(), in_loop),
    ]
}

/// Returns what a record says of feedback and of a direct term.
fn in_loop(test: FeedbackTest) -> String {
    let p = chance(test.p_value);
    let later = test.later.map_or_else(String::new, chance);
    match test.verdict() {
        LoopVerdict::Open => format!("no sign of feedback ({p})"),
        LoopVerdict::Feedback => {
            format!("u follows y: feedback ({p}; later u, as a direct term does not: {later})")
        }
        LoopVerdict::AtOnce => format!(
            "u(k) and y(k) move together ({p}): u acts at once (nk = 0: --delay 0), or a controller answers within the \
             sample; no later u follows y ({later}), as with nk = 0, or a controller without memory"
        ),
        LoopVerdict::Told => format!(
            "u(k) tells y(k) ({p}): feedback of a controller without a setpoint change, which no model can be told \
             from, or u acts at once (nk = 0: --delay 0) without noise"
        ),
    }
}

/// Returns the basis of [`residual_tests`].
pub(super) fn residual_basis(residuals: &Residuals) -> String {
    format!(
        "each test at 1 %, over up to {} lags of {} residuals",
        residuals.lags(),
        residuals.rows
    )
}

/// Returns the verdict of a test for whiteness.
pub(super) fn whiteness(white: Whiteness) -> String {
    let verdict = if white.passed { "white" } else { "NOT white" };
    format!("{verdict} ({})", chance(white.p_value))
}

/// Formats `p = 0.1234`.
pub(super) fn chance(p: f64) -> String {
    if p < 1e-4 {
        "p < 0.0001".to_owned()
    } else {
        format!("p = {p:.4}")
    }
}

/// Formats `0.5 - 0.2i`, or with `+-` for a pair, with four digits.
fn complex(z: c64) -> String {
    if z.im == 0.0 {
        return rounded(z.re, 4);
    }
    format!("{} +- {}i", rounded(z.re, 4), rounded(z.im.abs(), 4))
}

/// Returns the closest pole and zero that may cancel, and the orders without them.
pub(super) fn cancellation(model: &LinearModel, precision: &Precision) -> Option<String> {
    let first: &Cancellation = precision.cancellations.first()?;
    let (poles, zeros) = if first.pole.im == 0.0 {
        ("pole", "zero")
    } else {
        ("poles", "zeros")
    };
    let Cancellation { pole, zero, .. } = first;
    Some(format!(
        "{poles} {} and {zeros} {} may be the same ({}): the order may be too high; try orders {}",
        complex(*pole),
        complex(*zero),
        chance(first.p_value),
        first.orders_without(model.orders())
    ))
}

/// Whether the noise at the output, C/(A D) e, is not e itself.
pub(super) fn has_noise_model(model: &LinearModel) -> bool {
    multiply(&model.a, &model.d) != model.c
}

/// Returns why a model has no standard errors; `None` if it has them.
pub(super) fn no_errors(model: &LinearModel) -> Option<&'static str> {
    match model.standard_errors() {
        None if model.noise_variance.is_nan() => Some("no equations are left to estimate the noise"),
        None => Some("this estimator gives no covariance of its parameters"),
        Some(errors) if errors.iter().all(|error| error.is_finite()) => None,
        Some(_) => Some("the information matrix is singular"),
    }
}
