//! Noise by its covariances in the plant's own states: the study `known-noise`, its units, and mistakes.

use super::summary;
use asobench::study::file::ExperimentFile;
use asobench::study::{CellSummary, Experiment, Measure, Trials, Worker};

const STUDY: &str = include_str!("../../experiments/known-noise.toml");

fn study(change: impl Fn(String) -> String) -> Experiment {
    let file = ExperimentFile::parse(&change(STUDY.to_owned())).unwrap();
    Experiment::new(file).unwrap()
}

/// scipy 1.17.1: with `F = expm(A Ts)`, Qd by `quad` of `expm(A t) Q expm(A t).T`, `P = solve_discrete_are(F.T, C.T,
/// Qd, [[R]], s=S)` and `O = [C; C F]` the trace of `O P O.T` is the mean square of the steady filter's error.
#[test]
fn the_error_of_the_filter_is_that_of_scipys_riccati_equation() {
    let experiment = study(|text| text);
    for (index, expected) in [(0, 0.06377580157566715), (1, 0.021083855042077923)] {
        let found = summary(&experiment, index, 400);
        let rms = |label: &str| found.output(label).unwrap().measures[&Measure::RmsState].rmse;
        let right = rms("known observer=kalman");
        let z = (right.value - f64::sqrt(expected)) / right.mcse;
        assert!(z.abs() < 4.0, "{index}: {right:?} {expected}");
        // sqrt of 1.0154 and so on: the same with the gains of the other filters, by solve_discrete_lyapunov.
        let [quiet, uncorrelated] = [
            [1.4082697361827874, 1.0154300215132464],
            [2.378487433972798, 1.1955413881683126],
        ][index];
        for (label, ratio) in [("quiet", quiet), ("uncorrelated", uncorrelated)] {
            let wrong = rms(&format!("known observer=kalman:{label}"));
            let z = (wrong.value - ratio * f64::sqrt(expected)) / wrong.mcse;
            assert!(z.abs() < 4.0, "{index} {label}: {wrong:?} {ratio}");
        }
    }
}

/// The share of p-values below 0.05 is near 0.05 for the right filter alone: within 4.5 standard errors of 0.05 and the
/// excess of Ljung and Box's statistic, at most 0.01 of 500 samples.
#[test]
fn innovations_are_white_if_the_covariances_are_right() {
    let experiment = study(|text| text);
    for (index, cell) in experiment.cells.iter().enumerate() {
        let mut trials = Trials::of_all_measures(&experiment, cell);
        let mut worker = Worker::new(&experiment, cell).unwrap();
        worker.run_into(0..600, &mut trials).unwrap();
        let mut below = vec![0.0; experiment.output_count()];
        for (i, row) in trials.rows.iter().enumerate() {
            let p = row[Measure::InnovationsWhite];
            assert!((0.0..=1.0).contains(&p), "{p}");
            let outputs = below.len();
            below[i % outputs] += if p < 0.05 { 1.0 / 600.0 } else { 0.0 };
        }
        let error = f64::sqrt(0.05 * 0.95 / 600.0);
        assert!(
            below[0] > 0.05 - 4.5 * error && below[0] < 0.06 + 4.5 * error,
            "{below:?}"
        );
        assert!(below[1] > 0.99, "{below:?}");
        assert_eq!(below[2] > 0.97, index == 1, "{below:?}");
    }
}

/// The same errors whatever the speed and the current are measured in, and the same test of the innovations.
#[test]
fn units_of_the_states_do_not_matter() {
    let found = |experiment: &Experiment, index: usize| -> CellSummary { summary(experiment, index, 20) };
    let plain = study(|text| text);
    for [i, j] in [[3_i32, -4], [20, 11], [-30, 30]].map(|powers| powers.map(|e| 2_f64.powi(e))) {
        let scaled = study(|text| {
            let of = |numbers: [f64; 2]| format!("[{:?}, {:?}]", numbers[0], numbers[1]);
            let rows = |m: [[f64; 2]; 2]| format!("[{}, {}]", of(m[0]), of(m[1]));
            let a = rows([[-10.0, 5.0 * i / j], [-j / i, -20.0]]);
            let q = rows([[2.0 * i * i, 0.2 * i * j], [0.2 * i * j, 0.1 * j * j]]);
            [
                ("A = [[-10, 5], [-1, -20]]", format!("A = {a}")),
                ("B = [0, 20]", format!("B = {}", of([0.0, 20.0 * j]))),
                ("C = [1, 0]", format!("C = {}", of([1.0 / i, 0.0]))),
                ("G = [1, 0]", format!("G = {}", of([i, 0.0]))),
                ("Q = [[2, 0.2], [0.2, 0.1]]", format!("Q = {q}")),
                ("S = [0.025, 0]", format!("S = {}", of([0.025 * i, 0.0]))),
            ]
            .into_iter()
            .fold(text, |text, (from, to)| {
                assert!(text.contains(from), "{from}");
                text.replace(from, &to)
            })
        });
        for index in 0..plain.cells.len() {
            let (plain, scaled) = (found(&plain, index), found(&scaled, index));
            for (one, other) in plain.outputs.iter().zip(&scaled.outputs) {
                for measure in [Measure::RmsState, Measure::InnovationsWhite] {
                    let [one, other] = [one, other].map(|of| of.measures[&measure].rmse.value);
                    assert!((one / other - 1.0).abs() < 1e-9, "{measure} {one} {other}");
                }
            }
        }
    }
}

