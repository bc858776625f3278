//! Tests of responses, regions and cancellations against independent formulas, and over many records; F tests of
//! added lags against numpy.

mod levels;

use super::past_input::past_input;
use super::*;
use crate::data::Rounding;
use crate::estimator::InitialCondition;
use crate::estimator::{ArxOptions, Method, Pass, Shape, Window};
use crate::metric::tails::normal_above;
use crate::model::LinearModel;
use crate::plant::PoleFinder;
use crate::signal::{Input, InputLaw, Purpose, Sequence, stream};
use faer::c64;

/// Step of derivatives along the imaginary axis. They involve no subtraction, so they have no cancellation.
const STEP: f64 = 1e-30;

/// A model of given orders with some parameters; its poles are inside the unit circle.
fn model_of(orders: &str) -> LinearModel {
    let mut model = LinearModel::zero(orders.parse().unwrap());
    let n = model.orders().parameters();
    model.set_parameters(&[-0.9, 0.5, 0.3, 0.7, -0.2, 0.4][..n]);
    model
}

/// The polynomials A, B (with its delay), F with one parameter moved along the imaginary axis.
fn moved(model: &LinearModel, parameter: usize) -> [Vec<c64>; 3] {
    let orders = model.orders();
    let theta: Vec<c64> = model
        .parameters()
        .enumerate()
        .map(|(i, theta)| c64::new(theta, if i == parameter { STEP } else { 0.0 }))
        .collect();
    let (a, rest) = theta.split_at(orders.na);
    let (b, rest) = rest.split_at(orders.nb);
    let f = &rest[orders.nc + orders.nd..];
    let begin = |first: &[f64], rest: &[c64]| {
        let first = first.iter().map(|c| c64::new(*c, 0.0));
        first.chain(rest.iter().copied()).collect::<Vec<c64>>()
    };
    [begin(&[1.0], a), begin(&vec![0.0; orders.nk], b), begin(&[1.0], f)]
}

/// The model with a covariance for which every standard error is the size of the derivative with respect to one
/// parameter.
fn of_one(model: &LinearModel, parameter: usize) -> LinearModel {
    let n = model.orders().parameters();
    let mut model = model.clone();
    model.covariance = vec![0.0; n * n];
    model.covariance[parameter * (n + 1)] = 1.0;
    model
}

const STRUCTURES: [&str; 4] = [
    "na=2,nb=3,nk=1",
    "nb=2,nf=2,nk=3",
    "na=1,nb=1,nf=2,nc=1,nk=0",
    "nb=2,nf=2,nd=1,nk=1",
];

#[test]
fn derivatives_of_the_step_response_by_a_complex_step() {
    for orders in STRUCTURES {
        let model = model_of(orders);
        for parameter in 0..model.orders().parameters() {
            let [a, b, f] = moved(&model, parameter);
            // w = B/A 1, s = w/F.
            let (mut w, mut s) = (Vec::<c64>::new(), Vec::<c64>::new());
            let found = step_response(&of_one(&model, parameter), 30);
            for (k, found) in found.iter().enumerate() {
                let past = |c: &[c64], x: &[c64]| -> c64 {
                    let lags = 1..c.len().min(k + 1);
                    lags.map(|i| c[i] * x[k - i]).sum()
                };
                let driven: c64 = b.iter().take(k + 1).sum();
                w.push(driven - past(&a, &w));
                s.push(w[k] - past(&f, &s));
                let derivative = s[k].im / STEP;
                let near = |found: f64, expected: f64| (found - expected).abs() < 1e-12 * (1.0 + expected.abs());
                assert!(near(found.value, s[k].re), "{orders} at {k}");
                assert!(near(found.se, derivative.abs()), "{orders} {parameter} at {k}");
            }
        }
    }
}

/// `G = B/(A F)` at `z = e^(i omega)` with one parameter moved.
fn gain(model: &LinearModel, parameter: usize, by: f64, omega: f64) -> c64 {
    let mut theta: Vec<f64> = model.parameters().collect();
    theta[parameter] += by;
    let mut model = model.clone();
    model.set_parameters(&theta);
    let value = |c: &[f64]| -> c64 {
        let terms = c.iter().enumerate();
        let angle = |i: usize| -omega * i as f64;
        terms.map(|(i, c)| c64::new(angle(i).cos(), angle(i).sin()) * *c).sum()
    };
    value(&model.b) / (value(&model.a) * value(&model.f))
}

