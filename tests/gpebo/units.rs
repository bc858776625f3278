//! All observers in other units of states, time, u and y: powers of two and of ten from 1e-9 to 1e9.

use super::common::proposed;
use asobench::observer::gpebo::{
    Cascade, Factor, GpeboOptions, Halving, ObserverSpec, Operator, Outcome, Scenario, halve,
};
use asobench::observer::{care_correlated, parse_poles, place};
use asobench::plant::ContinuousPlant;
use asobench::signal::{Hold, Signal, Wave};
use faer::Mat;

/// A number of the unit 1 is `states[i]` for x_i, `time` for seconds, `u` and `y`.
#[derive(Clone, Debug)]
struct Units {
    states: Vec<f64>,
    time: f64,
    u: f64,
    y: f64,
}

/// An observer with the settings that a user has in the unit 1.
enum Kind {
    Poles([(f64, f64); 3]),
    Steady,
    Gradient,
    FiniteTime,
    Proposed,
    LsDrem,
    Prior,
    Filter,
}

const KINDS: [Kind; 8] = [
    Kind::Poles([(-2.0, 0.0), (-3.0, 1.0), (-3.0, -1.0)]),
    Kind::Steady,
    Kind::Gradient,
    Kind::FiniteTime,
    Kind::Proposed,
    Kind::LsDrem,
    Kind::Prior,
    Kind::Filter,
];

impl Kind {
    /// Whether the prior p0 I or the process noise q I asks for one unit of all states.
    fn wants_one_unit_of_states(&self) -> bool {
        matches!(self, Self::LsDrem | Self::Prior | Self::Filter)
    }

    /// The observer in these units; `None` where one of its numbers is beyond doubles.
    fn spec(&self, plant: &ContinuousPlant, units: &Units) -> Option<ObserverSpec> {
        let n = plant.order();
        let Units { states, time, y, .. } = units;
        let x0 = vec![0.0; n];
        let det: f64 = states.iter().product();
        // Delta, and the regressions of theta_i.
        let regressor = y.powi(n as i32) / det;
        let gradient = 30.0 / (regressor * regressor) / time;
        let (p0, r) = (4.0 * states[0] * states[0], 0.05 * y * y * time);
        let s: Vec<f64> = states.iter().map(|unit| 0.03 * unit * y).collect();
        Some(match self {
            Self::Poles(list) => {
                let poles = list.map(|(re, im)| format!("{:?}{:+?}i", re / time, im / time));
                let poles = parse_poles(&poles.join(",")).unwrap();
                let gain = place(plant.a(), plant.c(), &poles).unwrap();
                ObserverSpec::Luenberger { gain, x0 }
            }
            Self::Steady => {
                let q = |i: usize, j: usize| {
                    if i == j {
                        0.3 * states[i] * states[j] / time
                    } else {
                        0.0
                    }
                };
                let q = Mat::from_fn(n, n, q);
                let solved = care_correlated(plant.a(), plant.c(), q.as_ref(), &s, r);
                ObserverSpec::Luenberger {
                    gain: solved.unwrap().gain,
                    x0,
                }
            }
            Self::Gradient => ObserverSpec::Gradient {
                gains: vec![gradient; n],
            },
            Self::FiniteTime => ObserverSpec::FiniteTime {
                gains: vec![gradient; n],
                share: 0.5,
            },
            Self::LsDrem => ObserverSpec::LsDrem {
                gains: vec![2.0 / time; n],
                p0,
                r,
            },
            Self::Prior => ObserverSpec::KalmanBucy { p0, r },
            Self::Filter => ObserverSpec::Filter {
                p0,
                q: Mat::from_fn(n, n, |i, j| {
                    let share = if i == j { 0.1 } else { 0.04 };
                    share * states[i] * states[j] / time
                }),
                s,
                r,
                x0,
            },
            Self::Proposed => {
                // The second determinant goes as regressor^9 states_i^3 / time^3.
                let gain = |unit: &f64| {
                    let determinant = regressor.powi(9) * unit.powi(3);
                    1e9 * (time.powi(3) / determinant) * (time.powi(3) / determinant) / time
                };
                let gains: Vec<f64> = states.iter().map(gain).collect();
                if !gains.iter().all(|gain| gain.is_normal()) {
                    return None;
                }
                let lag = |pole: f64| Operator::Lag(pole / time);
                match proposed(Factor::Drop, gains) {
                    ObserverSpec::Proposed {
                        order, gains, factor, ..
                    } => ObserverSpec::Proposed {
                        k: 1.0 / time,
                        order,
                        filters: vec![lag(2.0), lag(6.0)],
                        gains,
                        factor,
                    },
                    other => other,
                }
            }
        })
    }
}

/// A motor's position, speed and current, in the units.
fn plant(units: &Units) -> ContinuousPlant {
    let a = [[0.0, 1.0, 0.0], [0.0, -0.5, 2.0], [0.0, -0.3, -3.0]];
    let Units { states, time, u, y } = units;
    let rows = (0..3).map(|i| (0..3).map(|j| a[i][j] * (states[i] / states[j]) / time).collect());
    let b = vec![0.0, 0.0, 2.0 * states[2] / u / time];
    ContinuousPlant::new(&rows.collect::<Vec<_>>(), b, vec![*y / states[0], 0.0, 0.0]).unwrap()
}

