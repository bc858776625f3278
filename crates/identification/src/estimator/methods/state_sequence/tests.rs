//! State sequences against definitions, without noise, on long records, and where they fail.

use super::*;
use crate::data::{Detrend, Trend, csv};
use crate::estimator::test_setup::{self, estimate, plant};
use crate::estimator::{ArmaxOptions, ParsimKOptions, Progress, Shape};
use crate::signal::Purpose;
use serde_json::Value;

/// The options of either method.
fn options(future: Future, n: usize, nk: usize, rows: Option<usize>) -> Box<dyn MethodKind> {
    let orders = Some(Orders::arx(n, n, nk));
    match future {
        Future::Projected => Box::new(CvaOptions {
            orders,
            block_rows: rows,
            ..CvaOptions::default()
        }),
        Future::Predicted => Box::new(SsarxOptions {
            orders,
            block_rows: rows,
            ..SsarxOptions::default()
        }),
    }
}

fn parsim(n: usize, nk: usize, block_rows: Option<usize>) -> Box<dyn MethodKind> {
    Box::new(ParsimKOptions {
        orders: Some(Orders::arx(n, n, nk)),
        block_rows,
        ..ParsimKOptions::default()
    })
}

fn normal(trial: u64, purpose: Purpose, n: usize) -> Vec<f64> {
    test_setup::normal(89, trial, purpose, n)
}

/// `A y = B u + C e`, e of this standard deviation.
fn record(truth: &LinearModel, sd: f64, trial: u64, n: usize) -> (Vec<f64>, Vec<f64>) {
    let (u, e) = (normal(trial, Purpose::Input, n), normal(trial, Purpose::NoiseDrive, n));
    let (mut y, mut v) = (vec![0.0; n], vec![0.0; n]);
    truth.simulate(&u, &mut y);
    crate::model::polynomial::filter(&truth.c, &e, &mut v);
    crate::model::polynomial::divide(&truth.a, &mut v);
    y.iter_mut().zip(&v).for_each(|(y, v)| *y += sd * v);
    (u, y)
}

/// `reference.py` says how its numbers were made. Its square roots of covariances square their condition, some 1e5.
#[test]
fn models_of_another_program() {
    let cases: Value = serde_json::from_str(include_str!("reference.json")).unwrap();
    let cases = cases.as_array().unwrap();
    assert_eq!(cases.len(), 9);
    for case in cases {
        let size = |key: &str| case[key].as_u64().unwrap() as usize;
        let numbers = |key: &str| -> Vec<f64> {
            case[key]
                .as_array()
                .unwrap()
                .iter()
                .map(|x| x.as_f64().unwrap())
                .collect()
        };
        let file = case["file"].as_str().unwrap();
        let path = format!("../../tests/recorded_data/data/{file}");
        let record = csv::read(std::fs::File::open(path).unwrap()).unwrap();
        let less_mean = |signal: &[f64]| {
            let mut signal = signal[..size("N")].to_vec();
            Trend::fit(Detrend::Mean, &signal).subtract(&mut signal);
            signal
        };
        let (u, y) = (less_mean(&record.u), less_mean(&record.y));
        let method = case["method"].as_str().unwrap();
        let rows = Some(size("block_rows"));
        let options: Box<dyn MethodKind> = match method {
            "cva" => options(Future::Projected, size("n"), size("nk"), rows),
            "ssarx" => options(Future::Predicted, size("n"), size("nk"), rows),
            _ => parsim(size("n"), size("nk"), rows),
        };
        let pass = estimate(options.as_ref(), size("n"), &u, &y);
        assert_eq!(pass.failure, None, "{file}");
        let model = &pass.model;
        let values = match method {
            "parsim-k" => (&pass.singular_values, numbers("singular_values")),
            _ => (&pass.correlations, numbers("correlations")),
        };
        for (what, found, expected) in [
            ("values", &values.0[..], values.1),
            ("A", &model.a, numbers("A")),
            ("B", &model.b[model.delay..], numbers("B")),
            ("C", &model.c, numbers("C")),
        ] {
            assert_eq!(found.len(), expected.len());
            let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (found, expected) in found.iter().zip(&expected) {
                let error = (found - expected).abs() / largest;
                assert!(error < 1e-7, "{file} {method} {what}: {found} {expected}");
            }
        }
    }
}

