//! The lowest minima of prediction errors on hard records (`optima/optima.json` says how they were found, without this
//! program).

use crate::common::PROGRAM;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recorded_data/optima")
}

fn optima() -> Value {
    let text = std::fs::read_to_string(folder().join("optima.json")).expect("optima.json");
    serde_json::from_str(&text).expect("JSON")
}

/// The JSON that `asobench estimate` prints for a case, and its text on standard error.
fn estimate(case: &Value, more: &[&str]) -> (Value, String) {
    let text = |key: &str| case[key].as_str().expect(key).to_owned();
    let orders = case["orders"].as_object().expect("orders").iter();
    let orders: Vec<String> = orders.map(|(key, n)| format!("{key}={n}")).collect();
    let mut command = Command::new(PROGRAM);
    command
        .arg("estimate")
        .arg(folder().join(text("file")))
        .args(["--estimator", &text("estimator"), "--format", "json"])
        .args(["--orders", &orders.join(","), "--initial", "zero"])
        .args(more);
    if let Some(window) = case["N"].as_u64() {
        command.args(["--window", &window.to_string()]);
    }
    let output = command.output().expect("asobench runs");
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{case}: {error}");
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    (report["estimates"][0].clone(), error)
}

/// At the lowest interior minimum known, or below; where the criterion falls towards the boundary, a model with a
/// status, and with standard errors only at a minimum.
#[test]
fn the_lowest_minimum_is_found() {
    let file = optima();
    let cases = file["cases"].as_array().expect("cases");
    assert!(cases.len() >= 30);
    let mut at_the_boundary = 0;
    for case in cases {
        let (found, error) = estimate(case, &[]);
        let loss = found["loss"].as_f64().expect("a loss");
        let status = found["status"].as_str().expect("a status");
        if case["inside"] == true {
            assert_eq!(status, "ok", "{case}");
            let best = case["best"].as_f64().expect("a loss");
            assert!(loss <= best * (1.0 + 1e-6), "{case}: {}", loss / best - 1.0);
        }
        assert_eq!(found["se"].is_null(), status != "ok", "{case}");
        if status == "boundary" {
            at_the_boundary += 1;
            assert!(error.contains("lies on the unit circle"), "{case}: {error}");
        }
    }
    assert!(at_the_boundary > 0);
}

/// More starts never lose an estimate, and never end at a higher loss.
#[test]
fn more_starts_lose_nothing() {
    for case in optima()["several_starts"].as_array().expect("cases") {
        let mut before = f64::INFINITY;
        for starts in ["0", "1", "5", "8", "12", "24", "60"] {
            let (found, _) = estimate(case, &["--starts", starts]);
            assert_eq!(found["status"], "ok", "{starts}: {case}");
            let loss = found["loss"].as_f64().expect("a loss");
            assert!(loss <= before * (1.0 + 1e-9), "{starts}: {case}");
            before = loss;
        }
    }
}
