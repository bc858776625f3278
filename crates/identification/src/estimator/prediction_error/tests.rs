//! Gradients against differences of the sum in the complex plane; recovery without noise.

use super::*;
use crate::estimator::{MethodKind as _, Progress, test_setup};
use crate::model::polynomial::{divide, filter};
use crate::signal::{Input, InputLaw, Purpose, Sequence, stream};
use faer::c64;
use rand::Rng as _;

const N: usize = 240;

fn uniform(trial: u64, count: usize) -> Vec<f64> {
    let mut random = stream(17, trial, Purpose::Plant);
    let mut draw = || (random.next_u64() >> 11) as f64 / 2_f64.powi(52) - 1.0;
    (0..count).map(|_| draw()).collect()
}

fn record(model: &LinearModel, trial: u64, noise: f64) -> (Vec<f64>, Vec<f64>) {
    let (mut u, mut y) = (vec![0.0; N], vec![0.0; N]);
    let input = Input::new(InputLaw::Signs, 1.0, Sequence::Independent);
    input.fill(&mut stream(18, trial, Purpose::Input), &mut u);
    model.simulate(&u, &mut y);
    let (e, mut v) = (uniform(1000 + trial, N), vec![0.0; N]);
    filter(&model.c, &e, &mut v);
    divide(&model.d, &mut v);
    divide(&model.a, &mut v);
    y.iter_mut().zip(&v).for_each(|(y, v)| *y += noise * v);
    (u, y)
}

/// Structures with orders 1 and 2 and delays 0 to 2.
fn structures() -> Vec<Orders> {
    let mut all = Vec::new();
    for n in 1..=2 {
        for nk in 0..=2 {
            let none = Orders {
                nk,
                nb: n,
                ..Orders::default()
            };
            all.push(Orders { nf: n, ..none });
            all.push(Orders { na: n, nc: n, ..none });
            all.push(Orders {
                nf: n,
                nc: 1,
                nd: n,
                ..none
            });
            all.push(Orders {
                na: 1,
                nf: n,
                nc: 1,
                nd: 1,
                ..none
            });
        }
    }
    all
}

/// Returns a model with zeros well inside the unit circle and no common factors.
fn model(orders: Orders, trial: u64) -> LinearModel {
    let mut model = LinearModel::zero(orders);
    let theta: Vec<f64> = uniform(trial, orders.parameters())
        .iter()
        .map(|x| 0.45 * x + 0.05)
        .collect();
    model.set_parameters(&theta);
    model.b[orders.nk] = 1.0;
    if orders.nc > 0 && orders.nd > 0 {
        // C and D are far from cancelling.
        (model.c[1], model.d[1]) = (0.5, -0.4);
    }
    model
}

/// Returns the sum of squares in complex arithmetic, by the recursions themselves.
fn complex_sum(orders: Orders, theta: &[c64], u: &[f64], y: &[f64]) -> c64 {
    let (a, rest) = theta.split_at(orders.na);
    let (b, rest) = rest.split_at(orders.nb);
    let (c, rest) = rest.split_at(orders.nc);
    let (d, f) = rest.split_at(orders.nd);
    let zero = c64::new(0.0, 0.0);
    let (mut x, mut w, mut e) = (vec![zero; N], vec![zero; N], vec![zero; N]);
    let mut sum = zero;
    for k in 0..N {
        let past = |signal: &[c64], lag: usize| k.checked_sub(lag).map_or(zero, |k| signal[k]);
        let real = |signal: &[f64], lag: usize| k.checked_sub(lag).map_or(zero, |k| c64::new(signal[k], 0.0));
        for (i, b) in b.iter().enumerate() {
            x[k] += *b * real(u, orders.nk + i);
        }
        for (i, f) in f.iter().enumerate() {
            let old = past(&x, i + 1);
            x[k] -= *f * old;
        }
        w[k] = c64::new(y[k], 0.0) - x[k];
        for (i, a) in a.iter().enumerate() {
            w[k] += *a * real(y, i + 1);
        }
        e[k] = w[k];
        for (i, d) in d.iter().enumerate() {
            let old = past(&w, i + 1);
            e[k] += *d * old;
        }
        for (i, c) in c.iter().enumerate() {
            let old = past(&e, i + 1);
            e[k] -= *c * old;
        }
        sum += e[k] * e[k];
    }
    sum
}