/// Orders 1 to 4, with and without a direct term. A record without noise does not tell C.
#[test]
fn a_record_without_noise_gives_its_plant() {
    for (order, nk) in [(1, 1), (2, 0), (2, 1), (3, 1), (4, 0), (4, 1)] {
        let mut a = vec![1.0];
        for pole in &[0.8, -0.4, 0.3, -0.2][..order] {
            a = crate::model::polynomial::multiply(&a, &[1.0, -pole]);
        }
        let b = (0..order + 1 - nk).map(|i| 1.0 / (1.0 + i as f64));
        let theta: Vec<f64> = a[1..].iter().copied().chain(b).collect();
        let truth = plant(&format!("na={order},nb={},nk={nk}", order + 1 - nk), &theta);
        let (u, y) = record(&truth, 0.0, order as u64, 400);
        let methods = [
            options(Future::Projected, order, nk, None),
            options(Future::Predicted, order, nk, None),
            parsim(order, nk, None),
        ];
        for (method, options) in methods.iter().enumerate() {
            let pass = estimate(options.as_ref(), order, &u, &y);
            assert_eq!((pass.failure, pass.progress), (None, Progress::InitialState));
            let found = pass.model.a[1..].iter().chain(&pass.model.b[nk..]);
            for (found, truth) in found.zip(&theta) {
                assert!((found - truth).abs() < 1e-7, "{order} {nk} {method}: {found} {truth}");
            }
        }
    }
}

/// Canonical variates are asymptotically efficient for a white input (Bauer 2005), as `armax` is: at 20,000 samples
/// within four of its standard errors, each of A, B and C.
#[test]
fn the_bound_at_twenty_thousand_samples() {
    let truth = plant("na=2,nb=2,nc=2", &[-1.5, 0.7, 1.0, 0.5, 0.6, 0.2]);
    let (u, y) = record(&truth, 0.5, 3, 20_000);
    let armax = estimate(&ArmaxOptions::default(), 2, &u, &y);
    let errors = armax.model.standard_errors().unwrap();
    for future in [Future::Projected, Future::Predicted] {
        let pass = estimate(options(future, 2, 1, None).as_ref(), 2, &u, &y);
        assert_eq!(pass.failure, None);
        let both = pass.model.parameters().zip(truth.parameters());
        for ((found, truth), error) in both.zip(&errors) {
            let distance = (found - truth).abs() / error;
            assert!(distance < 4.0, "{future:?}: {found} {truth}, {distance}");
        }
    }
}

/// The order by canonical correlations: by BIC it is the true one in long records, and never below it by AIC.
#[test]
fn the_order_by_canonical_correlations() {
    let truth = plant("na=2,nb=2,nc=2", &[-1.5, 0.7, 1.0, 0.5, 0.6, 0.2]);
    let (mut by_bic, mut by_aic) = (0, 0);
    for trial in 0..20 {
        let (u, y) = record(&truth, 0.5, 50 + trial, 4000);
        let chosen = |criterion: Criterion| {
            let options = CvaOptions {
                orders: Some(Orders::arx(6, 6, 1)),
                correlations: Some(criterion),
                ..CvaOptions::default()
            };
            let pass = estimate(&options, 6, &u, &y);
            assert_eq!(pass.failure, None);
            assert_eq!(pass.a.len(), pass.model.a.len() - 1);
            pass.model.a.len() - 1
        };
        by_bic += usize::from(chosen(Criterion::Bic) == 2);
        by_aic += usize::from(chosen(Criterion::Aic) >= 2);
    }
    assert!(by_bic >= 19 && by_aic == 20, "{by_bic} {by_aic}");
}

