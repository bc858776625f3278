//! Against another program, `morsm.py`.

use super::*;
use crate::estimator::test_setup::{self, estimate, plant};
use crate::estimator::{BjOptions, Progress, Shape};
use crate::model::polynomial::divide;
use crate::signal::Purpose;
use serde_json::Value;

fn both(orders: Orders, high_order: Option<usize>) -> [Box<dyn MethodKind>; 2] {
    let orders = Some(orders);
    let stabilise = None;
    [
        Box::new(BjsmOptions {
            orders,
            high_order,
            stabilise,
            ..BjsmOptions::default()
        }),
        Box::new(MorsmOptions {
            orders,
            high_order,
            stabilise,
            ..MorsmOptions::default()
        }),
    ]
}

/// `y = B/F u + sd C/D e`.
fn record(truth: &LinearModel, sd: f64, trial: u64, n: usize) -> [Vec<f64>; 2] {
    let normal = |purpose| test_setup::normal(97, trial, purpose, n);
    let (u, e) = (normal(Purpose::Input), normal(Purpose::NoiseDrive));
    let (mut y, mut v) = (vec![0.0; n], vec![0.0; n]);
    truth.simulate(&u, &mut y);
    filter(&truth.c, &e, &mut v);
    divide(&truth.d, &mut v);
    y.iter_mut().zip(&v).for_each(|(y, v)| *y += sd * v);
    [u, y]
}

/// Recorded and simulated data against the fixed points of the iterations by numpy; `morsm.py` says how.
#[test]
fn fixed_points_of_another_program() {
    let cases: Value = serde_json::from_str(include_str!("../morsm.json")).unwrap();
    assert_eq!(cases.as_array().unwrap().len(), 14);
    for case in cases.as_array().unwrap() {
        let number = |key: &str| case[key].as_u64().unwrap() as usize;
        let file = case["file"].as_str().unwrap();
        let path = format!("../../tests/recorded_data/data/{file}");
        let record = crate::data::csv::read(std::fs::File::open(path).unwrap()).unwrap();
        let n = number("N");
        let orders: Orders = case["orders"].as_str().unwrap().parse().unwrap();
        let place = usize::from(case["method"] == "morsm");
        let high_order = Some(number("high_order"));
        let orders = Some(orders);
        let initial = match case["initial"].as_str() {
            Some("estimate") => InitialCondition::Estimate,
            _ => InitialCondition::Zero,
        };
        let offset = match case["offset"].as_f64() {
            Some(_) => OffsetChoice::Estimate,
            None => OffsetChoice::None,
        };
        let options: [Box<dyn MethodKind>; 2] = [
            Box::new(BjsmOptions {
                orders,
                high_order,
                initial,
                offset,
                ..BjsmOptions::default()
            }),
            Box::new(MorsmOptions {
                orders,
                high_order,
                initial,
                offset,
                ..MorsmOptions::default()
            }),
        ];
        let shifted = |signal: &[f64], i: usize| -> Vec<f64> {
            let added = case["added"][i].as_f64().unwrap_or(0.0);
            signal[..n].iter().map(|x| x + added).collect()
        };
        let (u, y) = (shifted(&record.u, 0), shifted(&record.y, 1));
        let pass = estimate(options[place].as_ref(), 2, &u, &y);
        assert_eq!(pass.failure, None, "{file}");
        let errors = pass.model.standard_errors().unwrap();
        let offsets = pass.offsets.iter();
        let errors: Vec<f64> = errors.into_iter().chain(offsets.clone().map(|of| of.se)).collect();
        let found = pass.model.parameters().chain(offsets.map(|of| of.value));
        let expected = case["theta"].as_array().unwrap().iter();
        let expected = expected.chain(case["offset"].as_f64().map(|_| &case["offset"]));
        for (i, (found, expected)) in found.zip(expected).enumerate() {
            let expected = expected.as_f64().unwrap();
            assert!((found - expected).abs() < 1e-7, "{file} {place}: {found} {expected}");
            let error = case["se"][i].as_f64().unwrap();
            assert!(
                (errors[i] / error - 1.0).abs() < 1e-5,
                "{file} {place}: {} {error}",
                errors[i]
            );
        }
    }
}

