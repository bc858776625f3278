//! The numbers in a study's summary that tests look at. Only this part of the engine knows where they are stored.
//!
//! Populations: shares, quantiles and paired ratios are over all trials, with failed ones ranked last. Means, root mean
//! squares and biases are over the trials that have the measure; [`Number::kept`] tells their share.

use crate::claim::known::{Bound, Known};
use crate::claim::ranked::Ranked;
use crate::claim::statistics::cell::in_cell;
use crate::claim::statistics::number::{Missing, Number, exact, not_kept, single};
use crate::claim::statistics::of_output::{kept, number, ranked};
use crate::claim::statistics::ratio::paired_median;
use crate::design::Measure;
use crate::design::file::{ClaimTest, SlopeTable, TestKind};
use crate::outcome::method_times::MethodTime;
use crate::outcome::summary::{CellSummary, Summary};
use asobench_identification::metric::{Estimate, SlopeOf, slope_weights};

mod cell;
pub(crate) mod number;
mod of_output;
mod ratio;

/// The results by which claims are judged.
#[derive(Clone, Copy)]
pub(crate) struct Results<'a> {
    pub(crate) summary: &'a Summary,
    pub(crate) times: &'a [MethodTime],
}

/// The cells of a test, as indices in the summary: one, two (from, to) or a family.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Members {
    Cell(usize),
    Pair(usize, usize),
    Family(Vec<usize>),
}

