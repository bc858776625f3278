//! Runs cells of the shipped files, cut to size, and holds what is found against theory.

use asobench::metric::quantile;
use asobench::study::file::ExperimentFile;
use asobench::study::{Cell, CellTally, Experiment, Measure, Trials, Worker};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

pub fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("experiments")
        .join(format!("{name}.toml"))
}

/// A shipped file with some keys set. Comparisons, slopes, bounds and claims do not matter here, and are cut.
pub fn cut(name: &str, set: &[&str]) -> Experiment {
    let always = [
        "compare=[]",
        "slopes=[]",
        "bounds=[]",
        "claims=[]",
        "timing=false",
        "curves=false",
        "parameters=true",
    ];
    let file = ExperimentFile::read(&path(name)).unwrap();
    let file = always.iter().chain(set).try_fold(file, |file, text| file.set(text));
    Experiment::new(file.unwrap()).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Trials 0 ... of one cell of an experiment, by the engine that a study of it runs on.
pub struct Found {
    trials: Vec<Trials>,
}

pub fn run(experiment: &Experiment, cell: usize, trials: u64) -> Found {
    let cell = &experiment.cells[cell];
    let trials = (0..trials).into_par_iter().map_init(
        || Worker::new(experiment, cell).unwrap(),
        |worker, index| {
            let mut single = Trials::of_all_measures(experiment, cell);
            worker.run_into(index..index + 1, &mut single).unwrap();
            single
        },
    );
    Found {
        trials: trials.collect(),
    }
}

impl Found {
    pub fn figure(&self, output: usize, figure: Measure) -> Vec<f64> {
        self.trials
            .iter()
            .map(|trial| trial.rows.row(0, output)[figure])
            .collect()
    }

    pub fn rows(&self) -> impl Iterator<Item = asobench::study::Row> {
        self.trials.iter().flat_map(|trial| trial.rows.iter())
    }

    /// The tally that a study keeps of all trials.
    pub fn tally(&mut self, experiment: &Experiment, cell: &Cell) -> CellTally {
        let mut all = CellTally::default();
        for trial in &mut self.trials {
            all.merge(CellTally::from_trials(experiment, cell, trial));
        }
        all
    }

    /// Per trial the error of (alpha, beta), the paper's p: alpha_i = -a_(n+1-i), beta = h.
    pub fn errors(&self, output: usize) -> Vec<Vec<f64>> {
        let of_trial = |trial: &Trials| {
            let errors = trial.rows.parameters(0, output);
            let (a, h) = errors.split_at(errors.len() / 2);
            a.iter().rev().map(|a| -a).chain(h.iter().copied()).collect()
        };
        self.trials.iter().map(of_trial).collect()
    }
}

pub fn mean(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
    (mean, (squares / (count - 1.0) / count).sqrt())
}

/// Root mean square, its standard error by the delta method.
pub fn rmse(values: &[f64]) -> (f64, f64) {
    let squares: Vec<f64> = values.iter().map(|x| x * x).collect();
    let (square, error) = mean(&squares);
    (square.sqrt(), error / (2.0 * square.sqrt()))
}

pub fn median(mut values: Vec<f64>) -> (f64, f64) {
    values.retain(|x| !x.is_nan());
    values.sort_by(f64::total_cmp);
    let median = quantile(&values, 0.5);
    (median.value, median.mcse)
}

/// Trial by trial `2 X(2N) - X(N)`: its mean has no bias of order 1/N.
pub fn extrapolate(short: &[Vec<f64>], long: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let pair = |(s, l): (&Vec<f64>, &Vec<f64>)| s.iter().zip(l).map(|(s, l)| 2.0 * l - s).collect();
    short.iter().zip(long).map(pair).collect()
}

/// A figure by theory.
pub enum Theory {
    /// A value, within 4 standard errors.
    Value(f64),
    /// A value that is known to a standard error of its own, or to half a printed digit (added to 4 standard errors).
    Printed(f64, f64, f64),
    /// A bound.
    AtMost(f64),
    /// A bound from below.
    AtLeast(f64),
}

pub struct Check {
    pub experiment: &'static str,
    pub figure: String,
    pub trials: u64,
    pub found: (f64, f64),
    pub theory: Theory,
}

impl Check {
    /// Distance in standard errors (0 where a bound is met), and whether it is accepted.
    fn distance(&self) -> (f64, bool) {
        let (found, error) = self.found;
        let over = |difference: f64, error: f64| {
            if difference == 0.0 { 0.0 } else { difference / error }
        };
        match self.theory {
            Theory::Value(theory) => {
                let distance = over(found - theory, error);
                (distance, distance.abs() <= 4.0)
            }
            Theory::Printed(theory, of_theory, digit) => {
                let joint = error.hypot(of_theory);
                let limit = 4.0 * joint + digit;
                (over(found - theory, joint), (found - theory).abs() <= limit)
            }
            Theory::AtMost(limit) => (over((found - limit).max(0.0), error), found <= limit),
            Theory::AtLeast(limit) => (over((found - limit).min(0.0), error), found >= limit),
        }
    }

    pub fn holds(&self) -> bool {
        self.distance().1
    }

    pub fn text(&self) -> String {
        let theory = match self.theory {
            Theory::Value(theory) | Theory::Printed(theory, _, _) => number(theory),
            Theory::AtMost(limit) => format!("<= {}", number(limit)),
            Theory::AtLeast(limit) => format!(">= {}", number(limit)),
        };
        let mark = if self.holds() { "" } else { "  <--" };
        let (experiment, figure, trials) = (self.experiment, &self.figure, self.trials);
        let (found, error) = (number(self.found.0), number(self.found.1));
        let distance = match self.theory {
            Theory::Value(_) | Theory::Printed(..) => format!("{:.2}", self.distance().0),
            Theory::AtMost(_) | Theory::AtLeast(_) => String::new(),
        };
        format!("{experiment:<14} {figure:<62} {trials:>6} {found:>9} +- {error:<8} {theory:>11} {distance:>6}{mark}")
    }
}

/// Four digits or so.
fn number(x: f64) -> String {
    if x == 0.0 {
        "0".to_owned()
    } else if x.abs() < 0.001 {
        format!("{x:.2e}")
    } else {
        format!("{x:.5}")
    }
}

/// One check of a vector of means: the component that theory moves farthest from 0, in standard errors; but one that is
/// farther than 4 from theory (or undefined) in its place. The text says how near all are.
pub fn vector(experiment: &'static str, figure: &str, errors: &[Vec<f64>], theory: &[f64]) -> Check {
    let count = theory.len();
    let n = count / 2;
    let check = |i: usize| {
        let values: Vec<f64> = errors.iter().map(|e| e[i]).collect();
        Check {
            experiment,
            figure: String::new(),
            trials: errors.len() as u64,
            found: mean(&values),
            theory: Theory::Value(theory[i]),
        }
    };
    let checks: Vec<Check> = (0..count).map(check).collect();
    // NaN counts as largest.
    let largest = |size: &dyn Fn(usize) -> f64| (0..count).max_by(|&i, &j| size(i).total_cmp(&size(j))).unwrap();
    let farthest = largest(&|i| checks[i].distance().0.abs());
    let distance = checks[farthest].distance().0.abs();
    let moved = theory.iter().any(|theory| *theory != 0.0);
    let shown = if checks[farthest].holds() && moved {
        largest(&|i| (theory[i] / checks[i].found.1).abs())
    } else {
        farthest
    };
    let name = if shown < n {
        format!("alpha_{}", shown + 1)
    } else {
        format!("beta_{}", shown - n + 1)
    };
    let figure = format!("{figure}: {name}; all within {distance:.1} SE");
    checks
        .into_iter()
        .nth(shown)
        .map(|check| Check { figure, ..check })
        .unwrap()
}

/// The ratio of two means over the same trials, by the delta method.
pub fn ratio(above: &[f64], below: &[f64]) -> (f64, f64) {
    let ((x, _), (y, _)) = (mean(above), mean(below));
    let influence: Vec<f64> = above.iter().zip(below).map(|(a, b)| (a - x / y * b) / y).collect();
    (x / y, mean(&influence).1)
}