/// Compared with central differences, whose error is of the order of `h^2` and `eps/h`.
#[test]
fn derivatives_of_the_frequency_response_by_differences() {
    let h = 1e-5;
    for orders in STRUCTURES {
        let model = model_of(orders);
        for parameter in 0..model.orders().parameters() {
            let found = frequency_response(&of_one(&model, parameter), &[0.01, 0.3, 1.0, 2.5, 3.1]);
            for found in found {
                let at = |by: f64| gain(&model, parameter, by, found.omega);
                let change = (at(h) / at(-h)).ln() / (2.0 * h);
                let near = |found: f64, expected: f64| (found - expected.abs()).abs() < 1e-7 * (1.0 + expected.abs());
                assert!((found.magnitude - at(0.0).norm()).abs() < 1e-12 * found.magnitude);
                let turns = (found.phase - at(0.0).arg()) / std::f64::consts::TAU;
                assert!((turns - turns.round()).abs() < 1e-12);
                assert!(near(found.log_magnitude_se, change.re), "{orders} {parameter}");
                assert!(near(found.phase_se, change.im), "{orders} {parameter}");
            }
        }
    }
}

/// A delay of nk samples adds `-nk omega` to the phase, also beyond -180 degrees.
#[test]
fn the_phase_of_a_delay_has_no_jumps() {
    let mut model = LinearModel::zero("nb=1,nk=7".parse().unwrap());
    model.set_parameters(&[2.0]);
    let frequencies: Vec<f64> = (1..100).map(|i| 0.03 * f64::from(i)).collect();
    for point in frequency_response(&model, &frequencies) {
        assert!((point.phase + 7.0 * point.omega).abs() < 1e-9);
        assert!((point.magnitude - 2.0).abs() < 1e-12 && point.phase_se.is_nan());
    }
}

/// `S = [4, 1.2; 1.2, 1]`, `det S = 2.56`. The polygon inscribed in the ellipse has `sin(2 pi/m)/(2 pi/m)` of its area,
/// and every corner satisfies `d' S^-1 d = 5.991`.
#[test]
fn an_ellipse_of_known_covariance() {
    let error = RootError {
        re: 2.0,
        im: 1.0,
        covariance: 1.2,
        modulus: 0.0,
    };
    let at = c64::new(0.3, 0.4);
    let corners = Root { at, error }.region_95(360).unwrap();
    let next = corners.iter().cycle().skip(1);
    let twice: f64 = corners.iter().zip(next).map(|(a, b)| a.0 * b.1 - a.1 * b.0).sum();
    let limit = -2.0 * 0.05_f64.ln();
    let angle = std::f64::consts::TAU / 360.0;
    let area = std::f64::consts::PI * limit * 2.56_f64.sqrt() * angle.sin() / angle;
    assert!((twice / 2.0 - area).abs() < 1e-12 * area);
    for (x, y) in corners {
        let (x, y) = (x - 0.3, y - 0.4);
        let square = (x * x - 2.4 * x * y + 4.0 * y * y) / 2.56;
        assert!((square - limit).abs() < 1e-12);
    }
    let real = Root {
        at: c64::new(0.5, 0.0),
        error,
    };
    assert_eq!(
        real.region_95(9).unwrap(),
        [(0.5 - 2.0 * Z_95, 0.0), (0.5 + 2.0 * Z_95, 0.0)]
    );
    let unknown = RootError { re: f64::NAN, ..error };
    assert!(Root { at, error: unknown }.region_95(9).is_none());
}

fn normal(trial: u64, purpose: Purpose, n: usize) -> Vec<f64> {
    let mut signal = vec![0.0; n];
    let input = Input::new(InputLaw::Gaussian, 1.0, Sequence::Independent);
    input.fill(&mut stream(67, trial, purpose), &mut signal);
    signal
}

/// The least-squares estimate, of given orders, from a record of `A y = B u + e` with u and e white of unit variance.
fn estimated(plant: &LinearModel, orders: &str, trial: u64, n: usize) -> LinearModel {
    let u = normal(trial, Purpose::Input, n);
    let mut y = vec![0.0; n];
    crate::model::polynomial::filter(&plant.b, &u, &mut y);
    for (y, e) in y.iter_mut().zip(normal(trial, Purpose::Plant, n)) {
        *y += e;
    }
    crate::model::polynomial::divide(&plant.a, &mut y);
    let orders = orders.parse().unwrap();
    let options = ArxOptions {
        orders: Some(orders),
        ..ArxOptions::default()
    };
    let shape = Shape {
        order: orders.order(),
        window: n,
    };
    let mut estimator = Method::named("arx", options).prepare(shape).unwrap();
    let mut passes = [Pass::new(shape.order)];
    estimator.estimate(Window::new(&u, &y, n), &mut passes);
    assert!(passes[0].failure.is_none());
    passes[0].model.clone()
}

