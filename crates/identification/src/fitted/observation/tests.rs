//! Observers of models against `reference.py`.

use super::*;
use crate::adaptive::KreisselmeierOptions;
use crate::estimator::ArxOptions;
use crate::fit;
use crate::model::LinearModel;
use serde_json::Value;

fn numbers(of: &Value) -> Vec<f64> {
    match of {
        Value::Array(all) => all.iter().flat_map(numbers).collect(),
        one => vec![one.as_f64().unwrap()],
    }
}

fn square(of: &Value) -> Mat<f64> {
    let all = numbers(of);
    let n = of.as_array().unwrap().len();
    Mat::from_fn(n, n, |i, j| all[i * n + j])
}

/// The largest difference, relative to the largest number.
fn off(found: &[f64], exact: &[f64]) -> f64 {
    assert_eq!(found.len(), exact.len());
    let size = exact.iter().fold(1.0_f64, |most, x| most.max(x.abs()));
    let pairs = found.iter().zip(exact);
    pairs.fold(0.0, |most, (found, exact)| (found - exact).abs().max(most)) / size
}

fn fitted(of: &Value, x0: &[f64]) -> Fitted {
    let [a, b, c, d, f] = ["A", "B", "C", "D", "F"].map(|name| numbers(&of[name]));
    let model = LinearModel {
        delay: b.iter().take_while(|b| **b == 0.0).count(),
        a,
        b,
        c,
        d,
        f,
        noise_variance: 1.0,
        covariance: Vec::new(),
    };
    let mut pass = Pass::new(model.orders().order());
    pass.set_model(&model, f64::NAN).unwrap();
    pass.set_initial_state(x0);
    Fitted::new(pass, 0)
}

