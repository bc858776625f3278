//! Discrete observers: records with process noise and random initial states, and the law that with the plant and the
//! noise known no observer of the same information beats the Kalman filter.

mod covariances;
mod reference;
mod units;

use asobench::data::{Process, ProcessError, ProcessSettings, Realisation};
use asobench::estimator::initial_state::InitialState;
use asobench::estimator::{FailureKind, Stage, Window};
use asobench::metric::Estimate;
use asobench::observer::{
    DiscreteGpebo, Kalman, MeasurementNoise, ObservedModel, ProcessNoise, StochasticModel, ThetaEstimator,
};
use asobench::plant::StateSpace;
use asobench::signal::{Input, InputLaw, LevelOver, LevelReading, Sequence};
use asobench::study::file::{ExperimentFile, Key};
use asobench::study::{Cell, CellSummary, CellTally, Engine, Experiment, Measure, Trial, Trials, Worker};

const SEED: u64 = 2023;
const STUDY: &str = include_str!("../../experiments/observer-comparison.toml");
const BEST: &str = "known observer=kalman-varying";

/// A(q) = 1 - 1.5 q^-1 + 0.7 q^-2.
fn settings(process_noise: f64, x0_deviation: f64) -> ProcessSettings {
    let nominal = LevelReading {
        over: LevelOver::Process,
        ..LevelReading::default()
    };
    ProcessSettings {
        plant: StateSpace::new(vec![-0.7, 1.5], vec![1.0, 2.0]).unwrap().into(),
        x0: vec![1.0, -2.0],
        x0_deviation,
        input: Input::new(InputLaw::Signs, 1.0, Sequence::Independent),
        noise: "white".parse().unwrap(),
        level: nominal,
        input_noise: 0.0,
        process_noise,
        state_noise: None,
        feedback: Default::default(),
        change: None,
    }
}

/// Trials of one process, each with 200 samples.
fn records(process_noise: f64, x0_deviation: f64, trials: u64) -> Vec<Realisation> {
    let process = Process::from_settings(settings(process_noise, x0_deviation)).unwrap();
    let draw = |trial| {
        let mut record = Realisation::default();
        process.realise(SEED, trial, 10.0, 50, 200, &mut record);
        record
    };
    (0..trials).map(draw).collect()
}

/// The mean square over its expected value, in standard errors of normal numbers.
fn in_standard_errors(values: &[f64], variance: f64) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().map(|x| x * x).sum::<f64>() / count;
    (mean / variance - 1.0) / (2.0 / count).sqrt()
}

/// `w(k) = x(k+1) - A x(k) - b u(k)`, component by component.
fn process_noise(record: &Realisation) -> [Vec<f64>; 2] {
    let rows: Vec<&[f64]> = record.states.chunks_exact(2).collect();
    let mut w = [Vec::new(), Vec::new()];
    for (k, pair) in rows.windows(2).enumerate() {
        let (x, next, u) = (pair[0], pair[1], record.u0[k]);
        w[0].push(next[0] - x[1] - u);
        w[1].push(next[1] - (1.5 * x[1] - 0.7 * x[0]) - 2.0 * u);
    }
    w
}

#[test]
fn process_noise_is_white_and_of_the_stated_variance_in_every_state() {
    let (mut all, mut products) = ([Vec::new(), Vec::new()], [0.0; 2]);
    for record in records(0.3, 0.0, 60) {
        let [first, second] = process_noise(&record);
        let product = |x: &[f64], y: &[f64]| -> f64 { x.iter().zip(y).map(|(x, y)| x * y).sum() };
        products[0] += product(&first, &second);
        products[1] += product(&first[1..], &first);
        all[0].extend(first);
        all[1].extend(second);
    }
    for w in &all {
        let z = in_standard_errors(w, 0.09);
        assert!(z.abs() < 4.0, "{z}");
    }
    for product in products {
        let z = product / (0.09 * (all[0].len() as f64).sqrt());
        assert!(z.abs() < 4.0, "{z}");
    }
}

