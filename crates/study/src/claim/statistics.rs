//! The numbers in a study's summary that tests look at. Only this part of the engine knows where they are stored.
//!
//! Populations: shares, quantiles and paired ratios are over all trials, with failed ones ranked last. Means, root mean
//! squares and biases are over the trials that have the measure; [`Number::kept`] tells their share.

use crate::claim::freedom::Freedom;
use crate::claim::known::Known;
use crate::claim::moment;
use crate::claim::moment::Sum;
use crate::claim::statistics::cell::in_cell;
use crate::claim::statistics::number::{Missing, Number, exact, known, not_kept, single};
use crate::claim::statistics::of_output::kept;
use crate::claim::statistics::ratio::paired_median;
use crate::design::file::claim_test::{ClaimTest, TestKind};
use crate::design::file::tables::SlopeTable;
use crate::design::measure::Measure;
use crate::outcome::method_times::MethodTime;
use crate::outcome::summary::{CellSummary, Summary};
use asobench_identification::metric::{Estimate, JACKKNIFE_GROUPS, SlopeOf, slope_weights};

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
    pub(crate) fn numbers(
        self,
        test: &ClaimTest,
        members: &Members,
    ) -> Result<Vec<Number>, Missing> {
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
            (TestKind::Slope(slope), Members::Family(cells)) => self
                .slope(slope, &test.output, cells)
                .map(|number| vec![number]),
            (TestKind::Time { to }, Members::Cell(index)) => {
                single(self.time(*index, &test.output, to))
            }
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
    fn pair(
        self,
        [from, to]: [usize; 2],
        output: &str,
        measure: Measure,
    ) -> Result<Known, Missing> {
        let mut pairs = self.summary.cell_pairs.iter();
        let found = pairs.find(|pair| {
            let cells = (pair.from, pair.to) == (from, to);
            cells && pair.table.measure == measure && pair.table.output == output
        });
        let what = || not_kept(&format!("pairs of cells in {measure} of '{output}'"));
        Ok(paired_median(&found.ok_or_else(what)?.ratio, measure))
    }

    fn slope(self, table: &SlopeTable, output: &str, cells: &[usize]) -> Result<Number, Missing> {
        let mut slopes = self.summary.slopes.iter();
        let found = slopes
            .find(|slope| slope.table == *table && slope.output == output && slope.cells == cells);
        let what = || {
            format!(
                "slope of {} over {} of '{output}'",
                table.measure, table.over
            )
        };
        let found = found.ok_or_else(|| not_kept(&what()))?;
        let undefined = || {
            format!(
                "the {} is undefined: {}",
                what(),
                found.undefined.clone().unwrap_or_default()
            )
        };
        let slope = found.slope.ok_or_else(undefined)?;
        let freedom = Freedom::constant((JACKKNIFE_GROUPS - 1) as f64);
        if table.statistic == SlopeOf::Median {
            return Ok(known((slope.value, slope.mcse), freedom, false)?.into());
        }
        let estimate = Estimate {
            value: slope.value,
            mcse: slope.mcse,
        };
        let sums = self
            .sums_of_squares(table, output, cells)
            .ok_or_else(|| not_kept(&what()))?;
        Ok(Number {
            kept: self.least_kept(cells, output, table.measure),
            ..Number::of_moment(moment::slope(estimate, freedom, &sums))?
        })
    }

    /// Returns the weight in a slope, and the sum of squares, of every cell.
    fn sums_of_squares(
        self,
        table: &SlopeTable,
        output: &str,
        cells: &[usize],
    ) -> Option<Vec<(f64, Sum)>> {
        let cells = cells.iter().map(|cell| self.summary.cells.get(*cell));
        let cells: Vec<&CellSummary> = cells.collect::<Option<_>>()?;
        let x = cells
            .iter()
            .map(|cell| cell.setting(table.over).parse::<f64>());
        let x: Vec<f64> = x.collect::<Result<_, _>>().ok()?;
        let sum = |cell: &&CellSummary| {
            let statistics = cell.output(output)?.measures.get(&table.measure)?;
            Some(Sum::of_powers(statistics, 2, table.measure))
        };
        let sums: Vec<Sum> = cells.iter().map(sum).collect::<Option<_>>()?;
        Some(slope_weights(&x)?.into_iter().zip(sums).collect())
    }

    /// Returns the smallest share of trials that have a measure, over some cells.
    fn least_kept(self, cells: &[usize], output: &str, measure: Measure) -> Option<f64> {
        let cells = cells
            .iter()
            .filter_map(|cell| self.summary.cells.get(*cell));
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
            time.ok_or_else(|| {
                format!("no times of '{method}' were measured; they need timing = true")
            })
        };
        let (first, second) = (time_of(method)?, time_of(to)?);
        let rounds = first.rounds.iter().zip(&second.rounds);
        let mut ratios: Vec<f64> = rounds
            .filter_map(|(first, second)| Some((*first)? / (*second)?))
            .collect();
        ratios.sort_by(f64::total_cmp);
        let spread = |low: f64, high: f64| (high - low) / 1.349;
        let found = if ratios.is_empty() {
            let relative = |time: &MethodTime| {
                spread(time.q25_seconds, time.q75_seconds) / time.median_seconds
            };
            let ratio = first.median_seconds / second.median_seconds;
            (ratio, ratio * relative(first).hypot(relative(second)))
        } else {
            let at = |q: f64| ratios[((ratios.len() - 1) as f64 * q).round() as usize];
            (at(0.5), spread(at(0.25), at(0.75)))
        };
        known(found, Freedom::FIXED, true)
    }
}
