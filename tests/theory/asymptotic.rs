//! The figures of `asobench theory` against trials of long windows, and against the theory of this folder.

use super::cells::open;
use super::population::trace;
use super::study::{cut, mean, run};
use asobench::claim::judge;
use asobench::data::PlantSource;
use asobench::study::file::ExperimentFile;
use asobench::study::{CellPart, DiscreteCell, Experiment, Look, Measure, Summary};
use faer::Mat;
use faer::linalg::solvers::Solve;

/// The true (alpha, beta).
fn truth(cell: &DiscreteCell) -> Vec<f64> {
    let PlantSource::Fixed(plant) = &cell.process.settings().plant else {
        panic!("a fixed plant");
    };
    [&plant.denominator()[1..], &plant.h()].concat()
}

/// `N z'P^-1 z`, z the error about the limit, has the mean of chi-squared with as many degrees as parameters: within
/// four standard errors, for every output that has theory. Returns how many have.
fn check(experiment: &Experiment, trials: u64) -> usize {
    let mut checked = 0;
    for (index, cell) in experiment.cells.iter().enumerate() {
        let theory = experiment.theory(index);
        let found = run(experiment, index, trials);
        let cell = cell.discrete().unwrap();
        let truth = truth(cell);
        for (number, (label, theory)) in theory.as_ref().unwrap().outputs.iter().enumerate() {
            let Ok(theory) = theory else { continue };
            let covariance = &theory.asymptotic.covariance;
            let factors = Mat::from_fn(truth.len(), truth.len(), |i, j| covariance[(i, j)]);
            let factors = factors.partial_piv_lu();
            let squares: Vec<f64> = found
                .errors(number)
                .iter()
                .map(|error| {
                    let z = Mat::from_fn(truth.len(), 1, |i, _| error[i] + truth[i] - theory.asymptotic.p[i]);
                    cell.window as f64 * (z.transpose() * factors.solve(&z))[(0, 0)]
                })
                .collect();
            let (value, error) = mean(&squares);
            let distance = (value - truth.len() as f64) / error;
            println!("{index} {label:<12} {value:>8.3} +- {error:.3}: {distance:.2}");
            assert!(distance.abs() <= 4.0, "{label} of cell {index}: {distance}");
            checked += 1;
        }
    }
    checked
}

const LONG: [&str; 2] = ["window=20000", "horizon=auto"];

/// Biased estimates among them: least squares with eta exact in each window, of both outputs, and passes in a loop.
#[test]
fn covariances_are_those_of_trials_with_long_windows() {
    let quick = ["measures=[\"e_a\"]"];
    let closed = ["noise=white", "eta=20", "feedback=[\"static\", \"dynamic\"]"];
    let set = [&LONG[..], &quick, &closed].concat();
    assert_eq!(check(&cut("closed-loop", &set), 250), 6);
    let measured = ["noise=white", "eta=60", "eta_of=measured"];
    let least_squares = ["methods=[{estimator = \"ls\"}]"];
    let set = [&LONG[..], &quick, &measured, &least_squares].concat();
    assert_eq!(check(&cut("noise-level", &set), 250), 1);
    let methods = ["ls", "iv4", "iv-delayed", "stmcb", "sriv", "armax"];
    let methods = methods.map(|name| {
        let starts = if name == "armax" { ", starts = 0" } else { "" };
        format!("{{estimator = \"{name}\"{starts}}}")
    });
    let methods = format!("methods=[{}]", methods.join(", "));
    let others = ["plant=aastroem", "noise=white", "eta=50", methods.as_str()];
    let set = [&LONG[..], &quick, &others].concat();
    assert_eq!(check(&cut("methods", &set), 120), 6);
}

/// A study of one input: least squares, biased under white output noise, and three consistent methods.
fn of_input(name: &str, table: &str, window: usize, more: &str) -> Experiment {
    let table = match table {
        "" => String::new(),
        table => format!("[inputs.{name}]\n{table}\n"),
    };
    let text = format!(
        "measures = ['e_a']\nparameters = true\n[settings]\nplant = 'second'\nnoise = 'white'\neta = 30\n\
         window = {window}\nhorizon = 'auto'\namplitude = 3\ninput = '{name}'\n{more}\n\
         [plants.second]\nA = [1, -1.5, 0.7]\nB = [0, 1, 0.5]\n\
         [noises.slow]\nC = [1]\nD = [1, -0.8]\n{table}\
         [[methods]]\nestimator = 'iv'\niterations = 2\nreport = [0, 2]\n[[methods]]\nestimator = 'iv4'\n\
         [[methods]]\nestimator = 'oe'\nstarts = 0\n"
    );
    Experiment::new(ExperimentFile::parse(&text).unwrap()).unwrap()
}

