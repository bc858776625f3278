//! Delays among the operators of both mixings. The paper's plant and disturbance have closed forms, also delayed; the
//! reference values are by a Runge-Kutta method of order 4 on these, whose steps are a tenth of 0.005 s and end at
//! every kink. In it a delayed filter is a filter of delayed signals.

use super::common::example_of;
use asobench::observer::gpebo::{Cascade, Factor, GpeboOptions, ObserverSpec, Operator, Scenario, halve};
use asobench::plant::ContinuousPlant;
use asobench::signal::{Signal, Wave};

fn proposed(filters: [Operator; 2], gains: [f64; 2]) -> ObserverSpec {
    ObserverSpec::Proposed {
        k: 1.0,
        order: 2,
        filters: filters.to_vec(),
        gains: gains.to_vec(),
        factor: Factor::Keep,
    }
}

/// The largest difference of theta_hat from reference values at 2, 5 and 20 s.
fn distance(cascade: &Cascade, reference: [[f64; 2]; 3]) -> f64 {
    let mut most = 0.0_f64;
    cascade.run(1, |sample| {
        for (t, theta) in [2.0, 5.0, 20.0].into_iter().zip(reference) {
            if (sample.t - t).abs() < 1e-9 {
                for (found, theta) in sample.estimates[0].theta.iter().zip(theta) {
                    most = most.max((found - theta).abs());
                }
            }
        }
    });
    most
}

/// Delays in the first mixing, in the second, and in both: the order of the integration is at least 2.
#[test]
fn delayed_estimates_agree_with_another_integration() {
    use Operator::{Delay, Lag};
    let gradient = ObserverSpec::Gradient { gains: vec![1.0; 2] };
    let cases = [
        (
            Delay(0.5),
            gradient,
            [
                [1.03399763, 1.78809809],
                [1.00500356, 1.76238244],
                [0.93915259, 2.04914516],
            ],
        ),
        (
            Delay(0.5),
            proposed([Lag(2.0), Lag(6.0)], [1e10, 1e17]),
            [
                [0.56507154, 0.79344553],
                [0.56830952, 0.79346109],
                [0.56830952, 0.79346109],
            ],
        ),
        (
            Lag(1.0),
            proposed([Lag(2.0), Delay(0.25)], [1e11, 1e13]),
            [
                [0.92333351, 1.93801825],
                [1.00748487, 1.91822554],
                [1.00682796, 1.91825878],
            ],
        ),
        (
            Delay(0.5),
            proposed([Delay(0.25), Delay(0.5)], [1e9, 1e16]),
            [
                [0.96643588, 1.12405977],
                [0.96645094, 1.12405977],
                [0.96645094, 1.12405977],
            ],
        ),
    ];
    for (first, observer, reference) in cases {
        let [coarse, fine] = [0.005, 0.0025].map(|step| {
            let cascade = example_of([0.3, 1.0], first, step, std::slice::from_ref(&observer));
            distance(&cascade, reference)
        });
        let what = format!("{first:?} {observer:?}: {coarse:e} {fine:e}");
        // The reference has an error of 5e-9.
        assert!(coarse < 1e-5 && fine < coarse / 3.7, "{what}");
        let order = halve(&example_of([0.3, 1.0], first, 0.005, &[observer]), |_| {}).observers[0].theta;
        assert!(order.order.unwrap() > 1.9, "{what} {order:?}");
    }
}

/// Delta and mbar are those of the delayed signals, exactly, also where the disturbance jumps: no delayed row before
/// the delay is over.
#[test]
fn the_first_mixing_is_exact() {
    let jumps = Signal::new(vec![Wave::Samples {
        interval: 0.4,
        values: vec![0.3, -0.2, 0.5, 0.1].into(),
        hold: asobench::signal::Hold::Zero,
    }]);
    let scenario = Scenario {
        u: Signal::default(),
        delta: jumps,
        x0: vec![1.0, 2.0],
        horizon: 1.6,
        scored_from: 0.0,
        step: 0.1,
    };
    let options = GpeboOptions {
        xi0: vec![0.0; 2],
        filters: vec![Operator::Delay(0.3)],
    };
    let plant = ContinuousPlant::bobtsov2023();
    let cascade = Cascade::new(&plant, &scenario, &options, &[]).unwrap();
    let phi = |t: f64| [5.0 * (3.0 * t).cos(), 5.0 / 3.0 * (3.0 * t).sin()];
    // Values from the left: a sample is the end of the step before it.
    let delta = |t: f64| [0.3, -0.2, 0.5, 0.1][(((t - 1e-9) / 0.4).floor() as usize).min(3)];
    let z = |t: f64| phi(t)[0] + 2.0 * phi(t)[1] + delta(t);
    let mut seen = 0;
    cascade.run(2, |sample| {
        let t = sample.t;
        let (row, zbar) = if t < 0.3 + 1e-9 {
            ([0.0; 2], 0.0)
        } else {
            (phi(t - 0.3), z(t - 0.3))
        };
        seen += 1;
        let phi = phi(t);
        let expected = [
            phi[0] * row[1] - phi[1] * row[0],
            row[1] * z(t) - phi[1] * zbar,
            phi[0] * zbar - row[0] * z(t),
        ];
        let found = [sample.delta, sample.mbar[0], sample.mbar[1]];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-11, "{t}: {found} {expected}");
        }
    });
    assert_eq!(seen, 17);
}
