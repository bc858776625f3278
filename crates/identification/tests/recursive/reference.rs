//! Against formulas that were computed elsewhere.

use super::{distance, number, numbers, run, settings};
use asobench_identification::data::{Detrend, Trend, csv};
use asobench_identification::estimator::recursive::{
    ExtendedLeastSquares, RecursiveEstimator, RecursiveForm, RecursiveInstruments, RecursiveIv,
    RecursiveLeastSquares, RecursivePrediction, RecursiveSettings, RecursiveSriv,
};
use serde_json::Value;
use std::path::Path;

fn record(case: &Value) -> (Vec<f64>, Vec<f64>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/recorded_data/data");
    let path = folder.join(case["data"].as_str().expect("a file"));
    let mut record = csv::read(std::fs::File::open(path).expect("a record")).expect("samples");
    let n = case["N"].as_u64().expect("N") as usize;
    let detrend: Detrend = case["detrend"].as_str().unwrap().parse().unwrap();
    for values in [&mut record.u, &mut record.y] {
        values.truncate(n);
        Trend::fit(detrend, values).subtract(values);
    }
    (record.u, record.y)
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
            "riv" => vec![Box::new(RecursiveIv::new(
                settings,
                RecursiveInstruments::Delayed,
            ))],
            "rels" => vec![Box::new(ExtendedLeastSquares::new(settings))],
            other => panic!("{other}"),
        };
        let tolerance = if method == "riv" { 1e-7 } else { 1e-8 };
        let (u, y) = record(case);
        for mut recursion in recursions {
            let mut compared = 0;
            run(&mut *recursion, &u, &y, |k, theta| {
                let key = if k == y.len() {
                    "end".to_owned()
                } else {
                    k.to_string()
                };
                if let Some(exact) = case["theta"].get(&key) {
                    let off = distance(theta, &numbers(exact));
                    assert!(
                        off <= tolerance,
                        "{method} {} k = {key}: {off}",
                        case["data"]
                    );
                    compared += 1;
                }
            });
            assert_eq!(compared, 4);
        }
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
