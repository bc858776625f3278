//! Changes of coordinates.

use super::common::{Uniform, proposed};
use asobench::observer::gpebo::{Cascade, Factor, GpeboOptions, ObserverSpec, Operator, Scenario};
use asobench::plant::ContinuousPlant;
use asobench::signal::{Signal, Wave};
use faer::{Mat, mat};

/// The same run in the coordinates T x; Luenberger's gain and both initial values go along.
fn in_coordinates(plant: &ContinuousPlant, t: &Mat<f64>, observers: &[ObserverSpec]) -> Vec<Vec<Vec<f64>>> {
    let n = plant.order();
    let times = |v: &[f64]| -> Vec<f64> { (0..n).map(|i| (0..n).map(|j| t[(i, j)] * v[j]).sum()).collect() };
    let x0: Vec<f64> = (0..n).map(|i| 1.0 + i as f64).collect();
    let scenario = Scenario {
        u: Signal::new(vec![Wave::Constant { value: 1.0 }]),
        delta: Signal::new(vec![Wave::Sine {
            amplitude: 0.2,
            frequency: 1.3,
            phase: 0.1,
        }]),
        x0: times(&x0),
        horizon: 6.0,
        scored_from: 0.0,
        step: 5e-3,
    };
    let filters = (1..n).map(|k| Operator::Lag(k as f64)).collect();
    let options = GpeboOptions {
        xi0: times(&vec![0.3; n]),
        filters,
    };
    let plant = plant.transformed(t.as_ref()).unwrap();
    let cascade = Cascade::new(&plant, &scenario, &options, observers).unwrap();
    let mut errors = vec![vec![]; observers.len()];
    cascade.run(1, |sample| {
        for (errors, estimate) in errors.iter_mut().zip(sample.estimates) {
            errors.push(estimate.x.clone());
        }
    });
    errors
}

/// The largest difference of `T xhat` in the old and `xhat` in the new coordinates, relative to the largest `xhat`.
fn difference(t: &Mat<f64>, old: &[Vec<f64>], new: &[Vec<f64>]) -> f64 {
    let n = t.nrows();
    let (mut largest, mut difference) = (0.0_f64, 0.0_f64);
    for (old, new) in old.iter().zip(new) {
        for i in 0..n {
            let expected: f64 = (0..n).map(|j| t[(i, j)] * old[j]).sum();
            difference = difference.max((expected - new[i]).abs());
            largest = largest.max(new[i].abs());
        }
    }
    difference / largest
}

/// Under x -> T x: theta -> T theta, Delta -> Delta / det T, mbar -> T mbar / det T. With equal gains, the gradient is
/// one vector equation and xhat is invariant for any T if gamma goes to gamma (det T)^2. The Kalman-Bucy filter's prior
/// N(0, p0 I) is invariant under rotations only. The full-order observer is invariant with L -> T L.
#[test]
fn invariance_of_gradient_and_kalman_bucy() {
    let plant = ContinuousPlant::bobtsov2023();
    let (sin, cos) = 0.7_f64.sin_cos();
    let rotation = mat![[cos, sin], [-sin, cos]];
    let shear = mat![[2.0, 0.5], [-1.0, 1.5]];
    let observers = |t: &Mat<f64>, squared_det: f64| {
        let times = |v: [f64; 2]| {
            (0..2)
                .map(|i| t[(i, 0)] * v[0] + t[(i, 1)] * v[1])
                .collect::<Vec<f64>>()
        };
        vec![
            ObserverSpec::Luenberger {
                gain: times([2.0, 3.2]),
                x0: times([0.1, 0.2]),
            },
            ObserverSpec::Gradient {
                gains: vec![0.3 * squared_det; 2],
            },
            ObserverSpec::KalmanBucy { p0: 0.5, r: 0.2 },
        ]
    };
    let identity = Mat::identity(2, 2);
    let original = in_coordinates(&plant, &identity, &observers(&identity, 1.0));
    for (t, squared_det, prior_kept) in [(rotation, 1.0, true), (shear, 12.25, false)] {
        let new = in_coordinates(&plant, &t, &observers(&t, squared_det));
        assert!(difference(&t, &original[0], &new[0]) < 1e-11);
        assert!(difference(&t, &original[1], &new[1]) < 1e-11);
        let kalman = difference(&t, &original[2], &new[2]);
        assert!(if prior_kept { kalman < 1e-11 } else { kalman > 1e-3 }, "{kalman}");
    }
}

/// Eq. (17) is nonlinear in m_i and takes each component by itself, so only what keeps the components apart can leave
/// xhat invariant: even permutations (det T = 1), and, once g is dropped, scalings x_i -> s_i x_i. There with d = det T
/// m_i -> (s_i / d) m_i, phi -> phi / d, so psi_j -> s_i^(3-j) / d^3 psi_j and the determinant of the second mixing
/// goes to s_i^3 / d^9 times itself: gamma_i -> gamma_i d^18 / s_i^6. With g kept, e^(m s / d) is another weight.
#[test]
fn invariance_of_the_proposed() {
    let plant = Uniform(11).plant(3);
    let cycle = mat![[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
    let identity = Mat::identity(3, 3);
    let kept = |gains: [f64; 3]| [proposed(Factor::Keep, gains.to_vec())];
    let old = in_coordinates(&plant, &identity, &kept([1e9, 2e9, 3e9]));
    let new = in_coordinates(&plant, &cycle, &kept([2e9, 3e9, 1e9]));
    assert!(difference(&cycle, &old[0], &new[0]) < 1e-6);

    let plant = ContinuousPlant::bobtsov2023();
    let scaling = mat![[2.0, 0.0], [0.0, 0.25]];
    let identity = Mat::identity(2, 2);
    let gains = [1e11, 1e12];
    let scaled = |g: [f64; 2]| {
        let d18 = 0.5_f64.powi(18);
        vec![g[0] * d18 / 2_f64.powi(6), g[1] * d18 / 0.25_f64.powi(6)]
    };
    for (factor, invariant) in [(Factor::Drop, true), (Factor::Keep, false)] {
        let old = in_coordinates(&plant, &identity, &[proposed(factor, gains.to_vec())]);
        let new = in_coordinates(&plant, &scaling, &[proposed(factor, scaled(gains))]);
        let found = difference(&scaling, &old[0], &new[0]);
        assert!(
            if invariant { found < 1e-9 } else { found > 1e-3 },
            "{factor:?} {found}"
        );
    }
}
