//! The plant and the controller of Gilson, Garnier, Young and Van den Hof (2008), sampled at 5 ms.

use super::*;
use crate::estimator::{FailureKind, MethodOptions, Pass, Shape, Window};
use crate::model::LinearModel;
use crate::model::polynomial::{divide, filter};
use crate::signal::{Input, InputLaw, Purpose, Sequence, stream};

const STEP: f64 = 0.005;
const TRUTH: [f64; 4] = [1.0, 1.0, 0.5, 1.0];

/// `(10 s + 15)/s` at the samples.
fn controller() -> OutputFeedback {
    "10,-9.925/1,-1".parse().unwrap()
}

fn plant() -> LinearModel {
    let continuous = ContinuousModel {
        numerator: vec![1.0, 1.0],
        denominator: vec![1.0, 0.5, 1.0],
        step: STEP,
        ..ContinuousModel::default()
    };
    let mut sampled = LinearModel::zero("nb=2,nf=2,nk=1".parse().unwrap());
    continuous.sample(&mut sampled);
    sampled
}

fn draw(law: InputLaw, trial: u64, purpose: Purpose, n: usize) -> Vec<f64> {
    let mut signal = vec![0.0; n];
    let input = Input::new(law, 1.0, Sequence::Independent);
    input.fill(&mut stream(101, trial, purpose), &mut signal);
    signal
}

/// u, y and r of the loop from rest; r has random signs, each for half a second, `dead` samples pass before u acts, and
/// the noise is `(1 + 0.5/q)/(1 - 0.85/q) e`.
fn record(deviation: f64, dead: usize, trial: u64, n: usize) -> [Vec<f64>; 3] {
    let truth = plant();
    let drawn = draw(InputLaw::Signs, trial, Purpose::Input, n);
    let r: Vec<f64> = (0..n).map(|k| drawn[k / 100]).collect();
    let e = draw(InputLaw::Gaussian, trial, Purpose::NoiseDrive, n);
    let mut v = vec![0.0; n];
    filter(&[1.0, 0.5], &e, &mut v);
    divide(&[1.0, -0.85], &mut v);
    let mut signals = [(); 4].map(|()| vec![0.0; n]);
    let [u, y, x, k] = &mut signals;
    for i in 0..n {
        let past = |c: &[f64], s: &[f64], dead: usize| -> f64 {
            let terms = c.iter().enumerate().skip(1);
            terms
                .filter(|(lag, _)| lag + dead <= i)
                .map(|(lag, c)| c * s[i - lag - dead])
                .sum()
        };
        x[i] = past(&truth.b, u, dead) - past(&truth.f, x, 0);
        y[i] = x[i] + deviation * v[i];
        k[i] = past(&[0.0, 1.0], k, 0) + 10.0 * y[i] + past(&[0.0, -9.925], y, 0);
        u[i] = r[i] - k[i];
    }
    let [u, y, ..] = signals;
    [u, y, r]
}

fn estimate(options: impl Into<MethodOptions>, [u, y, r]: &[Vec<f64>; 3]) -> Pass {
    let shape = Shape {
        order: 2,
        window: y.len(),
    };
    let mut estimator = options.into().prepare(&shape.into()).expect("an estimator");
    let mut passes = [Pass::new(2)];
    estimator.estimate(Window::with_reference(u, y, r, y.len()), &mut passes);
    let [pass] = passes;
    pass
}

fn clrivc(orders: &str, controller: Option<OutputFeedback>) -> ClrivcOptions {
    ClrivcOptions {
        orders: Some(orders.parse().unwrap()),
        ts: Some(STEP),
        controller,
        ..ClrivcOptions::default()
    }
}

const HYBRID: &str = "nb=2,nc=1,nd=1,nf=2,nk=1";

/// The largest distance from the truth in standard errors.
fn distance(pass: &Pass) -> f64 {
    assert_eq!(pass.failure, None);
    let errors = pass.continuous.standard_errors().expect("errors");
    let found = pass.continuous.parameters();
    let distances = found.iter().zip(TRUTH).zip(errors);
    let distances = distances.map(|((found, truth), error)| (found - truth).abs() / error);
    distances.fold(0.0, f64::max)
}

/// Without noise the plant comes back, also with a dead time.
#[test]
fn the_plant_is_recovered_without_noise() {
    for (dead, orders) in [(0, "nb=2,nf=2,nk=1"), (3, "nb=2,nf=2,nk=4")] {
        let record = record(0.0, dead, 1, 3000);
        for controller in [None, Some(controller())] {
            let pass = estimate(clrivc(orders, controller), &record);
            assert_eq!(pass.failure, None, "{orders}");
            for (found, truth) in pass.continuous.parameters().iter().zip(TRUTH) {
                assert!((found - truth).abs() < 1e-7, "{orders}: {found} {truth}");
            }
        }
    }
}

