//! Methods in continuous time, in closed loop and for errors in variables against numpy and scipy (the scripts in
//! `newcomers/`, which wrote its records and JSON).

use super::{numbers, size};
use crate::common::PROGRAM;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recorded_data/newcomers")
}

fn cases(file: &str) -> Vec<Value> {
    let text = std::fs::read_to_string(folder().join(file)).expect(file);
    let file: Value = serde_json::from_str(&text).expect("JSON");
    file["cases"].as_array().expect("cases").clone()
}

fn run(data: &str, arguments: &[&str]) -> Output {
    let mut command = Command::new(PROGRAM);
    command.arg("estimate").arg(folder().join(data)).args(arguments);
    command.output().expect("asobench runs")
}

fn estimate(data: &str, arguments: &[&str]) -> Value {
    let output = run(data, &[arguments, &["--format", "json"]].concat());
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{data}: {error}");
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    report["estimates"][0].clone()
}

fn text<'a>(case: &'a Value, key: &str) -> &'a str {
    case[key].as_str().expect(key)
}

/// Each number within this part of the reference.
fn near(what: &str, found: &[f64], expected: &Value, tolerance: f64) {
    let expected = numbers(expected).expect("numbers");
    assert_eq!(found.len(), expected.len(), "{what}");
    for (found, expected) in found.iter().zip(expected) {
        let error = (found / expected - 1.0).abs();
        assert!(error < tolerance, "{what}: {found} {expected}");
    }
}

/// Coefficients in s, noise model, standard errors and loss. scipy's search ends at 1e-9, its differences at 1e-8.
#[test]
fn models_in_continuous_time() {
    let mut all = cases("continuous.json");
    all.extend(cases("loop_continuous.json"));
    assert_eq!(all.len(), 6);
    for case in &all {
        let (data, method) = (text(case, "data"), text(case, "method"));
        let what = format!("{data} {method}");
        let hold = ["--hold", text(case, "hold")];
        let options = ["--estimator", method, "--orders", text(case, "orders")];
        let more = case["arguments"].as_array().into_iter().flatten();
        let more: Vec<&str> = more.filter_map(Value::as_str).collect();
        let found = estimate(data, &[&options[..], &hold, &more].concat());
        let (expected, continuous) = (&case["expected"], &found["continuous"]);
        assert_eq!(found["status"], "ok", "{what}");
        assert_eq!(continuous["sampling_time"], case["ts"], "{what}");
        let list = |of: &Value, skip: usize| numbers(of).expect("numbers").split_off(skip);
        let theta = [list(&continuous["numerator"], 0), list(&continuous["denominator"], 1)];
        near(&what, &theta.concat(), &expected["theta"], 1e-8);
        near(&what, &list(&continuous["se"], 0), &expected["se"], 1e-7);
        let noise = [list(&found["model"]["C"], 1), list(&found["model"]["D"], 1)].concat();
        near(&what, &noise, &expected["noise"], 1e-8);
        let orders = &found["model"]["orders"];
        let count = |key: &str| {
            size(&Value::from(orders.as_str().map_or(0, |text| {
                let number = text
                    .split(',')
                    .find_map(|part| part.strip_prefix(key)?.strip_prefix('='));
                number.and_then(|number| number.parse::<u64>().ok()).unwrap_or(0)
            })))
        };
        let (first, all) = (count("nb"), count("nc") + count("nd"));
        near(
            &what,
            &list(&found["se"], 0)[first..first + all],
            &expected["noise_se"],
            1e-7,
        );
        near(
            &what,
            &[found["loss"].as_f64().expect("a loss")],
            &Value::from(vec![expected["loss"].clone()]),
            1e-11,
        );
    }
}

