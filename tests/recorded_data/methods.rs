//! Prediction error methods, instrumental variables and iterations against reference values that were made without this
//! program (`data/expected_methods.json` says by what, and the conventions).

use super::{distance, folder, numbers, size};
use serde_json::Value;
use std::process::Command;

/// Which estimator serves a case.
fn estimator(case: &Value) -> &'static str {
    let has = |key: &str| case["orders"].get(key).is_some();
    match case["method"].as_str().expect("a method") {
        "pem" if has("na") => "armax",
        "pem" if has("nc") || has("nd") => "bj",
        "pem" => "oe",
        "iv4" => "iv4",
        "sriv" => "sriv",
        "smb" => "stmcb",
        "2sls" => "iv-delayed",
        other => panic!("{other}"),
    }
}

/// What `asobench estimate` prints for a case.
fn estimate(case: &Value) -> Value {
    let orders = case["orders"].as_object().expect("orders");
    let counts = orders.iter().filter(|(key, _)| *key != "rows");
    let counts: Vec<String> = counts.map(|(key, n)| format!("{key}={n}")).collect();
    let mut command = Command::new(env!("CARGO_BIN_EXE_asobench"));
    command
        .arg("estimate")
        .arg(folder().join(case["data"].as_str().expect("a file")))
        .args(["--estimator", estimator(case)])
        .args(["--orders", &counts.join(",")])
        .args(["--window", &size(&case["N"]).to_string()])
        .args(["--detrend", case["detrend"].as_str().expect("a name")])
        .args(["--format", "json"]);
    if let Some(rows) = orders.get("rows") {
        command.args(["--rows", rows.as_str().expect("a name")]);
    }
    if let Some(extra) = case["extra"].as_u64() {
        command.args(["--extra", &extra.to_string()]);
    }
    let output = command.output().expect("asobench runs");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {error}", case["name"]);
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    report["estimates"][0].clone()
}

/// Every case within the tolerances that it states; the defaults of every method reach the lowest minimum.
#[test]
fn the_reference_values_of_every_method() {
    let path = folder().join("expected_methods.json");
    let text = std::fs::read_to_string(path).expect("expected_methods.json");
    let file: Value = serde_json::from_str(&text).expect("JSON");
    let cases = file["cases"].as_array().expect("cases");
    assert!(cases.len() >= 20);
    for case in cases {
        let (name, found) = (&case["name"], estimate(case));
        assert_eq!(found["status"], "ok", "{name}");
        let model = &found["model"];
        let polynomial = |key: &str, skip: usize| -> Vec<f64> {
            numbers(&model[key]).expect("a polynomial").split_off(skip)
        };
        let delay = size(&case["orders"]["nk"]);
        let theta = [
            polynomial("A", 1),
            polynomial("B", delay),
            polynomial("C", 1),
            polynomial("D", 1),
            polynomial("F", 1),
        ];
        let (expected, tolerance) = (&case["expected"], &case["tol"]);
        let vector = |what: &str, found: &[f64], expected: &Value| {
            let expected = numbers(expected).expect("numbers");
            let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let allowed = tolerance[format!("{what}_rel")]
                .as_f64()
                .expect("a tolerance");
            let error = distance(found, &expected) / largest;
            assert!(error <= allowed, "{name} {what}: {error:e}");
        };
        vector("theta", &theta.concat(), &expected["theta"]);
        if !expected["se"].is_null() {
            vector(
                "se",
                &numbers(&found["se"]).expect("standard errors"),
                &expected["se"],
            );
        }
        let scalar = |found: &Value, expected: &Value, allowed: f64| {
            let (Some(found), Some(expected)) = (found.as_f64(), expected.as_f64()) else {
                return;
            };
            let error = (found / expected - 1.0).abs();
            assert!(error <= allowed, "{name}: {found} {expected}");
        };
        let loss = tolerance["loss_rel"].as_f64().unwrap_or(1e-9);
        scalar(&found["loss"], &expected["loss"], loss);
        scalar(&found["noise_variance"], &expected["sigma2"], loss);
        if !expected["loss"].is_null() {
            let fit = &found["fit_percent"]["window"]["simulated"];
            scalar(fit, &expected["fit_percent"], 1e-6);
        }
    }
}

/// What was seen while the reference values were made: refined IV diverges on this record from the start by least squares,
/// though the output-error method has a minimum.
#[test]
fn a_refined_iv_that_diverges_is_typed() {
    let output = Command::new(env!("CARGO_BIN_EXE_asobench"))
        .arg("estimate")
        .arg(folder().join("epfl_active_suspension.csv"))
        .args(["--estimator", "sriv,oe", "--orders", "nb=3,nf=4,nk=2"])
        .args(["--window", "2000", "--detrend", "mean", "--format", "json"])
        .output()
        .expect("asobench runs");
    assert_eq!(output.status.code(), Some(1));
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let status = |i: usize| {
        report["estimates"][i]["status"]
            .as_str()
            .expect("a status")
            .to_owned()
    };
    assert_eq!([status(0), status(1)], ["unstable-predictor", "ok"]);
}
