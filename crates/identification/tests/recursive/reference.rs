//! Against formulas that were computed elsewhere.

use super::{distance, number, numbers, run, settings};
use asobench_identification::data::{Detrend, Trend, csv};
use asobench_identification::estimator::recursive::{
    ExtendedLeastSquares, RecursiveEstimator, RecursiveForm, RecursiveInstruments, RecursiveIv, RecursiveLeastSquares,
    RecursivePrediction, RecursiveSettings, RecursiveSriv,
};
use serde_json::Value;
use std::path::Path;

fn read(file: &str) -> (Vec<f64>, Vec<f64>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/recorded_data/data");
    let file = std::fs::File::open(folder.join(file)).expect("a record");
    let record = csv::read(file).expect("samples");
    (record.u, record.y)
}

fn record(case: &Value) -> (Vec<f64>, Vec<f64>) {
    let (mut u, mut y) = read(case["data"].as_str().expect("a file"));
    let n = case["N"].as_u64().expect("N") as usize;
    let detrend: Detrend = case["detrend"].as_str().unwrap().parse().unwrap();
    for values in [&mut u, &mut y] {
        values.truncate(n);
        Trend::fit(detrend, values).subtract(values);
    }
    (u, y)
}

/// Every case at the tolerance of the file, in every form that a method has.
#[test]
fn least_squares_instruments_and_extended_least_squares() {
    let file: Value = serde_json::from_str(include_str!("expected.json")).expect("JSON");
    let cases = file["cases"].as_array().expect("cases");
    assert_eq!(cases.len(), 6);
    for case in cases {
        let settings = RecursiveSettings {
            forgetting: number(&case["forgetting"]),
            early_forgetting: number(&case["forgetting"]),
            ..settings(case)
        };
        let method = case["method"].as_str().expect("a method");
        let recursions: Vec<Box<dyn RecursiveEstimator>> = match method {
            "rls" => [RecursiveForm::SquareRoot, RecursiveForm::Covariance]
                .map(|form| -> Box<dyn RecursiveEstimator> {
                    Box::new(RecursiveLeastSquares::new(settings.clone(), form))
                })
                .into(),
            "riv" => vec![Box::new(RecursiveIv::new(settings, RecursiveInstruments::Delayed))],
            "rels" => vec![Box::new(ExtendedLeastSquares::new(settings))],
            other => panic!("{other}"),
        };
        let tolerance = if method == "riv" { 1e-7 } else { 1e-8 };
        let (u, y) = record(case);
        for mut recursion in recursions {
            let mut compared = 0;
            run(&mut *recursion, &u, &y, |k, theta| {
                let key = if k == y.len() { "end".to_owned() } else { k.to_string() };
                if let Some(exact) = case["theta"].get(&key) {
                    let off = distance(theta, &numbers(exact));
                    assert!(off <= tolerance, "{method} {} k = {key}: {off}", case["data"]);
                    compared += 1;
                }
            });
            assert_eq!(compared, 4);
        }
    }
}

/// Records in other units, up to 1e6 and with u and y in units of their own: `scaled.py` has 60 digits. The information
/// about theta is lost to rounding by eps times its condition, that of the records in their own units, below 1e6 here,
/// as it does not depend on the units, not even where u and y have units of their own. With p0 = 1e18 and a start of
/// fewer equations than parameters Z'Phi lacks full rank for long, which leaves the same digits.
#[test]
fn records_in_other_units() {
    let file: Value = serde_json::from_str(include_str!("scaled.json")).expect("JSON");
    let cases = file["cases"].as_array().expect("cases");
    assert_eq!(cases.len(), 112);
    for case in cases {
        let settings = RecursiveSettings {
            forgetting: number(&case["forgetting"]),
            early_forgetting: number(&case["forgetting"]),
            ..settings(case)
        };
        let method = case["method"].as_str().expect("a method");
        let iv = |instruments| Box::new(RecursiveIv::new(settings.clone(), instruments));
        let mut recursion: Box<dyn RecursiveEstimator> = match method {
            "rls" => Box::new(RecursiveLeastSquares::new(settings, RecursiveForm::SquareRoot)),
            "delayed" => iv(RecursiveInstruments::Delayed),
            "auxiliary" => iv(RecursiveInstruments::Auxiliary),
            "rels" => Box::new(ExtendedLeastSquares::new(settings)),
            other => panic!("{other}"),
        };
        let (mut u, mut y) = read(case["data"].as_str().expect("a file"));
        let [of_u, of_y] = ["scale_u", "scale_y"].map(|key| number(&case[key]));
        for (u, y) in u.iter_mut().zip(&mut y) {
            *u *= of_u;
            *y *= of_y;
        }
        let tolerance = 1e-9;
        let mut compared = 0;
        run(&mut *recursion, &u[..400], &y[..400], |k, theta| {
            let Some(exact) = case["theta"].get(k.to_string()) else {
                return;
            };
            // Coefficients of B have other units than those of A.
            let exact = numbers(exact);
            for (found, exact) in [(&theta[..2], &exact[..2]), (&theta[2..4], &exact[2..4])] {
                let off = distance(found, exact);
                println!("{method} {of_u} {of_y} {} {k}: {off:.1e}", case["p0"]);
                assert!(off < tolerance, "{method} {of_u} {of_y} {} {k}: {off}", case["p0"]);
            }
            compared += 1;
        });
        assert_eq!(compared, 3);
    }
}

/// `reference.py` inverts the information anew at every k, which takes about eps times its condition, here below 1e4.
#[test]
fn refined_instruments_and_prediction_errors() {
    let file: Value = serde_json::from_str(include_str!("reference.json")).expect("JSON");
    let cases = file["recursions"].as_array().expect("cases");
    assert_eq!(cases.len(), 14);
    for case in cases {
        let [u, y, theta0] = ["u", "y", "theta0"].map(|key| numbers(&case[key]));
        let [forgetting, early_forgetting] = ["lambda", "early"].map(|key| number(&case[key]));
        let settings = RecursiveSettings {
            theta0,
            forgetting,
            early_forgetting,
            start: case["start"].as_u64().expect("a number") as usize,
            ..settings(case)
        };
        let method = case["method"].as_str().expect("a method");
        let mut recursion: Box<dyn RecursiveEstimator> = match method {
            "sriv" => Box::new(RecursiveSriv::new(settings)),
            "rpem" => Box::new(RecursivePrediction::new(settings)),
            other => panic!("{other}"),
        };
        run(&mut *recursion, &u, &y, |k, theta| {
            if let Some(exact) = case["theta"].get(k.to_string()) {
                let off = distance(theta, &numbers(exact));
                assert!(off < 1e-10, "{method} {} k = {k}: {off}", case["orders"]);
            }
        });
    }
}
