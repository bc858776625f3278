//! Adaptive observers: without noise, against each other, and against `reference.py`.

use super::{distance, number, numbers};
use asobench_identification::adaptive::{
    AdaptiveObserver, FedObserver, JointEkf, JointEkfSettings, Kreisselmeier, KreisselmeierSettings, StateFilters,
    Zhang, ZhangSettings,
};
use asobench_identification::estimator::IvOptions;
use asobench_identification::estimator::recursive::{
    RecursiveEstimator, RecursiveForm, RecursiveLeastSquares, RecursivePrediction, RecursiveSettings, Rerun,
    RerunWindow,
};
use asobench_identification::model::Orders;
use asobench_identification::plant::StateSpace;
use asobench_identification::signal::{Input, InputLaw, Purpose, Sequence, stream};
use serde_json::Value;

const A: [f64; 3] = [0.2, -0.95, 1.6];
const B: [f64; 3] = [1.0, -0.5, 0.25];
const SAMPLES: usize = 3000;

/// u, y and the states (row k is x(k)) of the plant, from rest or from 1.
fn record(start: f64, sigma: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let draw = |purpose| {
        let mut signal = vec![0.0; SAMPLES];
        let input = Input::new(InputLaw::Gaussian, 1.0, Sequence::Independent);
        input.fill(&mut stream(43, 0, purpose), &mut signal);
        signal
    };
    let (u, e) = (draw(Purpose::Input), draw(Purpose::Plant));
    let plant = StateSpace::new(A.to_vec(), B.to_vec()).expect("a plant");
    let (mut y, mut states) = (vec![0.0; SAMPLES], vec![0.0; 3 * SAMPLES]);
    plant.simulate(&mut [start; 3], &u, &mut y, &mut states);
    y.iter_mut().zip(&e).for_each(|(y, e)| *y += sigma * e);
    (u, y, states)
}

fn arx() -> RecursiveSettings {
    RecursiveSettings::new(Orders::arx(3, 3, 1))
}

/// Runs to the end; the last state belongs to k = SAMPLES, and is compared one sample before.
fn errors(observer: &mut dyn AdaptiveObserver, record: &(Vec<f64>, Vec<f64>, Vec<f64>)) -> [f64; 2] {
    let (u, y, states) = record;
    for k in 0..SAMPLES - 1 {
        observer.update(u[k], y[k]).expect("no divergence");
    }
    let plant = [A, B].concat();
    [
        distance(observer.state(), &states[3 * (SAMPLES - 1)..]),
        distance(observer.plant(), &plant),
    ]
}

/// Without noise all converge to plant and state, although the plant does not start where they do. The gradient is
/// slow: its rate is the least eigenvalue of R over tr R. The Kalman filter converges as fast as its gain, which the
/// steps of the parameters keep from falling to 0.
#[test]
fn without_noise_all_converge() {
    let record = record(1.0, 0.0);
    let filter = vec![-0.6, 0.11, -0.006];
    let output_error: Orders = "nb=3,nf=3,nk=1".parse().unwrap();
    let rls = RecursiveLeastSquares::new(arx(), RecursiveForm::SquareRoot);
    let observers: [(&str, f64, Box<dyn AdaptiveObserver>); 6] = [
        (
            "dead beat",
            1e-9,
            Box::new(FedObserver::new(rls.clone(), StateFilters::new(&[0.0; 3]))),
        ),
        (
            "poles",
            1e-9,
            Box::new(FedObserver::new(rls, StateFilters::new(&filter))),
        ),
        (
            "rpem",
            1e-9,
            Box::new(FedObserver::new(
                RecursivePrediction::new(RecursiveSettings::new(output_error)),
                StateFilters::new(&filter),
            )),
        ),
        (
            "kreisselmeier",
            1e-2,
            Box::new(Kreisselmeier::new(KreisselmeierSettings {
                filter: filter.clone(),
                memory: 0.98,
                gain: 1.9,
            })),
        ),
        (
            "zhang",
            1e-9,
            Box::new(Zhang::new(ZhangSettings {
                gain: filter,
                forgetting: 0.98,
                p0: 1e3,
            })),
        ),
        (
            "ekf",
            1e-6,
            Box::new(JointEkf::new(JointEkfSettings {
                x0: vec![0.0; 3],
                a0: A.map(|a| 0.8 * a).to_vec(),
                b0: vec![0.8; 3],
                state_variance: 1.0,
                parameter_variance: 0.1,
                noise: 1e-4,
                state_noise: 0.0,
                parameter_noise: 1e-6,
            })),
        ),
    ];
    for (name, tolerance, mut observer) in observers {
        let found = errors(&mut *observer, &record);
        assert!(found.iter().all(|error| *error < tolerance), "{name}: {found:?}");
    }
}