/// Inputs that no filter of white numbers has: periodic ones, with and without a mean and held for some samples, the
/// signs of filtered numbers, and filtered numbers. Where least squares is biased, its error with binary numbers needs
/// their fourth moments. 8,128 samples are whole periods of the first four; 7,500 are not of the fifth.
#[test]
fn inputs_with_spectra_of_their_own() {
    const MULTISINE: &str = "law = 'multisine'\nperiod = 64\nband = [0.1, 0.7]\nodd = true";
    const STEPS: &str = "law = 'steps'\nvalues = [1, -1, 3, 0, -2, 1, 2, -3]\nhold = 8";
    const MEAN: &str = "law = 'prbs'\nregister = 7\nlevels = [-1, 2]";
    const HIGH: &str = "law = 'prbs'\nregister = 7\nclock = 2\nlevels = [9, 11]";
    const FAR: &str = "law = 'prbs'\nregister = 7\nclock = 2\nlevels = [1, 3]";
    for (name, table, window, outputs) in [
        ("mean", MEAN, 8_128, 4),
        ("far", FAR, 8_128, 4),
        ("multisine", MULTISINE, 8_128, 4),
        ("steps", STEPS, 8_128, 4),
        ("cut", "law = 'prbs'\nregister = 9\nclock = 3", 7_500, 4),
        ("binary", "law = 'binary'\nfilter = 'slow'", 8_128, 3),
        ("slow", "", 8_128, 4),
    ] {
        let experiment = of_input(name, table, window, "");
        assert_eq!(check(&experiment, 100), outputs, "{name}");
    }
    // The record begins at 1 and its output's mean is 225. The start has, by the method, a share of the error that
    // falls as 1/N: of 8,128 samples it is not small.
    let high = of_input("high", HIGH, 32_512, "");
    assert_eq!(check(&high, 100), 4);
    for more in [
        "eta_of = 'measured'",
        "feedback = 'loop'\n[feedbacks.loop]\nnumerator = [0.02]",
    ] {
        let experiment = of_input("mean", MEAN, 8_128, more);
        println!("{more}");
        assert_eq!(
            check(&experiment, 100),
            if more.starts_with("eta") { 4 } else { 3 },
            "{more}"
        );
    }
}

/// One line excites two coefficients and two lines four: with one, a model of order 2 has no limit but by least
/// squares, whose regressors have the noise.
#[test]
fn too_few_lines_are_singular() {
    for (periods, outputs) in [("[16]", 1), ("[16, 5]", 4)] {
        let count = periods.matches(' ').count() + 1;
        let table = format!(
            "law = 'sines'\namplitudes = [{}]\nperiods = {periods}",
            vec!["1"; count].join(", ")
        );
        let experiment = of_input("sines", &table, 8_000, "");
        let theory = experiment.theory(0).as_ref().unwrap();
        let found = theory.outputs.iter().filter(|(_, theory)| theory.is_ok());
        assert_eq!(found.count(), outputs, "{periods}");
        assert_eq!(check(&experiment, 100), outputs);
    }
}

/// The passes of the paper, by impulse responses.
#[test]
fn passes_have_the_covariances_of_this_folders_theory() {
    for colour in ["ar", "white", "ma", "arma", "strong"] {
        let noise = format!("noise={colour}");
        let experiment = cut("noise-colour", &[&noise, "eta=10", "window=98"]);
        let theory = experiment.theory(0).as_ref().unwrap();
        let other = open(colour, 10.0);
        let passes = other.iterated(1);
        let last = theory.outputs.last().unwrap().1.as_ref().unwrap();
        for (output, covariance) in [
            (&theory.outputs[1].1, other.covariance_with(&passes[0])),
            (&theory.outputs[2].1, other.instruments_covariance()),
        ] {
            let found = output.as_ref().unwrap().trace;
            let expected = trace(&covariance);
            assert!((found / expected - 1.0).abs() < 1e-7, "{colour} {found} {expected}");
        }
        assert!(last.is_consistent);
        let limit = &theory.outputs[0].1.as_ref().unwrap().asymptotic.p;
        for (found, expected) in limit.iter().zip(&passes[0]) {
            assert!((found - expected).abs() < 1e-9, "{colour}");
        }
    }
}

/// Least squares under 1/A is efficient: its median is that of the shared bound, and a claim says so; the median of the
/// separate bound is larger. Under white noise least squares is biased and has no efficiency.
#[test]
fn summaries_and_claims_know_the_bounds() {
    let claim = |id: &str, to: &str, limit: &str| {
        format!(
            "[[claims]]\nid = '{id}'\ntest = {{ ratio = 'e_a', of = 'ls', to = '{to}', {limit} }}\nwhere = {{ noise = \
             'ar' }}\n"
        )
    };
    let text = "measures = ['e_a']\ntrials = 2000\n[settings]\nnoise = ['ar', 'white']\nwindow = 4000\n\
        [[methods]]\nestimator = 'ls'\n"
        .to_owned()
        + &claim("S", "bound:shared", "between = [0.9, 1.1]")
        + &claim("P", "bound:separate", "below = 1")
        + &claim("O", "theory", "within = 1.1");
    let experiment = Experiment::new(ExperimentFile::parse(&text).unwrap()).unwrap();
    let cells = experiment.cells.iter().enumerate().map(|(index, cell)| {
        let tally = run(&experiment, index, 2000).tally(&experiment, cell);
        CellPart::new(&experiment, index, &tally)
    });
    let summary = Summary::new(&experiment, cells.collect());
    let [own, white] = [0, 1].map(|cell| summary.cells[cell].outputs[0].theory[&Measure::Ea]);
    let shared = own.efficiency.shared.unwrap();
    assert!((shared - 1.0).abs() < 0.1, "{shared}");
    assert!(own.efficiency.separate.unwrap() > shared);
    assert!(own.theory.is_some() && white.theory.is_none());
    assert!(white.bound.separate.is_some());
    assert_eq!([white.efficiency.shared, white.efficiency.separate], [None; 2]);
    for judged in judge(&experiment.file, &summary, &[], Look::ONLY) {
        assert!(judged.line.contains("holds"), "{}", judged.line);
    }
    let stored = serde_json::to_vec(&summary).unwrap();
    let read = Summary::from_json(&stored).unwrap();
    let found = read.cells[0].outputs[0].theory[&Measure::Ea].efficiency.shared.unwrap();
    assert!((found - shared).abs() < 1e-8);
}