/// One line names the option that a user must give, or the value that is refused.
#[test]
fn the_time_between_samples_is_asked_for() {
    let line = |arguments: &[&str]| {
        let output = run("rao_garnier.csv", arguments);
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let srivc = ["--estimator", "srivc", "--order", "2"];
    let error = line(&[&srivc[..], &["--time", "none"]].concat());
    assert!(
        error.contains("--estimator srivc: needs the time between samples; expected --ts SECONDS"),
        "{error}"
    );
    let error = line(&[&srivc[..], &["--hold", "second"]].concat());
    assert!(error.contains("unknown hold 'second'"), "{error}");
    let error = line(&["--estimator", "srivc", "--orders", "nb=4,nf=2"]);
    assert!(error.contains("--orders: expected an nb of 1 to nf + 1"), "{error}");
    // `--order` and `--delay` alone, and the page.
    let found = estimate(
        "rao_garnier.csv",
        &["--estimator", "srivc", "--order", "2", "--delay", "3"],
    );
    assert_eq!(found["continuous"]["dead_time"], 0.02);
    let found = estimate(
        "lines.csv",
        &["--estimator", "srivc", "--order", "2", "--hold", "first-order"],
    );
    assert_eq!(found["continuous"]["numerator"].as_array().map(Vec::len), Some(2));
    assert_eq!(found["model"]["B"].as_array().map(Vec::len), Some(3));
}

/// A pole at 0 and a dead time as text and JSON; one line for each that cannot be.
#[test]
fn integrators_and_dead_times() {
    let srivc = ["--estimator", "srivc", "--orders", "nb=1,nf=1"];
    let options = [&srivc[..], &["--integrator", "--dead-time", "0.015"]].concat();
    let found = estimate("rao_garnier.csv", &options);
    let continuous = &found["continuous"];
    assert_eq!(continuous["integrator"], true);
    assert_eq!(continuous["denominator"][2], 0.0);
    assert_eq!(continuous["dead_time"], 0.015);
    assert!(continuous["dead_time_se"].is_null() && found["static_gain"].is_null());
    assert_eq!(found["model"]["B"].as_array().map(Vec::len), Some(5));
    let output = run("rao_garnier.csv", &options);
    let text = String::from_utf8_lossy(&output.stdout);
    for part in [
        "y = B(s)/A(s) u, A(0) = 0, zero-order",
        "dead time          0.015 s",
        "(an integrator)",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let both = ["--integrator", "--initial", "estimate", "--offset=estimate"];
    let mistakes: [(&[&str], &str); 4] = [
        (
            &["--dead-time", "-1"],
            "--dead-time: dead time '-1': expected seconds of at least 0",
        ),
        (
            &["--dead-time", "0.2:0.1"],
            "--dead-time: dead time '0.2:0.1': expected",
        ),
        (&["--dead-time", "400"], "a dead time of 400 s; expected one below"),
        (&both, "--offset: the level of an integrator is in its state"),
    ];
    for (more, expected) in mistakes {
        let output = run("rao_garnier.csv", &[&srivc[..], more].concat());
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(error.contains(expected), "{error}");
    }
}

/// Each case of a file: polynomials and standard errors. Root finders and searches end at 1e-9, differences at 1e-8.
fn compare(file: &str, count: usize) {
    let cases = cases(file);
    assert_eq!(cases.len(), count);
    for (i, case) in cases.iter().enumerate() {
        let method = text(case, "method");
        let what = format!("{file} {i} {method}");
        let given = case["arguments"].as_array().expect("arguments").iter();
        let given: Vec<&str> = given.filter_map(Value::as_str).collect();
        let found = estimate(text(case, "data"), &[&["--estimator", method][..], &given].concat());
        assert_eq!(found["status"], "ok", "{what}");
        for (key, expected) in case["expected"].as_object().expect("numbers") {
            if key == "se" {
                near(&what, &numbers(&found["se"]).expect("errors"), expected, 1e-6);
                continue;
            }
            let skip = usize::from(key != "B" || found["model"]["B"][0] == 0.0);
            let polynomial = numbers(&found["model"][key]).expect("a polynomial");
            near(&what, &polynomial[skip..], expected, 1e-7);
        }
    }
}

/// Known and unknown controller, two stages, joint, indirect, four steps with the reference.
#[test]
fn methods_of_a_closed_loop() {
    compare("loop.json", 6);
}

/// The ratio of the noises, or one, both or none of their variances.
#[test]
fn errors_in_variables() {
    compare("errors.json", 6);
}

/// The order by each rule, and the model of that order: scipy's minima are known to the root of its accuracy in the
/// sum.
#[test]
fn the_order_by_each_rule() {
    let cases = cases("choose.json");
    assert_eq!(cases.len(), 45);
    for case in &cases {
        let method = text(case, "method");
        let given = case["arguments"].as_array().expect("arguments").iter();
        let given: Vec<&str> = given.filter_map(Value::as_str).collect();
        let what = format!("{method} {given:?}");
        let data = format!("../data/{}", text(case, "data"));
        // The references take zero signals before the record.
        let start: &[&str] = match method {
            "oe" | "armax" | "bj" | "pem" | "cva" | "ssarx" | "parsim-k" => &["--initial", "zero"],
            _ => &[],
        };
        let found = estimate(&data, &[&["--estimator", method][..], &given, start].concat());
        let model = &found["model"];
        let with_a = !["oe", "bj", "moesp", "n4sid"].contains(&method);
        let denominator = &model[if with_a { "A" } else { "F" }];
        for (found, expected) in [(denominator, "denominator"), (&model["B"], "B")] {
            let found = numbers(found).expect("a polynomial").split_off(1);
            let expected = numbers(&case[expected]).expect("numbers");
            assert_eq!(found.len(), size(&case["order"]), "{what}");
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-6, "{what}: {found} {expected}");
            }
        }
        let loss = found["loss"].as_f64().expect("a loss");
        let ratio = loss / case["loss"].as_f64().expect("a loss");
        assert!((ratio - 1.0).abs() < 1e-10, "{what}: {ratio}");
    }
}

/// A record without a reference is refused in one line; a column of another name can be chosen.
#[test]
fn the_reference_is_asked_for() {
    for arguments in [
        &["--estimator", "clriv"][..],
        &["--estimator", "clrivc"],
        &["--estimator", "two-stage"],
        &["--estimator", "iv4", "--instruments", "r"],
    ] {
        let output = run("rao_garnier.csv", &[arguments, &["--order", "2"]].concat());
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(
            error.contains("needs the reference of the loop; expected --reference COLUMN"),
            "{error}"
        );
    }
    let output = run(
        "rao_garnier.csv",
        &[
            "--estimator",
            "two-stage",
            "--order",
            "2",
            "--reference",
            "u",
            "--input",
            "y",
            "--output",
            "y",
        ],
    );
    assert_eq!(output.status.code(), Some(2));
    let output = run(
        "loop.csv",
        &["--estimator", "clriv", "--order", "2", "--controller", "x"],
    );
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(error.contains("--controller: feedback 'x': expected a gain"), "{error}");
}
