//! The law of d, shown: maximum likelihood from the truth in many runs beside the law of an efficient method.

use super::competitor::Competitor;
use super::manifest::{self, Division};
use super::results::runs_of;
use super::scenario::{Scenario, Suite, SuiteStudy};
use super::score::mean_of;
use super::stored::{Stored, SuiteError};
use crate::claim::Verdict;
use asobench_identification::metric::Estimate;
use asobench_identification::theory::distribution;
use serde::{Deserialize, Serialize};

/// The mean of d is in here where the law holds.
const NEAR: [f64; 2] = [0.9, 1.1];
/// With a larger standard error of the mean nothing is said for the law.
const UNCERTAIN: f64 = 0.05;
/// The level of Kolmogorov's test over all scenarios together.
const LEVEL: f64 = 0.05;

/// The law of d in some scenarios.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Laws {
    /// The edition of the suite.
    pub suite: String,
    /// The contest; all but the open one measure d alike.
    pub contest: Division,
    /// Runs of each scenario.
    pub runs: u64,
    /// The scenarios.
    pub scenarios: Vec<Law>,
}

/// The law of d in a scenario.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Law {
    /// The scenario.
    pub name: String,
    /// The checksum of what it is.
    pub content: String,
    /// Lost runs.
    pub lost: u64,
    /// The mean of d over the other runs, and its standard error.
    pub mean: [f64; 2],
    /// The p-value of Kolmogorov's test of d, infinite in a lost run, against its law.
    pub p: f64,
    /// The same corrected over all scenarios (Holm).
    pub holm: f64,
}

impl Law {
    /// Whether the law holds: a mean of 0.9 to 1.1, known to 0.05, and no certain difference from the law. It does not
    /// hold where there is one, or where the mean is outside by two standard errors; else the runs do not say.
    pub fn verdict(&self) -> Verdict {
        let [mean, error] = self.mean;
        let outside = (NEAR[0] - mean).max(mean - NEAR[1]);
        if self.holm < LEVEL || outside > 2.0 * error {
            Verdict::DoesNotHold
        } else if outside <= 0.0 && error <= UNCERTAIN {
            Verdict::Holds
        } else {
            Verdict::Undecided
        }
    }
}

/// Runs the ideal in the scenarios of a study that it is for.
///
/// # Errors
/// [`SuiteError`].
pub fn law(study: &SuiteStudy, runs: u64, threads: usize) -> Result<Vec<Law>, SuiteError> {
    let (experiment, declined) = study.experiment(&[Competitor::Ideal], runs)?;
    if let Some((_, why)) = declined.first() {
        return Err(SuiteError::of(&study.name)(why));
    }
    let Some(experiment) = experiment else {
        return Ok(Vec::new());
    };
    let found = runs_of(&experiment, runs, threads).map_err(SuiteError::of(&study.name))?;
    let both = study.scenarios.iter().zip(found);
    let laws = both.map(|(scenario, runs)| {
        let d = runs.iter().map(|(row, _)| match study.why_lost(row) {
            None => row[study.distance()],
            Some(_) => f64::INFINITY,
        });
        of_sample(scenario, d.collect())
    });
    Ok(laws.collect())
}

/// The law of a sample. Kolmogorov's distance D has the p-value `2 sum_k (-1)^(k-1) exp(-2 k^2 x^2)`,
/// `x = (sqrt(n) + 0.12 + 0.11/sqrt(n)) D` (Stephens, JRSS B 32, 1970).
fn of_sample(scenario: &Scenario, mut d: Vec<f64>) -> Law {
    d.sort_unstable_by(f64::total_cmp);
    let n = d.len() as f64;
    let apart = d.iter().enumerate().map(|(i, d)| {
        let law = if d.is_finite() {
            distribution(&scenario.weights, *d)
        } else {
            1.0
        };
        let below = if d.is_finite() { (i + 1) as f64 / n - law } else { 0.0 };
        (law - i as f64 / n).max(below)
    });
    let apart = apart.fold(0.0, f64::max);
    let x = (n.sqrt() + 0.12 + 0.11 / n.sqrt()) * apart;
    let term = |k: u32| {
        let sign = if k % 2 == 1 { 2.0 } else { -2.0 };
        sign * (-2.0 * f64::from(k * k) * x * x).exp()
    };
    let p = if x < 0.2 { 1.0 } else { (1..100).map(term).sum::<f64>() };
    let kept: Vec<f64> = d.iter().copied().filter(|d| d.is_finite()).collect();
    let Estimate { value, mcse } = mean_of(&kept);
    Law {
        name: scenario.name.clone(),
        content: scenario.content.clone(),
        lost: d.len() as u64 - kept.len() as u64,
        // Nothing is known of a law with fewer than two runs.
        mean: if kept.len() < 2 { [f64::MAX, 0.0] } else { [value, mcse] },
        p: p.clamp(0.0, 1.0),
        holm: 1.0,
    }
}

impl Laws {
    /// The laws of scenarios of a suite, with Holm's correction over all of them.
    pub fn new((suite, contest): (String, Division), runs: u64, mut scenarios: Vec<Law>) -> Self {
        let mut order: Vec<usize> = (0..scenarios.len()).collect();
        order.sort_by(|i, j| scenarios[*i].p.total_cmp(&scenarios[*j].p));
        let mut most = 0.0_f64;
        for (place, i) in order.iter().enumerate() {
            most = most.max(scenarios[*i].p * (order.len() - place) as f64);
            scenarios[*i].holm = most.min(1.0);
        }
        Self {
            suite,
            contest,
            runs,
            scenarios,
        }
    }

    /// Those that the program carries for a suite: of an edition with the same F, and of the same d.
    ///
    /// # Errors
    /// If they are damaged.
    pub fn shipped(suite: &Suite) -> Result<Option<Self>, SuiteError> {
        let laws = Self::carried(manifest::LAW)?;
        Ok(laws.filter(|of| suite.manifest.is_alike(&of.suite) && suite.division.is_open() == of.contest.is_open()))
    }

    /// The law in a scenario; `None` where it was not shown.
    pub fn of(&self, scenario: &Scenario) -> Option<&Law> {
        self.scenarios.iter().find(|of| of.content == scenario.content)
    }
}

impl Stored for Laws {}

impl Law {
    /// The mean of d with its standard error.
    pub fn mean(&self) -> Estimate {
        let [value, mcse] = self.mean;
        Estimate { value, mcse }
    }
}
