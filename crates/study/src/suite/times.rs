//! Times of methods, measured apart from results: on one thread, all methods of a scenario in turns, as ratios to a
//! reference in the same round.

use super::manifest;
use super::results::{ResultsError, parsed, rounded};
use super::scenario::Scenario;
use super::score::Estimated;
use crate::design::Experiment;
use crate::files;
use crate::run::trial::Trial;
use crate::text::visible;
use asobench_identification::estimator::SetupError;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The method whose time is the unit.
pub const REFERENCE: &str = "arx";
/// A run that takes longer, in seconds, is lost.
pub const TIME_LIMIT: f64 = 60.0;
/// A turn lasts about so many seconds, within these numbers of runs of a record. The shortest run of a turn counts:
/// other work of the machine only adds.
const TURN: f64 = 5e-3;
const RUNS: [f64; 2] = [3.0, 50.0];
/// The standard error of a median over that of a mean, for normal numbers.
const OF_MEDIAN: f64 = 1.2533;

/// The times of some methods.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Times {
    /// The edition of the suite.
    pub suite: String,
    /// The program that measured, with its instruction set.
    pub program: String,
    /// The methods.
    pub methods: Vec<MethodTimes>,
}

/// The times of a method.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MethodTimes {
    /// The method.
    pub method: String,
    /// The scenarios that it is for.
    pub scenarios: Vec<ScenarioTimes>,
}

/// The times of a method in a scenario.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScenarioTimes {
    /// The scenario.
    pub name: String,
    /// The checksum of what it is.
    pub content: String,
    /// The median time of a run in seconds.
    pub seconds: f64,
    /// In each round the time of a run over that of the reference; null beyond the limit.
    pub ratios: Vec<Option<f64>>,
}

/// Times methods on the first records of a scenario, each round on one record. Each experiment has a single method, and
/// `cell` is the scenario's. The first method is the reference. A round before the first warms up and is not counted.
///
/// # Errors
/// [`SetupError`].
pub fn time(
    scenario: &Scenario,
    (cell, rounds): (usize, u64),
    methods: &[(String, &Experiment)],
) -> Result<Vec<ScenarioTimes>, SetupError> {
    let trials = methods.iter().map(|(_, of)| Trial::new(of, &of.cells[cell]));
    let mut trials: Vec<Trial<'_>> = trials.collect::<Result<_, _>>()?;
    let run = |trial: &mut Trial<'_>, number: u64| -> Result<f64, SetupError> {
        let spent = trial.measure(number, |_, _, _, _| ())?;
        Ok(spent.estimation.as_secs_f64())
    };
    let mut warm = Vec::new();
    for trial in &mut trials {
        warm.push(run(trial, 0)?);
    }
    let count = trials.len();
    let mut seconds = vec![Vec::new(); count];
    for round in 0..rounds {
        for turn in 0..count {
            let place = (turn + round as usize) % count;
            let mut least = f64::INFINITY;
            if warm[place] <= TIME_LIMIT {
                let runs = (TURN / warm[place].max(1e-9)).clamp(RUNS[0], RUNS[1]);
                for _ in 0..runs as u32 {
                    least = least.min(run(&mut trials[place], round)?);
                }
            }
            seconds[place].push(least);
        }
    }
    let of = |own: &Vec<f64>| ScenarioTimes {
        name: scenario.name.clone(),
        content: scenario.content.clone(),
        seconds: rounded(median(own.clone()).min(f64::MAX), 4),
        ratios: own
            .iter()
            .zip(&seconds[0])
            .map(|(own, reference)| (*own <= TIME_LIMIT).then(|| rounded(own / reference, 4)))
            .collect(),
    };
    Ok(seconds.iter().map(of).collect())
}

fn median(mut x: Vec<f64>) -> f64 {
    x.sort_unstable_by(f64::total_cmp);
    let middle = x.len() / 2;
    if x.len() % 2 == 1 {
        x[middle]
    } else {
        0.5 * (x[middle - 1] + x[middle])
    }
}

