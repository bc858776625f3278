//! Recorded data against other programs' least squares (`data/README.md`): `asobench estimate`, as a user runs it, and
//! the solvers of `ls`.

mod bank;
mod hints;
mod methods;
mod newcomers;
mod optima;
mod situations;

use crate::common::PROGRAM;
use asobench::data::{Detrend, Trend, csv};
use asobench::estimator::{Estimator, LeastSquares, Pass, Shape, Solver, Window};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recorded_data/data")
}

fn read(name: &str) -> Value {
    let text = std::fs::read_to_string(folder().join(name)).expect(name);
    serde_json::from_str(&text).expect("JSON")
}

/// The cases of least squares, or of other methods.
fn cases(least_squares: bool) -> Vec<Value> {
    let file = read("expected.json");
    let cases = file["cases"].as_array().expect("cases").iter();
    let asked = cases.filter(|case| (case["method"] == "ls") == least_squares);
    asked.cloned().collect()
}

fn size(value: &Value) -> usize {
    value.as_u64().expect("a size") as usize
}

fn numbers(value: &Value) -> Option<Vec<f64>> {
    let values = value.as_array()?.iter();
    values.map(Value::as_f64).collect()
}

/// The largest difference.
fn distance(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let differences = found.iter().zip(expected).map(|(f, e)| (f - e).abs());
    differences.fold(0.0, f64::max)
}

/// The entry of the estimates that `asobench estimate` prints for a case.
fn arx(case: &Value) -> Value {
    let rows = match case["regression"].as_str().expect("the rows") {
        text if text.starts_with("prewindow") => "prewindow",
        text if text.starts_with("zero_padded_both_sides") => "padded",
        text => {
            assert_eq!(text, "t>=max(na,nb+nk-1)");
            "complete"
        }
    };
    assert_eq!(size(&case["rows"][0]), 0);
    let [na, nb, nk] = ["na", "nb", "nk"].map(|key| size(&case[key]));
    let output = Command::new(PROGRAM)
        .arg("estimate")
        .arg(folder().join(case["data"].as_str().expect("a file")))
        .args(["--estimator", "arx", "--rows", rows])
        .args(["--orders", &format!("na={na},nb={nb},nk={nk}")])
        .args(["--window", &size(&case["rows"][1]).to_string()])
        .args(["--detrend", case["detrend"].as_str().expect("a name")])
        .args(["--format", "json"])
        .output()
        .expect("asobench runs");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {error}", case["name"]);
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    report["estimates"][0].clone()
}

/// Every least-squares case of other programs, any orders and rows: parameters, loss, covariance, each within the
/// tolerance that the case states (its digits).
#[test]
fn arx_of_other_programs() {
    let mut compared = 0;
    for case in &cases(true) {
        let (name, found) = (&case["name"], arx(case));
        assert_eq!(found["status"], "ok", "{name}");
        let model = &found["model"];
        let polynomial = |key: &str| numbers(&model[key]).expect("a polynomial");
        let (a, b) = (polynomial("A"), polynomial("B"));
        let delay = size(&case["nk"]);
        assert!(a[0] == 1.0 && b[..delay].iter().all(|zero| *zero == 0.0));
        for key in ["C", "D", "F"] {
            assert_eq!(polynomial(key), [1.0], "{name}");
        }
        let theta = [&a[1..], &b[delay..]].concat();
        let expected = &case["expected"];
        let absolute = case["tol"].as_f64();
        if let Some(expected) = numbers(&expected["theta"]) {
            let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let relative = case["tol_rel"].as_f64().map(|tolerance| tolerance * largest);
            let tolerance = absolute.or(relative).expect("a tolerance");
            let worst = distance(&theta, &expected);
            println!("{name}: {worst:.1e} of {tolerance:.1e}");
            assert!(worst <= tolerance, "{name}: {worst:e}");
            compared += 1;
        }
        let samples = size(&case["rows"][1]) as f64;
        let loss = found["loss"].as_f64().expect("a loss");
        if let Some(expected) = expected["loss_rss_over_N"].as_f64() {
            assert!(
                (loss - expected).abs() <= absolute.expect("a tolerance"),
                "{name}: {loss}"
            );
            compared += 1;
        }
        for key in ["rss", "rss_onestep"] {
            if let (Some(expected), Some(tolerance)) = (expected[key].as_f64(), case["tol_rss_rel"].as_f64()) {
                let error = (loss * samples / expected - 1.0).abs();
                assert!(error <= tolerance, "{name} {key}: {error:e}");
                compared += 1;
            }
        }
        if let Some(covariance) = expected["cov"].as_array() {
            let diagonal = covariance.iter().enumerate().map(|(i, row)| row[i].as_f64());
            let expected: Vec<f64> = diagonal.map(|v| v.expect("a number").sqrt()).collect();
            let errors = numbers(&found["se"]).expect("standard errors");
            let worst = distance(&errors, &expected);
            assert!(
                worst <= case["tol_cov"].as_f64().expect("a tolerance"),
                "{name}: {worst:e}"
            );
            compared += 1;
        }
    }
    assert!(compared >= 27, "{compared}");
}

/// theta = (alpha, beta) of least squares on the case's rows, with its delay taken out.
fn theta(case: &Value, solver: Solver) -> Vec<f64> {
    let file = folder().join(case["data"].as_str().expect("a file"));
    let mut record = csv::read(std::fs::File::open(file).expect("a record")).expect("a valid record");
    let detrend = case["detrend"].as_str().expect("a name");
    let detrend: Detrend = detrend.parse().expect("a detrend");
    for values in [&mut record.u, &mut record.y] {
        values.truncate(size(&case["rows"][1]));
        Trend::fit(detrend, values).subtract(values);
    }
    let delay = size(&case["nk"]) - 1;
    record.y.drain(..delay);
    record.u.truncate(record.y.len());
    let shape = Shape {
        order: size(&case["na"]),
        window: record.y.len(),
    };
    let mut passes = [Pass::new(shape.order)];
    let window = Window::new(&record.u, &record.y, shape.window);
    LeastSquares::new(shape, solver)
        .expect("a valid shape")
        .estimate(window, &mut passes);
    let [pass] = passes;
    assert_eq!(pass.failure, None, "{}", case["name"]);
    let orders = pass.model.orders();
    assert_eq!((orders.na, orders.nb, orders.nk), (shape.order, shape.order, 1));
    pass.model.parameters().collect()
}

/// Octave's cases with na = nb (three of them with a delay) by the solvers of `ls`, within 1e-7 of the largest
/// coefficient; the expected values have 12 digits.
#[test]
fn octave_arx_by_the_solvers_of_ls() {
    let cases = cases(true);
    let octave = |case: &&Value| case["name"].as_str().is_some_and(|n| n.starts_with("octave"));
    let cases: Vec<&Value> = cases.iter().filter(octave).collect();
    assert!(cases.len() >= 15);
    for case in cases {
        assert_eq!(case["na"], case["nb"]);
        let expected = numbers(&case["expected"]["theta"]).expect("theta");
        for solver in [Solver::Qr, Solver::Svd] {
            let worst = distance(&theta(case, solver), &expected);
            println!("{} {solver}: {worst:.1e}", case["name"]);
            assert!(worst < 1e-7, "{} {solver}: {worst:e}", case["name"]);
        }
    }
}
