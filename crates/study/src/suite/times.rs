//! Times of methods, measured apart from results: on one thread, all methods of a scenario in turns, as ratios to a
//! reference in the same round.

use super::manifest;
use super::results::rounded;
use super::scenario::Scenario;
use super::score::mean_of;
use super::stored::{Stored, SuiteError};
use crate::design::Experiment;
use crate::run::trial::Trial;
use crate::text::visible;
use asobench_identification::estimator::SetupError;
use asobench_identification::metric::Estimate;
use serde::{Deserialize, Serialize};

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
    methods: &[&Experiment],
) -> Result<Vec<ScenarioTimes>, SetupError> {
    let trials = methods.iter().map(|of| Trial::new(of, &of.cells[cell]));
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
    f64::midpoint(x[(x.len() - 1) / 2], x[x.len() / 2])
}

impl ScenarioTimes {
    /// The logarithm of the median ratio with its standard error over rounds; infinite if half of the rounds is lost.
    fn logarithm(&self) -> Estimate {
        let logs = self.ratios.iter().map(|of| of.map_or(f64::INFINITY, f64::ln));
        let logs: Vec<f64> = logs.collect();
        let kept: Vec<f64> = logs.iter().copied().filter(|log| log.is_finite()).collect();
        Estimate {
            mcse: OF_MEDIAN * mean_of(&kept).mcse,
            value: median(logs),
        }
    }
}

impl MethodTimes {
    /// The geometric mean over scenarios of the median ratio, with its standard error over rounds; infinite if a run
    /// beyond the limit is typical of a scenario.
    pub fn typical(&self) -> Estimate {
        let each = self.scenarios.iter().map(ScenarioTimes::logarithm);
        let each: Vec<Estimate> = each.collect();
        let count = each.len() as f64;
        let value = (each.iter().map(|of| of.value).sum::<f64>() / count).exp();
        let square: f64 = each.iter().map(|of| of.mcse * of.mcse).sum();
        let mcse = if value.is_finite() {
            value * square.sqrt() / count
        } else {
            0.0
        };
        Estimate { value, mcse }
    }

    /// The smallest and the largest median ratio of a scenario.
    pub fn extremes(&self) -> [f64; 2] {
        let each = self.scenarios.iter().map(|of| of.logarithm().value.exp());
        each.fold([f64::INFINITY, 0.0], |[low, high], of| [low.min(of), high.max(of)])
    }

    /// The longest median time of a run, in seconds.
    pub fn longest(&self) -> f64 {
        self.scenarios.iter().map(|of| of.seconds).fold(0.0, f64::max)
    }
}

impl Stored for Times {
    fn fault(&self) -> Option<String> {
        let mut all = self.methods.iter().flat_map(|of| &of.scenarios);
        let known = |x: &f64| *x > 0.0 && x.is_finite();
        let is_sound =
            |of: &ScenarioTimes| !of.ratios.is_empty() && of.seconds >= 0.0 && of.ratios.iter().flatten().all(known);
        let of = all.find(|of| !is_sound(of))?;
        let name = visible(&of.name);
        Some(format!("scenario {name}: expected times of one round or more"))
    }
}

impl Times {
    /// Those that the program carries.
    ///
    /// # Errors
    /// If they are damaged.
    pub fn shipped() -> Result<Option<Self>, SuiteError> {
        Self::carried(manifest::TIMES)
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
