//! Recursive estimators and adaptive observers against values that were made without this program (`expected.json` has
//! its conventions, `reference.py` makes `reference.json`), and against theory.

mod observers;
mod reference;
mod theory;

use asobench_identification::estimator::recursive::{RecursiveEstimator, RecursiveSettings};
use serde_json::Value;

fn numbers(of: &Value) -> Vec<f64> {
    let all = of.as_array().expect("a list").iter();
    all.map(|x| x.as_f64().expect("a number")).collect()
}

fn number(of: &Value) -> f64 {
    of.as_f64().expect("a number")
}

fn norm(of: &[f64]) -> f64 {
    of.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The norm of the difference over that of the exact one.
fn distance(found: &[f64], exact: &[f64]) -> f64 {
    assert_eq!(found.len(), exact.len());
    let difference: Vec<f64> = found.iter().zip(exact).map(|(f, e)| f - e).collect();
    norm(&difference) / norm(exact)
}

/// The settings of a case in a file.
fn settings(case: &Value) -> RecursiveSettings {
    let table = case["orders"].as_object().expect("orders").iter();
    let text: Vec<String> = table.map(|(name, n)| format!("{name}={n}")).collect();
    let orders = text.join(",").parse().expect("orders");
    RecursiveSettings {
        p0: case["p0"].as_f64(),
        start: case["start"].as_u64().unwrap_or(0) as usize,
        ..RecursiveSettings::new(orders)
    }
}

/// Takes all samples, and says theta after each.
fn run(recursion: &mut dyn RecursiveEstimator, u: &[f64], y: &[f64], mut visit: impl FnMut(usize, &[f64])) {
    for (k, (u, y)) in u.iter().zip(y).enumerate() {
        recursion.update(*u, *y).expect("no divergence");
        visit(k + 1, recursion.theta());
    }
}