/// `dV/dtheta = 2 psi'e` against `Im V(theta + i h) / h`, h = 1e-30; exact to rounding.
#[test]
fn gradients_are_exact() {
    for (trial, orders) in structures().into_iter().enumerate() {
        let trial = trial as u64;
        let (u, y) = record(&model(orders, trial), trial, 0.3);
        let theta: Vec<f64> = model(orders, 500 + trial).parameters().collect();
        let mut descent = Descent::new(orders, OfRecord::default(), Runs::new(&[N]));
        for gradient in descent.gradients(&u, &y, &theta) {
            let size = gradient.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
            for (j, found) in gradient.iter().enumerate() {
                let mut shifted: Vec<c64> = theta.iter().map(|x| c64::new(*x, 0.0)).collect();
                shifted[j].im = 1e-30;
                let expected = complex_sum(orders, &shifted, &u, &y).im / 1e-30 / 2.0;
                let error = (found - expected).abs() / size;
                assert!(error < 1e-11, "{orders} {j}: {found} {expected}");
            }
        }
    }
}

/// With a little noise the parameters are found within its size. Without noise, and without C and D, they are exact.
#[test]
fn every_structure_is_recovered() {
    // With both A and F, the two may be exchanged.
    let structures = structures().into_iter().filter(|orders| orders.na * orders.nf == 0);
    for (trial, orders) in structures.enumerate() {
        let trial = trial as u64;
        let truth = model(orders, trial);
        let exact = orders.nc + orders.nd == 0;
        let (u, y) = record(&truth, trial, if exact { 0.0 } else { 1e-3 });
        let mut method = PredictionError::new(orders, 4, InitialCondition::Zero, N).unwrap();
        let mut passes = [Pass::new(1)];
        method.estimate(Window::new(&u, &y, N), &mut passes);
        let [pass] = passes;
        assert_eq!(
            (pass.failure, pass.progress),
            (None, Progress::InitialState),
            "{orders}"
        );
        let errors = pass.model.standard_errors().unwrap();
        let found = pass.model.parameters().zip(truth.parameters());
        for ((found, truth), error) in found.zip(errors) {
            let allowed = if exact { 1e-9 } else { 6.0 * error };
            assert!((found - truth).abs() < allowed, "{orders}: {found} {truth} {error}");
        }
    }
}

/// Without noise, nothing is left for C to explain, and A and B are exact.
#[test]
fn armax_without_noise() {
    let orders: Orders = "na=2,nb=2,nc=2".parse().unwrap();
    let truth = LinearModel {
        c: vec![1.0, 0.0, 0.0],
        ..model(orders, 3)
    };
    let (u, y) = record(&truth, 3, 0.0);
    let mut method = PredictionError::new(orders, 4, InitialCondition::Zero, N).unwrap();
    let mut passes = [Pass::new(1)];
    method.estimate(Window::new(&u, &y, N), &mut passes);
    let [pass] = passes;
    assert_eq!(pass.failure, None);
    for (found, truth) in pass.model.parameters().zip(truth.parameters()).take(4) {
        assert!((found - truth).abs() < 1e-10, "{found} {truth}");
    }
}

/// In other units the model is the same; B is in those of y over u.
#[test]
fn units_do_not_matter() {
    let structures = structures().into_iter().filter(|orders| orders.na * orders.nf == 0);
    for (trial, orders) in structures.enumerate() {
        let (u, y) = record(&model(orders, trial as u64), trial as u64, 0.2);
        let estimate = |u: &[f64], y: &[f64]| {
            let mut method = PredictionError::new(orders, 4, InitialCondition::Zero, N).unwrap();
            let mut passes = [Pass::new(1)];
            method.estimate(Window::new(u, y, N), &mut passes);
            let [pass] = passes;
            pass
        };
        let scaled = |signal: &[f64], by: f64| signal.iter().map(|x| by * x).collect::<Vec<_>>();
        let pass = estimate(&u, &y);
        let other = estimate(&scaled(&u, 8.0), &scaled(&y, 1.0 / 64.0));
        assert_eq!(pass.failure, other.failure, "{orders}");
        let both = pass.model.parameters().zip(other.model.parameters());
        for (i, (found, other)) in both.enumerate() {
            let of_b = (orders.na..orders.na + orders.nb).contains(&i);
            let other = if of_b { 512.0 * other } else { other };
            assert!(
                (found - other).abs() < 1e-7 * found.abs().max(1.0),
                "{orders} {i}: {found} {other}"
            );
        }
    }
}