fn precision(model: &LinearModel) -> Precision {
    let a: Vec<f64> = model.a[1..].iter().rev().map(|a| -a).collect();
    let poles = PoleFinder::new(a.len()).poles(&a);
    Precision::new(model, &poles)
}

fn plant(a: &[f64], b: &[f64]) -> LinearModel {
    let mut plant = LinearModel::zero(crate::model::Orders::arx(a.len(), b.len(), 1));
    plant.set_parameters(&[a, b].concat());
    plant
}

/// Four standard errors of a share.
fn four_errors(share: f64, trials: f64) -> f64 {
    4.0 * (share * (1.0 - share) / trials).sqrt()
}

/// Ljung's plant `1 - 1.5 q^-1 + 0.7 q^-2`, `q^-1 + 0.5 q^-2`. The 95 % bands of step response, magnitude and phase
/// hold the true value in 95 % of the records, and the ellipse holds the true pole.
#[test]
fn bands_and_ellipses_hold_the_truth_as_often_as_they_say() {
    let plant = plant(&[-1.5, 0.7], &[1.0, 0.5]);
    let (trials, n) = (1000_u64, 2000);
    let (times, frequencies) = ([1, 4, 10, 40], [0.1, 0.5, 2.0]);
    let true_step = step_response(&plant, 41);
    let true_gain = frequency_response(&plant, &frequencies);
    let true_pole = c64::new(0.75, (0.7_f64 - 0.5625).sqrt());
    let mut held = [0_u64; 11];
    for trial in 0..trials {
        let model = estimated(&plant, "na=2,nb=2", trial, n);
        let step = step_response(&model, 41);
        let gain = frequency_response(&model, &frequencies);
        let precision = precision(&model);
        let pole = precision.poles.iter().find(|pole| pole.at.im > 0.0).unwrap();
        let steps = times.map(|k| (step[k].value - true_step[k].value) / step[k].se);
        let sizes = [0, 1, 2].map(|i| (gain[i].magnitude / true_gain[i].magnitude).ln() / gain[i].log_magnitude_se);
        let phases = [0, 1, 2].map(|i| (gain[i].phase - true_gain[i].phase) / gain[i].phase_se);
        let scores = steps.iter().chain(&sizes).chain(&phases);
        for (held, score) in held.iter_mut().zip(scores) {
            *held += u64::from(score.abs() <= Z_95);
        }
        // A point inside a convex polygon lies to the left of every edge.
        let corners = pole.region_95(90).unwrap();
        let next = corners.iter().cycle().skip(1);
        let inside = corners
            .iter()
            .zip(next)
            .all(|(a, b)| (b.0 - a.0) * (true_pole.im - a.1) - (b.1 - a.1) * (true_pole.re - a.0) >= 0.0);
        held[10] += u64::from(inside);
    }
    for (i, held) in held.into_iter().enumerate() {
        let share = held as f64 / trials as f64;
        let limit = four_errors(0.95, trials as f64);
        assert!((share - 0.95).abs() < limit, "quantity {i}: {share}");
    }
}

/// A model of order 2 for a plant of order 1 with white e has a pole and a zero that both tend to 0. They are told
/// apart in 5 % of the records.
#[test]
fn an_order_too_many_is_found() {
    let plant = plant(&[-0.8], &[1.0]);
    let (trials, mut found) = (500, 0);
    for trial in 0..trials {
        let model = estimated(&plant, "na=2,nb=2", trial, 2000);
        let precision = precision(&model);
        if let Some(first) = precision.cancellations.first() {
            found += 1;
            assert!(first.pole.norm() < 0.4 && first.zero.norm() < 0.4);
            let orders = first.orders_without(model.orders());
            assert_eq!(orders.to_string(), "na=1,nb=1,nk=1");
        }
    }
    let share = f64::from(found) / f64::from(trials as u32);
    assert!((share - 0.95).abs() < four_errors(0.95, trials as f64), "{share}");
}

