//! Numbers of one cell: shares, moments, quantiles, coverages and biases of an output.

use super::super::known::{Freedom, Known};
use super::super::moment::{self, Sum};
use super::ratio::{over_theory, ratio, ratio_of_medians, wins};
use super::{MOST_RELATIVE_ERROR, Missing, Number, estimated, exact, not_kept, single};
use crate::study::file::{BoundTable, ClaimStatistic, ClaimTest, Outcome, TestKind, ValueOf};
use crate::study::{CellSummary, Measure, OutputSummary, TheoryReference};
use asobench_identification::metric::{Estimate, Quantile, Share, Statistics, Worse};

pub(super) fn in_cell(cell: &CellSummary, test: &ClaimTest) -> Result<Vec<Number>, Missing> {
    let output = cell.output(&test.output);
    let output = output.ok_or_else(|| format!("the results have no output '{}'", test.output))?;
    let numbers = match &test.kind {
        TestKind::Outcome(outcome) => single(outcome_count(cell, output, *outcome)),
        TestKind::Bound(bound) => single(bound_count(cell, &test.output, bound)),
        TestKind::Wins { measure, to } => single(wins(cell, &test.output, to, *measure)),
        TestKind::Value {
            what: ValueOf::Measure(measure),
            statistic,
        } => value(cell, output, *measure, *statistic).map(|number| vec![number]),
        TestKind::Value { what, statistic } => {
            let name = match what {
                ValueOf::Parameter(name) => Some(name),
                _ => None,
            };
            match statistic {
                ClaimStatistic::Coverage => coverages(cell, output, name),
                _ => biases(cell, output, name),
            }
        }
        TestKind::Ratio {
            measure,
            to,
            measure_of_to,
            statistic,
        } => match (TheoryReference::named(to), statistic) {
            (Some(reference), statistic) => {
                let measures = [*measure, *measure_of_to];
                over_theory(cell, output, measures, reference, *statistic)
                    .map(|number| vec![number])
            }
            (None, ClaimStatistic::Median) => single(ratio_of_medians(
                cell,
                [(&test.output, *measure), (to, *measure_of_to)],
            )),
            (None, statistic) => {
                ratio(cell, &test.output, to, *measure, *statistic).map(|number| vec![number])
            }
        },
        TestKind::Cells { .. } | TestKind::Slope(_) | TestKind::Time { .. } => Ok(Vec::new()),
    }?;
    Ok(if cell.deterministic {
        exact(numbers)
    } else {
        numbers
    })
}

fn outcome_count(
    cell: &CellSummary,
    output: &OutputSummary,
    outcome: Outcome,
) -> Result<Known, Missing> {
    let count = match outcome {
        Outcome::Failed => output.outcomes.failed(),
        Outcome::Unstable => output.outcomes.unstable,
        Outcome::Lost => match output.outcomes.lost_trials() {
            (lost, true) => lost,
            _ => return Err(not_kept("the number of lost trials")),
        },
    };
    count_of(count, cell.trials)
}

pub(super) fn count_of(count: u64, total: u64) -> Result<Known, Missing> {
    if total == 0 {
        Err("there is no trial to count".to_owned())
    } else {
        Ok(Known::Count { count, total })
    }
}

fn bound_count(cell: &CellSummary, label: &str, bound: &BoundTable) -> Result<Known, Missing> {
    let found = cell
        .bounds
        .iter()
        .find(|summary| summary.bound.limits() == bound.limits());
    let output =
        found.and_then(|summary| summary.outputs.iter().find(|output| output.output == label));
    let what = || {
        not_kept(&format!(
            "the share of trials with {} {}",
            bound.measure,
            bound.text()
        ))
    };
    let met = output.ok_or_else(what)?.met;
    count_of(met.count, met.total)
}

pub(super) fn statistics(output: &OutputSummary, measure: Measure) -> Result<&Statistics, Missing> {
    let found = output.measures.get(&measure);
    found.ok_or_else(|| not_kept(&format!("the measure {measure}")))
}

fn value(
    cell: &CellSummary,
    output: &OutputSummary,
    measure: Measure,
    statistic: ClaimStatistic,
) -> Result<Number, Missing> {
    let statistics = statistics(output, measure)?;
    let quantile = |q: f64, of_q: Quantile| Ok(quantile(statistics, q, of_q, measure).into());
    match statistic {
        ClaimStatistic::Mean => moment(cell, statistics, 1, measure),
        ClaimStatistic::Rms => moment(cell, statistics, 2, measure),
        ClaimStatistic::Q05 => quantile(0.05, statistics.q05),
        ClaimStatistic::Q25 => quantile(0.25, statistics.q25),
        ClaimStatistic::Q75 => quantile(0.75, statistics.q75),
        ClaimStatistic::Q95 => quantile(0.95, statistics.q95),
        _ => quantile(0.5, statistics.q50),
    }
}