/// eta 'nominal' is of the output's variance with process noise; the noise's is then the same in every trial.
#[test]
fn the_nominal_noise_level_holds_the_process_noise() {
    let process = Process::from_settings(settings(0.8, 0.0)).unwrap();
    let (plant, _, variances) = process.open_loop().unwrap();
    let expected = plant.energy().unwrap() + 0.64 * plant.disturbance_energy().unwrap();
    assert!((variances.output / expected - 1.0).abs() < 1e-14);
    let records = records(0.8, 0.0, 2000);
    let last: Vec<f64> = records.iter().map(|record| record.y0[199]).collect();
    let z = in_standard_errors(&last, expected);
    assert!(z.abs() < 4.0, "{z}");
    assert!(records.iter().all(|record| record.scale == 0.1 * expected.sqrt()));
}

#[test]
fn initial_states_are_drawn_about_the_stated_one() {
    let records = records(0.0, 2.0, 2000);
    for (i, mean) in [1.0, -2.0].into_iter().enumerate() {
        let differences: Vec<f64> = records.iter().map(|r| r.truth.x0[i] - mean).collect();
        let z = in_standard_errors(&differences, 4.0);
        let centre = differences.iter().sum::<f64>() / (4.0 * 2000.0_f64).sqrt();
        assert!(z.abs() < 4.0 && centre.abs() < 4.0, "{z} {centre}");
    }
    let starts = |record: &Realisation| record.states[..2] == record.truth.x0;
    assert!(records.iter().all(starts));
}

/// Disturbances have streams of their own: input and measurement noise keep their bits, and more of either only scales
/// it.
#[test]
fn disturbances_leave_input_and_noise_alone() {
    let [plain, disturbed, twice] = [(0.0, 0.0), (0.3, 1.0), (0.6, 1.0)].map(|(q, d)| records(q, d, 1).remove(0));
    assert_eq!((&plain.u, &plain.f), (&disturbed.u, &disturbed.f));
    assert_ne!(plain.y0, disturbed.y0);
    assert_eq!(disturbed.truth.x0, twice.truth.x0);
    let [once, twice] = [&disturbed, &twice].map(|record| process_noise(record)[0][100]);
    assert!((twice / once - 2.0).abs() < 1e-9, "{once} {twice}");
}

#[test]
fn disturbances_that_make_no_sense_are_refused() {
    for wrong in [-1.0, f64::NAN, f64::INFINITY] {
        for (q, d) in [(wrong, 0.0), (0.0, wrong)] {
            let refused = Process::from_settings(settings(q, d)).unwrap_err();
            assert!(matches!(refused, ProcessError::Deviation(..)), "{refused}");
        }
    }
}

/// The study with other settings.
fn study(changes: &[&str]) -> Experiment {
    let mut file = ExperimentFile::parse(STUDY).unwrap().quick();
    for change in changes {
        file = file.set(change).unwrap();
    }
    Experiment::new(file).unwrap()
}

fn summary(experiment: &Experiment, index: usize, trials: u64) -> CellSummary {
    let cell = &experiment.cells[index];
    let mut all = Trials::new(experiment, cell);
    Worker::new(experiment, cell)
        .unwrap()
        .run_into(0..trials, &mut all)
        .unwrap();
    CellSummary::new(experiment, index, &CellTally::from_trials(experiment, cell, &mut all))
}

fn rmse_ratio(cell: &CellSummary, first: &str, second: &str) -> Estimate {
    let pair = cell
        .comparisons
        .iter()
        .find(|pair| (pair.first.as_str(), pair.second.as_str()) == (first, second));
    pair.unwrap().measures[&Measure::RmsState].rmse_ratio
}

/// Two computations of one gain differ by rounding.
const ROUNDING: f64 = 1e-12;

/// The pairs of a cell whose first observer is better than the second by more than 4 paired standard errors in RMS.
fn beaten(cell: &CellSummary, firsts: &[&str], second: &str) -> Vec<String> {
    let mut beaten = Vec::new();
    for first in firsts {
        let ratio = rmse_ratio(cell, first, second);
        if ratio.value < 1.0 - 4.0 * ratio.mcse - ROUNDING {
            let cell = cell.cell;
            beaten.push(format!("cell {cell}: {first} / {second} = {ratio:?}"));
        }
    }
    beaten
}

