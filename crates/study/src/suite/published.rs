//! Published Monte-Carlo tables, reproduced: our mean and standard deviation of each coefficient beside the printed
//! ones.

use super::competitor::Competitor;
use super::manifest::{self, Manifest, Tier};
use super::records::{Estimates, drawn};
use super::results::runs_of;
use super::scenario::Suite;
use super::score::{deviation, mean, mean_of};
use super::stored::SuiteError;
use crate::design::DiscreteCell;
use asobench_identification::metric::Estimate;
use asobench_identification::model::LinearModel;
use asobench_identification::names::UnknownName;
use asobench_identification::plant::StateSpace;
use asobench_identification::signal::Input;
use asobench_identification::theory::FisherInformation;
use serde::Deserialize;
use std::fmt::Display;

/// So many standard errors of the difference make two numbers differ.
const CERTAIN: f64 = 4.0;
/// The edition whose methods are told as those of the sources.
const TOLD: &str = "1.1";
/// Runs where the source has a single one.
const RUNS: u64 = 500;

/// A published table of one method on one system.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedTable {
    /// The scenario, or a system of its own records.
    pub scenario: String,
    /// The method.
    pub method: String,
    /// Its name in the source.
    pub printed_as: String,
    /// Where it is printed.
    pub source: String,
    /// The runs behind it; 1 for a single run with its standard errors.
    pub runs: u64,
    /// Our runs, if they are not as many.
    pub ours: Option<u64>,
    /// The numbers are of theory, and printed to this error.
    pub rounding: Option<f64>,
    /// The source prints no numbers but a formula: they are a bound that we evaluated ourselves.
    #[serde(default)]
    pub evaluated: bool,
    /// The estimates: coefficients such as f1; E, the relative error of the noise-free output; E<0.05, the share
    /// of runs with less.
    pub coefficients: Vec<String>,
    /// Their means.
    pub mean: Vec<f64>,
    /// Their standard deviations, with n - 1; none printed if empty.
    #[serde(default)]
    pub sd: Vec<f64>,
    /// Why ours differ, as far as it is known.
    pub why: Option<String>,
}

#[derive(Deserialize)]
struct Tables {
    tables: Vec<PublishedTable>,
}

/// A number, theirs and ours.
#[derive(Clone, Debug)]
pub struct Reproduced {
    /// Its name.
    pub name: String,
    /// The printed mean, and the printed standard deviation if there is one.
    pub printed: (Estimate, Option<Estimate>),
    /// Ours.
    pub ours: (Estimate, Estimate),
    /// The standard deviation at the Cramer-Rao bound, where our mean is certainly no other than the truth.
    pub bound: Option<f64>,
    /// Runs that left a model.
    pub kept: usize,
    /// The standard error of the printed mean if all its runs had one input, where ours have many and the source does
    /// not say.
    pub of_one_input: Option<f64>,
}

impl Reproduced {
    /// Whether neither the means nor the standard deviations differ certainly.
    pub fn agrees(&self) -> bool {
        let ((_, sd), (_, our_sd)) = (self.printed, self.ours);
        let alike = |a: Estimate, b: Estimate| (a.value - b.value).abs() <= CERTAIN * a.mcse.hypot(b.mcse);
        self.apart(self.printed.0.mcse) <= CERTAIN && sd.is_none_or(|sd| alike(sd, our_sd))
    }

    /// The difference of the means in its standard errors, that of the printed one being `error`.
    pub fn apart(&self, error: f64) -> f64 {
        let (printed, ours) = (self.printed.0, self.ours.0);
        (printed.value - ours.value).abs() / error.hypot(ours.mcse)
    }
}

/// The published tables that the program carries.
///
/// # Errors
/// A fault in the tables.
pub fn published() -> Result<Vec<PublishedTable>, SuiteError> {
    let read: Result<Tables, _> = toml::from_str(manifest::PUBLISHED);
    Ok(read.map_err(SuiteError::of("suite/published"))?.tables)
}

impl PublishedTable {
    /// The number of our runs.
    pub fn our_runs(&self) -> u64 {
        let as_theirs = if self.runs > 1 { self.runs } else { RUNS };
        self.ours.unwrap_or(as_theirs)
    }