/// Gain, poles, covariances, states, their deviations and predictions of every kind of observer.
#[test]
fn observers_of_models() {
    let all: Value = serde_json::from_str(include_str!("reference.json")).unwrap();
    let at: Vec<usize> = numbers(&all["at"]).iter().map(|k| *k as usize).collect();
    let cases = all["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 13);
    for case in cases {
        let [x0, u, y] = ["x0", "u", "y"].map(|key| numbers(&case[key]));
        let (model, kind) = (fitted(&case["model"], &x0), case["kind"].as_str().unwrap());
        let noise = NoiseCovariances {
            process: square(&case["Q"]),
            measurement: case["r"].as_f64().unwrap(),
            start: Some(square(&case["P0"])),
        };
        let observer = model.observer(&kind.parse().unwrap(), Some(&noise), &u, &y);
        let observer = observer.unwrap();
        let poles: Vec<f64> = observer.poles.iter().flat_map(|p| [p.re, p.im]).collect();
        let p = observer.covariance.as_ref().unwrap();
        let n = p.nrows();
        let p: Vec<f64> = (0..n).flat_map(|i| (0..n).map(move |j| p[(i, j)])).collect();
        let observed = observer.run(&u, &y).unwrap();
        assert_eq!(observed.states.len(), n * (u.len() + 1));
        let rows = |of: &[f64]| -> Vec<f64> {
            let rows = at.iter().map(|k| &of[k * n..(k + 1) * n]);
            rows.flatten().copied().collect()
        };
        let predictions = at[..at.len() - 1].iter().map(|k| observed.predictions[*k]);
        for (what, found) in [
            ("gain", observer.gain.clone()),
            ("poles", poles),
            ("covariance", p),
            ("innovation", vec![observer.innovation]),
            ("states", rows(&observed.states)),
            ("deviations", rows(&observed.deviations)),
            ("predictions", predictions.collect()),
        ] {
            let off = off(&found, &numbers(&case[what]));
            assert!(off < 1e-10, "{kind}, {}: {what} {off:e}", case["model"]);
        }
        for ((e, y), of) in observed.innovations.iter().zip(&y).zip(&observed.predictions) {
            assert!((y - of - e).abs() < 1e-12);
        }
    }
}

/// Covariances and poles must be there where an observer needs them, and fit the order.
#[test]
fn refusals() {
    let model = serde_json::json!({ "A": [1.0, -0.5], "B": [0.0, 1.0], "C": [1.0], "D": [1.0], "F": [1.0] });
    let model = fitted(&model, &[0.0]);
    let (u, y) = ([1.0, -1.0], [0.0, 1.0]);
    let refused = |kind: &str, noise: Option<&NoiseCovariances>| {
        let kind: ObserverKind = kind.parse().unwrap();
        model.observer(&kind, noise, &u, &y).unwrap_err()
    };
    let varying = refused("kalman-varying", None);
    assert_eq!(varying, ObservationError::NoCovariances);
    assert!(matches!(refused("poles:0.1,0.2", None), ObservationError::Gain(_)));
    let mut noise = NoiseCovariances {
        process: Mat::from_fn(1, 1, |_, _| 1.0),
        measurement: -1.0,
        start: None,
    };
    assert!(matches!(refused("kalman", Some(&noise)), ObservationError::Riccati(_)));
    assert!(matches!(
        refused("dead-beat", Some(&noise)),
        ObservationError::Riccati(_)
    ));
    noise.measurement = 1.0;
    noise.process = Mat::from_fn(2, 2, |_, _| 1.0);
    assert!(matches!(
        refused("dead-beat", Some(&noise)),
        ObservationError::Riccati(_)
    ));
    // A record without noise has no finite likelihood.
    let mut exact = fitted(
        &serde_json::json!({ "A": [1.0, -0.5], "B": [0.0, 1.0], "C": [1.0], "D": [1.0], "F": [1.0] }),
        &[0.0],
    );
    let kind = ObserverKind::Kalman;
    assert!(matches!(
        exact.observer(&kind, None, &[0.0; 20], &[0.0; 20]),
        Err(ObservationError::Noise(_))
    ));
    exact.pass.progress = Progress::Parameters;
    let none = exact.observer(&kind, None, &u, &y).unwrap_err();
    assert_eq!(none, ObservationError::NoStart);
}

/// Without a delay of its own a model sees y later; and dead-beat innovations of an ARX model are its equation errors.
#[test]
fn innovations_of_a_dead_beat_observer_are_equation_errors() {
    let u: Vec<f64> = (0..200).map(|k| f64::from(k * k % 7) - 3.0).collect();
    let mut y = vec![0.0; 200];
    for k in 2..200 {
        let noise = f64::from(k as u32 * 7919 % 101) / 50.0 - 1.0;
        y[k] = 1.2 * y[k - 1] - 0.5 * y[k - 2] + u[k - 1] + 0.3 * u[k - 2] + 0.1 * noise;
    }
    let orders = Some("na=2,nb=2,nk=1".parse().unwrap());
    let options = ArxOptions {
        orders,
        ..ArxOptions::default()
    };
    let model = fit(options, 2, &u, &y).unwrap();
    let kind = "dead-beat".parse().unwrap();
    let observer = model.observer(&kind, None, &u, &y).unwrap();
    let observed = observer.run(&u, &y).unwrap();
    let (a, b) = (&model.linear().a, &model.linear().b);
    for k in 2..200 {
        let of = y[k] + a[1] * y[k - 1] + a[2] * y[k - 2] - b[1] * u[k - 1] - b[2] * u[k - 2];
        assert!((observed.innovations[k] - of).abs() < 1e-12, "{k}");
    }
    assert!(observed.deviations.is_empty() && observer.covariance.is_none());
    let late = Fitted {
        shift: 1,
        ..model.clone()
    };
    let advanced: Vec<f64> = [7.0].into_iter().chain(y.iter().copied()).collect();
    let later: Vec<f64> = u.iter().copied().chain([9.0]).collect();
    let observer = late.observer(&kind, None, &later, &advanced).unwrap();
    let late = observer.run(&later, &advanced).unwrap();
    assert_eq!(late.states, observed.states);
}

/// An adaptive observer starts from nothing, and in the end knows the plant of a record without noise.
#[test]
fn adaptive_states() {
    let word = |k: u32| k.wrapping_mul(2_654_435_761) >> 13;
    let u: Vec<f64> = (0..1000).map(|k| f64::from(word(k) % 7) - 3.0).collect();
    let mut y = vec![0.0; 1000];
    for k in 2..1000 {
        y[k] = 1.2 * y[k - 1] - 0.5 * y[k - 2] + u[k - 1] + 0.3 * u[k - 2];
    }
    let observed = observe_adaptively(KreisselmeierOptions::default(), 2, &u, &y).unwrap();
    assert_eq!(observed.states.len(), 2002);
    assert_eq!(observed.states[..2], [0.0; 2]);
    let late = observed.innovations[800..]
        .iter()
        .fold(0.0_f64, |most, e| most.max(e.abs()));
    assert!(late < 1e-6, "{late}");
    // A method without states of its own.
    let arx = observe_adaptively(ArxOptions::default(), 2, &u, &y).unwrap_err();
    assert_eq!(arx, ObservationError::Failed(FailureKind::NonFinite));
}
