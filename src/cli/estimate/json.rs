//! The estimates as JSON. Numbers have the shortest form that reads back to the same bits (at most 17 significant
//! digits); undefined ones are null.

use super::report::{Estimate, Observed, Part, PartReport, PassReport, Report};
use crate::diagnosis::{Cancellation, Precision, Root, Z_95};
use crate::estimator::{Offset, Progress};
use crate::model::{ContinuousModel, LinearModel};
use asobench_identification::Fitted;
use serde_json::{Map, Value, json};

pub(super) fn render(report: &Report) -> Value {
    let shift = report.shift();
    let samples = report.shifted(shift);
    let solver = report
        .estimates
        .iter()
        .find_map(|estimate| estimate.options.get("solver"));
    json!({
        "file": report.file.display().to_string(),
        "order": report.orders.order() - shift,
        "delay": report.orders.nk,
        "orders": report.orders,
        "samples": samples.y.len(),
        "window": samples.window,
        "skipped": report.skipped,
        "sampling_time": report.clock.map(|clock| clock.step),
        "form": report.form,
        "validation": report.validation.as_ref().map(|validation| validation.file.display().to_string()),
        "solver": solver,
        "unit": report.unit,
        "detrend": report.detrend,
        "subtracted": report.subtracted().map(|[u, y]| json!({ "u": u.line(), "y": y.line() })),
        "gain": report.gain,
        "feedback_p_value": report.feedback.map(|test| test.p_value),
        "feedback": report.feedback,
        "excitation_order": report.excitation,
        "convention": "model: A(q) y = B(q)/F(q) u + C(q)/D(q) e in q^-1, of the original record, where y \
                       is less the offset if there is one; \
                       x(k+1) = A x(k) + b u(k), y = x_1 + d u, last row of A is a; alpha_i = -a_(n+1-i), beta_i = \
                       h_i; for ls and iv with delay nk, y(k) there is y(k + nk - 1) of the file",
        "records": records(report),
        "estimates": report.estimates.iter().map(|of| estimate(of, report)).collect::<Vec<_>>(),
    })
}

/// Returns the records, if there are several.
fn records(report: &Report) -> Option<Vec<Value>> {
    let part = |part: &Part| {
        json!({
            "file": part.file.display().to_string(),
            "lines": part.lines,
            "samples": part.samples,
            "feedback_p_value": part.feedback.map(|test| test.p_value),
            "feedback": part.feedback,
        })
    };
    (!report.parts.is_empty()).then(|| report.parts.iter().map(part).collect())
}

fn estimate(estimate: &Estimate, report: &Report) -> Value {
    let mut object = Map::new();
    object.insert("estimator".to_owned(), json!(estimate.name));
    object.insert("options".to_owned(), json!(estimate.options));
    object.append(&mut pass(estimate.last()));
    object.insert("hints".to_owned(), json!(estimate.hints));
    let fitted = &estimate.last().fitted;
    let begins = (fitted.pass.progress == Progress::InitialState).then(|| fitted.begins_at_rest());
    object.insert("begins_at_rest".to_owned(), json!(begins));
    object.insert("start_p_value".to_owned(), json!(estimate.start_chance));
    if estimate.passes[0].0 > 0 {
        let passes = estimate.passes.iter().map(|(number, report)| {
            let mut object = pass(report);
            object.insert("pass".to_owned(), json!(number));
            Value::Object(object)
        });
        object.insert("passes".to_owned(), passes.collect());
    }
    let fit = estimate
        .fit
        .as_ref()
        .map(|fits| json!({ "window": fits.window, "validation": fits.validation }));
    object.insert("fit_percent".to_owned(), json!(fit));
    if !report.parts.is_empty() {
        let offsets = &estimate.last().fitted.pass.offsets;
        let part = |(i, part): (usize, &PartReport)| {
            json!({
                "fit_percent": part.fit,
                "residuals": part.residuals,
                "offset": offsets.get(i).map(offset),
            })
        };
        let parts: Vec<Value> = estimate.parts.iter().enumerate().map(part).collect();
        object.insert("records".to_owned(), json!(parts));
        object.insert("white_in_all".to_owned(), json!(estimate.white));
    }
    object.insert("observer".to_owned(), json!(estimate.observer.as_ref().map(observer)));
    Value::Object(object)
}

fn polynomials(model: &LinearModel) -> Value {
    let LinearModel { a, b, c, d, f, .. } = model;
    json!({ "A": a, "B": b, "C": c, "D": d, "F": f, "orders": model.orders() })
}

fn observer(observer: &Observed) -> Value {
    json!({ "g": observer.g, "x_at_window": observer.at_window(), "x_last": observer.last() })
}

fn offset(Offset { value, se }: &Offset) -> Value {
    json!({ "value": value, "se": se, "interval_95": [value - Z_95 * se, value + Z_95 * se] })
}

