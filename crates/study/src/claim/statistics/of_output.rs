//! Statistics of one measure of one output of a cell.

use crate::claim::freedom::Freedom;
use crate::claim::known::Known;
use crate::claim::moment as of_moment;
use crate::claim::moment::Sum;
use crate::claim::statistics::number::{MOST_RELATIVE_ERROR, Missing, Number, estimated, not_kept};
use crate::design::measure::Measure;
use crate::outcome::summary::{CellSummary, OutputSummary};
use asobench_identification::metric::Statistics;

pub(crate) fn count_of(count: u64, total: u64) -> Result<Known, Missing> {
    if total == 0 {
        Err("there is no trial to count".to_owned())
    } else {
        Ok(Known::Count { count, total })
    }
}

pub(crate) fn statistics(output: &OutputSummary, measure: Measure) -> Result<&Statistics, Missing> {
    let found = output.measures.get(&measure);
    found.ok_or_else(|| not_kept(&format!("the measure {measure}")))
}

/// Returns a mean (power 1) or root mean square (power 2) over the trials that have the measure.
pub(crate) fn moment(
    cell: &CellSummary,
    statistics: &Statistics,
    power: u8,
    measure: Measure,
) -> Result<Number, Missing> {
    let count = statistics.count;
    let estimate = if power == 1 {
        statistics.mean
    } else {
        statistics.rmse
    };
    let estimate = estimated(cell, estimate);
    let found = if power == 1 && statistics.min < 0.0 {
        let sum = Sum::about_mean(statistics, measure.name());
        of_moment::signed(estimate, statistics.sd.value, count, sum)
    } else {
        let sum = Sum::of_powers(statistics, power, measure);
        of_moment::not_negative(estimate, count, power, sum)
    };
    Ok(Number {
        kept: kept(count, cell.trials),
        ..Number::of_moment(found)?
    })
}

pub(crate) fn kept(count: u64, total: u64) -> Option<f64> {
    (count < total).then(|| count as f64 / total as f64)
}

/// Returns quantiles of n values with their ranks. A quantile lies between the values of ranks j and j + 1, or equals
/// one of them; j is q (n - 1) rounded down, ranks from 0.
pub(crate) fn at_ranks(
    quantiles: impl Iterator<Item = (f64, f64)>,
    n: u64,
) -> impl Iterator<Item = (f64, u64)> {
    let rank = move |q: f64| (q * n.saturating_sub(1) as f64) as u64 + 1;
    quantiles.map(move |(q, x)| (x, rank(q)))
}

/// Returns a quantile with its standard error, or, if it has none, with the ranks of known values.
pub(crate) fn ranks(
    q: f64,
    total: u64,
    (value, error): (f64, f64),
    points: impl Iterator<Item = (f64, u64)>,
    logarithmic: bool,
) -> Known {
    let is_near_normal = value.is_finite() && error > 0.0 && error.is_finite();
    if is_near_normal && !(logarithmic && error > MOST_RELATIVE_ERROR * value) {
        return Known::Estimate {
            value,
            error,
            freedom: Freedom::of_quantile(q, total),
            logarithmic,
        };
    }
    Known::Ranks {
        value,
        q,
        total,
        points: points.filter(|(x, _)| !x.is_nan()).collect(),
    }
}