/// A pole that a zero cancels may be anywhere, so its parameters cannot be found.
#[test]
fn what_cannot_be_identified_is_typed() {
    let truth = LinearModel {
        b: vec![0.0, 1.0],
        f: vec![1.0, -0.5],
        ..LinearModel::zero("nb=1,nf=1".parse().unwrap())
    };
    let (u, y) = record(&truth, 1, 0.0);
    let mut method = PredictionError::new("nb=2,nf=2".parse().unwrap(), 4, InitialCondition::Zero, N).unwrap();
    let mut passes = [Pass::new(1)];
    method.estimate(Window::new(&u, &y, N), &mut passes);
    let kind = passes[0].failure.expect("a failure").kind;
    assert_eq!(kind, crate::estimator::FailureKind::NotIdentifiable);
}

/// One record, and two.
const RUNS: [&[usize]; 2] = [&[N], &[90, N - 90]];

/// The choices of start and offset that are fitted beside the parameters.
fn beside(orders: Orders) -> [OfRecord; 4] {
    let initial = initial_numbers(orders);
    let all = [(false, 0), (false, initial), (true, 0), (true, initial)];
    all.map(|(offset, initial)| OfRecord { offset, initial })
}

/// The gradient with initial numbers and an offset of each record, against differences of the sum in each of them.
#[test]
fn gradients_with_numbers_of_each_record() {
    let cases = structures().into_iter().enumerate();
    let cases = cases.flat_map(|(trial, orders)| beside(orders).map(|of| (trial, orders, of)));
    for ((trial, orders, of), lengths) in cases.flat_map(|case| RUNS.map(|of| (case, of))) {
        let trial = trial as u64;
        let (u, y) = record(&model(orders, trial), trial, 0.3);
        let mut theta: Vec<f64> = model(orders, 500 + trial).parameters().collect();
        theta.extend(uniform(900 + trial, of.count() * lengths.len()));
        let mut descent = Descent::new(orders, of, Runs::new(lengths));
        let [gradient, other] = descent.gradients(&u, &y, &theta);
        let size = gradient.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
        for j in 0..theta.len() {
            let h = 1e-6;
            let mut beside = |sign: f64| {
                let mut shifted = theta.clone();
                shifted[j] += sign * h;
                descent.sum_at(&u, &y, &shifted)
            };
            let expected = (beside(1.0) - beside(-1.0)) / (4.0 * h);
            for found in [gradient[j], other[j]] {
                let error = (found - expected).abs() / size;
                assert!(error < 1e-7, "{orders} {of:?} {j}: {found} {expected}");
            }
        }
    }
}

/// The Hessian against differences of the gradient, with and without initial numbers and offsets.
#[test]
fn hessians_are_exact() {
    let cases = structures().into_iter().enumerate();
    for ((trial, orders), lengths) in cases.flat_map(|of| RUNS.map(|lengths| (of, lengths))) {
        let trial = trial as u64;
        let (u, y) = record(&model(orders, trial), trial, 0.3);
        for of in beside(orders) {
            let mut theta: Vec<f64> = model(orders, 500 + trial).parameters().collect();
            theta.extend(uniform(900 + trial, of.count() * lengths.len()));
            let mut descent = Descent::new(orders, of, Runs::new(lengths));
            let hessian = descent.hessian(&u, &y, &theta).clone();
            let scale = |i: usize| hessian[(i, i)].abs().sqrt().max(1.0);
            for j in 0..theta.len() {
                let h = 1e-5;
                let mut beside = |sign: f64| {
                    let mut shifted = theta.clone();
                    shifted[j] += sign * h;
                    let [gradient, _] = descent.gradients(&u, &y, &shifted);
                    gradient
                };
                let (after, before) = (beside(1.0), beside(-1.0));
                for i in j..theta.len() {
                    let expected = (after[i] - before[i]) / (2.0 * h);
                    let error = (hessian[(i, j)] - expected).abs() / (scale(i) * scale(j));
                    assert!(error < 1e-7, "{orders} {of:?} {i} {j}: {} {expected}", hessian[(i, j)]);
                }
            }
        }
    }
}

