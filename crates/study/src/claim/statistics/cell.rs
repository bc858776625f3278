//! Numbers of one cell: shares, moments, quantiles, coverages and biases of an output.

use crate::claim::known::{Bound, Known};
use crate::claim::statistics::number::{Missing, Number, exact, not_kept, single};
use crate::claim::statistics::of_output::{count_of, kept, moment, number, quantile, statistics};
use crate::claim::statistics::ratio::{median_ratio, over_theory, ratio_of_medians, ratio_of_rms, wins};
use crate::design::Measure;
use crate::design::file::{
    BoundTable, ClaimTest, CoefficientStatistic, Outcome, RatioStatistic, TestKind, TheoryReference, ValueStatistic,
};
use crate::outcome::summary::{CellSummary, OutputSummary};
use asobench_identification::metric::{Estimate, Share};

pub(crate) fn in_cell(cell: &CellSummary, test: &ClaimTest) -> Result<Vec<Number>, Missing> {
    let output = cell.output(&test.output);
    let output = output.ok_or_else(|| format!("the results have no output '{}'", test.output))?;
    let name = test.output.as_str();
    let numbers = match &test.kind {
        TestKind::Outcome(outcome) => single(outcome_count(cell, output, *outcome)),
        TestKind::Bound(bound) => single(bound_count(cell, name, bound)),
        TestKind::Wins { measure, to } => single(wins(cell, [name, to], *measure)),
        TestKind::Value { measure, statistic } => single(value(cell, output, (*measure, *statistic), test)),
        TestKind::Coefficient { name, statistic } => match statistic {
            CoefficientStatistic::Coverage => coverages(cell, output, name.as_ref()),
            CoefficientStatistic::ShareAbove => shares_above(cell, output, name.as_ref()),
            CoefficientStatistic::Bias => biases(cell, output, name.as_ref(), test),
        },
        TestKind::Ratio {
            measure,
            to,
            measure_of_to,
            statistic,
        } => match (TheoryReference::named(to), statistic) {
            (Some(reference), statistic) => {
                let (measures, of) = ((*measure, *measure_of_to), (reference, *statistic));
                single(over_theory(cell, output, measures, of, test))
            }
            (None, RatioStatistic::Median) => single(ratio_of_medians(cell, (name, *measure), (to, *measure_of_to))),
            (None, RatioStatistic::PairedMedian) => single(median_ratio(cell, [name, to], [*measure, *measure_of_to])),
            (None, RatioStatistic::Rms) => single(ratio_of_rms(cell, [name, to], *measure, test)),
        },
        TestKind::Cells { .. } | TestKind::Slope(_) | TestKind::Time { .. } => Ok(Vec::new()),
    }?;
    Ok(if cell.deterministic { exact(numbers) } else { numbers })
}

fn outcome_count(cell: &CellSummary, output: &OutputSummary, outcome: Outcome) -> Result<Known, Missing> {
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
    let output = found.and_then(|summary| summary.outputs.iter().find(|output| output.output == label));
    let what = || not_kept(&format!("the share of trials with {} {}", bound.measure, bound.text()));
    let met = output.ok_or_else(what)?.met;
    count_of(met.count, met.total)
}

fn value(
    cell: &CellSummary,
    output: &OutputSummary,
    (measure, statistic): (Measure, ValueStatistic),
    test: &ClaimTest,
) -> Result<Number, Missing> {
    let all = statistics(output, measure)?;
    let quantile = |q: f64, found| Ok(quantile(output, measure, (q, found))?.into());
    match statistic {
        ValueStatistic::Mean => moment(cell, output, (measure, 1), test),
        ValueStatistic::Rms => moment(cell, output, (measure, 2), test),
        ValueStatistic::Q05 => quantile(0.05, all.q05),
        ValueStatistic::Q25 => quantile(0.25, all.q25),
        ValueStatistic::Q75 => quantile(0.75, all.q75),
        ValueStatistic::Q95 => quantile(0.95, all.q95),
        ValueStatistic::Median => quantile(0.5, all.q50),
    }
}

/// Returns shares of trials of a coefficient, or of every one, that is in the list.
fn shares<'a>(
    cell: &CellSummary,
    name: Option<&String>,
    all: impl Iterator<Item = (&'a String, Share)>,
) -> Result<Vec<Number>, Missing> {
    let wanted = all.filter(|(parameter, _)| name.is_none_or(|name| name == *parameter));
    let number = |(parameter, Share { count, total, .. }): (&String, Share)| {
        Ok(Number {
            name: Some(parameter.clone()),
            kept: kept(total, cell.trials),
            ..count_of(count, total)?.into()
        })
    };
    wanted.map(number).collect()
}

/// Returns the shares of 95 % intervals that contain the truth, for one coefficient or for all with a standard error.
fn coverages(cell: &CellSummary, output: &OutputSummary, name: Option<&String>) -> Result<Vec<Number>, Missing> {
    let all = output.coverage.iter();
    let found = shares(cell, name, all.map(|(name, of)| (name, of.covered)))?;
    if found.is_empty() {
        return Err(format!(
            "no coefficient of '{}' has a standard error; a run keeps them if coverage = true",
            output.label()
        ));
    }
    Ok(found)
}

/// Returns the shares of estimates above the truth, for one coefficient or for all that are estimated.
fn shares_above(cell: &CellSummary, output: &OutputSummary, name: Option<&String>) -> Result<Vec<Number>, Missing> {
    let all = output.above_truth.iter();
    let found = shares(cell, name, all.map(|(name, share)| (name, *share)))?;
    if found.is_empty() {
        return Err(not_kept("the shares of estimates above the truth"));
    }
    Ok(found)
}

/// Returns the mean signed error over its standard deviation, delta = m / s, for one coefficient or for all. By the
/// delta method Var delta is `(Var m + delta^2 Var s - 2 delta Cov(m, s)) / s^2` with `Cov(m, s) = s^2 g / (2 M)`,
/// where g is the skewness of the errors. Errors have no bounds, so nothing is certain of their mean.
fn biases(
    cell: &CellSummary,
    output: &OutputSummary,
    name: Option<&String>,
    test: &ClaimTest,
) -> Result<Vec<Number>, Missing> {
    let named = output.parameters.iter();
    let wanted = named.filter(|(parameter, errors)| match name {
        Some(name) => name == parameter,
        // A coefficient that a delay makes 0 in every model has no errors at all.
        None => errors.mean.value != 0.0 || errors.sd.value != 0.0,
    });
    let biases: Result<Vec<Number>, Missing> = wanted
        .map(|(parameter, errors)| {
            let (mean, sd) = (errors.mean, errors.sd);
            let delta = mean.value / sd.value;
            // Older versions did not store the skewness.
            let skewness = Some(errors.skewness).filter(|g| g.is_finite());
            let [of_mean, of_sd] = [mean.mcse / sd.value, delta * sd.mcse / sd.value];
            let shared = delta * skewness.unwrap_or(0.0) / errors.count as f64;
            let estimate = Estimate {
                value: delta,
                mcse: (of_mean * of_mean + of_sd * of_sd - shared).sqrt(),
            };
            Ok(Number {
                name: Some(parameter.clone()),
                kept: kept(errors.count, cell.trials),
                ..number(estimate, 1, [Bound::Unknown, Bound::Unknown], test)?
            })
        })
        .collect();
    let biases = biases?;
    if biases.is_empty() {
        return Err(not_kept("the errors of the coefficients"));
    }
    Ok(biases)
}
