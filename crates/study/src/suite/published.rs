//! Published Monte-Carlo tables, reproduced: our mean and standard deviation of each coefficient beside the printed ones.

use super::manifest::{self, Tier};
use super::scenario::{Competitor, Suite, SuiteError};
use super::score::Estimated;
use crate::design::experiment::Experiment;
use crate::run::runner::{Block, RunError, run};
use asobench_identification::estimator::EstimatorName;
use asobench_identification::names::UnknownName;
use asobench_identification::theory::FisherInformation;
use serde::Deserialize;
use std::convert::Infallible;
use std::sync::atomic::AtomicBool;

/// So many standard errors of the difference make two numbers differ.
const CERTAIN: f64 = 4.0;

/// A published table of one method on one scenario.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedTable {
    /// The scenario.
    pub scenario: String,
    /// The method.
    pub method: EstimatorName,
    /// Its name in the source.
    pub printed_as: String,
    /// Where it is printed.
    pub source: String,
    /// The runs behind it; 1 for a single run with its standard errors.
    pub runs: u64,
    /// The coefficients, such as f1.
    pub coefficients: Vec<String>,
    /// Their means.
    pub mean: Vec<f64>,
    /// Their standard deviations, with n - 1.
    pub sd: Vec<f64>,
}

#[derive(Deserialize)]
struct Tables {
    tables: Vec<PublishedTable>,
}

/// A coefficient, theirs and ours.
#[derive(Clone, Debug)]
pub struct Reproduced {
    /// The coefficient.
    pub name: String,
    /// The printed mean, and the printed standard deviation where there is more than one run.
    pub printed: (Estimated, Option<Estimated>),
    /// Ours.
    pub ours: (Estimated, Estimated),
    /// The standard deviation at the Cramer-Rao bound, where our mean is certainly no other than the truth.
    pub bound: Option<f64>,
    /// Runs that left a model.
    pub kept: usize,
}

impl Reproduced {
    /// Whether neither the means nor the standard deviations differ certainly.
    pub fn agrees(&self) -> bool {
        let alike = |a: Estimated, b: Estimated| {
            (a.value - b.value).abs() <= CERTAIN * a.error.hypot(b.error)
        };
        let ((mean, sd), (our_mean, our_sd)) = (self.printed, self.ours);
        alike(mean, our_mean) && sd.is_none_or(|sd| alike(sd, our_sd))
    }
}

/// The published tables that the program carries.
///
/// # Errors
/// What is wrong with them.
pub fn published() -> Result<Vec<PublishedTable>, SuiteError> {
    let read: Result<Tables, _> = toml::from_str(manifest::published());
    let read = read.map_err(|error| SuiteError::Manifest(format!("suite/published: {error}")))?;
    Ok(read.tables)
}

impl PublishedTable {
    /// Runs the method on `runs` records of the suite's seed, and returns each coefficient.
    ///
    /// # Errors
    /// [`SuiteError`].
    pub fn reproduce(&self, runs: u64, threads: usize) -> Result<Vec<Reproduced>, SuiteError> {
        let only = [self.scenario.clone()];
        let suite = Suite::new(Tier::Full, &only)?;
        let competitors = [Competitor::Estimator(self.method)];
        let wrong = |what: String| SuiteError::Manifest(format!("{}: {what}", self.scenario));
        let study = suite
            .studies
            .first()
            .ok_or_else(|| wrong("no such study".to_owned()))?;
        let (experiment, declined) = study.experiment(&competitors, runs)?;
        let reason = || {
            declined
                .iter()
                .map(|(_, why)| why.clone())
                .collect::<String>()
        };
        let experiment = experiment.ok_or_else(|| wrong(reason()))?;
        let errors =
            errors(&experiment, runs, threads).map_err(|error| wrong(error.to_string()))?;
        let cell = experiment.cells[0].discrete();
        let cell = cell.ok_or_else(|| wrong("no plant".to_owned()))?;
        let information = FisherInformation::new(&cell.process, cell.eta, cell.window);
        let information = information.map_err(|why| wrong(why.to_string()))?;
        let mut all = Vec::new();
        for (i, name) in self.coefficients.iter().enumerate() {
            let (column, sign, truth) = place(&experiment, name)?;
            let found: Vec<f64> = errors
                .iter()
                .map(|errors| truth + sign * errors[column])
                .collect();
            let ours = moments(&found);
            let is_near = (ours.0.value - truth).abs() <= CERTAIN * ours.0.error;
            all.push(Reproduced {
                name: name.clone(),
                printed: self.printed(i),
                ours,
                bound: information.deviation(column).filter(|_| is_near),
                kept: found.len(),
            });
        }
        Ok(all)
    }

    fn printed(&self, i: usize) -> (Estimated, Option<Estimated>) {
        let (value, sd, runs) = (self.mean[i], self.sd[i], self.runs as f64);
        let error = sd / runs.sqrt();
        let spread = (self.runs > 1).then(|| Estimated {
            value: sd,
            error: sd / (2.0 * (runs - 1.0)).sqrt(),
        });
        (Estimated { value, error }, spread)
    }
}

/// Mean and standard deviation with their standard errors, the latter from the fourth moment.
fn moments(x: &[f64]) -> (Estimated, Estimated) {
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n;
    let power = |p: i32| x.iter().map(|x| (x - mean).powi(p)).sum::<f64>() / n;
    let (second, fourth) = (power(2), power(4));
    let sd = (second * n / (n - 1.0)).sqrt();
    let of_variance = ((fourth - second * second) / n).max(0.0).sqrt();
    let spread = Estimated {
        value: sd,
        error: of_variance / (2.0 * sd),
    };
    let error = sd / n.sqrt();
    (Estimated { value: mean, error }, spread)
}

/// The signed errors of `a_1 ... a_n, h_1 ... h_n` of every run that left a model, in the order of the runs.
fn errors(
    experiment: &Experiment,
    runs: u64,
    threads: usize,
) -> Result<Vec<Vec<f64>>, RunError<Infallible>> {
    let mut found = Vec::new();
    let order = experiment.cells[0].order();
    run(
        experiment,
        runs,
        threads,
        &AtomicBool::new(false),
        |block: Block| {
            for place in 0..block.rows.trial_count() {
                let row = block.rows.row(place, 0);
                if !row.is_lost() {
                    let errors = block.rows.parameters(place, 0)[..2 * order].to_vec();
                    found.push((row.trial, errors));
                }
            }
            Ok(())
        },
    )?;
    found.sort_by_key(|(trial, _)| *trial);
    Ok(found.into_iter().map(|(_, errors)| errors).collect())
}

/// The column of a coefficient, the sign of its error there, and its true value: `alpha_i = -a_(n+1-i)`.
fn place(experiment: &Experiment, name: &str) -> Result<(usize, f64, f64), SuiteError> {
    let cell = &experiment.cells[0];
    let plant = cell.discrete().and_then(|cell| cell.process.plant());
    let (letter, number) = name.split_at(1.min(name.len()));
    let found = plant
        .zip(number.parse::<usize>().ok())
        .and_then(|(plant, i)| {
            let n = plant.order();
            let inside = (1..=n).contains(&i);
            match letter {
                "a" | "f" if inside => Some((n - i, -1.0, -plant.a()[n - i])),
                "b" if inside => Some((n + i - 1, 1.0, plant.h()[i - 1])),
                _ => None,
            }
        });
    found.ok_or_else(|| UnknownName::new("coefficient", name, &["a1", "f1", "b1"]).into())
}
