//! The Kalman-Bucy filter.

use super::common::{Uniform, a_times, dot, gauss_legendre};
use asobench::observer::gpebo::{Cascade, GpeboOptions, ObserverSpec, Operator, Scenario};
use asobench::signal::{Signal, Wave};

/// Least squares in theta, and the exact steps of the filter with process noise, against an integration of the Riccati
/// equation and of the filter in x.
#[test]
fn kalman_bucy_is_the_riccati_filter() {
    let mut uniform = Uniform(5);
    let (p0, r) = (0.7, 0.2);
    for (n, q) in [(1, 0.0), (2, 0.0), (3, 0.0), (1, 0.5), (2, 0.5), (3, 0.5), (3, 1e-4)] {
        let plant = uniform.plant(n);
        let scenario = Scenario {
            u: Signal::new(vec![Wave::Sine {
                amplitude: 1.0,
                frequency: 1.7,
                phase: 0.3,
            }]),
            delta: Signal::new(vec![Wave::Sine {
                amplitude: 0.2,
                frequency: 4.0,
                phase: 0.0,
            }]),
            x0: uniform.vector(n),
            horizon: 3.0,
            scored_from: 0.0,
            step: 5e-3,
        };
        let filters = (1..n).map(|k| Operator::Lag(k as f64)).collect();
        let options = GpeboOptions {
            xi0: uniform.vector(n),
            filters,
        };
        let least_squares = ObserverSpec::KalmanBucy { p0, r };
        // Q and S of noises that have much in common.
        let intensity = |i: usize, j: usize| if i == j { q } else { 0.3 * q };
        let s = vec![0.4 * (q * r).sqrt(); n];
        let filter = ObserverSpec::Filter {
            p0,
            q: faer::Mat::from_fn(n, n, intensity),
            s: s.clone(),
            r,
            x0: options.xi0.clone(),
        };
        let observers = [if q == 0.0 { least_squares } else { filter }];
        let cascade = Cascade::new(&plant, &scenario, &options, &observers).unwrap();
        // [x; xhat; P by rows]
        let f = |t: f64, y: &[f64]| {
            let (x, rest) = y.split_at(n);
            let (xhat, p) = rest.split_at(n);
            let u = (1.7 * t + 0.3).sin();
            let pc = p.chunks(n).zip(&s).map(|(row, s)| dot(row, plant.c()) + s);
            let pc: Vec<f64> = pc.collect();
            let innovation = (dot(plant.c(), x) + 0.2 * (4.0 * t).sin() - dot(plant.c(), xhat)) / r;
            let mut out: Vec<f64> = a_times(&plant, x)
                .iter()
                .zip(plant.b())
                .map(|(ax, b)| ax + b * u)
                .collect();
            let ax = a_times(&plant, xhat);
            out.extend((0..n).map(|i| ax[i] + plant.b()[i] * u + pc[i] * innovation));
            let ap = |i: usize, j: usize| -> f64 { (0..n).map(|k| plant.a()[(i, k)] * p[k * n + j]).sum() };
            out.extend((0..n * n).map(|k| {
                let (i, j) = (k / n, k % n);
                ap(i, j) + ap(j, i) + intensity(i, j) - pc[i] * pc[j] / r
            }));
            out
        };
        let mut y = [scenario.x0.clone(), options.xi0.clone()].concat();
        y.extend((0..n * n).map(|k| if k / n == k % n { p0 } else { 0.0 }));
        let mut last = 0.0;
        cascade.run(1, |sample| {
            if sample.t > 0.0 {
                gauss_legendre(&f, last, &mut y, sample.t - last);
            }
            last = sample.t;
            for i in 0..n {
                assert!(
                    (sample.estimates[0].x[i] - y[n + i]).abs() < 1e-9,
                    "n {n}, q {q}: {last}"
                );
            }
        });
    }
}