impl ScenarioTimes {
    /// The logarithm of the median ratio with its standard error over rounds; infinite if half of the rounds is lost.
    fn logarithm(&self) -> Estimated {
        let logs = self.ratios.iter().map(|of| of.map_or(f64::INFINITY, f64::ln));
        let logs: Vec<f64> = logs.collect();
        let (count, value) = (logs.len() as f64, median(logs.clone()));
        let kept: Vec<f64> = logs.into_iter().filter(|log| log.is_finite()).collect();
        let mean = kept.iter().sum::<f64>() / kept.len() as f64;
        let square: f64 = kept.iter().map(|log| (log - mean).powi(2)).sum();
        let error = OF_MEDIAN * (square / (count - 1.0).max(1.0) / count).sqrt();
        Estimated { value, error }
    }
}

impl MethodTimes {
    /// The geometric mean over scenarios of the median ratio, with its standard error over rounds; infinite if a run
    /// beyond the limit is typical of a scenario.
    pub fn typical(&self) -> Estimated {
        let each = self.scenarios.iter().map(ScenarioTimes::logarithm);
        let each: Vec<Estimated> = each.collect();
        let count = each.len() as f64;
        let value = (each.iter().map(|of| of.value).sum::<f64>() / count).exp();
        let square: f64 = each.iter().map(|of| of.error * of.error).sum();
        let error = if value.is_finite() {
            value * square.sqrt() / count
        } else {
            0.0
        };
        Estimated { value, error }
    }

    /// The smallest and the largest median ratio of a scenario.
    pub fn extremes(&self) -> [f64; 2] {
        let each = self.scenarios.iter().map(|of| of.logarithm().value.exp());
        each.fold([f64::INFINITY, 0.0], |[low, high], of| [low.min(of), high.max(of)])
    }

    /// The longest median time of a run.
    pub fn longest(&self) -> Duration {
        let longest = self.scenarios.iter().map(|of| of.seconds).fold(0.0, f64::max);
        Duration::from_secs_f64(longest.min(1e9))
    }
}

impl Times {
    /// Reads the text of a file and checks its checksum, and that a run could have written it.
    ///
    /// # Errors
    /// [`ResultsError::Damaged`].
    pub fn parse(text: &str) -> Result<Self, ResultsError> {
        parsed::<Self>(text)?.checked()
    }

    /// Checks that a run could have written it.
    pub(super) fn checked(self) -> Result<Self, ResultsError> {
        let all = self.methods.iter().flat_map(|of| &of.scenarios);
        let known = |x: f64| x > 0.0 && x.is_finite();
        let mut unsound =
            all.filter(|of| of.ratios.is_empty() || of.seconds < 0.0 || !of.ratios.iter().flatten().all(|x| known(*x)));
        match unsound.next() {
            Some(of) => Err(ResultsError::Damaged(format!(
                "scenario {}: expected times of one round or more",
                visible(&of.name)
            ))),
            None => Ok(self),
        }
    }

    /// Returns the text of the file, with its checksum.
    pub fn text(&self) -> String {
        files::sealed(self)
    }

    /// Those that the program carries.
    ///
    /// # Errors
    /// [`ResultsError::Damaged`].
    pub fn shipped() -> Result<Option<Self>, ResultsError> {
        let text = manifest::TIMES;
        (!text.is_empty()).then(|| Self::parse(text)).transpose()
    }

    /// The times of a method in some scenarios; `None` if one was not measured.
    pub fn of<'a>(&self, method: &str, scenarios: impl Iterator<Item = &'a Scenario>) -> Option<MethodTimes> {
        let found = self.methods.iter().find(|of| of.method == method)?;
        let one = |scenario: &Scenario| {
            let mut own = found.scenarios.iter();
            own.find(|of| of.content == scenario.content).cloned()
        };
        let own: Vec<ScenarioTimes> = scenarios.filter_map(one).collect();
        (!own.is_empty()).then(|| MethodTimes {
            method: method.to_owned(),
            scenarios: own,
        })
    }
}
