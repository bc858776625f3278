//! A sample of each recursion and of each adaptive observer, orders 2, 4 and 6, beside the papers' own algorithm made
//! anew from all samples so far, N = 98, 998, 5000, which is what one more sample costs without a recursion.
//!
//! Recursions run round a record of 5000 samples; criterion's time is that of one sample.

use asobench::adaptive::{
    AdaptiveObserver, FedObserver, JointEkf, JointEkfSettings, Kreisselmeier, KreisselmeierSettings, StateFilters,
    Zhang, ZhangSettings,
};
use asobench::estimator::recursive::{
    ExtendedLeastSquares, RecursiveEstimator, RecursiveForm, RecursiveInstruments, RecursiveIv, RecursiveLeastSquares,
    RecursivePrediction, RecursiveSettings, RecursiveSriv,
};
use asobench::estimator::{IvOptions, Method, Pass, Shape, Window};
use asobench::model::Orders;
use asobench::plant::StateSpace;
use asobench::signal::{Input, InputLaw, Purpose, Sequence, stream};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::hint::black_box;

const SAMPLES: usize = 5000;

/// A stable plant: the first n of seven poles, as those of `benches/methods.rs`.
fn plant(n: usize) -> StateSpace {
    let mut f = vec![1.0];
    for pole in &[0.8, -0.7, 0.5, -0.4, 0.2, -0.2][..n] {
        let with = |k: usize| f.get(k).copied().unwrap_or(0.0);
        f = (0..=f.len())
            .map(|k| with(k) - if k > 0 { pole * with(k - 1) } else { 0.0 })
            .collect();
    }
    let a: Vec<f64> = f[1..].iter().rev().map(|f| -f).collect();
    let b = (0..n).map(|i| 1.0 / (1.0 + i as f64)).collect();
    StateSpace::new(a, b).expect("a plant")
}

fn record(plant: &StateSpace) -> (Vec<f64>, Vec<f64>) {
    let n = plant.order();
    let draw = |purpose| {
        let mut signal = vec![0.0; SAMPLES];
        let input = Input::new(InputLaw::Gaussian, 1.0, Sequence::Independent);
        input.fill(&mut stream(61, n as u64, purpose), &mut signal);
        signal
    };
    let (u, e) = (draw(Purpose::Input), draw(Purpose::Plant));
    let (mut y, mut states) = (vec![0.0; SAMPLES], vec![0.0; n * SAMPLES]);
    plant.simulate(&mut vec![0.0; n], &u, &mut y, &mut states);
    y.iter_mut().zip(&e).for_each(|(y, e)| *y += 0.2 * e);
    (u, y)
}

fn recursions(n: usize) -> Vec<(&'static str, Box<dyn RecursiveEstimator>)> {
    let arx = || RecursiveSettings {
        p0: Some(1e4),
        ..RecursiveSettings::new(Orders::arx(n, n, 1))
    };
    let output_error = || {
        RecursiveSettings::new(Orders {
            nb: n,
            nf: n,
            nk: 1,
            ..Orders::default()
        })
    };
    let armax = RecursiveSettings::new(Orders {
        nc: 1,
        ..Orders::arx(n, n, 1)
    });
    let iv = |instruments| Box::new(RecursiveIv::new(arx(), instruments));
    let rls = |form| Box::new(RecursiveLeastSquares::new(arx(), form));
    vec![
        ("rls", rls(RecursiveForm::SquareRoot)),
        ("rls-covariance", rls(RecursiveForm::Covariance)),
        ("recursive-iv-delayed", iv(RecursiveInstruments::Delayed)),
        ("recursive-iv-auxiliary", iv(RecursiveInstruments::Auxiliary)),
        ("rels", Box::new(ExtendedLeastSquares::new(armax))),
        ("recursive-sriv", Box::new(RecursiveSriv::new(output_error()))),
        ("rpem", Box::new(RecursivePrediction::new(output_error()))),
    ]
}

fn observers(plant: &StateSpace) -> Vec<(&'static str, Box<dyn AdaptiveObserver>)> {
    let n = plant.order();
    let settings = RecursiveSettings::new(Orders::arx(n, n, 1));
    let rls = RecursiveLeastSquares::new(settings, RecursiveForm::SquareRoot);
    vec![
        (
            "fed-by-rls",
            Box::new(FedObserver::new(rls, StateFilters::new(&vec![0.0; n]))),
        ),
        (
            "kreisselmeier",
            Box::new(Kreisselmeier::new(KreisselmeierSettings {
                filter: vec![0.0; n],
                memory: 0.98,
                gain: 1.0,
            })),
        ),
        (
            "zhang",
            Box::new(Zhang::new(ZhangSettings {
                gain: vec![0.0; n],
                forgetting: 0.99,
                p0: 1e4,
            })),
        ),
        (
            "joint-ekf",
            Box::new(JointEkf::new(JointEkfSettings {
                x0: vec![0.0; n],
                a0: plant.a().to_vec(),
                b0: plant.b().to_vec(),
                state_variance: 1.0,
                parameter_variance: 0.01,
                noise: 0.04,
                state_noise: 0.0,
                parameter_noise: 0.0,
            })),
        ),
    ]
}

fn recursive(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("recursive");
    for n in [2, 4, 6] {
        let plant = plant(n);
        let (u, y) = record(&plant);
        for (name, mut recursion) in recursions(n) {
            let mut samples = u.iter().zip(&y).cycle();
            group.bench_function(BenchmarkId::new(name, format!("n={n}")), |b| {
                b.iter(|| {
                    let (u, y) = samples.next().expect("a cycle");
                    black_box(recursion.update(*u, *y)).expect("no divergence");
                });
            });
        }
        for (name, mut observer) in observers(&plant) {
            let mut samples = u.iter().zip(&y).cycle();
            group.bench_function(BenchmarkId::new(name, format!("n={n}")), |b| {
                b.iter(|| {
                    let (u, y) = samples.next().expect("a cycle");
                    black_box(observer.update(*u, *y)).expect("no divergence");
                });
            });
        }
        let method = Method::instrumental_variables(IvOptions::default());
        for window in [98, 998, 5000] {
            let shape = Shape { order: n, window };
            let mut estimator = method.prepare(shape).expect("a shape");
            let mut passes = vec![Pass::new(n); method.passes()];
            group.bench_function(BenchmarkId::new("iv-again", format!("n={n},N={window}")), |b| {
                b.iter(|| {
                    estimator.estimate(Window::new(&u, &y, window), &mut passes);
                    black_box(passes.len())
                });
            });
        }
    }
}

criterion_group!(benches, recursive);
criterion_main!(benches);