/// Returns a mean (power 1) or root mean square (power 2) over the trials that have the measure.
pub(super) fn moment(
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
        moment::signed(estimate, statistics.sd.value, count, sum)
    } else {
        let sum = Sum::of_powers(statistics, power, measure);
        moment::not_negative(estimate, count, power, sum)
    };
    Ok(Number {
        kept: kept(count, cell.trials),
        ..Number::of_moment(found)?
    })
}

pub(super) fn kept(count: u64, total: u64) -> Option<f64> {
    (count < total).then(|| count as f64 / total as f64)
}

/// Returns a quantile over all trials.
fn quantile(statistics: &Statistics, q: f64, quantile: Quantile, measure: Measure) -> Known {
    let (n, lost) = (
        statistics.count + statistics.undefined,
        statistics.undefined,
    );
    // Lost trials rank below or above the others.
    let (below, end) = match measure.worse() {
        Worse::Larger => (0, (f64::INFINITY, statistics.count)),
        Worse::Smaller => (lost, (f64::NEG_INFINITY, lost)),
    };
    let value = if quantile.lost { end.0 } else { quantile.value };
    let extremes = [
        (statistics.min, below + 1),
        (statistics.max, below + statistics.count),
    ];
    let quantiles = [0.05, 0.25, 0.5, 0.75, 0.95].into_iter();
    let quantiles = quantiles.zip(statistics.quantiles.all().map(|quantile| quantile.value));
    let points = at_ranks(quantiles, n).chain(extremes).chain([end]);
    ranks(q, n, (value, quantile.mcse), points, false)
}

/// Returns quantiles of n values with their ranks. A quantile lies between the values of ranks j and j + 1, or equals
/// one of them; j is q (n - 1) rounded down, ranks from 0.
pub(super) fn at_ranks(
    quantiles: impl Iterator<Item = (f64, f64)>,
    n: u64,
) -> impl Iterator<Item = (f64, u64)> {
    let rank = move |q: f64| (q * n.saturating_sub(1) as f64) as u64 + 1;
    quantiles.map(move |(q, x)| (x, rank(q)))
}

/// Returns a quantile with its standard error, or, if it has none, with the ranks of known values.
pub(super) fn ranks(
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

/// Returns the shares of 95 % intervals that contain the truth, for one coefficient or for all with a standard error.
fn coverages(
    cell: &CellSummary,
    output: &OutputSummary,
    name: Option<&String>,
) -> Result<Vec<Number>, Missing> {
    let named = output.coverage.iter();
    let wanted = named.filter(|(parameter, _)| name.is_none_or(|name| name == parameter));
    let shares: Result<Vec<Number>, Missing> = wanted
        .map(|(parameter, coverage)| {
            let Share { count, total, .. } = coverage.covered;
            Ok(Number {
                name: Some(parameter.clone()),
                kept: kept(total, cell.trials),
                ..count_of(count, total)?.into()
            })
        })
        .collect();
    let shares = shares?;
    if shares.is_empty() {
        return Err(format!(
            "no coefficient of '{}' has a standard error; a run keeps them if coverage = true",
            output.label()
        ));
    }
    Ok(shares)
}

/// Returns the mean signed error over its standard deviation, delta = m / s, for one coefficient or for all. By the
/// delta method Var delta is `(Var m + delta^2 Var s - 2 delta Cov(m, s)) / s^2` with `Cov(m, s) = s^2 g / (2 M)`,
/// where g is the skewness of the errors.
fn biases(
    cell: &CellSummary,
    output: &OutputSummary,
    name: Option<&String>,
) -> Result<Vec<Number>, Missing> {
    let named = output.parameters.iter();
    // A coefficient that a delay makes 0 in every model has no errors at all.
    let estimated = |errors: &Statistics| errors.mean.value != 0.0 || errors.sd.value != 0.0;
    let wanted = named.filter(|(parameter, errors)| match name {
        Some(name) => name == parameter,
        None => estimated(errors),
    });
    let biases: Result<Vec<Number>, Missing> = wanted
        .map(|(parameter, errors)| {
            let (mean, sd) = (errors.mean, errors.sd);
            let delta = mean.value / sd.value;
            let m = errors.count as f64;
            // Older versions did not store the skewness.
            let skewness = Some(errors.skewness)
                .filter(|g| g.is_finite())
                .unwrap_or(0.0);
            let [of_mean, of_sd] = [mean.mcse / sd.value, delta * sd.mcse / sd.value];
            let square = of_mean * of_mean + of_sd * of_sd - delta * skewness / m;
            // Not a number if there are too few trials for the error of the standard deviation.
            let error = square.sqrt();
            let estimate = Estimate {
                value: delta,
                mcse: error,
            };
            let sum = Sum::about_mean(errors, &format!("the error of {parameter}"));
            Ok(Number {
                name: Some(parameter.clone()),
                kept: kept(errors.count, cell.trials),
                ..Number::of_moment(moment::bias(estimate, errors.count, sum))?
            })
        })
        .collect();
    let biases = biases?;
    if biases.is_empty() {
        return Err(not_kept("the errors of the coefficients"));
    }
    Ok(biases)
}