/// Zhang's observer with the gain of recursive least squares is the state filters fed by recursive least squares on
/// their regressors: two formulas, one observer. The regressors are those of dead-beat filters here, which are phi.
#[test]
fn zhang_is_the_fed_observer() {
    let (u, y, _) = record(0.0, 0.3);
    let settings = RecursiveSettings {
        p0: Some(100.0),
        forgetting: 0.99,
        ..arx()
    };
    let rls = RecursiveLeastSquares::new(settings, RecursiveForm::Covariance);
    let mut fed = FedObserver::new(rls, StateFilters::new(&[0.0; 3]));
    let mut zhang = Zhang::new(ZhangSettings {
        gain: vec![0.0; 3],
        forgetting: 0.99,
        p0: 100.0,
    });
    for k in 0..SAMPLES {
        // Zhang's takes the first equations with zeros before the record; recursive least squares leaves them out, so
        // the two come together as these are forgotten.
        fed.update(u[k], y[k]).unwrap();
        zhang.update(u[k], y[k]).unwrap();
    }
    assert!(distance(zhang.theta(), fed.estimator().theta()) < 1e-9);
    assert!(distance(zhang.state(), fed.state()) < 1e-9);
}

/// The joint Kalman filter, to rounding of sums in another order through 300 steps.
#[test]
fn the_joint_kalman_filter_is_that_of_numpy() {
    let file: Value = serde_json::from_str(include_str!("reference.json")).expect("JSON");
    let cases = file["filters"].as_array().expect("cases");
    assert_eq!(cases.len(), 3);
    for case in cases {
        let [u, y, x0, a0, b0] = ["u", "y", "x0", "a0", "b0"].map(|key| numbers(&case[key]));
        let [state_variance, parameter_variance, noise, state_noise, parameter_noise] =
            ["px", "ptheta", "r", "qx", "qtheta"].map(|key| number(&case[key]));
        let mut filter = JointEkf::new(JointEkfSettings {
            x0,
            a0,
            b0,
            state_variance,
            parameter_variance,
            noise,
            state_noise,
            parameter_noise,
        });
        for (k, (u, y)) in u.iter().zip(&y).enumerate() {
            filter.update(*u, *y).unwrap();
            if let Some(exact) = case["state"].get((k + 1).to_string()) {
                let found = [filter.state(), filter.plant()].concat();
                let off = distance(&found, &numbers(exact));
                assert!(off < 1e-9, "n = {} k = {k}: {off}", case["n"]);
            }
        }
    }
}

/// The papers' algorithm made anew: on a growing window it is the estimate of the whole window, on a sliding one that
/// of the last samples alone. It feeds the observer as a recursion does.
#[test]
fn the_papers_algorithm_again() {
    let (u, y, states) = record(1.0, 0.0);
    for window in [RerunWindow::Growing(20), RerunWindow::Sliding(40)] {
        let rerun = Rerun::new(IvOptions::default(), 3, window, 10).unwrap();
        let mut observer = FedObserver::new(rerun, StateFilters::new(&[0.0; 3]));
        for k in 0..99 {
            observer.update(u[k], y[k]).unwrap();
            assert_eq!(
                observer.estimator().is_determined(),
                k + 1
                    >= match window {
                        RerunWindow::Growing(n) | RerunWindow::Sliding(n) => n,
                    }
            );
        }
        assert!(distance(observer.plant(), &[A, B].concat()) < 1e-9);
        assert!(distance(observer.state(), &states[3 * 99..3 * 100]) < 1e-9);
        assert_eq!(observer.estimator().samples(), 99);
        let x0 = &observer.estimator().pass().x0;
        let first = match window {
            RerunWindow::Growing(_) => 0,
            RerunWindow::Sliding(n) => 90 - n,
        };
        assert!(distance(x0, &states[3 * first..3 * first + 3]) < 1e-9);
    }
}