const OTHERS: [&str; 4] = [
    "known observer=dead-beat",
    "known observer=scaled:0.5",
    "known observer=scaled:1",
    "known observer=kalman",
];

/// The law, in every cell of the shipped study. That the test can fail is seen from the reverse: the filter beats the
/// others.
#[test]
fn no_observer_of_the_same_information_beats_the_kalman_filter() {
    let reverse = format!("compare=[[\"{BEST}\",\"known observer=dead-beat\"]]");
    let cells = study(&[]).cells.len();
    assert_eq!(cells, 18);
    for index in 0..cells {
        let found = summary(&study(&[]), index, 60);
        let wrong = beaten(&found, &OTHERS, BEST);
        assert!(wrong.is_empty(), "{wrong:?}");
        let found = summary(&study(&[&reverse]), index, 60);
        assert_eq!(beaten(&found, &[BEST], "known observer=dead-beat").len(), 1);
    }
}

/// The error that the filter states: by the stabilising solution P of the Riccati equation.
fn stated_error(cell: &Cell) -> f64 {
    let cell = cell.discrete().unwrap();
    let (settings, n) = (cell.process.settings(), cell.order);
    let (plant, noise, variances) = cell.process.open_loop().unwrap();
    let measurement = MeasurementNoise {
        numerator: noise.numerator(),
        denominator: &noise.denominator(),
        deviation: settings.level.scale(cell.eta, &[], &[], variances),
    };
    let process = ProcessNoise::States.covariance(plant.b(), settings.process_noise.powi(2));
    let model = StochasticModel::new(plant.a(), plant.b(), process.as_ref(), measurement).unwrap();
    let filter = Kalman::steady(&model).unwrap();
    let p = filter.gains().covariance();
    (0..n).map(|i| p[(i, i)]).sum::<f64>().sqrt()
}

/// For every colour of the measurement noise: the augmented states and the variance of the noise are right.
#[test]
fn the_errors_of_the_filter_are_those_of_the_riccati_equation() {
    let experiment = study(&["process_noise=[0.1, 0.5]", "scored_from=window", "exclude=[]"]);
    for (index, cell) in experiment.cells.iter().enumerate() {
        let found = summary(&experiment, index, 60);
        let expected = stated_error(cell);
        for label in [BEST, "known observer=kalman"] {
            let rms = found.output(label).unwrap().measures[&Measure::RmsState].rmse;
            let z = (rms.value - expected) / rms.mcse;
            assert!(z.abs() < 4.0, "{:?} {label}: {rms:?}, {expected}", cell.settings);
        }
    }
}

/// Without process noise the steady gain of a stable plant is 0: the model alone, in whatever noise.
#[test]
fn without_process_noise_the_steady_filter_is_the_model_alone() {
    let experiment = study(&["process_noise=0", "scored_from=start", "exclude=[]"]);
    for cell in &experiment.cells {
        let mut trial = Trial::new(&experiment, cell).unwrap();
        let rows = trial.run(3).unwrap();
        let outputs = experiment.outputs();
        let rms = |label: &str| {
            let at = outputs.iter().position(|output| output.label() == label);
            rows[at.unwrap()][Measure::RmsState]
        };
        let (steady, alone) = (rms("known observer=kalman"), rms("known observer=scaled:1"));
        assert!((steady / alone - 1.0).abs() < 1e-9, "{steady} {alone}");
    }
}

