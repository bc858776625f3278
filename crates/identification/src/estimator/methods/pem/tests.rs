//! The innovations form against scipy, without noise, at the bound, and where it fails.

use super::*;
use crate::data::{Detrend, Trend, csv};
use crate::estimator::test_setup::{self, estimate, plant};
use crate::estimator::{ArmaxOptions, FailureKind, Shape};
use crate::model::LinearModel;
use crate::model::polynomial::{divide, filter};
use crate::signal::Purpose;
use serde_json::Value;

fn options(n: usize, nk: usize, start: SubspaceStart) -> PemOptions {
    PemOptions {
        orders: Some(Orders::arx(n, n, nk)),
        initial_model: start,
        ..PemOptions::default()
    }
}

fn normal(trial: u64, purpose: Purpose, n: usize) -> Vec<f64> {
    test_setup::normal(97, trial, purpose, n)
}

/// `A y = B u + C e`, e of this standard deviation.
fn record(truth: &LinearModel, sd: f64, trial: u64, n: usize) -> (Vec<f64>, Vec<f64>) {
    let (u, e) = (normal(trial, Purpose::Input, n), normal(trial, Purpose::NoiseDrive, n));
    let (mut y, mut v) = (vec![0.0; n], vec![0.0; n]);
    truth.simulate(&u, &mut y);
    filter(&truth.c, &e, &mut v);
    divide(&truth.a, &mut v);
    y.iter_mut().zip(&v).for_each(|(y, v)| *y += sd * v);
    (u, y)
}

fn second_order() -> LinearModel {
    plant("na=2,nb=2,nc=2", &[-1.5, 0.7, 1.0, 0.5, 0.6, 0.2])
}

const STARTS: [SubspaceStart; 3] = [SubspaceStart::Cva, SubspaceStart::Ssarx, SubspaceStart::ParsimK];

