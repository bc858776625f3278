//! C6: what the ways to solve for p cost and what they keep.
//!
//! One method is cheaper than another in a cell where the upper quartile of its times is below the other's lower one.

use super::{Finding, Number, Studies, count_of, listed, settle};
use crate::report::results::{Study, Time, median};
use crate::study::{CellSummary, Measure};
use std::collections::BTreeMap;

/// Solvers that work on (N-n) x (N-n) matrices or larger.
const NAIVE: [&str; 2] = ["dual", "augmented"];
const PARTITIONED: &str = "partitioned";

/// In how many cells the partitioned inverse is cheaper than another solver.
#[derive(Default)]
struct Race {
    cheaper: usize,
    dearer: usize,
    cells: usize,
    /// The lengths of records with which it is dearer.
    dearer_at: Vec<usize>,
    /// The other's time over that of the partitioned inverse, in every cell.
    ratios: Vec<f64>,
}

/// C6.
pub(super) fn cost(studies: Studies<'_>) -> Finding {
    let Some(study) = studies.named("solvers") else {
        return Finding::not_run("solvers");
    };
    let races = races(study);
    if races.is_empty() {
        return Finding::undecided(
            study,
            "No times were measured: the experiment needs timing = true and a method with each solver.",
        );
    }
    let judged = |of: &Race| (of.cheaper == of.cells, of.dearer > 0);
    let all: Vec<(bool, bool)> = races.values().map(judged).collect();
    let yes = all.iter().filter(|(always, _)| *always).count();
    let no = all.iter().filter(|(_, lost)| *lost).count();
    let verdict = settle(yes, no, all.len() - yes - no);
    let text = |(solver, race): (&String, &Race)| {
        let (low, high) = ends(&race.ratios);
        format!(
            "{solver} {} to {} times as long ({})",
            factor(low),
            factor(high),
            race.outcome()
        )
    };
    let texts: Vec<String> = races.iter().map(text).collect();
    let mut because = format!(
        "Times over those of the partitioned inverse, least to greatest of {} cells: {}. Dual and augmented solve systems of size N - n or more.",
        races.values().map(|race| race.cells).max().unwrap_or(0),
        texts.join("; ")
    );
    if !NAIVE.iter().any(|naive| races.contains_key(*naive)) {
        because.truncate(because.find(" Dual").unwrap_or(because.len()));
    }
    because.push_str(&digits(study));
    let numbers = races.iter().map(|(solver, race)| {
        let middle = middle(race.ratios.clone());
        Number::new(
            format!("median time of {solver} over partitioned"),
            middle,
            f64::NAN,
        )
    });
    Finding::new(study, verdict, because)
        .numbers(numbers.collect())
        .led_by(&against(&races))
}

impl Race {
    /// Where it is cheaper and dearer beyond doubt.
    fn outcome(&self) -> String {
        if self.dearer == 0 {
            return format!("longer in {}", count_of(self.cheaper, self.cells));
        }
        let mut at = self.dearer_at.clone();
        at.sort_unstable();
        at.dedup();
        let at = match at.as_slice() {
            [one] => format!(", N = {one}"),
            [first, .., last] => format!(", N from {first} to {last}"),
            [] => String::new(),
        };
        format!(
            "longer in {}, shorter in {}{at}",
            count_of(self.cheaper, self.cells),
            self.dearer
        )
    }
}

/// Against which solvers the claim holds, and against which it does not.
fn against(races: &BTreeMap<String, Race>) -> String {
    let named = |wanted: fn(&Race) -> bool| -> Vec<String> {
        let found = races.iter().filter(|(_, race)| wanted(race));
        found.map(|(solver, _)| solver.clone()).collect()
    };
    let [always, never] = [
        named(|race| race.cheaper == race.cells),
        named(|race| race.dearer > 0),
    ];
    if always.is_empty() || never.is_empty() {
        return String::new();
    }
    format!(
        "It holds in every cell against {}, and not against {}.",
        listed(&always),
        listed(&never)
    )
}

/// A factor with two digits.
fn factor(x: f64) -> String {
    if x >= 10.0 {
        format!("{x:.0}")
    } else {
        format!("{x:.1}")
    }
}

fn ends(values: &[f64]) -> (f64, f64) {
    let fold = |(low, high): (f64, f64), x: &f64| (low.min(*x), high.max(*x));
    values.iter().fold((f64::INFINITY, 0.0), fold)
}

fn middle(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The partitioned inverse against every other solver of the same estimator.
fn races(study: &Study) -> BTreeMap<String, Race> {
    let mut races: BTreeMap<String, Race> = BTreeMap::new();
    let named = |time: &Time| study.solver(&time.method);
    for own in study
        .times
        .iter()
        .filter(|time| named(time).as_deref() == Some(PARTITIONED))
    {
        for other in study.times.iter().filter(|time| time.cell == own.cell) {
            let same =
                study.options(&other.method).is_some() == study.options(&own.method).is_some();
            let Some(solver) = named(other).filter(|solver| same && solver != PARTITIONED) else {
                continue;
            };
            let race = races.entry(solver).or_default();
            race.cells += 1;
            race.cheaper += usize::from(own.q75_seconds < other.q25_seconds);
            if own.q25_seconds > other.q75_seconds {
                race.dearer += 1;
                race.dearer_at
                    .extend(study.summary.cells.get(own.cell).map(|cell| cell.window));
            }
            race.ratios.push(other.median_seconds / own.median_seconds);
        }
    }
    races
}

/// The measure whose logarithm counts the digits: e_a, of rounding alone where there is no noise.
fn digits_of(cell: &CellSummary, label: &str) -> Option<f64> {
    let error = median(cell, label, Measure::Ea).value;
    (cell.eta == 0.0 && error > 0.0).then(|| -error.log10())
}

/// What each solver keeps of the digits, against the partitioned inverse.
fn digits(study: &Study) -> String {
    let Some(first) = study.summary.cells.first() else {
        return String::new();
    };
    let outputs: Vec<(String, String)> = first
        .outputs
        .iter()
        .filter(|output| output.pass > 0)
        .filter_map(|output| Some((study.solver(&output.estimator)?, output.label())))
        .collect();
    let Some((_, own)) = outputs.iter().find(|(solver, _)| solver == PARTITIONED) else {
        return String::new();
    };
    let texts: Vec<String> = outputs
        .iter()
        .filter(|(_, label)| label != own)
        .filter_map(|(solver, label)| {
            let more = |cell: &CellSummary| Some(digits_of(cell, label)? - digits_of(cell, own)?);
            let all: Vec<f64> = study.summary.cells.iter().filter_map(more).collect();
            (!all.is_empty()).then(|| format!("{solver} {:+.1}", middle(all)))
        })
        .collect();
    let kept: Vec<f64> = study
        .summary
        .cells
        .iter()
        .filter_map(|cell| digits_of(cell, own))
        .collect();
    if kept.is_empty() || texts.is_empty() {
        return String::new();
    }
    let (low, high) = ends(&kept);
    format!(
        " Without noise the partitioned inverse keeps {low:.1} to {high:.1} digits of a; what the others keep more, in the median cell: {}.",
        listed(&texts)
    )
}