impl Results<'_> {
    /// Returns the numbers that a test looks at: one, or one for every coefficient.
    pub(crate) fn numbers(self, test: &ClaimTest, members: &Members) -> Result<Vec<Number>, Missing> {
        let cell = |index: usize| {
            let cell = self.summary.cells.get(index);
            cell.ok_or_else(|| format!("cell {index} is missing"))
        };
        match (&test.kind, members) {
            (TestKind::Cells { measure, .. }, Members::Pair(from, to)) => {
                let known = self.pair([*from, *to], &test.output, *measure);
                let sure = cell(*from)?.deterministic && cell(*to)?.deterministic;
                single(known).map(|numbers| if sure { exact(numbers) } else { numbers })
            }
            (TestKind::Slope(slope), Members::Family(cells)) => single(self.slope(slope, test, cells)),
            (TestKind::Time { to }, Members::Cell(index)) => single(self.time(*index, &test.output, to)),
            (_, Members::Cell(index)) => in_cell(cell(*index)?, test),
            _ => Err("the test is about other cells".to_owned()),
        }
    }

    /// Returns the number of trials of the cell; of the second cell of a pair, the first of a family.
    pub(crate) fn trials(self, members: &Members) -> u64 {
        let index = match members {
            Members::Cell(index) | Members::Pair(_, index) => Some(index),
            Members::Family(cells) => cells.first(),
        };
        let cell = index.and_then(|index| self.summary.cells.get(*index));
        cell.map_or(0, |cell| cell.trials)
    }

    /// Returns the ratio of an output's measure in one cell to that in another, on the same trials.
    fn pair(self, [from, to]: [usize; 2], output: &str, measure: Measure) -> Result<Known, Missing> {
        let mut pairs = self.summary.cell_pairs.iter();
        let found = pairs.find(|pair| {
            let cells = (pair.from, pair.to) == (from, to);
            cells && pair.table.measure == measure && pair.table.output == output
        });
        let what = || not_kept(&format!("pairs of cells in {measure} of '{output}'"));
        let pair = found.ok_or_else(what)?;
        let ratios = pair.ratios.as_ref().ok_or_else(what)?;
        paired_median(&pair.ratio, ratios, measure)
    }

    fn slope(self, table: &SlopeTable, test: &ClaimTest, cells: &[usize]) -> Result<Number, Missing> {
        let output = &test.output;
        let mut slopes = self.summary.slopes.iter();
        let found = slopes.find(|slope| slope.table == *table && slope.output == *output && slope.cells == cells);
        let what = || format!("slope of {} over {} of '{output}'", table.measure, table.over);
        let found = found.ok_or_else(|| not_kept(&what()))?;
        let undefined = || {
            format!(
                "the {} is undefined: {}",
                what(),
                found.undefined.clone().unwrap_or_default()
            )
        };
        let slope = found.slope.ok_or_else(undefined)?;
        let (value, error) = (slope.value, slope.mcse);
        if table.statistic == SlopeOf::Rmse {
            let estimate = Estimate { value, mcse: error };
            return Ok(Number {
                kept: self.least_kept(cells, output, table.measure),
                ..number(estimate, 1, [Bound::Unknown, Bound::Unknown], test)?
            });
        }
        let cells = self.weighted(table, output, cells)?;
        Ok(Known::Slope { value, error, cells }.into())
    }

    /// Returns the weight in a slope, and the values, of every cell.
    fn weighted(self, table: &SlopeTable, output: &str, cells: &[usize]) -> Result<Vec<(f64, Ranked)>, Missing> {
        let missing = || not_kept(&format!("cells of the slope over {}", table.over));
        let cells = cells.iter().map(|cell| self.summary.cells.get(*cell));
        let cells = cells.collect::<Option<Vec<&CellSummary>>>();
        let cells = cells.ok_or_else(missing)?;
        let x = cells.iter().map(|cell| cell.setting(table.over).parse::<f64>());
        let x: Vec<f64> = x.collect::<Result<_, _>>().map_err(|_| missing())?;
        let weights = slope_weights(&x).ok_or_else(missing)?;
        let of_cell = |(weight, cell): (f64, &CellSummary)| {
            let output = cell.output(output).ok_or_else(missing)?;
            Ok((weight, ranked(output, table.measure)?))
        };
        weights.into_iter().zip(cells).map(of_cell).collect()
    }

    /// Returns the smallest share of trials that have a measure, over some cells.
    fn least_kept(self, cells: &[usize], output: &str, measure: Measure) -> Option<f64> {
        let cells = cells.iter().filter_map(|cell| self.summary.cells.get(*cell));
        let shares = cells.filter_map(|cell| {
            let statistics = cell.output(output)?.measures.get(&measure)?;
            kept(statistics.count, cell.trials)
        });
        shares.reduce(f64::min)
    }

    /// Returns the ratio of two methods' times: the median over the rounds in which both had a turn, so that what slows
    /// the machine slows both. Rounds share the state of the machine, so their number does not reduce the error, which
    /// is the standard deviation of one round's ratio, (q75 - q25) / 1.349. Of older times, which have no rounds, it is
    /// the ratio of the medians, with the quartiles of each.
    fn time(self, cell: usize, method: &str, to: &str) -> Result<Known, Missing> {
        let time_of = |method: &str| {
            let mut times = self.times.iter();
            let time = times.find(|time| time.cell == cell && time.method == method);
            time.ok_or_else(|| format!("no times of '{method}' were measured; they need timing = true"))
        };
        let (first, second) = (time_of(method)?, time_of(to)?);
        let rounds = first.rounds.iter().zip(&second.rounds);
        let mut ratios: Vec<f64> = rounds
            .filter_map(|(first, second)| Some((*first)? / (*second)?))
            .collect();
        ratios.sort_by(f64::total_cmp);
        let spread = |low: f64, high: f64| (high - low) / 1.349;
        let found = if ratios.is_empty() {
            let relative = |time: &MethodTime| spread(time.q25_seconds, time.q75_seconds) / time.median_seconds;
            let ratio = first.median_seconds / second.median_seconds;
            (ratio, ratio * relative(first).hypot(relative(second)))
        } else {
            let at = |q: f64| ratios[((ratios.len() - 1) as f64 * q).round() as usize];
            (at(0.5), spread(at(0.25), at(0.75)))
        };
        match found {
            (value, error) if value > 0.0 && error > 0.0 && error.is_finite() => Ok(Known::Time { value, error }),
            _ => Err("the times have no spread that could be judged".to_owned()),
        }
    }
}