/// A discrete plant in its own states, noise on the input, and the initial state of a table.
#[test]
fn discrete_states_and_noise_on_the_input() {
    let text = "measures = [\"rms_x\"]\n[plants.own]\na = [-0.7, 1.5]\nb = [1.0, 2.0]\nx0 = [1.0, -2.0]\n\
                [plants.same.states]\nA = [[0, 1], [-0.7, 1.5]]\nB = [1, 2]\nC = [1, 0]\n\
                [plants.turned]\nx0 = [-1.0, 2.0]\n[plants.turned.states]\nA = [[1, 1], [-0.2, 0.5]]\nB = [1, 1]\n\
                    C = [1, 0]\n\
                [covariances.motor]\ninput = 0.25\nR = 0.09\n\
                [settings]\nplant = \"PLANT\"\nnoise = \"white\"\nx0 = X0\nETA\nwindow = 20\nhorizon = 60\n\
                [[methods]]\nestimator = \"known\"\nobserver = \"kalman\"";
    let run = |plant: &str, x0: &str, eta: &str| {
        let text = text.replace("PLANT", plant).replace("X0", x0).replace("ETA", eta);
        let experiment = Experiment::new(ExperimentFile::parse(&text).unwrap()).unwrap();
        summary(&experiment, 0, 200).outputs[0].measures[&Measure::RmsState].rmse
    };
    let by_covariances = "eta = 0\nprocess_noise = \"motor\"";
    let own = run("own", "1", by_covariances);
    let same = run("same", "1", by_covariances);
    assert!((own.value / same.value - 1.0).abs() < 1e-12, "{own:?} {same:?}");
    // Noise on the measured input drives the plant in the same way, seen from the filter.
    let by_settings = "eta = 30\neta_over = \"absolute\"\ninput_noise = 2.5\namplitude = 10";
    let measured = run("own", "1", by_settings);
    let z = (own.value - measured.value) / own.mcse.hypot(measured.mcse);
    assert!(z.abs() < 4.0, "{own:?} {measured:?}");
    // x = (C z, C A z).
    let text = text
        .replace("PLANT", "turned")
        .replace("X0", "\"plant\"")
        .replace("ETA", by_covariances);
    let experiment = Experiment::new(ExperimentFile::parse(&text).unwrap()).unwrap();
    let cell = experiment.cells[0].discrete().unwrap();
    assert_eq!(cell.process.settings().x0, [-1.0, 1.0]);
}

#[test]
#[expect(clippy::too_many_lines, reason = "a table")]
fn mistakes_are_told_by_key() {
    let refused = |from: &str, to: &str| {
        assert!(STUDY.contains(from), "{from}");
        let text = STUDY.replacen(from, to, 1);
        let made = ExperimentFile::parse(&text).map(Experiment::new);
        made.and_then(|made| made.map(|_| ())).unwrap_err().to_string()
    };
    let q = "Q = [[2, 0.2], [0.2, 0.1]]";
    for (from, to, expected) in [
        (
            q,
            "Q = [[2, 0.2]]",
            "covariances.correlated.Q: expected 2 rows of 2 finite numbers",
        ),
        (
            q,
            "Q = [[2, 0.2], [0.3, 0.1]]",
            "covariances.correlated.Q: not symmetric in row 1, column 2",
        ),
        (
            q,
            "Q = [[2, 2], [2, 0.1]]",
            "covariances.correlated.Q: not positive semidefinite",
        ),
        (q, "", "covariances.correlated.S: too large for Q and R"),
        (
            q,
            "G = [1, 0]",
            "covariances.correlated: expected one of Q, G with variance, and input",
        ),
        (
            q,
            "input = -1",
            "covariances.correlated.input: -1; expected a standard deviation of at least 0",
        ),
        (
            "G = [1, 0]\nvariance = 2",
            "G = [1]\nvariance = 2",
            "covariances.torque.G: expected 2 finite numbers",
        ),
        (
            "variance = 2",
            "variance = -2",
            "covariances.torque.variance: -2; expected a variance of at least 0",
        ),
        (
            "R = 0.01",
            "R = 0",
            "covariances.torque.R: 0; expected a variance above 0",
        ),
        (
            "S = [0.025, 0]",
            "S = [0.025]",
            "covariances.correlated.S: expected 2 finite numbers",
        ),
        ("R = 0.03\nS", "S", "covariances.correlated.S: expected R beside it"),
        (
            "\"torque\", ",
            "\"torqe\", ",
            "process_noise: unknown covariances 'torqe', did you mean 'torque'",
        ),
        (
            "kalman:quiet\", \"kalman:un",
            "kalman:silent\", \"kalman:un",
            "methods[1].observer: unknown covariances 'silent'",
        ),
        (
            "eta = 0",
            "eta = 5",
            "eta: 5 beside R of covariances.torque; expected eta = 0",
        ),
        (
            "noise = \"white\"",
            "noise = \"ar\"",
            "expected noise = \"white\" beside it",
        ),
        (
            "Ts = 0.02",
            "Ts = -1",
            "states.Ts: -1; expected a sampling time above 0",
        ),
        ("B = [0, 20]", "B = [20]", "states: B must have 2 entries"),
        (
            "estimator = \"known\"",
            "estimator = \"ls\"",
            "'kalman:quiet' is an observer of estimator 'known' only",
        ),
        (
            "plant = \"motor\"",
            "plant = \"random\"\nplant_order = 2",
            "'torque' beside random plants",
        ),
        (
            "[plants.motor.states]",
            "[plants.motor]\na = [0.5]\n[plants.motor.states]",
            "expected one of them",
        ),
    ] {
        let error = refused(from, to);
        assert!(error.contains(expected), "{to}: {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}