/// Returns a model in continuous time; `None` if the estimator has none.
fn continuous(model: &ContinuousModel) -> Option<Value> {
    (!model.numerator.is_empty()).then(|| {
        json!({
            "numerator": model.numerator,
            "denominator": model.denominator,
            "se": model.standard_errors(),
            "covariance": (!model.covariance.is_empty()).then_some(&model.covariance),
            "hold": model.hold,
            "sampling_time": model.step,
            "dead_time": model.dead_time * model.step,
            "dead_time_se": model.dead_time_error(),
            "integrator": model.has_integrator(),
        })
    })
}

/// Returns a pole and a zero that may cancel, and the orders without them.
fn cancellation(pair: &Cancellation, model: &LinearModel) -> Value {
    let Cancellation { pole, zero, .. } = pair;
    json!({
        "pole": { "re": pole.re, "im": pole.im },
        "zero": { "re": zero.re, "im": zero.im },
        "distance": pair.distance(),
        "p_value": pair.p_value,
        "orders": pair.orders_without(model.orders()),
    })
}

fn cancellations(precision: Option<&Precision>, model: &LinearModel) -> Option<Vec<Value>> {
    let pairs = precision?.cancellations.iter();
    Some(pairs.map(|pair| cancellation(pair, model)).collect())
}

fn pass(report: &PassReport) -> Map<String, Value> {
    let PassReport {
        fitted: Fitted { pass, model, .. },
        radius,
        precision,
        residuals,
        ..
    } = report;
    let parameters = pass.progress >= Progress::Parameters;
    let known = |values: &[f64]| {
        if parameters { json!(values) } else { Value::Null }
    };
    let alpha: Vec<f64> = pass.a.iter().rev().map(|a| -a).collect();
    let x0 = (pass.progress == Progress::InitialState).then_some(&pass.x0);
    let roots = |of: fn(&Precision) -> &Vec<Root>| -> Value {
        let root = |Root { at, error }: &Root| json!({ "re": at.re, "im": at.im, "modulus": at.norm(), "se": error });
        let roots = precision.as_ref().map(of);
        json!(roots.map(|roots| roots.iter().map(root).collect::<Vec<_>>()))
    };
    let gain = |of: fn(&Precision) -> f64| json!(precision.as_ref().map(of));
    let cancellations = cancellations(precision.as_ref(), model);
    let errors = model.standard_errors().filter(|_| parameters);
    let intervals: Option<Vec<[f64; 2]>> = errors.as_ref().map(|errors| {
        let pairs = model.parameters().zip(errors);
        pairs
            .map(|(theta, se)| [theta - Z_95 * se, theta + Z_95 * se])
            .collect()
    });
    let failure = pass.failure.filter(|failure| !failure.kind.leaves_a_model());
    let failure =
        failure.map(|failure| json!({ "kind": failure.kind, "stage": failure.stage as u32, "pass": failure.pass }));
    let fields = [
        (
            "status",
            json!(pass.failure.as_ref().map_or("ok", |failure| failure.kind.name())),
        ),
        ("failure", json!(failure)),
        ("model", if parameters { polynomials(model) } else { Value::Null }),
        ("continuous", json!(continuous(&pass.continuous))),
        ("noise_variance", json!(parameters.then_some(model.noise_variance))),
        ("output_noise", json!(pass.noise_variances.map(|[y, _]| y))),
        ("input_noise", json!(pass.noise_variances.map(|[_, u]| u))),
        ("loss", json!(parameters.then_some(pass.loss))),
        ("se", json!(errors)),
        ("interval_95", json!(intervals)),
        ("offset", json!(pass.offsets.first().map(offset))),
        ("static_gain", gain(|precision| precision.static_gain)),
        ("static_gain_se", gain(|precision| precision.static_gain_se)),
        ("residuals", json!(residuals)),
        ("iterations", json!(pass.iterations)),
        ("minima", json!(pass.minima)),
        (
            "singular_values",
            json!((!pass.singular_values.is_empty()).then_some(&pass.singular_values)),
        ),
        (
            "correlations",
            json!((!pass.correlations.is_empty()).then_some(&pass.correlations)),
        ),
        ("a", known(&pass.a)),
        ("b", known(&pass.b)),
        ("h", known(&pass.h)),
        ("d", json!(parameters.then_some(pass.direct))),
        ("x0", json!(x0)),
        ("alpha", known(&alpha)),
        ("beta", known(&pass.h)),
        ("spectral_radius", json!(radius)),
        ("modes", json!(report.modes)),
        ("poles", roots(|precision| &precision.poles)),
        ("zeros", roots(|precision| &precision.zeros)),
        ("cancellations", json!(cancellations)),
        ("unstable", json!(parameters.then_some(pass.unstable))),
        ("condition", json!(pass.condition)),
    ];
    fields.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}
