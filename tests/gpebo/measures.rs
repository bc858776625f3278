//! The measures of one trial against closed forms: mean squares and times, and what step halving
//! says of them.

use asobench::observer::gpebo::{BAND, Cascade, GpeboOptions, Halving, ObserverSpec, Operator, Scenario, halve};
use asobench::plant::ContinuousPlant;
use asobench::signal::{Signal, Wave};

const AMPLITUDE: f64 = 0.3;
const FREQUENCY: f64 = 1.7;
const THETA: f64 = 2.0;
const HORIZON: f64 = 8.0;
/// No multiple of any step.
const FROM: f64 = 1.23;

/// x' = 0, y = x + 0.3 sin(1.7 t), x(0) = 2, xi = 0: phi = 1, theta = 2, and what is estimated is
/// one number.
fn integrator(observer: ObserverSpec, step: f64) -> Halving {
    let plant = ContinuousPlant::new(&[vec![0.0]], vec![1.0], vec![1.0]).unwrap();
    let scenario = Scenario {
        u: Signal::default(),
        delta: Signal::new(vec![Wave::Sine {
            amplitude: AMPLITUDE,
            frequency: FREQUENCY,
            phase: 0.0,
        }]),
        x0: vec![THETA],
        horizon: HORIZON,
        scored_from: FROM,
        step,
    };
    let options = GpeboOptions {
        xi0: vec![0.0],
        filters: vec![],
    };
    halve(&Cascade::new(&plant, &scenario, &options, &[observer]).unwrap(), |_| {})
}

/// The error of the estimate of `e' = -rate (e - delta)`, e(0) = -2: the gradient with that gain,
/// the full-order observer with L = rate.
fn filtered(rate: f64, t: f64) -> f64 {
    let (w, size) = (FREQUENCY, rate * rate + FREQUENCY * FREQUENCY);
    let steady = |t: f64| AMPLITUDE * rate / size * (rate * (w * t).sin() - w * (w * t).cos());
    steady(t) + (-THETA - steady(0.0)) * (-rate * t).exp()
}

/// The same of least squares with the prior's weight r / p0: `theta_hat = int z / (r / p0 + t)`.
fn averaged(weight: f64, t: f64) -> f64 {
    let disturbance = AMPLITUDE * (1.0 - (FREQUENCY * t).cos()) / FREQUENCY;
    (THETA * t + disturbance) / (weight + t) - THETA
}

/// The root mean square over the scored time by Simpson's rule with 1e5 parts.
fn rms(error: &impl Fn(f64) -> f64) -> f64 {
    let h = (HORIZON - FROM) / 1e5;
    let square = |k: f64| error(FROM + k * h).powi(2);
    let parts = (0..100_000).map(f64::from);
    let sum: f64 = parts.map(|k| square(k) + 4.0 * square(k + 0.5) + square(k + 1.0)).sum();
    (sum * h / 6.0 / (HORIZON - FROM)).sqrt()
}