/// With A and B alone, fitting the effect of the past gives up the first equations: the result is least squares of the
/// complete rows. A record that does not begin at rest is recovered.
#[test]
fn initial_conditions_are_fitted() {
    let orders: Orders = "na=2,nb=3,nk=2".parse().unwrap();
    let (u, y) = record(&model(orders, 7), 7, 0.2);
    let (u, y) = (&u[30..], &y[30..]);
    let run = |estimator: &mut dyn Estimator, u: &[f64], y: &[f64]| {
        let mut passes = [Pass::new(2)];
        estimator.estimate(Window::new(u, y, y.len()), &mut passes);
        let [pass] = passes;
        assert_eq!(pass.failure, None);
        pass
    };
    let estimate = InitialCondition::Estimate;
    let mut method = PredictionError::new(orders, 2, estimate, y.len()).unwrap();
    let fitted = run(&mut method, u, y);
    let arx = crate::estimator::ArxOptions {
        orders: Some(orders),
        ..Default::default()
    };
    let shape = crate::estimator::Shape {
        order: 2,
        window: y.len(),
    };
    let complete = run(&mut *arx.prepare(&shape.into()).unwrap(), u, y);
    for (fitted, complete) in fitted.model.parameters().zip(complete.model.parameters()) {
        assert!((fitted - complete).abs() < 1e-9, "{fitted} {complete}");
    }
    let orders: Orders = "nb=2,nf=2".parse().unwrap();
    let truth = model(orders, 8);
    let (u, y) = record(&truth, 8, 0.0);
    let (u, y) = (&u[30..], &y[30..]);
    let mut method = PredictionError::new(orders, 4, estimate, y.len()).unwrap();
    let pass = run(&mut method, u, y);
    for (found, truth) in pass.model.parameters().zip(truth.parameters()) {
        assert!((found - truth).abs() < 1e-9, "{found} {truth}");
    }
    assert!(pass.x0.iter().any(|x| x.abs() > 0.1));
}

const BESIDE: [Beside; 2] = [
    Beside {
        initial: InitialCondition::Zero,
        offset: OffsetChoice::Estimate,
    },
    Beside {
        initial: InitialCondition::Estimate,
        offset: OffsetChoice::Estimate,
    },
];

/// `offset.py` minimises the same sum over the states of the predictor, the offsets and the parameters.
#[test]
fn offsets_and_starts_of_another_program() {
    let cases: serde_json::Value = serde_json::from_str(include_str!("offset.json")).unwrap();
    let cases = cases.as_array().unwrap();
    assert_eq!(cases.len(), 9);
    for case in cases {
        let file = case["file"].as_str().unwrap();
        let numbers = |of: &serde_json::Value| -> Vec<f64> {
            let list = of.as_array().unwrap().iter();
            list.map(|x| x.as_f64().unwrap()).collect()
        };
        let lengths: Vec<usize> = numbers(&case["lengths"]).iter().map(|n| *n as usize).collect();
        let path = format!("../../tests/recorded_data/data/{file}");
        let all = crate::data::csv::read(std::fs::File::open(path).unwrap()).unwrap();
        let runs = Runs::new(&lengths);
        let (mut u, mut y) = (Vec::new(), Vec::new());
        for (run, added) in runs.iter().zip(case["added"].as_array().unwrap()) {
            let added = numbers(added);
            u.extend(all.u[run.clone()].iter().map(|x| x + added[0]));
            y.extend(all.y[run.clone()].iter().map(|x| x + added[1]));
        }
        let orders: Orders = case["orders"].as_str().unwrap().parse().unwrap();
        let beside = BESIDE[usize::from(case["initial"] == "estimate")];
        let mut method = PredictionError::of_runs(orders, 8, beside, runs).unwrap();
        let mut passes = [Pass::new(2)];
        method.estimate(Window::new(&u, &y, y.len()), &mut passes);
        let [pass] = passes;
        assert_eq!(pass.failure, None, "{file} {orders}");
        let ratio = pass.loss / case["loss"].as_f64().unwrap();
        assert!((ratio - 1.0).abs() < 1e-10, "{file} {orders}: loss {ratio}");
        let offsets = pass.offsets.iter();
        let expected = numbers(&case["theta"]).into_iter().chain(numbers(&case["offsets"]));
        let found = pass.model.parameters().chain(offsets.clone().map(|of| of.value));
        for (i, (found, expected)) in found.zip(expected).enumerate() {
            let error = (found - expected).abs() / expected.abs().max(1.0);
            assert!(error < 1e-8, "{file} {orders} {i}: {found} {expected}");
        }
        let errors = pass.model.standard_errors().unwrap();
        let errors = errors.into_iter().chain(offsets.map(|of| of.se));
        for (i, (found, expected)) in errors.zip(numbers(&case["se"])).enumerate() {
            let ratio = found / expected;
            assert!((ratio - 1.0).abs() < 1e-6, "{file} {orders} {i}: se {ratio}");
        }
    }
}

