//! Filters and GPEBO against `reference.py`.

use asobench::observer::{
    DiscreteGpebo, Kalman, MeasurementNoise, ObservedModel, ProcessNoise, StochasticModel, ThetaEstimator,
    maximum_likelihood_ratio,
};
use serde_json::Value;

fn cases(of: &str) -> (Vec<usize>, Vec<Value>) {
    let all: Value = serde_json::from_str(include_str!("reference.json")).unwrap();
    let at = numbers(&all["at"]).into_iter().map(|k| k as usize);
    (at.collect(), all[of].as_array().unwrap().clone())
}

fn numbers(of: &Value) -> Vec<f64> {
    let all = of.as_array().unwrap().iter();
    all.map(|x| x.as_f64().unwrap()).collect()
}

fn close(found: &[f64], exact: &[f64], tolerance: f64) {
    assert_eq!(found.len(), exact.len());
    let size = exact.iter().fold(1.0_f64, |most, x| most.max(x.abs()));
    for (found, exact) in found.iter().zip(exact) {
        let off = (found - exact).abs();
        assert!(off <= tolerance * size, "{found} {exact}");
    }
}

/// The parts of `kalman-coloured`: the likelihood and the states for a given rho, and the rho that is found.
#[test]
fn kalman_filters_of_coloured_noise() {
    let (at, cases) = cases("kalman");
    assert_eq!(cases.len(), 3);
    for case in cases {
        let [a, b, x0, c, d, u, y] = ["a", "b", "x0", "c", "d", "u", "y"].map(|key| numbers(&case[key]));
        let noise = MeasurementNoise {
            numerator: &c,
            denominator: &d,
            deviation: 1.0,
        };
        for filter in case["filters"].as_array().unwrap() {
            let q = ProcessNoise::States.covariance(&b, filter["rho"].as_f64().unwrap());
            let model = StochasticModel::new(&a, &b, q.as_ref(), noise).unwrap();
            let mut kalman = Kalman::steady(&model).unwrap();
            let cost = kalman.log_likelihood(&u, &y, &x0).unwrap().minus_two_log;
            close(&[cost], &[filter["minus_two_log"].as_f64().unwrap()], 1e-10);
            let mut states = vec![];
            kalman.run(&u, &y, &x0, |_, x| states.push(x.to_vec())).unwrap();
            for (k, exact) in at.iter().zip(filter["xhat"].as_array().unwrap()) {
                close(&states[*k], &numbers(exact), 1e-9);
            }
        }
        let model = ObservedModel { a: &a, b: &b, x0: &x0 };
        let found = maximum_likelihood_ratio(model, &u, &y, ProcessNoise::States, noise, None);
        let (found, best) = (found.unwrap(), &case["best"]);
        let [rho, cost] = ["rho", "minus_two_log"].map(|key| best[key].as_f64().unwrap());
        assert!((found.rho / rho).log10().abs() < 1e-5, "{} {rho}", found.rho);
        close(&[found.likelihood.minus_two_log], &[cost], 1e-10);
    }
}

#[test]
fn gpebo_in_discrete_time() {
    let (at, cases) = cases("gpebo");
    assert_eq!(cases.len(), 4);
    for case in cases {
        let [a, b, x0, u, y] = ["a", "b", "x0", "u", "y"].map(|key| numbers(&case[key]));
        let model = ObservedModel { a: &a, b: &b, x0: &x0 };
        let [gamma, rho] = ["gamma", "rho"].map(|key| case[key].as_f64().unwrap());
        for (by, exact) in [
            (ThetaEstimator::Drem(gamma), &case["drem"]),
            (ThetaEstimator::Squares(rho), &case["squares"]),
        ] {
            let mut states = vec![];
            DiscreteGpebo::new(by, a.len())
                .run(model, &u, &y, |_, x| states.push(x.to_vec()))
                .unwrap();
            for (k, exact) in at.iter().zip(exact.as_array().unwrap()) {
                close(&states[*k], &numbers(exact), 1e-9);
            }
        }
    }
}