/// At 20,000 samples the truth is within four standard errors, whatever the noise model; `rivc`, which is for open
/// loops, is further off without a noise model.
#[test]
fn consistent_at_twenty_thousand_samples() {
    let record = record(0.05, 0, 2, 20_000);
    for controller in [None, Some(controller())] {
        let distance = distance(&estimate(clrivc(HYBRID, controller), &record));
        assert!(distance < 4.0, "{distance}");
    }
    let open = RivcOptions {
        orders: Some("nb=2,nf=2,nk=1".parse().unwrap()),
        ts: Some(STEP),
        ..RivcOptions::default()
    };
    let open = estimate(open, &record);
    let white = estimate(clrivc("nb=2,nf=2,nk=1", Some(controller())), &record);
    let error = |pass: &Pass| {
        let found = pass.continuous.parameters();
        let errors = found.iter().zip(TRUTH);
        errors.fold(0.0_f64, |m, (found, truth)| m.max((found - truth).abs()))
    };
    assert!(error(&open) > 4.0 * error(&white), "{} {}", error(&open), error(&white));
}

/// Standard errors are those that 240 records show: the squares of the errors over them have a mean of 1 within four of
/// its standard errors, 0.37. So the covariance of optimal instruments is reached.
#[test]
fn standard_errors_are_those_of_many_records() {
    let trials = 240;
    let mut squares = [0.0; 4];
    for trial in 0..trials {
        let record = record(0.005, 0, 100 + trial, 3000);
        let pass = estimate(clrivc(HYBRID, Some(controller())), &record);
        assert_eq!(pass.failure, None);
        let errors = pass.continuous.standard_errors().expect("errors");
        let found = pass.continuous.parameters();
        for (i, square) in squares.iter_mut().enumerate() {
            *square += ((found[i] - TRUTH[i]) / errors[i]).powi(2) / trials as f64;
        }
    }
    let most = 4.0 * (2.0 / trials as f64).sqrt();
    let right = squares.iter().all(|square| (square - 1.0).abs() < most);
    assert!(right, "{squares:?}");
}

/// An open loop is a loop whose input is its reference: `clrivc` is `rivc` there, bit by bit.
#[test]
fn an_open_loop_is_one_without_feedback() {
    let [_, _, r] = record(0.0, 0, 3, 1500);
    let mut y = vec![0.0; r.len()];
    plant().simulate(&r, &mut y);
    let e = draw(InputLaw::Gaussian, 3, Purpose::NoiseDrive, r.len());
    y.iter_mut().zip(e).for_each(|(y, e)| *y += 0.01 * e);
    let open = [r.clone(), y, r];
    let options = clrivc(HYBRID, Some(controller()));
    let (one, other) = (estimate(options.as_rivc(), &open), estimate(options, &open));
    assert_eq!(one.failure, None);
    assert_eq!((one.model, one.continuous), (other.model, other.continuous));
}

/// Every kind of failure.
#[test]
fn failures_are_typed() {
    let [u, y, r] = record(0.02, 0, 4, 600);
    let kind = |pass: Pass| pass.failure.map(|failure| failure.kind);
    for controller in [None, Some(controller())] {
        let options = clrivc(HYBRID, controller);
        let silent = [u.clone(), y.clone(), vec![0.0; 600]];
        assert_eq!(kind(estimate(options.clone(), &silent)), Some(FailureKind::Singular));
        let huge = [u.clone(), vec![f64::MAX; 600], r.clone()];
        assert_eq!(kind(estimate(options, &huge)), Some(FailureKind::NonFinite));
    }
    // A controller that is not the loop's closes no stable loop around the model.
    let wrong = clrivc(HYBRID, Some("-3000".parse().unwrap()));
    let wrong = kind(estimate(wrong, &[u, y, r]));
    assert_eq!(wrong, Some(FailureKind::UnstableInstruments));
    let short = Shape { order: 2, window: 4 };
    assert!(ClrivcOptions::default().prepare(&short.into()).is_err());
    for (key, options) in [
        (
            "long",
            ClrivcOptions {
                long: Some(0),
                ..ClrivcOptions::default()
            },
        ),
        (
            "ts",
            ClrivcOptions {
                ts: Some(-1.0),
                ..ClrivcOptions::default()
            },
        ),
        ("orders", clrivc("nb=4,nf=2,nk=1", None)),
    ] {
        assert_eq!(options.check().unwrap_err().key.as_deref(), Some(key));
    }
}