#[test]
fn a_record_without_noise_gives_its_model() {
    for (nk, orders) in ["nb=1,nf=1,nk=0", "nb=2,nf=2,nk=1", "nb=1,nf=2,nk=2"]
        .iter()
        .enumerate()
    {
        let theta = [&[1.0, 0.5][..], &[-0.9, 0.2]].concat();
        let shape: Orders = orders.parse().unwrap();
        let truth = plant(orders, &[&theta[..shape.nb], &theta[2..2 + shape.nf]].concat());
        let [u, y] = record(&truth, 0.0, nk as u64, 300);
        for options in both(shape, None) {
            let pass = estimate(options.as_ref(), 2, &u, &y);
            assert_eq!((pass.failure, pass.progress), (None, Progress::InitialState));
            for (found, truth) in pass.model.parameters().zip(truth.parameters()) {
                assert!((found - truth).abs() < 1e-8, "{orders}: {found} {truth}");
            }
        }
    }
}

/// Efficient for a Box-Jenkins process in open loop: at 20,000 samples within four standard errors, which are those
/// of `bj` with the true structure.
#[test]
fn the_bound_at_twenty_thousand_samples() {
    let orders = "nb=2,nc=1,nd=1,nf=2";
    let truth = plant(orders, &[1.0, 0.5, 0.6, -0.8, -1.5, 0.7]);
    let [u, y] = record(&truth, 0.5, 5, 20_000);
    let bj = BjOptions {
        orders: Some(truth.orders()),
        ..BjOptions::default()
    };
    let bound = estimate(&bj, 2, &u, &y).model.standard_errors().unwrap();
    let plant_orders = Orders {
        nc: 0,
        nd: 0,
        ..truth.orders()
    };
    for options in both(plant_orders, None) {
        let pass = estimate(options.as_ref(), 2, &u, &y);
        assert_eq!(pass.failure, None);
        let errors = pass.model.standard_errors().unwrap();
        let expected = [1.0, 0.5, -1.5, 0.7];
        for (i, (found, place)) in pass.model.parameters().zip([0, 1, 4, 5]).enumerate() {
            assert!((found - expected[i]).abs() < 4.0 * errors[i], "{found} {}", expected[i]);
            let ratio = errors[i] / bound[place];
            assert!((0.95..1.05).contains(&ratio), "{ratio}");
        }
    }
}

/// `y = 2 u + e`: a model of order 0 has no state, so `initial = estimate` adds nothing.
#[test]
fn a_gain_has_no_start() {
    let truth = plant("nb=1,nf=0,nk=0", &[2.0]);
    let [u, y] = record(&truth, 0.01, 7, 400);
    let (orders, initial) = (Some(truth.orders()), InitialCondition::Estimate);
    let both: [Box<dyn MethodKind>; 2] = [
        Box::new(BjsmOptions {
            orders,
            initial,
            ..BjsmOptions::default()
        }),
        Box::new(MorsmOptions {
            orders,
            initial,
            ..MorsmOptions::default()
        }),
    ];
    for options in both {
        let pass = estimate(options.as_ref(), 1, &u, &y);
        assert_eq!((pass.failure, pass.start_numbers), (None, 0));
        assert!((pass.model.b[0] - 2.0).abs() < 0.01, "{:?}", pass.model.b);
    }
}

#[test]
fn what_cannot_be_estimated_is_typed() {
    let truth = plant("nb=2,nf=2", &[1.0, 0.5, -1.5, 0.7]);
    let [u, _] = record(&truth, 20.0, 3, 40);
    let kind = |options: &dyn MethodKind, y: &[f64]| estimate(options, 2, &u, y).failure.map(|f| f.kind);
    for options in both(truth.orders(), None) {
        assert_eq!(kind(options.as_ref(), &[0.0; 40]), Some(FailureKind::RankDeficient));
    }
    let fails = BjsmOptions {
        stabilise: Some(Stabilise::None),
        ..BjsmOptions::default()
    };
    let mut kinds = std::collections::BTreeSet::new();
    for trial in 0..200 {
        let [u, y] = record(&truth, 20.0, 1000 + trial, 40);
        let pass = estimate(&fails, 2, &u, &y);
        kinds.extend(pass.failure.map(|failure| failure.kind.to_string()));
        let pass = estimate(&BjsmOptions::default(), 2, &u, &y);
        let limit = pass
            .failure
            .is_none_or(|failure| failure.kind == FailureKind::IterationLimit);
        assert!(limit && pass.model.f.iter().all(|f| f.is_finite()));
    }
    assert!(kinds.contains("unstable-predictor"), "{kinds:?}");
    let error = BjsmOptions {
        high_order: Some(30),
        ..BjsmOptions::default()
    };
    let error = error.prepare(&Shape { order: 2, window: 40 }.into()).err().unwrap();
    assert!(error.to_string().contains("too short"), "{error}");
    let wrong = MorsmOptions {
        orders: Some("na=1,nb=1".parse().unwrap()),
        ..MorsmOptions::default()
    };
    assert!(wrong.check().is_err());
}
