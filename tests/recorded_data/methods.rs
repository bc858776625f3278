//! Prediction error methods, instrumental variables and iterations against reference values that were made without this
//! program (`data/expected_methods.json` says by what, and the conventions).

use super::{cases, distance, folder, numbers, read, size};
use crate::common::PROGRAM;
use asobench::data::{Detrend, Trend, csv};
use asobench::estimator::{Criterion, OrderComparison};
use asobench::model::Orders;
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

/// The JSON that `asobench estimate` prints for a case.
fn estimate(case: &Value) -> Value {
    let orders = case["orders"].as_object().expect("orders");
    let counts = orders.iter().filter(|(key, _)| *key != "rows");
    let counts: Vec<String> = counts.map(|(key, n)| format!("{key}={n}")).collect();
    let mut command = Command::new(PROGRAM);
    command
        .arg("estimate")
        .arg(folder().join(case["data"].as_str().expect("a file")))
        .args(["--estimator", estimator(case)])
        .args(["--orders", &counts.join(",")])
        .args(["--window", &size(&case["N"]).to_string()])
        .args(["--detrend", case["detrend"].as_str().expect("a name")])
        .args(["--format", "json"]);
    if case["method"] == "pem" {
        command.args(["--initial", "zero"]);
    }
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
    let file = read("expected_methods.json");
    let cases = file["cases"].as_array().expect("cases");
    assert!(cases.len() >= 20);
    for case in cases {
        let (name, found) = (&case["name"], estimate(case));
        assert_eq!(found["status"], "ok", "{name}");
        let model = &found["model"];
        let polynomial =
            |key: &str, skip: usize| -> Vec<f64> { numbers(&model[key]).expect("a polynomial").split_off(skip) };
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
            let allowed = tolerance[format!("{what}_rel")].as_f64().expect("a tolerance");
            let error = distance(found, &expected) / largest;
            assert!(error <= allowed, "{name} {what}: {error:e}");
        };
        vector("theta", &theta.concat(), &expected["theta"]);
        if !expected["se"].is_null() {
            vector("se", &numbers(&found["se"]).expect("standard errors"), &expected["se"]);
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

/// Instruments from a fixed model (published), and R's sysid by its reading.
#[test]
fn instrumental_variables_of_other_programs() {
    let cases = cases(false);
    assert!(cases.len() >= 5);
    for case in &cases {
        let name = case["name"].as_str().expect("a name");
        let [na, nb, nk] = ["na", "nb", "nk"].map(|key| size(&case[key]));
        let method = case["method"].as_str().expect("a method");
        let estimator = if method == "iv4_rsysid" { "iv4" } else { "iv" };
        let mut command = Command::new(PROGRAM);
        command
            .arg("estimate")
            .arg(folder().join(case["data"].as_str().expect("a file")))
            .args(["--estimator", estimator])
            .args(["--orders", &format!("na={na},nb={nb},nk={nk}")])
            .args(["--window", &size(&case["rows"][1]).to_string()])
            .args(["--detrend", case["detrend"].as_str().expect("a name")])
            .args(["--format", "json"]);
        if method == "iv_fixed_aux" {
            let list = |key: &str| {
                let numbers = numbers(&case["aux"][key]).expect("numbers");
                let texts: Vec<String> = numbers.iter().map(f64::to_string).collect();
                texts.join(",")
            };
            let model = format!("B={};F={}", list("num"), list("den"));
            command.args(["--rows", "prewindow", "--fixed-model", &model]);
        } else {
            command.args(["--reading", "r-sysid"]);
        }
        let output = command.output().expect("asobench runs");
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{name}: {error}");
        let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let estimates = report["estimates"].as_array().expect("estimates");
        let model = &estimates.last().expect("an estimate")["model"];
        let a = numbers(&model["A"]).expect("A");
        let b = numbers(&model["B"]).expect("B");
        let theta = [&a[1..], &b[nk..]].concat();
        let expected = numbers(&case["expected"]["theta"]).expect("theta");
        let worst = distance(&theta, &expected);
        assert!(worst <= case["tol"].as_f64().expect("a tolerance"), "{name}: {worst:e}");
    }
}

/// Losses and criteria of ARX models of order 1 to 8 over the same equations, and the order that each criterion
/// chooses.
#[test]
fn orders_are_chosen_as_by_another_program() {
    let file = read("expected_methods.json");
    for case in file["orders"].as_array().expect("cases") {
        let name = &case["name"];
        let path = folder().join(case["data"].as_str().expect("a file"));
        let mut record = csv::read(std::fs::File::open(path).expect("a record")).expect("a valid record");
        let detrend: Detrend = case["detrend"].as_str().expect("a name").parse().expect("detrend");
        for values in [&mut record.u, &mut record.y] {
            values.truncate(size(&case["N"]));
            Trend::fit(detrend, values).subtract(values);
        }
        let expected = &case["expected"];
        let table = expected["table"].as_array().expect("a table");
        let nk = size(&case["orders"]["nk"]);
        let orders: Vec<Orders> = table
            .iter()
            .map(|row| Orders::arx(size(&row["na"]), size(&row["nb"]), nk))
            .collect();
        let mut comparison = OrderComparison::new(&orders, record.u.len()).expect("enough samples");
        comparison.run(&record.u, &record.y);
        assert_eq!(comparison.equations(), size(&expected["rows"]));
        for (row, candidate) in table.iter().zip(comparison.candidates()) {
            let loss = candidate.loss.expect("a loss");
            let close = |found: f64, key: &str| {
                let expected = row[key].as_f64().expect(key);
                let error = (found / expected - 1.0).abs();
                assert!(error < 1e-9, "{name} {} {key}: {error:e}", candidate.orders);
            };
            close(loss, "V");
            for criterion in Criterion::ALL {
                let parameters = candidate.orders.parameters();
                let value = criterion.value(loss, comparison.equations(), parameters);
                close(value, criterion.name());
            }
        }
        for criterion in Criterion::ALL {
            let best = comparison.best(*criterion).expect("a model");
            assert_eq!(
                orders[best].na,
                size(&expected["best"][criterion.name()]),
                "{criterion}"
            );
        }
    }
}

/// Correlations of residuals, their bounds and statistics, as `asobench estimate` prints them.
#[test]
fn residual_tests_of_another_program() {
    let file = read("expected_methods.json");
    for case in file["residuals"].as_array().expect("cases") {
        let (name, orders) = (&case["name"], &case["orders"]);
        let [na, nb, nk] = ["na", "nb", "nk"].map(|key| size(&orders[key]));
        let output = Command::new(PROGRAM)
            .arg("estimate")
            .arg(folder().join(case["data"].as_str().expect("a file")))
            .args(["--estimator", "arx"])
            .args(["--orders", &format!("na={na},nb={nb},nk={nk}")])
            .args(["--window", &size(&case["N"]).to_string()])
            .args(["--detrend", case["detrend"].as_str().expect("a name")])
            .args(["--format", "json"])
            .output()
            .expect("asobench runs");
        let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let found = &report["estimates"][0]["residuals"];
        let expected = case["expected"].as_object().expect("values");
        let mut compared = 0;
        for (key, expected) in expected.iter().filter(|(key, _)| *key != "theta") {
            if let Some(expected) = numbers(expected) {
                let found = numbers(&found[key]).expect("numbers");
                let scale = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                let error = distance(&found, &expected) / scale;
                assert!(error < 1e-9, "{name} {key}: {error:e}");
            } else {
                let expected = expected.as_f64().expect("a number");
                let error = found[key].as_f64().expect("a number") / expected - 1.0;
                assert!(error.abs() < 1e-8, "{name} {key}: {error:e}");
            }
            compared += 1;
        }
        assert!(compared >= 15, "{compared}");
    }
}

/// Refined IV diverges on this record from the start by least squares, though the output-error method has a minimum: it
/// is stabilised, or fails with a name.
#[test]
fn a_refined_iv_that_diverges_is_stabilised() {
    let estimate = |more: &[&str]| {
        let output = Command::new(PROGRAM)
            .arg("estimate")
            .arg(folder().join("epfl_active_suspension.csv"))
            .args(["--orders", "nb=3,nf=4,nk=2"])
            .args(["--window", "2000", "--detrend", "mean", "--format", "json"])
            .args(more)
            .output()
            .expect("asobench runs");
        let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        (output.status.code(), report["estimates"].clone())
    };
    let (code, failed) = estimate(&["--estimator", "sriv", "--stabilise", "none"]);
    assert_eq!(code, Some(1));
    assert_eq!(failed[0]["status"], "unstable-predictor");
    let (code, found) = estimate(&["--estimator", "sriv,oe"]);
    assert_eq!(code, Some(0));
    let loss = |i: usize| found[i]["loss"].as_f64().expect("a loss");
    // It rests at another minimum.
    let status = |i: usize| found[i]["status"].clone();
    assert_eq!([status(0), status(1)], ["ok", "ok"]);
    assert!(loss(0) < 1.3 * loss(1), "{} {}", loss(0), loss(1));
}

/// The weightings of subspace methods against explicit projections (`subspace.py`, which says how `data/subspace.json`
/// was made).
#[test]
fn subspace_weightings_of_another_program() {
    for case in read("subspace.json").as_array().expect("cases") {
        let n = size(&case["n"]);
        for (weights, expected) in case["poles"].as_object().expect("weightings") {
            let output = Command::new(PROGRAM)
                .arg("estimate")
                .arg(folder().join(case["file"].as_str().expect("a file")))
                .args(["--estimator", "n4sid", "--weights", weights])
                .args(["--orders", &format!("n={n},nk=0")])
                .args(["--block-rows", &case["block_rows"].to_string()])
                .args(["--window", &case["N"].to_string()])
                .args(["--detrend", "mean", "--format", "json"])
                .output()
                .expect("asobench runs");
            let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
            let found = report["estimates"][0]["poles"].as_array().expect("poles");
            assert_eq!(found.len(), n);
            for pole in expected.as_array().expect("poles") {
                let pole = numbers(pole).expect("a pole");
                let distance = |found: &Value| {
                    let part = |key: &str| found[key].as_f64().expect("a number");
                    (part("re") - pole[0]).hypot(part("im") - pole[1])
                };
                let nearest = found.iter().map(distance).fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-9, "{weights} {pole:?}: {nearest:e}");
            }
        }
    }
}
