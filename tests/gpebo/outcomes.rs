//! Overflow and refusals.

use asobench::observer::gpebo::{
    Cascade, CascadeError, Factor, GpeboOptions, ObserverSpec, Operator, Outcome, Scenario, halve,
};
use asobench::plant::ContinuousPlant;
use asobench::signal::{Signal, Wave};

/// An observer that overflows is reported and spoils nothing else.
#[test]
fn overflow_is_an_outcome() {
    let plant = ContinuousPlant::bobtsov2023();
    let (scenario, options) = good();
    let scenario = Scenario {
        horizon: 10.0,
        ..scenario
    };
    let observers = [
        ObserverSpec::Luenberger {
            gain: vec![-100.0, 0.0],
            x0: vec![0.0; 2],
        },
        ObserverSpec::Gradient { gains: vec![1.0; 2] },
    ];
    let cascade = Cascade::new(&plant, &scenario, &options, &observers).unwrap();
    let mut visits = 0;
    let summary = cascade.run(1, |_| visits += 1);
    assert_eq!((summary.outcome, visits), (Outcome::Finite, 101));
    assert!(matches!(summary.observers[0].outcome, Outcome::NotFinite(t) if t > 0.5 && t < 3.0));
    assert_eq!(summary.observers[1].outcome, Outcome::Finite);
    assert!(halve(&cascade, |_| {}).observers[0].relative().is_nan());

    let unstable = ContinuousPlant::new(&[vec![100.0]], vec![1.0], vec![1.0]).unwrap();
    let scenario = Scenario {
        x0: vec![1.0],
        ..scenario
    };
    let options = GpeboOptions {
        xi0: vec![0.0],
        filters: vec![],
    };
    let observers = [ObserverSpec::Gradient { gains: vec![1.0] }];
    let cascade = Cascade::new(&unstable, &scenario, &options, &observers).unwrap();
    let summary = cascade.run(1, |_| {});
    assert!(matches!(summary.outcome, Outcome::NotFinite(t) if t > 7.0 && t < 7.3));
    assert_eq!(summary.smallest_eigenvalue, None);
}

/// A scenario and options that are accepted.
fn good() -> (Scenario, GpeboOptions) {
    let scenario = Scenario {
        u: Signal::default(),
        delta: Signal::default(),
        x0: vec![1.0, 2.0],
        horizon: 1.0,
        scored_from: 0.0,
        step: 0.1,
    };
    let options = GpeboOptions {
        xi0: vec![0.0; 2],
        filters: vec![Operator::Lag(1.0)],
    };
    (scenario, options)
}

/// Returns why one observer of the example's plant is refused.
fn refusal(scenario: &Scenario, options: &GpeboOptions, observer: ObserverSpec) -> String {
    let plant = ContinuousPlant::bobtsov2023();
    Cascade::new(&plant, scenario, options, &[observer])
        .unwrap_err()
        .to_string()
}

fn gradient() -> ObserverSpec {
    ObserverSpec::Gradient { gains: vec![1.0; 2] }
}

#[test]
fn refusals() {
    let plant = ContinuousPlant::bobtsov2023();
    let (good, options) = good();
    let step = |step: f64| refusal(&Scenario { step, ..good.clone() }, &options, gradient());
    assert_eq!(step(2.0), "the step of 2 s must not be longer than the horizon of 1 s");
    assert_eq!(step(0.0), "the step: expected positive numbers, not 0");
    assert_eq!(step(f64::NAN), "the step: expected finite numbers");
    assert_eq!(
        step(1e-9),
        "the run would take about 1.0e9 steps; at most 1e7 are allowed"
    );
    let filters = GpeboOptions {
        filters: vec![Operator::Lag(-1.0)],
        ..options.clone()
    };
    assert_eq!(
        refusal(&good, &filters, gradient()),
        "filters in [continuous]: expected positive numbers, not -1"
    );
    assert_eq!(
        refusal(&good, &options, ObserverSpec::Gradient { gains: vec![1.0, 0.0] }),
        "observer 1: the gains: expected positive numbers, not 0"
    );
    let twice = ObserverSpec::Proposed {
        k: 1.0,
        order: 2,
        filters: vec![Operator::Lag(2.0); 2],
        gains: vec![1.0; 2],
        factor: Factor::Keep,
    };
    assert_eq!(
        refusal(&good, &options, twice),
        "observer 1: filters of the observer: expected distinct numbers, but 2 occurs twice"
    );
    let x0 = Scenario {
        x0: vec![1.0],
        ..good.clone()
    };
    assert_eq!(
        Cascade::new(&plant, &x0, &options, &[]).unwrap_err(),
        CascadeError::Setting("the initial state: expected 2 numbers, not 1".into())
    );
    let fast = Wave::Square {
        amplitude: 1.0,
        frequency: 1e300,
        phase: 0.0,
    };
    let fast = Scenario {
        delta: Signal::new(vec![fast]),
        ..good
    };
    let refusal = Cascade::new(&plant, &fast, &options, &[]).unwrap_err().to_string();
    assert!(
        refusal.contains("switches and samples; at most 1e6 are allowed"),
        "{refusal}"
    );
}

#[test]
fn refusals_of_delays() {
    let (good, options) = good();
    let delayed = |delays: Vec<f64>, scenario: &Scenario| {
        let filters = delays.into_iter().map(Operator::Delay).collect();
        let options = GpeboOptions {
            filters,
            ..options.clone()
        };
        refusal(scenario, &options, gradient())
    };
    assert_eq!(
        delayed(vec![0.25], &good),
        "filters in [continuous]: a delay of 0.25 s; expected a whole number of steps of 0.1 s, from 1 to 10000"
    );
    assert_eq!(
        delayed(vec![-0.1], &good),
        "filters in [continuous]: expected positive numbers, not -0.1"
    );
    let unequal = Scenario {
        scored_from: 0.25,
        ..good.clone()
    };
    let found = delayed(vec![0.3], &unequal);
    let start = "filters in [continuous]: a delay of 0.3 s among steps of 0.08333";
    assert!(found.starts_with(start), "{found}");
    let second = ObserverSpec::Proposed {
        k: 1.0,
        order: 2,
        filters: vec![Operator::Delay(0.1), Operator::Delay(0.05)],
        gains: vec![1.0; 2],
        factor: Factor::Keep,
    };
    assert_eq!(
        refusal(&good, &options, second),
        "observer 1: filters of the observer: a delay of 0.05 s; expected a whole number of steps of 0.1 s, from 1 \
        to 10000"
    );
}
