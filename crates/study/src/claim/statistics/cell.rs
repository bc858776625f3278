//! Numbers of one cell: shares, moments, quantiles, coverages and biases of an output.

use crate::claim::known::Known;
use crate::claim::moment as of_moment;
use crate::claim::moment::Sum;
use crate::claim::statistics::number::{Missing, Number, exact, not_kept, single};
use crate::claim::statistics::of_output::moment;
use crate::claim::statistics::of_output::{at_ranks, count_of, kept, ranks, statistics};
use crate::claim::statistics::ratio::{
    compared, over_theory, paired_median, ratio_of_medians, ratio_of_rms, wins,
};
use crate::design::file::bounds::BoundTable;
use crate::design::file::claim_statistic::{CoefficientStatistic, RatioStatistic, ValueStatistic};
use crate::design::file::claim_test::{ClaimTest, Outcome, TestKind};
use crate::design::file::theory_reference::TheoryReference;
use crate::design::measure::Measure;
use crate::outcome::summary::{CellSummary, OutputSummary};
use asobench_identification::metric::{Estimate, Quantile, Quantiles, Share, Statistics, Worse};

pub(crate) fn in_cell(cell: &CellSummary, test: &ClaimTest) -> Result<Vec<Number>, Missing> {
    let output = cell.output(&test.output);
    let output = output.ok_or_else(|| format!("the results have no output '{}'", test.output))?;
    let numbers = match &test.kind {
        TestKind::Outcome(outcome) => single(outcome_count(cell, output, *outcome)),
        TestKind::Bound(bound) => single(bound_count(cell, &test.output, bound)),
        TestKind::Wins { measure, to } => single(wins(cell, &test.output, to, *measure)),
        TestKind::Value { measure, statistic } => {
            value(cell, output, *measure, *statistic).map(|number| vec![number])
        }
        TestKind::Coefficient { name, statistic } => match statistic {
            CoefficientStatistic::Coverage => coverages(cell, output, name.as_ref()),
            CoefficientStatistic::Bias => biases(cell, output, name.as_ref()),
        },
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
            (None, RatioStatistic::Median) => single(ratio_of_medians(
                cell,
                [(&test.output, *measure), (to, *measure_of_to)],
            )),
            (None, RatioStatistic::PairedMedian) => {
                let pair = compared(cell, &test.output, to, *measure)?;
                Ok(vec![paired_median(pair, *measure).into()])
            }
            (None, RatioStatistic::Rms) => {
                ratio_of_rms(cell, &test.output, to, *measure).map(|number| vec![number])
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

pub(crate) fn value(
    cell: &CellSummary,
    output: &OutputSummary,
    measure: Measure,
    statistic: ValueStatistic,
) -> Result<Number, Missing> {
    let statistics = statistics(output, measure)?;
    let quantile = |q: f64, of_q: Quantile| Ok(quantile(statistics, q, of_q, measure).into());
    match statistic {
        ValueStatistic::Mean => moment(cell, statistics, 1, measure),
        ValueStatistic::Rms => moment(cell, statistics, 2, measure),
        ValueStatistic::Q05 => quantile(0.05, statistics.q05),
        ValueStatistic::Q25 => quantile(0.25, statistics.q25),
        ValueStatistic::Q75 => quantile(0.75, statistics.q75),
        ValueStatistic::Q95 => quantile(0.95, statistics.q95),
        ValueStatistic::Median => quantile(0.5, statistics.q50),
    }
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
    let values = statistics.quantiles.all().map(|quantile| quantile.value);
    let quantiles = Quantiles::SHARES.into_iter().zip(values);
    let points = at_ranks(quantiles, n).chain(extremes).chain([end]);
    ranks(q, n, (value, quantile.mcse), points, false)
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
                ..Number::of_moment(of_moment::bias(estimate, errors.count, sum))?
            })
        })
        .collect();
    let biases = biases?;
    if biases.is_empty() {
        return Err(not_kept("the errors of the coefficients"));
    }
    Ok(biases)
}