#[test]
fn what_cannot_be_estimated_is_typed() {
    let (u, zero) = (normal(5, Purpose::Input, 60), vec![0.0; 60]);
    for future in [Future::Projected, Future::Predicted] {
        let options = options(future, 1, 1, Some(3));
        let kind = |y: &[f64]| estimate(options.as_ref(), 1, &u, y).failure.unwrap().kind;
        let expected = match future {
            Future::Projected => FailureKind::Singular,
            Future::Predicted => FailureKind::RankDeficient,
        };
        assert_eq!(kind(&zero), expected);
        let mut huge = u.clone();
        (huge[3], huge[4]) = (f64::MAX, f64::MAX);
        assert_eq!(kind(&huge), FailureKind::NonFinite);
    }
    // The past of an impulse tells states, but after it there is no input.
    let (mut impulse, mut response) = (vec![0.0; 60], vec![0.0; 60]);
    impulse[0] = 1.0;
    plant("na=1,nb=1", &[-0.5, 1.0]).simulate(&impulse, &mut response);
    let silent = estimate(options(Future::Predicted, 1, 1, None).as_ref(), 1, &impulse, &response);
    assert_eq!(silent.failure.unwrap().kind, FailureKind::RankDeficient);
    let of = |y: &[f64]| estimate(parsim(1, 1, Some(3)).as_ref(), 1, &u, y).failure.unwrap().kind;
    assert_eq!(of(&zero), FailureKind::RankDeficient);
    let mut huge = u.clone();
    (huge[3], huge[4]) = (f64::MAX, f64::MAX);
    assert_eq!(of(&huge), FailureKind::NonFinite);
    // An output of order one has no second state.
    let truth = plant("na=1,nb=1", &[-0.5, 1.0]);
    let (u, y) = record(&truth, 0.0, 9, 200);
    let pass = estimate(options(Future::Projected, 2, 1, None).as_ref(), 2, &u, &y);
    assert_eq!(pass.failure.unwrap().kind, FailureKind::RankDeficient);
    let short = CvaOptions::default().prepare(&Shape { order: 4, window: 20 }.into());
    let error = short.err().unwrap().to_string();
    assert!(error.contains("with 5 block rows is too short for order 4"), "{error}");
}

/// An unstable model of a growing record is reflected if that is wanted, and its B is fitted to it.
#[test]
fn models_are_stable_by_an_option() {
    let truth = plant("na=1,nb=1,nc=1", &[-1.02, 1.0, 0.3]);
    let (u, y) = record(&truth, 0.1, 4, 150);
    let unstable = estimate(options(Future::Projected, 1, 1, None).as_ref(), 1, &u, &y);
    assert!(unstable.unstable && (unstable.model.a[1] + 1.02).abs() < 0.01);
    let options = CvaOptions {
        orders: Some(Orders::arx(1, 1, 1)),
        stabilise: Stabilise::Reflect,
        ..CvaOptions::default()
    };
    let stable = estimate(&options, 1, &u, &y);
    assert!(!stable.unstable && (stable.model.a[1] * unstable.model.a[1] - 1.0).abs() < 1e-9);
    assert!(stable.loss > unstable.loss);
}

/// In feedback `u = r - 0.4 y` the noise reaches the input. Methods of the predictor form are consistent: at 20,000
/// samples within six standard errors of `armax`, which is efficient.
#[test]
fn predictor_forms_serve_in_feedback() {
    let truth = plant("na=2,nb=2,nc=2", &[-1.5, 0.7, 1.0, 0.5, 0.6, 0.2]);
    let n = 20_000;
    let (r, e) = (normal(8, Purpose::Input, n), normal(8, Purpose::NoiseDrive, n));
    let (mut u, mut y) = (vec![0.0; n], vec![0.0; n]);
    for k in 0..n {
        let at = |x: &[f64], lag: usize| k.checked_sub(lag).map_or(0.0, |k| x[k]);
        y[k] = 1.5 * at(&y, 1) - 0.7 * at(&y, 2)
            + at(&u, 1)
            + 0.5 * at(&u, 2)
            + 0.5 * (e[k] + 0.6 * at(&e, 1) + 0.2 * at(&e, 2));
        u[k] = r[k] - 0.4 * y[k];
    }
    let armax = estimate(&ArmaxOptions::default(), 2, &u, &y);
    let errors = armax.model.standard_errors().unwrap();
    for options in [options(Future::Predicted, 2, 1, None), parsim(2, 1, None)] {
        let pass = estimate(options.as_ref(), 2, &u, &y);
        assert_eq!(pass.failure, None);
        let both = pass.model.parameters().zip(truth.parameters());
        // A and B.
        for ((found, truth), error) in both.zip(&errors).take(4) {
            let distance = (found - truth).abs() / error;
            assert!(distance < 6.0, "{found} {truth}, {distance}");
        }
    }
}