fn run(kind: &Kind, units: &Units) -> Option<Halving> {
    let plant = plant(units);
    let spec = kind.spec(&plant, units)?;
    let Units { states, time, u, y } = units;
    let sine = |amplitude: f64, frequency: f64| Wave::Sine {
        amplitude,
        frequency: frequency / time,
        phase: 0.4,
    };
    let values: Vec<f64> = (0..41).map(|k| y * 0.05 * (f64::from(k * k % 7) - 3.0)).collect();
    let scenario = Scenario {
        u: Signal::new(vec![Wave::Constant { value: *u }, sine(0.5 * u, 1.7)]),
        delta: Signal::new(vec![
            sine(0.1 * y, 4.0),
            Wave::Samples {
                interval: 0.25 * time,
                values: values.into(),
                hold: Hold::Zero,
            },
        ]),
        x0: [1.0, -0.5, 2.0].iter().zip(states).map(|(x, unit)| x * unit).collect(),
        horizon: 10.0 * time,
        scored_from: 4.0 * time,
        step: 0.025 * time,
    };
    let options = GpeboOptions {
        xi0: vec![0.0; 3],
        filters: vec![Operator::Lag(1.0 / time), Operator::Lag(2.0 / time)],
    };
    let cascade = Cascade::new(&plant, &scenario, &options, &[spec]).unwrap();
    Some(halve(&cascade, |_| {}))
}

/// Every observer, with its settings in the new units, has the same errors in them, to rounding, and the same step
/// error: states one by one and together, time, u and y in units from 1e-9 to 1e9.
#[test]
fn other_units_change_nothing_but_the_units() {
    let one = || Units {
        states: vec![1.0; 3],
        time: 1.0,
        u: 1.0,
        y: 1.0,
    };
    let factors = [-30, -9, 9, 30].map(|e| 2_f64.powi(e));
    let factors = factors.into_iter().chain([1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9]);
    let mut all = vec![];
    for by in factors {
        for which in 0..8 {
            let mut units = one();
            match which {
                0..3 => units.states[which] = by,
                3 => units.states = vec![by; 3],
                4 => units.time = by,
                5 => units.u = by,
                6 => units.y = by,
                _ => {
                    units = Units {
                        states: vec![1.0 / by, 1.0, by],
                        time: by,
                        u: by,
                        y: 1.0 / by,
                    }
                }
            }
            all.push(units);
        }
    }
    let mut wrong = vec![];
    for (number, kind) in KINDS.iter().enumerate() {
        let plain = run(kind, &one()).unwrap();
        let (own, limit) = (&plain.summary.observers[0], plain.observers[0].relative());
        assert!(own.outcome == Outcome::Finite && limit < 1e-2, "{number} {limit}");
        for units in &all {
            if kind.wants_one_unit_of_states() && units.states.iter().any(|x| *x != units.states[0]) {
                continue;
            }
            let Some(found) = run(kind, units) else {
                assert!(matches!(kind, Kind::Proposed));
                continue;
            };
            let (observer, error) = (&found.summary.observers[0], found.observers[0].relative());
            if matches!(kind, Kind::Proposed) && observer.outcome != Outcome::Finite {
                continue;
            }
            let same = |i: usize| {
                let (x, y) = (
                    observer.accuracy.rms_states[i] / units.states[i],
                    own.accuracy.rms_states[i],
                );
                (x - y).abs() <= 1e-9 * y
            };
            if !(0..3).all(same) || !(error <= 2.0 * limit + 1e-9) {
                let states = &observer.accuracy.rms_states;
                wrong.push(format!(
                    "{number} {units:?}: {states:?} {:?} {error:e} {limit:e}",
                    own.accuracy.rms_states
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Moler's badly scaled matrix as a plant (`x_1(1) = 0.446849468283175` from (1, 0, 0)): the plant's state is right,
/// with long and with short steps, in the published units and in others.
#[test]
fn a_badly_scaled_plant() {
    for unit in [1.0, 1e4, 1e-3] {
        let a = [
            vec![0.0, 1e-8 * unit, 0.0],
            vec![-(2e10 + 4e8 / 6.0) / unit, -3.0, 2e10 / unit],
            vec![200.0 / 3.0, 0.0, -200.0 / 3.0],
        ];
        let plant = ContinuousPlant::new(&a, vec![0.0; 3], vec![1.0, 0.0, 0.0]).unwrap();
        for step in [0.01, 0.1] {
            let scenario = Scenario {
                u: Signal::default(),
                delta: Signal::default(),
                x0: vec![1.0, 0.0, 0.0],
                horizon: 1.0,
                scored_from: 0.0,
                step,
            };
            let options = GpeboOptions {
                xi0: vec![0.0; 3],
                filters: vec![Operator::Lag(1.0), Operator::Lag(2.0)],
            };
            let spec = ObserverSpec::Luenberger {
                gain: vec![0.0; 3],
                x0: vec![0.0; 3],
            };
            let cascade = Cascade::new(&plant, &scenario, &options, &[spec]).unwrap();
            let mut last = 0.0;
            let found = halve(&cascade, |sample| last = sample.x[0]);
            assert!((last - 0.446_849_468_283_175).abs() < 1e-12, "{unit} {step} {last}");
            assert!(found.observers[0].state.relative() < 1e-12);
        }
    }
}