/// When the error is below a tenth of theta: the entries, by bisection in steps of 1e-4, and the
/// speed there.
fn entries(error: &impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let over = |t: f64| error(t).abs() - BAND * THETA;
    let entry = |k: u32| {
        let (mut outside, mut inside) = (f64::from(k) * 1e-4, f64::from(k + 1) * 1e-4);
        if over(outside) < 0.0 || over(inside) >= 0.0 {
            return None;
        }
        for _ in 0..60 {
            let middle = 0.5 * (outside + inside);
            if over(middle) < 0.0 {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        let speed = (over(inside + 1e-6) - over(inside - 1e-6)) / 2e-6;
        Some((inside, speed.abs()))
    };
    (0..80_000).filter_map(entry).collect()
}

/// An observer, its error over time, and whether it estimates theta.
type Exact = (ObserverSpec, Box<dyn Fn(f64) -> f64>, bool);

/// Observers of this plant with the closed forms of their errors.
fn observers() -> Vec<Exact> {
    let gradient = |gain: f64| ObserverSpec::Gradient { gains: vec![gain] };
    let full_order = ObserverSpec::Luenberger {
        gain: vec![3.0],
        x0: vec![0.0],
    };
    let recursive = ObserverSpec::KalmanBucy { p0: 4.0, r: 0.5 };
    let finite = ObserverSpec::FiniteTime {
        gains: vec![0.8],
        share: 0.3,
    };
    // Delta = 1, so that the share learnt is 1 - e^(-0.8 t): above 0.3 long before the score begins.
    let corrected = |t: f64| (THETA + filtered(0.8, t)) / (1.0 - (-0.8 * t).exp()).max(0.3) - THETA;
    vec![
        (finite, Box::new(corrected), true),
        (full_order, Box::new(|t| filtered(3.0, t)), false),
        (gradient(0.8), Box::new(|t| filtered(0.8, t)), true),
        (gradient(3.0), Box::new(|t| filtered(3.0, t)), true),
        (recursive, Box::new(|t| averaged(0.125, t)), true),
    ]
}

/// The mean squares are off by no more than twice what the step error says of them, and that is not
/// much.
#[test]
fn the_step_error_covers_the_mean_squares() {
    for step in [0.1, 0.05, 0.025] {
        for (observer, error, estimates) in observers() {
            let found = integrator(observer.clone(), step);
            let accuracy = &found.summary.observers[0].accuracy;
            let says = found.observers[0].relative();
            let exact = rms(&error);
            let off = (accuracy.rms_state / exact - 1.0).abs();
            let steps = found.summary.steps as f64;
            let rounding = 2.0 * f64::EPSILON * steps * THETA / exact;
            assert!(off <= 2.0 * says + rounding, "{observer:?} {step}: {off:e} {says:e}");
            assert!(says < 2e-2 * step * step, "{observer:?} {step}: {says:e}");
            if estimates {
                // e_theta = |x - xhat| / 2 here.
                let theta = accuracy.rms_theta * THETA / accuracy.rms_state;
                assert!((theta - 1.0).abs() < 1e-12);
                let end = error(HORIZON).abs() / THETA;
                assert!((accuracy.theta - end).abs() <= 2.0 * says, "{observer:?} {step}");
            }
        }
    }
}

/// Entries into the 10 % band, first and last, as exactly as theta itself: its error over its
/// speed, and what a polynomial of degree four leaves.
#[test]
fn times_are_as_exact_as_the_estimate() {
    let mut different = 0;
    for step in [0.1, 0.05] {
        for (observer, error, _) in observers().into_iter().filter(|observer| observer.2) {
            let exact = entries(&error);
            let outside = error(HORIZON).abs() >= BAND * THETA;
            let found = integrator(observer.clone(), step);
            let accuracy = &found.summary.observers[0].accuracy;
            let theta = found.observers[0].theta;
            let close = |found: f64, (exact, speed): (f64, f64)| {
                let tolerance = 3.0 * theta.error / speed + step.powi(5);
                let off = (found - exact).abs();
                assert!(off <= tolerance, "{observer:?} {step}: {off:e} {tolerance:e}");
                assert!(tolerance < step / 50.0, "{tolerance:e}");
            };
            close(accuracy.reached.unwrap(), exact[0]);
            assert_eq!(accuracy.settled.is_none(), outside, "{observer:?}");
            if let Some(settled) = accuracy.settled {
                close(settled, exact[exact.len() - 1]);
                different += usize::from(exact.len() > 1);
            }
        }
    }
    assert!(different > 0, "the last entry is not always the first");
}

/// Of A = diag(-1, -2, -3) and L = 0 the error of x_i is `x_i(0) e^(-i t)`, so its mean square from 0 to T is
/// `x_i(0)^2 (1 - e^(-2 i T)) / (2 i T)`.
#[test]
fn every_state_has_its_root_mean_square() {
    let rows: Vec<Vec<f64>> = (1..=3)
        .map(|i| (1..=3).map(|j| if i == j { -f64::from(i) } else { 0.0 }).collect())
        .collect();
    let plant = ContinuousPlant::new(&rows, vec![1.0; 3], vec![1.0; 3]).unwrap();
    let x0 = [1.0, -2.0, 5.0];
    let scenario = Scenario {
        u: Signal::default(),
        delta: Signal::default(),
        x0: x0.to_vec(),
        horizon: HORIZON,
        scored_from: 0.0,
        step: 0.01,
    };
    let options = GpeboOptions {
        xi0: vec![0.0; 3],
        filters: vec![Operator::Lag(1.0), Operator::Lag(2.0)],
    };
    let observer = ObserverSpec::Luenberger {
        gain: vec![0.0; 3],
        x0: vec![0.0; 3],
    };
    let cascade = Cascade::new(&plant, &scenario, &options, &[observer]).unwrap();
    let found = halve(&cascade, |_| {}).summary;
    let accuracy = &found.observers[0].accuracy;
    assert_eq!(accuracy.rms_states.len(), 3);
    let mut all = 0.0;
    for (i, (x0, rms)) in x0.iter().zip(&accuracy.rms_states).enumerate() {
        let rate = 2.0 * (i + 1) as f64;
        let exact = x0 * x0 * (1.0 - (-rate * HORIZON).exp()) / (rate * HORIZON);
        assert!((rms * rms / exact - 1.0).abs() < 1e-9, "x_{}: {rms}", i + 1);
        all += exact;
    }
    assert!((accuracy.rms_state.powi(2) / all - 1.0).abs() < 1e-9);
    assert!(accuracy.rms_theta.is_nan());
}

/// Without a disturbance the finite-time estimate is theta once the share is learnt, and the gradient's over the share
/// before.
#[test]
fn the_finite_time_estimate_is_exact_without_a_disturbance() {
    let plant = ContinuousPlant::new(&[vec![0.0]], vec![1.0], vec![1.0]).unwrap();
    let scenario = Scenario {
        u: Signal::default(),
        delta: Signal::default(),
        x0: vec![THETA],
        horizon: HORIZON,
        scored_from: FROM,
        step: 0.05,
    };
    let options = GpeboOptions {
        xi0: vec![0.0],
        filters: vec![],
    };
    let observer = ObserverSpec::FiniteTime {
        gains: vec![0.5],
        share: 0.6,
    };
    let cascade = Cascade::new(&plant, &scenario, &options, &[observer]).unwrap();
    let (mut before, mut after) = (0, 0);
    cascade.run(1, |sample| {
        let learnt = 1.0 - (-0.5 * sample.t).exp();
        let found = sample.estimates[0].theta[0];
        let exact = if learnt >= 0.6 {
            after += 1;
            THETA
        } else {
            before += 1;
            THETA * learnt / 0.6
        };
        assert!((found - exact).abs() < 1e-12, "{} {found}", sample.t);
    });
    assert!(before > 10 && after > 10);
}
