//! All discrete observers on records in other units of u and y: powers of two and of ten from 1e-9 to 1e9.

use super::records;
use asobench::estimator::{EstimatorName, Method, Pass, Shape, Window};
use asobench::observer::{
    DiscreteGpebo, Gain, GainSequence, Kalman, MeasurementNoise, ObservedModel, Observer, ProcessNoise,
    StochasticModel, ThetaEstimator, maximum_likelihood_ratio,
};
use faer::Mat;
use serde_json::Map;

const A: [f64; 2] = [-0.7, 1.5];
const C: [f64; 2] = [1.0, 0.4];
const D: [f64; 2] = [1.0, -0.6];

/// Every observer with the numbers of a user in the units of u and y: its estimates, `x(k)` by `x(k)`.
fn estimates([u, y]: [&[f64]; 2], [of_u, of_y]: [f64; 2]) -> Vec<(String, Vec<f64>)> {
    let b = [1.0, 2.0].map(|b| b * of_y / of_u);
    let x0 = [1.0, -2.0].map(|x| x * of_y);
    let model = ObservedModel { a: &A, b: &b, x0: &x0 };
    let mut all = vec![];
    for text in ["dead-beat", "scaled:0.5", "poles:0.3+0.2i,0.3-0.2i"] {
        let mut found = vec![];
        let gain: Gain = text.parse().unwrap();
        let run = Observer::new(gain, 2).run(model, u, y, |_, x| found.extend_from_slice(x));
        run.unwrap();
        all.push((text.to_owned(), found));
    }
    for by in [ThetaEstimator::Drem(2.0), ThetaEstimator::Squares(0.1)] {
        let mut found = vec![];
        let run = DiscreteGpebo::new(by, 2).run(model, u, y, |_, x| found.extend_from_slice(x));
        run.unwrap();
        all.push((format!("{by:?}"), found));
    }
    let white = MeasurementNoise::white(0.5 * of_y);
    let coloured = MeasurementNoise {
        numerator: &C,
        denominator: &D,
        ..white
    };
    let square = of_y * of_y;
    let identity = |by: f64| Mat::from_fn(2, 2, |i, j| if i == j { by * square } else { 0.0 });
    let q = identity(0.09);
    for (colour, noise) in [("white", white), ("coloured", coloured)] {
        let stochastic = StochasticModel::new(&A, &b, q.as_ref(), noise).unwrap();
        let p0 = stochastic.initial_covariance(identity(4.0).as_ref());
        let varying = Kalman::time_varying(&stochastic, p0.unwrap().as_ref(), u.len());
        let steady = Kalman::steady(&stochastic);
        for (gains, filter) in [("steady", steady), ("varying", varying)] {
            let mut found = vec![];
            let run = filter.unwrap().run(u, y, &x0, |_, x| found.extend_from_slice(x));
            run.unwrap();
            all.push((format!("{colour} {gains}"), found));
        }
        let own = MeasurementNoise {
            deviation: 1.0,
            ..noise
        };
        let ratio = maximum_likelihood_ratio(model, u, y, ProcessNoise::States, own, None);
        all.push((format!("{colour} ratio"), vec![ratio.unwrap().rho * of_y]));
    }
    // r = 0: the deviation of the model does not matter.
    let exact = StochasticModel::new(&A, &b, q.as_ref(), white).unwrap();
    let p0 = identity(4.0);
    let gains = GainSequence::without_measurement_noise(&exact, p0.as_ref(), Some(u.len()));
    let mut found = vec![];
    let mut filter = Kalman::new(&exact, gains.unwrap().into());
    filter.run(u, y, &x0, |_, x| found.extend_from_slice(x)).unwrap();
    all.push(("exact output".to_owned(), found));
    all
}

/// a, and b in the units of the first record, of an adaptive observer at the end of a record.
fn adapted(name: &str, [u, y]: [&[f64]; 2], [of_u, of_y]: [f64; 2]) -> Vec<f64> {
    let name: EstimatorName = name.parse().unwrap();
    let method = Method::named("method", name.parse(Map::new()).unwrap());
    let window = y.len();
    let mut estimator = method.prepare(Shape { order: 2, window }).unwrap();
    let mut passes = vec![Pass::new(2)];
    estimator.estimate(Window::new(u, y, window), &mut passes);
    assert_eq!(passes[0].failure, None, "{name}");
    let model = &passes[0].model;
    let b = model.b.iter().map(|b| b * of_u / of_y);
    model.a.iter().copied().chain(b).collect()
}

fn factors() -> Vec<[f64; 2]> {
    let all = [-30, -9, 9, 30].map(|e| 2_f64.powi(e));
    let all = all.into_iter().chain([1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9]);
    all.flat_map(|by| [[by, 1.0], [1.0, by], [by, by], [1.0 / by, by]])
        .collect()
}

fn assert_same(what: &str, found: &[f64], expected: &[f64], unit: f64) {
    assert_eq!(found.len(), expected.len());
    let size = expected.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    for (found, expected) in found.iter().zip(expected) {
        let off = (found / unit - expected).abs();
        assert!(off <= 1e-9 * size, "{what}: {found:e} / {unit:e} for {expected:e}");
    }
}

#[test]
fn other_units_change_nothing_but_the_units() {
    let record = records(0.3, 2.0, 1).remove(0);
    let plain = estimates([&record.u, &record.y], [1.0, 1.0]);
    assert_eq!(plain.len(), 12);
    for [of_u, of_y] in factors() {
        let u: Vec<f64> = record.u.iter().map(|u| u * of_u).collect();
        let y: Vec<f64> = record.y.iter().map(|y| y * of_y).collect();
        let found = estimates([&u, &y], [of_u, of_y]);
        for ((what, found), (_, expected)) in found.iter().zip(&plain) {
            assert_same(&format!("{what} {of_u:e} {of_y:e}"), found, expected, of_y);
        }
    }
}

/// The tuning of adaptive observers goes with the record, also where u and y are zero until a step comes.
#[test]
fn adaptive_observers_take_the_units_of_the_record() {
    let record = records(0.0, 0.0, 1).remove(0);
    for zeros in [0, 1, 40] {
        let late = |signal: &[f64], by: f64| -> Vec<f64> {
            let zeros = std::iter::repeat_n(0.0, zeros);
            zeros.chain(signal.iter().map(|x| x * by)).collect()
        };
        for name in ["kreisselmeier", "zhang", "joint-ekf"] {
            let of = |by: [f64; 2]| {
                let (u, y) = (late(&record.u, by[0]), late(&record.y, by[1]));
                adapted(name, [&u, &y], by)
            };
            let plain = of([1.0, 1.0]);
            for by in factors() {
                assert_same(&format!("{name} {zeros} {by:?}"), &of(by), &plain, 1.0);
            }
        }
    }
}