    /// Runs the method on records of the suite's seed, and returns each number.
    ///
    /// # Errors
    /// [`SuiteError`].
    pub fn reproduce(&self, threads: usize) -> Result<Vec<Reproduced>, SuiteError> {
        let manifest = Manifest::read(None)?;
        let found = match drawn(&self.scenario, self.our_runs(), manifest.seed) {
            None => self.on_scenario(threads)?,
            Some(found) => found.map_err(self.wrong())?,
        };
        let names = self.coefficients.iter().enumerate();
        let row = |(i, name): (usize, &String)| {
            let values: Vec<f64> = found.values.iter().map(|of| of[i]).collect();
            let is_share = name.starts_with("E<");
            let ours = moments(&values, found.shared);
            Reproduced {
                name: name.clone(),
                printed: self.printed(i, ours.1.value, is_share),
                of_one_input: (found.shared > 1).then(|| of_one_input(&values, found.shared, self.runs)),
                ours,
                bound: found.bound[i],
                kept: found.values.len(),
            }
        };
        Ok(names.map(row).collect())
    }

    fn wrong<E: Display>(&self) -> impl Fn(E) -> SuiteError {
        SuiteError::of(format!("suite/published: {}", self.scenario))
    }

    /// The estimates on the records of a scenario.
    fn on_scenario(&self, threads: usize) -> Result<Estimates, SuiteError> {
        let runs = self.our_runs();
        let only = std::slice::from_ref(&self.scenario);
        // Methods were told the orders of the truth.
        let suite = Suite::of(Some(TOLD), None, Tier::Full, only)?;
        let all = Competitor::of(suite.division);
        let names: Vec<String> = all.iter().map(Competitor::name).collect();
        let Some(place) = names.iter().position(|name| *name == self.method) else {
            return Err(SuiteError::new(UnknownName::new("method", &self.method, &names)));
        };
        let study = suite.studies.first().ok_or_else(|| self.wrong()("no such study"))?;
        let (experiment, declined) = study.experiment(&all[place..=place], runs)?;
        let declined = declined.first().map_or("", |(_, why)| why);
        let experiment = experiment.ok_or_else(|| self.wrong()(declined))?;
        let cell = experiment.cells[0].discrete();
        let (plant, cell) = cell
            .and_then(|cell| Some((cell.process.plant()?, cell)))
            .ok_or_else(|| self.wrong()("no plant"))?;
        let information = FisherInformation::new(&cell.process, cell.eta, cell.window);
        let information = information.map_err(self.wrong())?;
        // The signed errors of a_1 ... a_n, h_1 ... h_n of every run that left a model.
        let rows = runs_of(&experiment, runs, threads)
            .map_err(self.wrong())?
            .swap_remove(0);
        let kept = rows.into_iter().filter(|(row, _)| !row.is_lost());
        let errors: Vec<Vec<f64>> = kept.map(|(_, errors)| errors[..2 * plant.order()].to_vec()).collect();
        let (mut values, mut bound) = (vec![Vec::new(); errors.len()], Vec::new());
        for name in &self.coefficients {
            let (all, deviation): (Vec<f64>, _) = if let Some(limit) = name.strip_prefix('E') {
                let each = output_errors(cell, plant, &errors);
                let each = each.ok_or_else(|| self.wrong()("an input that is the same in all runs"))?;
                let limit = limit.strip_prefix('<').and_then(|limit| limit.parse::<f64>().ok());
                let of = |e: &f64| limit.map_or(*e, |limit| f64::from(u8::from(*e < limit)));
                (each.iter().map(of).collect(), None)
            } else {
                let (column, sign, truth) = place_of(plant, name)?;
                let found = errors.iter().map(|errors| truth + sign * errors[column]);
                let found: Vec<f64> = found.collect();
                let mean = moments(&found, 1).0;
                let is_near = (mean.value - truth).abs() <= CERTAIN * mean.mcse;
                (found, information.deviation(column).filter(|_| is_near))
            };
            values.iter_mut().zip(all).for_each(|(of, value)| of.push(value));
            bound.push(deviation);
        }
        Ok(Estimates {
            values,
            bound,
            shared: 1,
        })
    }