/// Designs of results that were made before these settings came stay the same.
#[test]
fn settings_at_their_defaults_are_left_out_of_the_design() {
    let design = |text: &str| Experiment::new(ExperimentFile::parse(text).unwrap()).unwrap();
    let plain = design("");
    let stated = "[settings]\nprocess_noise = 0\nx0_deviation = [0.0]\nscored_from = \"window\"";
    assert_eq!(design(stated).fingerprint(), plain.fingerprint());
    let other = design("[settings]\nprocess_noise = 0.1");
    assert_ne!(other.fingerprint(), plain.fingerprint());
    assert_eq!(other.engine(0).unwrap(), Engine::Faer);
    for key in [Key::ProcessNoise, Key::X0Deviation, Key::ScoredFrom] {
        assert!(!plain.file.settings.contains_key(&key));
    }
    let described = |experiment: &Experiment| experiment.cells[0].discrete().unwrap().process.describe();
    assert!(described(&plain).get("process_noise").is_none());
    assert_eq!(described(&other)["process_noise"], 0.1);
}

#[test]
fn what_an_observer_cannot_serve_is_refused_in_one_line() {
    let known = "[[methods]]\nestimator = \"known\"\nobserver = \"kalman\"\n";
    let nominal = "[settings]\neta_over = \"nominal\"\n";
    let loops = "[feedbacks.f]\nnumerator = [0.1]\n";
    for (text, part) in [
        (
            "[settings]\nprocess_noise = -1".to_owned(),
            "process_noise must be a finite",
        ),
        (
            format!("{loops}[settings]\nfeedback = \"f\"\nprocess_noise = 1"),
            "process_noise is for open loop",
        ),
        (
            format!("{loops}[settings]\nfeedback = \"f\"\nx0_deviation = 1"),
            "x0_deviation is for open loop",
        ),
        ("[settings]\nscored_from = \"end\"".to_owned(), "'end'"),
        (
            "[[methods]]\nobserver = \"kalmann\"".to_owned(),
            "unknown observer 'kalmann'",
        ),
        (
            "[[methods]]\nobserver = 3".to_owned(),
            "methods[0].observer: expected a text",
        ),
        ("[[methods]]\nobserver = []".to_owned(), "empty list"),
        (
            "[[methods]]\nobserver = \"poles:0.1\"".to_owned(),
            "1 poles, but the order is 6",
        ),
        (
            "[[methods]]\nobserver = \"kalman-varying\"".to_owned(),
            "of estimator 'known' only",
        ),
        (
            "[[methods]]\nestimator = \"known\"\nsolver = \"lu\"".to_owned(),
            "'solver' is an option of estimator 'iv' or 'ls' only",
        ),
        (known.to_owned(), "eta_over = \"nominal\""),
        (
            format!("{nominal}plant = \"random\"\n{known}"),
            "one plant for all trials",
        ),
        (format!("{nominal}order = 5\n{known}"), "of the setting's order"),
    ] {
        let file = ExperimentFile::parse(&text);
        let error = file.and_then(Experiment::new).err().expect(&text).to_string();
        assert!(error.contains(part), "{text}: {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

/// Noise whose numerator has a zero on the unit circle: the filter has a pole there, so no steady state; the
/// time-varying one runs.
#[test]
fn no_filter_is_a_failure_of_the_row() {
    let text = "measures = [\"rms_x\"]\n[noises.difference]\nnumerator = [1.0, -1.0]\n\
                [settings]\nnoise = \"difference\"\neta_over = \"nominal\"\nx0_deviation = 1\n\
                [[methods]]\nestimator = \"known\"\nobserver = [\"kalman\", \"kalman-varying\"]";
    let experiment = Experiment::new(ExperimentFile::parse(text).unwrap()).unwrap();
    let mut trial = Trial::new(&experiment, &experiment.cells[0]).unwrap();
    let rows = trial.run(0).unwrap();
    let failure = rows[0].failure.unwrap();
    assert_eq!(failure.kind, FailureKind::NoFilter);
    assert_eq!(failure.stage, Stage::Observer);
    assert!(rows[0][Measure::RmsState].is_nan());
    assert!(rows[1].failure.is_none() && rows[1][Measure::RmsState] < 1.0);
}

/// The rows of a study of the known second-order plant, by output: mean squares of `rms_x` with their standard errors.
fn mean_squares(settings: &str) -> Vec<[f64; 2]> {
    let text = format!(
        "seed = 31\nmeasures = [\"rms_x\"]\n[plants.second]\na = [-0.7, 1.5]\nb = [1.0, 2.0]\n\
         [settings]\nplant = \"second\"\nwindow = 20\nhorizon = 120\namplitude = 1\nx0_deviation = 2\n{settings}\n\
         [[methods]]\nestimator = \"known\"\n\
         observer = [\"kalman-varying\", \"kalman\", \"dead-beat\", \"scaled:0.5\", \"scaled:1\"]"
    );
    let experiment = Experiment::new(ExperimentFile::parse(&text).unwrap()).unwrap();
    let mut trial = Trial::new(&experiment, &experiment.cells[0]).unwrap();
    let mut all = vec![vec![]; 5];
    for number in 0..600 {
        for (row, all) in trial.run(number).unwrap().iter().zip(&mut all) {
            assert!(row.failure.is_none(), "{settings}");
            all.push(row[Measure::RmsState].powi(2));
        }
    }
    let summary = |values: &Vec<f64>| {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0);
        [mean, (variance / count).sqrt()]
    };
    all.iter().map(summary).collect()
}

/// The trace of the covariance of the prediction error in the steady state of the plant of [`mean_squares`], by the
/// recursion `P+ = A (P - P c c'P / (P_11 + r)) A' + Q` written out for two states.
fn trace(q: [[f64; 2]; 2], r: f64) -> f64 {
    let mut p = [[1.0, 0.0], [0.0, 1.0]];
    for _ in 0..1000 {
        let v = p[0][0] + r;
        let m = |i: usize, j: usize| p[i][j] - p[i][0] * p[0][j] / v;
        // A = [0 1; -0.7 1.5]
        let row = |j: usize| [m(1, j), -0.7 * m(0, j) + 1.5 * m(1, j)];
        let (first, second) = (row(0), row(1));
        let next = |i: usize| [second[i], -0.7 * first[i] + 1.5 * second[i]];
        p = [0, 1].map(|i| [0, 1].map(|j| next(i)[j] + q[i][j]));
    }
    p[0][0] + p[1][1]
}

/// With an exactly measured output (eta = 0) and with a noisy input the filters that know the plant have the error that
/// the Riccati equation says, and no other observer a smaller one.
#[test]
fn filters_of_exact_outputs_and_of_noisy_inputs() {
    let states = [[0.04, 0.0], [0.0, 0.04]];
    // 25 % of an amplitude of 1, through b = (1, 2).
    let with_input = [[0.0625 + 0.04, 0.125], [0.125, 0.25 + 0.04]];
    let input_alone = [[0.0625, 0.125], [0.125, 0.25]];
    for (settings, q, r) in [
        ("eta = 0\nprocess_noise = 0.2", states, 0.0),
        ("eta = 0\nprocess_noise = 0.2\ninput_noise = 25", with_input, 0.0),
        (
            "eta = 30\neta_over = \"absolute\"\nprocess_noise = 0.2\ninput_noise = 25\nnoise = \"white\"",
            with_input,
            0.09,
        ),
        (
            "eta = 30\neta_over = \"absolute\"\ninput_noise = 25\nnoise = \"white\"",
            input_alone,
            0.09,
        ),
    ] {
        let found = mean_squares(settings);
        let exact = trace(q, r);
        for [mean, error] in &found[..2] {
            let z = (mean - exact) / error;
            println!("{settings}: {mean:.5} {exact:.5} z {z:.2}");
            assert!(z.abs() < 4.0, "{settings}: {mean} {exact} {z}");
        }
        for [mean, error] in &found[2..] {
            assert!(mean + 4.0 * error > exact, "{settings}: {mean} {exact}");
        }
    }
}

/// Without any noise the time-varying filter knows the state after n samples; the steady one is the model alone.
#[test]
fn filters_without_noise() {
    let found = mean_squares("eta = 0");
    assert!(found[0][0] < 1e-20, "{found:?}");
    assert!((found[1][0] / found[4][0] - 1.0).abs() < 1e-9, "{found:?}");
}

/// The true plant is no estimate: where it is unstable or marginal, its outputs are not lost.
#[test]
fn known_models_of_unstable_plants_are_not_lost() {
    for a in ["[-1.0, 2.0]", "[-1.02, 2.0]"] {
        let text = format!(
            "measures = [\"rms_x\", \"spectral_radius\"]\n[plants.mine]\na = {a}\nb = [1.0, 0.5]\nunstable = true\n\
             [settings]\nplant = \"mine\"\nwindow = 20\nhorizon = 40\neta = 10\neta_over = \"absolute\"\n\
             noise = \"white\"\nprocess_noise = 0.1\n\
             [[methods]]\nestimator = \"known\"\nobserver = [\"kalman\", \"kalman-varying\"]"
        );
        let experiment = Experiment::new(ExperimentFile::parse(&text).unwrap()).unwrap();
        let cell = &experiment.cells[0];
        let mut trials = Trials::of_all_measures(&experiment, cell);
        Worker::new(&experiment, cell)
            .unwrap()
            .run_into(0..20, &mut trials)
            .unwrap();
        for row in trials.rows.iter() {
            assert!(row.failure.is_none() && !row.is_lost(), "{a}");
            assert!(row[Measure::RmsState] < 1.0, "{a}");
            assert!(row[Measure::SpectralRadius] >= 1.0, "{a}");
        }
    }
}

/// Stage 6 is the least squares of GPEBO: with xi(0) = 0, theta is x(0). From `P(0) = I / rho` theta solves `(D'D + rho
/// I) theta = D'z`, and `D'D >= I`, for the first n rows of D are those of I. So theta differs from stage 6's x0 by at
/// most `rho |x0|`.
#[test]
fn stage_6_is_the_least_squares_of_gpebo() {
    let plants: [(&[f64], &[f64]); 3] = [
        (&[0.9], &[1.0]),
        (&[-0.7, 1.5], &[1.0, 2.0]),
        (&[0.2, -0.3, 0.1, 0.8], &[1.0, -0.5, 0.3, 2.0]),
    ];
    for (a, b) in plants {
        let n = a.len();
        let mut x: Vec<f64> = (0..n).map(|i| 1.0 - 2.0 * i as f64).collect();
        let u: Vec<f64> = (0..80_i32).map(|k| f64::from(k * k % 11) - 5.0).collect();
        let noise = (0..80_i32).map(|k| 0.1 * (f64::from(k * k % 13) - 6.0));
        let y: Vec<f64> = u
            .iter()
            .zip(noise)
            .map(|(u, noise)| {
                let y = x[0] + noise;
                let last: f64 = a.iter().zip(&x).map(|(a, x)| a * x).sum();
                x.rotate_left(1);
                x[n - 1] = last;
                x.iter_mut().zip(b).for_each(|(x, b)| *x += b * u);
                y
            })
            .collect();
        let mut x0 = vec![0.0; n];
        let found = InitialState::new(n).estimate(a, b, Window::new(&u, &y, 80), &mut x0);
        found.expect("an initial state");
        for rho in [1e-2, 1e-4, 1e-6] {
            let mut observer = DiscreteGpebo::new(ThetaEstimator::Squares(rho), n);
            let zero = vec![0.0; n];
            let model = ObservedModel { a, b, x0: &zero };
            observer.run(model, &u, &y, |_, _| ()).expect("a run");
            let norm = |x: &mut dyn Iterator<Item = f64>| x.map(|x| x * x).sum::<f64>().sqrt();
            let pairs = observer.theta().iter().zip(&x0);
            let distance = norm(&mut pairs.map(|(theta, x0)| theta - x0));
            let size = norm(&mut x0.iter().copied());
            // The recursion's rounding: P begins at 1 / rho.
            let rounding = 1e2 * f64::EPSILON / rho;
            assert!(distance <= size * (rho + rounding), "n = {n}, rho = {rho}: {distance}");
            assert!(size > 0.5, "{size}");
        }
    }
}