/// `reference.py` minimises the same sum in state space; from each subspace model the search ends there.
#[test]
fn models_of_another_program() {
    let cases: Value = serde_json::from_str(include_str!("reference.json")).unwrap();
    let cases = cases.as_array().unwrap();
    assert_eq!(cases.len(), 3);
    for case in cases {
        let size = |key: &str| case[key].as_u64().unwrap() as usize;
        let numbers = |key: &str| -> Vec<f64> {
            let list = case[key].as_array().unwrap().iter();
            list.map(|x| x.as_f64().unwrap()).collect()
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
        for start in STARTS {
            let pass = estimate(&options(size("n"), size("nk"), start), size("n"), &u, &y);
            assert_eq!(pass.failure, None, "{file} {start}");
            let loss = case["loss"].as_f64().unwrap();
            assert!((pass.loss / loss - 1.0).abs() < 1e-10, "{file} {start}");
            let model = &pass.model;
            for (found, expected) in [
                (&model.a[..], numbers("A")),
                (&model.b[model.delay..], numbers("B")),
                (&model.c, numbers("C")),
                (&model.standard_errors().unwrap(), numbers("se")),
            ] {
                assert_eq!(found.len(), expected.len());
                let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                for (found, expected) in found.iter().zip(&expected) {
                    let error = (found - expected).abs() / largest;
                    assert!(error < 1e-7, "{file} {start}: {found} {expected}");
                }
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
        for start in STARTS {
            let pass = estimate(&options(order, nk, start), order, &u, &y);
            let found = pass.model.a[1..].iter().chain(&pass.model.b[nk..]);
            for (found, truth) in found.zip(&theta) {
                let error = (found - truth).abs();
                assert!(error < 1e-7, "{order} {nk} {start}: {found} {truth}");
            }
        }
    }
}

/// At 20,000 samples within four standard errors of the truth, and where `armax` ends, which searches from many starts.
#[test]
fn the_bound_at_twenty_thousand_samples() {
    let truth = second_order();
    let (u, y) = record(&truth, 0.5, 3, 20_000);
    let armax = estimate(&ArmaxOptions::default(), 2, &u, &y);
    for start in STARTS {
        let pass = estimate(&options(2, 1, start), 2, &u, &y);
        assert_eq!((pass.failure, pass.minima), (None, Some(1)));
        let errors = pass.model.standard_errors().unwrap();
        let both = pass.model.parameters().zip(armax.model.parameters());
        for (((found, armax), truth), error) in both.zip(truth.parameters()).zip(errors) {
            assert!((found - truth).abs() < 4.0 * error, "{found} {truth}");
            assert!((found - armax).abs() < 1e-6 * error, "{found} {armax}");
        }
    }
}

/// Standard errors are those that 100 records show: the squares of the errors over them have a mean of 1 within four of
/// its standard errors.
#[test]
fn standard_errors_are_those_of_many_records() {
    let (truth, trials) = (second_order(), 100);
    let mut squares = [0.0; 6];
    for trial in 0..trials {
        let (u, y) = record(&truth, 0.5, 100 + trial, 1000);
        let pass = estimate(&PemOptions::default(), 2, &u, &y);
        let errors = pass.model.standard_errors().unwrap();
        let both = pass.model.parameters().zip(truth.parameters());
        for (((found, truth), error), square) in both.zip(errors).zip(&mut squares) {
            *square += ((found - truth) / error).powi(2) / trials as f64;
        }
    }
    let most = 4.0 * (2.0 / trials as f64).sqrt();
    let right = squares.iter().all(|square| (square - 1.0).abs() < most);
    assert!(right, "{squares:?}");
}

#[test]
fn what_cannot_be_estimated_is_typed() {
    let (u, zero) = (normal(5, Purpose::Input, 60), vec![0.0; 60]);
    let kind = |options: &PemOptions, y: &[f64]| {
        let failure = estimate(options, 1, &u, y).failure;
        failure.map(|failure| failure.kind)
    };
    for (start, expected) in STARTS.into_iter().zip([
        FailureKind::Singular,
        FailureKind::RankDeficient,
        FailureKind::RankDeficient,
    ]) {
        let options = PemOptions {
            block_rows: Some(3),
            ..options(1, 1, start)
        };
        assert_eq!(kind(&options, &zero), Some(expected));
        let mut huge = u.clone();
        (huge[3], huge[4]) = (f64::MAX, f64::MAX);
        assert_eq!(kind(&options, &huge), Some(FailureKind::NonFinite));
    }
    // A difference of white noise: C has its zero on the unit circle, where there is no minimum inside.
    let e = normal(6, Purpose::NoiseDrive, 60);
    let difference = |k: usize| e[k] - if k > 0 { e[k - 1] } else { 0.0 };
    let y: Vec<f64> = (0..60).map(difference).collect();
    let found = kind(&options(1, 1, SubspaceStart::Cva), &y);
    assert_eq!(found, Some(FailureKind::Boundary));
    let short = Shape { order: 4, window: 12 };
    assert!(PemOptions::default().prepare(&short.into()).is_err());
    let late = options(2, 2, SubspaceStart::Cva);
    assert_eq!(late.check().unwrap_err().key.as_deref(), Some("orders"));
}

/// From 300 samples on a search of order 2 whose independent starts agree takes no subspace model, and a search that
/// begins at one ends no lower: with white noise at the output, for which armax has several minima, and its own noise.
#[test]
fn no_subspace_model_leads_lower_at_order_2() {
    let white = plant("na=2,nb=2,nc=2", &[-1.5, 0.7, 1.0, 0.5, -1.5, 0.7]);
    let (mut other, mut agreed) = (0, 0);
    for truth in [
        white,
        second_order(),
        plant("na=2,nb=2,nc=2", &[-0.1, -0.06, 1.0, 0.4, -0.9, 0.3]),
    ] {
        for trial in 0..40 {
            let (u, y) = record(&truth, 0.6, trial, 300);
            let armax = estimate(&ArmaxOptions::default(), 2, &u, &y);
            let pem = estimate(&options(2, 1, SubspaceStart::Ssarx), 2, &u, &y);
            assert!(armax.failure.is_none() && pem.failure.is_none(), "{truth:?} {trial}");
            assert!(armax.loss <= pem.loss * (1.0 + 1e-6), "{truth:?} {trial}");
            other += usize::from(armax.loss < pem.loss * (1.0 - 1e-6));
            agreed += usize::from(armax.iterations.unwrap() < 40);
        }
    }
    println!("{agreed} of 120 searches ended early, {other} lower than from the subspace model alone");
    assert!(agreed > 100);
}
