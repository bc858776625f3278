//! The linear parts.

use super::common::{Uniform, a_times, dot, gauss_legendre};
use asobench::observer::gpebo::{Cascade, GpeboOptions, ObserverSpec, Operator, Scenario};
use asobench::plant::ContinuousPlant;
use asobench::signal::{Hold, Signal, Wave};

const TOOTH: f64 = 0.25;

/// Inputs whose breakpoints are multiples of 1/4 s; the tests' own evaluation is from the middle of the quarter.
fn test_signals() -> (Signal, Signal) {
    use std::f64::consts::PI;
    let samples: Vec<f64> = (0..13).map(|k| f64::from(k * k % 7) - 2.0).collect();
    let u = Signal::new(vec![
        Wave::Sine {
            amplitude: 0.7,
            frequency: 2.3,
            phase: 0.4,
        },
        Wave::Square {
            amplitude: 1.3,
            frequency: 2.0 * PI,
            phase: PI / 2.0,
        },
        Wave::Samples {
            interval: TOOTH,
            values: samples.clone().into(),
            hold: Hold::Linear,
        },
        Wave::Constant { value: -0.2 },
    ]);
    let delta = Signal::new(vec![
        Wave::Ramp { slope: 0.3 },
        Wave::Sine {
            amplitude: 0.2,
            frequency: 5.0,
            phase: -1.0,
        },
        Wave::Sine {
            amplitude: 0.1,
            frequency: 1.0,
            phase: 0.0,
        },
        Wave::Samples {
            interval: 2.0 * TOOTH,
            values: samples.into(),
            hold: Hold::Zero,
        },
    ]);
    (u, delta)
}

fn test_input(t: f64, quarter: usize) -> f64 {
    let sample = |k: usize| (k * k % 7) as f64 - 2.0;
    let s = t / TOOTH - quarter as f64;
    // sin(2 pi t + pi / 2) = cos(2 pi t) changes its sign at 1/4 and 3/4
    let square = if matches!(quarter % 4, 1 | 2) { -1.3 } else { 1.3 };
    0.7 * (2.3 * t + 0.4).sin() + square - 0.2 + sample(quarter) * (1.0 - s) + sample(quarter + 1) * s
}

fn test_disturbance(t: f64, quarter: usize) -> f64 {
    let k = quarter / 2;
    0.3 * t + 0.2 * (5.0 * t - 1.0).sin() + 0.1 * t.sin() + (k * k % 7) as f64 - 2.0
}

/// `[x; xi; xhat; filtered z; Phi by columns; filtered phi by filters]'`.
fn all_linear(plant: &ContinuousPlant, gain: &[f64], poles: &[f64], [u, delta]: [f64; 2], y: &[f64]) -> Vec<f64> {
    let n = plant.order();
    let c = plant.c();
    let (x, xi, xhat) = (&y[..n], &y[n..2 * n], &y[2 * n..3 * n]);
    let z = dot(c, x) + delta - dot(c, xi);
    let innovation = dot(c, x) + delta - dot(c, xhat);
    let mut out = vec![];
    for (v, correction) in [(x, 0.0), (xi, 0.0), (xhat, innovation)] {
        let av = a_times(plant, v);
        out.extend((0..n).map(|i| av[i] + plant.b()[i] * u + gain[i] * correction));
    }
    out.extend(poles.iter().zip(&y[3 * n..]).map(|(a, zf)| a * (z - zf)));
    let phi = &y[4 * n - 1..4 * n - 1 + n * n];
    for column in phi.chunks(n) {
        out.extend(a_times(plant, column));
    }
    for (i, a) in poles.iter().enumerate() {
        for j in 0..n {
            let filtered = y[4 * n - 1 + n * n + i * n + j];
            out.push(a * (dot(c, &phi[j * n..(j + 1) * n]) - filtered));
        }
    }
    out
}

/// The determinant by expansion along the first row.
fn laplace(m: &[f64], n: usize) -> f64 {
    if n == 0 {
        return 1.0;
    }
    let minor = |column: usize| -> Vec<f64> {
        let kept = (n..n * n).filter(|k| k % n != column);
        kept.map(|k| m[k]).collect()
    };
    (0..n)
        .map(|j| (-1.0_f64).powi(j as i32) * m[j] * laplace(&minor(j), n - 1))
        .sum()
}

