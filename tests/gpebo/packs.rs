//! Trials in lock step: their bits are those that they have alone, whoever is beside them.

use super::common::Uniform;
use asobench::lanes::{Call, Isa};
use asobench::observer::gpebo::{
    Cascade, Factor, GpeboOptions, Halving, ObserverSpec, Operator, Propagators, Scenario, halve, halve_pack,
};
use asobench::plant::ContinuousPlant;
use asobench::real::Real;
use asobench::signal::{Signal, Wave};
use std::f64::consts::TAU;

/// Every kind of observer.
fn observers(n: usize) -> Vec<ObserverSpec> {
    let filters = |order: usize| [2.0, 6.0][..order].iter().map(|a| Operator::Lag(*a));
    let proposed = |order, factor, gain: f64| ObserverSpec::Proposed {
        k: 1.0,
        order,
        filters: filters(order).collect(),
        gains: (0..n).map(|i| gain * 100_f64.powi(i as i32)).collect(),
        factor,
    };
    vec![
        ObserverSpec::Luenberger {
            gain: vec![0.3; n],
            x0: vec![0.0; n],
        },
        ObserverSpec::Gradient { gains: vec![1.0; n] },
        ObserverSpec::FiniteTime {
            gains: (1..=n).map(|i| i as f64).collect(),
            share: 0.1,
        },
        ObserverSpec::LsDrem {
            gains: vec![1.0; n],
            p0: 4.0,
            r: 0.01,
        },
        ObserverSpec::KalmanBucy { p0: 4.0, r: 0.01 },
        ObserverSpec::Filter {
            p0: 1.0,
            q: faer::Mat::from_fn(n, n, |i, j| if i == j { 0.1 } else { 0.02 }),
            s: vec![0.01; n],
            r: 0.02,
            x0: vec![0.0; n],
        },
        proposed(2, Factor::Keep, 1e11),
        proposed(1, Factor::Drop, 1e6),
        // Too much for a number in some of the trials.
        proposed(2, Factor::Keep, 1e300),
    ]
}

/// A trial whose square has switches at times of its own, and whose sine has a phase of its own.
fn trial(n: usize, uniform: &mut Uniform, amplitude: f64) -> Cascade {
    let mut a = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..n {
            a[i][j] = 0.2 * ((3 * i + 5 * j) % 7) as f64 - 0.5;
        }
    }
    let plant = ContinuousPlant::new(&a, vec![1.0; n], (1..=n).map(|i| i as f64).collect());
    let mut phase = || TAU * uniform.next();
    let (first, second) = (phase(), phase());
    let scenario = Scenario {
        u: Signal::new(vec![Wave::Constant { value: 1.0 }]),
        delta: Signal::new(vec![
            Wave::Square {
                amplitude,
                frequency: 2.0,
                phase: first,
            },
            Wave::Sine {
                amplitude: 0.2,
                frequency: 3.0,
                phase: second,
            },
        ]),
        x0: vec![1.0; n],
        horizon: 6.0,
        scored_from: 2.5,
        step: 0.05,
    };
    let options = GpeboOptions {
        xi0: vec![0.0; n],
        filters: (1..n).map(|i| Operator::Lag(i as f64)).collect(),
    };
    Cascade::new(&plant.unwrap(), &scenario, &options, &observers(n)).unwrap()
}

/// All numbers, with their signs; of a NaN, that it is one.
fn bits(halving: &Halving) -> String {
    format!("{halving:?}")
}

struct Pack<'a>(&'a [Cascade]);

impl Call for Pack<'_> {
    type Output = Vec<Halving>;

    fn with<R: Real, const N: usize>(self) -> Vec<Halving> {
        halve_pack::<R>(self.0, &mut Propagators::default())
    }
}

#[test]
fn no_trial_depends_on_those_beside_it() {
    for n in [1, 2, 3, 4, 5] {
        let mut uniform = Uniform(n as u64);
        // One of them is beyond all numbers soon.
        let amplitudes = [0.3, 0.1, 1e160, 0.5, 0.3, 0.0, 0.2, 0.7, 0.4, 30.0, 0.3];
        let trials = amplitudes.map(|amplitude| trial(n, &mut uniform, amplitude));
        let alone: Vec<String> = trials.iter().map(|c| bits(&halve(c, |_| {}))).collect();
        for isa in [Isa::Portable, Isa::Avx2, Isa::Avx512] {
            if !isa.is_here() {
                continue;
            }
            for turn in 0..3 {
                let order: Vec<usize> = (0..11).map(|i| (i * (2 * turn + 1) + turn) % 11).collect();
                let shuffled: Vec<Cascade> = order.iter().map(|i| trials[*i].clone()).collect();
                let found = isa.dispatch(n, Pack(&shuffled));
                for (found, i) in found.iter().zip(&order) {
                    assert_eq!(bits(found), alone[*i], "{isa}, order {n}, trial {i}");
                }
            }
        }
    }
}
