//! The estimates as JSON. Numbers are in the shortest form that reads back to the same bits (at most
//! 17 significant digits); what is undefined is null.

use super::{Estimate, Name, Observed, PassReport, Report};
use crate::estimator::Progress;
use serde_json::{Map, Value, json};

pub(super) fn render(report: &Report) -> Value {
    json!({
        "file": report.file.display().to_string(),
        "order": report.order,
        "delay": report.delay,
        "samples": report.samples,
        "window": report.window,
        "solver": report.solver,
        "detrend": report.detrend,
        "gain": report.gain,
        "convention": "x(k+1) = A x(k) + b u(k), y = x_1, last row of A is a; A(q) y = B(q) u with \
                       alpha_i = -a_(n+1-i), beta_i = h_i; with delay nk, y(k) here is y(k + nk - 1) of the file",
        "estimates": report.estimates.iter().map(estimate).collect::<Vec<_>>(),
    })
}

fn estimate(estimate: &Estimate) -> Value {
    let mut object = Map::new();
    object.insert("estimator".to_owned(), json!(estimate.name));
    object.append(&mut pass(estimate.last()));
    if estimate.name == Name::InstrumentalVariables {
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
    object.insert(
        "observer".to_owned(),
        json!(estimate.observer.as_ref().map(observer)),
    );
    Value::Object(object)
}

fn observer(observer: &Observed) -> Value {
    json!({
        "g": observer.g,
        "x_at_window": observer.at_window,
        "x_last": observer.last,
    })
}

fn pass(report: &PassReport) -> Map<String, Value> {
    let PassReport {
        pass,
        poles,
        radius,
    } = report;
    let parameters = pass.progress >= Progress::Parameters;
    let known = |values: &[f64]| {
        if parameters {
            json!(values)
        } else {
            Value::Null
        }
    };
    let alpha: Vec<f64> = pass.a.iter().rev().map(|a| -a).collect();
    let x0 = (pass.progress == Progress::InitialState).then_some(&pass.x0);
    let poles: Vec<Value> = poles
        .iter()
        .map(|pole| json!({ "re": pole.re, "im": pole.im, "modulus": pole.norm() }))
        .collect();
    let failure = pass.failure.map(|failure| {
        json!({ "kind": failure.kind, "stage": failure.stage as u32, "pass": failure.pass })
    });
    let fields = [
        (
            "status",
            json!(pass.failure.map_or("ok", |failure| failure.kind.name())),
        ),
        ("failure", json!(failure)),
        ("a", known(&pass.a)),
        ("b", known(&pass.b)),
        ("h", known(&pass.h)),
        ("x0", json!(x0)),
        ("alpha", known(&alpha)),
        ("beta", known(&pass.h)),
        ("spectral_radius", json!(radius)),
        (
            "poles",
            if parameters {
                json!(poles)
            } else {
                Value::Null
            },
        ),
        ("unstable", json!(parameters.then_some(pass.unstable))),
        ("condition", json!(pass.condition)),
    ];
    fields
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
}