/// (Delta, mbar) by Cramer's rule from the independent state.
fn mixed(plant: &ContinuousPlant, delta: f64, y: &[f64]) -> (f64, Vec<f64>) {
    let n = plant.order();
    let z = dot(plant.c(), &y[..n]) + delta - dot(plant.c(), &y[n..2 * n]);
    let zbar = [&[z], &y[3 * n..4 * n - 1]].concat();
    let (phi, filtered) = y[4 * n - 1..].split_at(n * n);
    let mut m: Vec<f64> = phi.chunks(n).map(|column| dot(plant.c(), column)).collect();
    m.extend(filtered);
    let replaced = |i: usize| {
        let mut m = m.clone();
        (0..n).for_each(|row| m[row * n + i] = zbar[row]);
        laplace(&m, n)
    };
    (laplace(&m, n), (0..n).map(replaced).collect())
}

/// Plant, xi, filters, Phi, mixing and the full-order observer, for all kinds of waves, n = 1 to 4.
#[test]
fn linear_parts_are_exact() {
    let mut uniform = Uniform(3);
    let (u, delta) = test_signals();
    for n in (1..=4).cycle().take(20) {
        let plant = uniform.plant(n);
        let gain = uniform.vector(n);
        let poles: Vec<f64> = (1..n).map(|k| 0.5 + k as f64).collect();
        let options = GpeboOptions {
            xi0: uniform.vector(n),
            filters: poles.iter().copied().map(Operator::Lag).collect(),
        };
        let x0 = uniform.vector(n);
        let scenario = Scenario {
            u: u.clone(),
            delta: delta.clone(),
            x0,
            horizon: 3.0,
            scored_from: 0.0,
            step: TOOTH / 3.0,
        };
        let xhat0 = uniform.vector(n);
        let observers = [ObserverSpec::Luenberger {
            gain: gain.clone(),
            x0: xhat0.clone(),
        }];
        let cascade = Cascade::new(&plant, &scenario, &options, &observers).unwrap();
        let identity = (0..n * n).map(|k| f64::from(u8::from(k / n == k % n)));
        let mut y = [scenario.x0.clone(), options.xi0.clone(), xhat0, vec![0.0; n - 1]].concat();
        y.extend(identity);
        y.extend(vec![0.0; (n - 1) * n]);
        let (mut step, parts) = (0, 40);
        cascade.run(1, |sample| {
            let mut signal_at_end = test_disturbance(0.0, 0);
            if step > 0 {
                let quarter = (step - 1) / 3;
                let h = TOOTH / 3.0 / f64::from(parts);
                let start = TOOTH / 3.0 * (step - 1) as f64;
                let f = |t: f64, y: &[f64]| {
                    let signals = [test_input(t, quarter), test_disturbance(t, quarter)];
                    all_linear(&plant, &gain, &poles, signals, y)
                };
                for k in 0..parts {
                    gauss_legendre(&f, start + f64::from(k) * h, &mut y, h);
                }
                signal_at_end = test_disturbance(start + TOOTH / 3.0, quarter);
            }
            let scale = y.iter().fold(1.0, |m: f64, v| m.max(v.abs()));
            let close = |a: f64, b: f64, power: i32| {
                assert!(
                    (a - b).abs() <= 1e-10 * scale.powi(power),
                    "n {n} t {}: {a} {b}",
                    sample.t
                );
            };
            for i in 0..n {
                close(sample.x[i], y[i], 1);
                close(sample.estimates[0].x[i], y[2 * n + i], 1);
            }
            let (determinant, mbar) = mixed(&plant, signal_at_end, &y);
            close(sample.delta, determinant, n as i32);
            for i in 0..n {
                close(sample.mbar[i], mbar[i], n as i32);
                let theta = scenario.x0[i] - options.xi0[i];
                close(sample.dbar[i], mbar[i] - determinant * theta, n as i32);
            }
            step += 1;
        });
        assert_eq!(step, 37);
    }
}