/// Records cut out of a running plant about an operating point: of 400, the 95 % intervals of each parameter and of the
/// offset cover as often as a binomial count with 0.95 does, within 3.7 standard deviations: 18 intervals at 4e-3 in
/// all.
#[test]
fn intervals_with_offset_and_start_cover() {
    const RECORDS: u64 = 400;
    for (orders, theta) in [
        ("nb=2,nf=2", &[1.0, 0.5, -1.5, 0.7][..]),
        ("na=2,nb=2,nc=1", &[-1.5, 0.7, 1.0, 0.5, 0.4]),
        ("nb=2,nc=1,nd=1,nf=2", &[1.0, 0.5, 0.5, -0.6, -1.5, 0.7]),
    ] {
        let truth = test_setup::plant(orders, theta);
        let (n, before) = (2000, 100);
        let mut covered = vec![0; theta.len() + 1];
        for trial in 0..RECORDS {
            let normal = |purpose| test_setup::normal(29, trial, purpose, n + before);
            let (mut u, e) = (normal(Purpose::Input), normal(Purpose::NoiseDrive));
            for u in &mut u {
                *u += 2.0;
            }
            let (mut y, mut v) = (vec![0.0; u.len()], vec![0.0; u.len()]);
            truth.simulate(&u, &mut y);
            filter(&truth.c, &e, &mut v);
            divide(&truth.d, &mut v);
            divide(&truth.a, &mut v);
            y.iter_mut().zip(&v).for_each(|(y, v)| *y += v - 7.0);
            let mut method = PredictionError::new(truth.orders(), 0, BESIDE[1], n).unwrap();
            let mut passes = [Pass::new(2)];
            method.estimate(Window::new(&u[before..], &y[before..], n), &mut passes);
            let [pass] = passes;
            assert_eq!(pass.failure, None, "{orders} {trial}");
            let offset = pass.offsets[0];
            let errors = pass.model.standard_errors().unwrap();
            let found = pass.model.parameters().chain([offset.value]);
            let errors = errors.into_iter().chain([offset.se]);
            let truth = theta.iter().chain(&[-7.0]);
            for (i, ((found, error), truth)) in found.zip(errors).zip(truth).enumerate() {
                covered[i] += i32::from((found - truth).abs() < 1.959_964 * error);
            }
        }
        let mean = 0.95 * RECORDS as f64;
        let most = 3.7 * (mean * 0.05).sqrt();
        let right = covered.iter().all(|count| (f64::from(*count) - mean).abs() < most);
        assert!(right, "{orders}: {covered:?}");
    }
}

/// An offset of y moves mu alone, and an offset of u moves mu by the static gain: the two cannot be told apart.
#[test]
fn offsets_of_input_and_output_are_one() {
    for orders in ["nb=2,nf=2", "na=2,nb=2,nc=1", "nb=1,nc=1,nd=1,nf=1"] {
        let orders: Orders = orders.parse().unwrap();
        let (u, y) = record(&model(orders, 5), 5, 0.2);
        for beside in BESIDE {
            let of = |of_u: f64, of_y: f64| {
                let u: Vec<f64> = u.iter().map(|u| u + of_u).collect();
                let y: Vec<f64> = y.iter().map(|y| y + of_y).collect();
                let mut method = PredictionError::new(orders, 4, beside, N).unwrap();
                let mut passes = [Pass::new(1)];
                method.estimate(Window::new(&u, &y, N), &mut passes);
                let [pass] = passes;
                assert_eq!(pass.failure, None, "{orders}");
                pass
            };
            let (own, of_y) = (of(0.0, 0.0), of(0.0, 1000.0));
            let mut moved = vec![(of_y, 1000.0)];
            if beside.initial == InitialCondition::Estimate {
                moved.push((of(50.0, 0.0), -50.0 * own.model.static_gain()));
            }
            for (moved, by) in moved {
                let both = own.model.parameters().zip(moved.model.parameters());
                for (own, moved) in both {
                    assert!((own - moved).abs() < 1e-8, "{orders}: {own} {moved}");
                }
                let [own, moved] = [&own, &moved].map(|pass| pass.offsets[0].value);
                assert!((moved - own - by).abs() < 1e-6, "{orders}: {own} {moved} {by}");
            }
        }
    }
}