/// A pole at 0.5 and a zero at distance d; the difference of their estimates has standard deviation s over the records.
/// By the normal law a share of `Phi(1.96 - d/s) - Phi(-1.96 - d/s)` cannot tell them apart.
#[test]
fn separate_poles_and_zeros_are_told_apart_as_often_as_theory_says() {
    let (trials, n) = (500_u32, 4000);
    for (zero, bounds) in [(0.45, 0.02..0.98), (0.1, 0.0..1e-6)] {
        // A = (1 - 0.9 q^-1)(1 - 0.5 q^-1), B = q^-1 (1 - zero q^-1).
        let plant = plant(&[-1.4, 0.45], &[1.0, -zero]);
        let (mut differences, mut found) = (Vec::new(), 0);
        for trial in 0..trials {
            let model = estimated(&plant, "na=2,nb=2", u64::from(trial), n);
            let pole = -model.a[1] / 2.0 - (model.a[1] * model.a[1] / 4.0 - model.a[2]).sqrt();
            differences.push(pole + model.b[2] / model.b[1]);
            found += u32::from(!precision(&model).cancellations.is_empty());
        }
        let count = f64::from(trials);
        let mean = differences.iter().sum::<f64>() / count;
        let squares = differences.iter().map(|d| (d - mean) * (d - mean));
        let s = (squares.sum::<f64>() / count).sqrt();
        let far = (0.5 - zero) / s;
        let expected = normal_above(far - Z_95) - normal_above(far + Z_95);
        let share = f64::from(found) / count;
        assert!(bounds.contains(&expected), "{expected}");
        // s itself has a relative error of 1/sqrt(2 trials), which changes the share by the density times `far`.
        let density = (-(far - Z_95) * (far - Z_95) / 2.0).exp() / std::f64::consts::TAU.sqrt();
        let of_s = 4.0 * density * far / (2.0 * count).sqrt();
        let limit = four_errors(expected.max(1.0 / count), count) + of_s;
        assert!((share - expected).abs() < limit, "{share} instead of {expected}");
    }
}

/// Complex pairs: a resonance times a common factor with complex roots. Once the covariance is so large that the pairs
/// may be one, once so small that they may not.
#[test]
fn a_complex_pair_may_cancel_too() {
    // A = (1 - 0.9 q^-1)(1 - 0.8 q^-1 + 0.5 q^-2), B = q^-1 (1 - 0.82 q^-1 + 0.51 q^-2).
    let mut model = plant(&[-1.7, 1.22, -0.45], &[1.0, -0.82, 0.51]);
    for (variance, expected) in [(1e-2, true), (1e-8, false)] {
        model.covariance = vec![0.0; 36];
        for i in 0..6 {
            model.covariance[7 * i] = variance;
        }
        let found = precision(&model).cancellations;
        assert_eq!(found.iter().any(|pair| pair.pole.im > 0.0), expected);
        if expected {
            let pair = found.iter().find(|pair| pair.pole.im > 0.0).unwrap();
            assert_eq!(pair.orders_without(model.orders()).to_string(), "na=1,nb=1,nk=1");
        }
    }
    model.covariance.clear();
    assert!(precision(&model).cancellations.is_empty());
}

/// The F tests of past input and of feedback against numpy and scipy (`reference.py`).
#[test]
fn added_lags_of_another_program() {
    #[derive(serde::Deserialize)]
    struct Loop {
        p_value: Option<f64>,
        at_once: Option<f64>,
        later: Option<f64>,
    }
    #[derive(serde::Deserialize)]
    struct Case {
        name: String,
        rest: bool,
        u: Vec<f64>,
        y: Vec<f64>,
        orders: String,
        parameters: Vec<f64>,
        past: Option<f64>,
        feedback: Loop,
    }
    let cases: Vec<Case> = serde_json::from_str(include_str!("reference.json")).unwrap();
    let near = |found: Option<f64>, expected: Option<f64>, what: &str| {
        let same = match (found, expected) {
            (Some(found), Some(expected)) => (found - expected).abs() < 1e-8,
            (found, expected) => found.is_none() && expected.is_none(),
        };
        assert!(same, "{what}: {found:?} instead of {expected:?}");
    };
    for Case {
        name,
        rest,
        u,
        y,
        orders,
        parameters,
        past,
        feedback,
    } in cases
    {
        let mut model = LinearModel::zero(orders.parse().unwrap());
        model.set_parameters(&parameters);
        let start = if rest {
            InitialCondition::Zero
        } else {
            InitialCondition::Estimate
        };
        let found = past_input(&model, &u, &y, start).map(|test| test.p_value);
        near(found, past, &format!("{name}, past"));
        let found = FeedbackTest::of(&u, &y, model.delay, Rounding::default());
        near(found.map(|of| of.p_value), feedback.p_value, &format!("{name}, future"));
        near(
            found.and_then(|of| of.at_once),
            feedback.at_once,
            &format!("{name}, u(k)"),
        );
        near(found.and_then(|of| of.later), feedback.later, &format!("{name}, later"));
    }
}