    /// The printed mean and standard deviation. Where no deviation is printed, ours stands for it in the error of the
    /// mean.
    fn printed(&self, i: usize, our_sd: f64, is_share: bool) -> (Estimate, Option<Estimate>) {
        let runs = self.runs as f64;
        let sd = self.sd.get(i).copied();
        let error = self.rounding.unwrap_or(sd.unwrap_or(our_sd) / runs.sqrt());
        let spread = sd.filter(|_| self.runs > 1 && !is_share).map(|value| Estimate {
            value,
            mcse: self.rounding.unwrap_or(value / (2.0 * (runs - 1.0)).sqrt()),
        });
        let value = self.mean[i];
        (Estimate { value, mcse: error }, spread)
    }
}

/// Mean and standard deviation with their standard errors, the latter from the fourth moment. `shared` runs in a row
/// have one input. The error of a mean is at least what one run more makes of a share of all.
fn moments(x: &[f64], shared: usize) -> (Estimate, Estimate) {
    let (n, value, sd) = (x.len() as f64, mean(x), deviation(x));
    let power = |p: i32| x.iter().map(|x| (x - value).powi(p)).sum::<f64>() / n;
    let of_variance = ((power(4) - power(2).powi(2)) / n).max(0.0).sqrt();
    let is_share = x.iter().all(|x| *x == 0.0 || *x == 1.0);
    let least = if is_share { 1.0 / (n + 2.0) } else { 0.0 };
    let groups: Vec<f64> = x.chunks(shared).map(mean).collect();
    let of_mean = mean_of(&groups).mcse.max(least);
    let of_sd = if sd > 0.0 { of_variance / (2.0 * sd) } else { 0.0 };
    (Estimate { value, mcse: of_mean }, Estimate { value: sd, mcse: of_sd })
}

/// The standard error of the mean of `runs` runs with one input, from groups of `shared` runs with one input each:
/// analysis of variance.
fn of_one_input(x: &[f64], shared: usize, runs: u64) -> f64 {
    let groups: Vec<&[f64]> = x.chunks_exact(shared).collect();
    let of_each = |of: fn(&[f64]) -> f64| -> Vec<f64> { groups.iter().map(|group| of(group)).collect() };
    let between = deviation(&of_each(mean)).powi(2);
    let within = mean(&of_each(|group| deviation(group).powi(2)));
    let of_input = (between - within / shared as f64).max(0.0);
    (of_input + within / runs as f64).sqrt()
}

/// `|| y0 - yhat || / || y0 ||` of every run, the outputs of plant and model from rest; `None` if the input is drawn
/// anew in every run.
fn output_errors(cell: &DiscreteCell, plant: &StateSpace, errors: &[Vec<f64>]) -> Option<Vec<f64>> {
    let Input::Samples(samples) = cell.process.input() else {
        return None;
    };
    let u: Vec<f64> = samples.iter().copied().cycle().take(cell.window).collect();
    let n = plant.order();
    let output = |a: &[f64], h: &[f64]| {
        let mut y = vec![0.0; u.len()];
        LinearModel::from_canonical(a, h, 1).simulate(&u, &mut y);
        y
    };
    let add = |x: &[f64], e: &[f64]| -> Vec<f64> { x.iter().zip(e).map(|(x, e)| x + e).collect() };
    let h = plant.h();
    let truth = output(plant.a(), &h);
    let size: f64 = truth.iter().map(|y| y * y).sum();
    let of = |errors: &Vec<f64>| {
        let model = output(&add(plant.a(), &errors[..n]), &add(&h, &errors[n..]));
        let square: f64 = truth.iter().zip(&model).map(|(y, of)| (y - of).powi(2)).sum();
        (square / size).sqrt()
    };
    Some(errors.iter().map(of).collect())
}

/// The column of a coefficient, the sign of its error there, and its true value: `alpha_i = -a_(n+1-i)`.
fn place_of(plant: &StateSpace, name: &str) -> Result<(usize, f64, f64), SuiteError> {
    let (letter, number) = name.split_at(1.min(name.len()));
    let n = plant.order();
    let found = number.parse::<usize>().ok().filter(|i| (1..=n).contains(i));
    let found = found.and_then(|i| match letter {
        "a" | "f" => Some((n - i, -1.0, -plant.a()[n - i])),
        "b" => Some((n + i - 1, 1.0, plant.h()[i - 1])),
        _ => None,
    });
    found.ok_or_else(|| SuiteError::new(UnknownName::new("coefficient", name, ["a1", "f1", "b1", "E"])))
}
