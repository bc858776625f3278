//! Ratios of two outputs of a cell on the same trials, of their medians, and to theory.

use crate::claim::freedom::Freedom;
use crate::claim::known::Known;
use crate::claim::moment as of_moment;
use crate::claim::moment::Sum;
use crate::claim::statistics::number::{Missing, Number, estimated, known, not_kept};
use crate::claim::statistics::of_output::moment;
use crate::claim::statistics::of_output::{at_ranks, count_of, kept, ranks, statistics};
use crate::design::file::claim_statistic::RatioStatistic;
use crate::design::file::theory_reference::TheoryReference;
use crate::design::measure::Measure;
use crate::outcome::summary::{CellSummary, OutputSummary};
use asobench_identification::metric::{PairedStatistics, SKETCH_ERROR, Worse, Z};

pub(crate) fn compared<'a>(
    cell: &'a CellSummary,
    output: &str,
    to: &str,
    measure: Measure,
) -> Result<&'a PairedStatistics, Missing> {
    let mut pairs = cell.comparisons.iter();
    let pair = pairs.find(|pair| pair.first == output && pair.second == to);
    let found = pair.and_then(|pair| pair.measures.get(&measure));
    found.ok_or_else(|| {
        not_kept(&format!(
            "the comparison of '{output}' with '{to}' in {measure}"
        ))
    })
}

pub(crate) fn wins(
    cell: &CellSummary,
    output: &str,
    to: &str,
    measure: Measure,
) -> Result<Known, Missing> {
    let smaller = compared(cell, output, to, measure)?.share_smaller;
    let count = match measure.worse() {
        Worse::Larger => smaller.count,
        Worse::Smaller => smaller.total - smaller.count,
    };
    if smaller.total == 0 {
        return Err("all trials are ties".to_owned());
    }
    count_of(count, smaller.total)
}

/// Returns the ratio of the root mean squares of two outputs, each over the trials that both have.
pub(crate) fn ratio_of_rms(
    cell: &CellSummary,
    output: &str,
    to: &str,
    measure: Measure,
) -> Result<Number, Missing> {
    let pair = compared(cell, output, to, measure)?;
    let sum = |label: &str| {
        let output = cell.output(label);
        let output = output.ok_or_else(|| format!("the results have no output '{label}'"))?;
        Ok::<_, Missing>(Sum::of_powers(statistics(output, measure)?, 2, measure))
    };
    let sums = [sum(output)?, sum(to)?];
    let ratio = estimated(cell, pair.rmse_ratio);
    Ok(Number {
        kept: kept(pair.both, pair.trials()),
        ..Number::of_moment(of_moment::ratio(ratio, pair.both, sums))?
    })
}

/// Returns the median ratio of two outputs, or of two cells, over all trials. A trial in which one of them fails makes
/// the ratio infinite or 0.
pub(crate) fn paired_median(pair: &PairedStatistics, measure: Measure) -> Known {
    let all = pair.trials();
    let (zero, infinite) = match measure.worse() {
        Worse::Larger => (pair.only_first, pair.only_second),
        Worse::Smaller => (pair.only_second, pair.only_first),
    };
    let value = match pair.median_ratio {
        quantile if !quantile.lost => quantile.value,
        _ if zero > infinite => 0.0,
        _ => f64::INFINITY,
    };
    let quantiles = [
        (0.05, pair.ratio_q05.value),
        (0.25, pair.ratio_q25.value),
        (0.5, pair.median_ratio.value),
        (0.75, pair.ratio_q75.value),
        (0.95, pair.ratio_q95.value),
    ];
    let zero = (zero > 0).then_some((0.0, zero));
    let infinite = (infinite > 0).then_some((f64::INFINITY, all - infinite));
    // Ratios below 1, and ratios equal to 1.
    let (smaller, ties) = (pair.share_smaller.count, pair.ties);
    let ones = [(1.0, smaller), (1.0, smaller + ties)];
    let points = at_ranks(quantiles.into_iter(), all).chain(ones);
    let points = points.chain(zero).chain(infinite);
    ranks(0.5, all, (value, pair.median_ratio.mcse), points, true)
}

/// Returns the ratio of two medians on the same trials. With the relative errors a and b of the medians and their
/// correlation rho, the square of its own is `a^2 + b^2 - 2 rho a b`, but not below what the bins of the sketch leave.
/// Without a stored correlation, as in folders of older versions, the medians are treated as independent. A median
/// among failed trials makes the ratio infinite or 0.
pub(crate) fn ratio_of_medians(
    cell: &CellSummary,
    medians: [(&str, Measure); 2],
) -> Result<Known, Missing> {
    let mut found = Vec::with_capacity(2);
    for (label, measure) in medians {
        let output = cell.output(label);
        let output = output.ok_or_else(|| format!("the results have no output '{label}'"))?;
        found.push(statistics(output, measure)?);
    }
    let [first, second] = [found[0], found[1]];
    let by_lost = |value: f64, point: (f64, u64)| Known::Ranks {
        value,
        q: 0.5,
        total: cell.trials,
        points: vec![point],
    };
    match (first.q50.lost, second.q50.lost) {
        (true, true) => return Err("both medians are those of failed trials".to_owned()),
        (true, false) => return Ok(by_lost(f64::INFINITY, (f64::INFINITY, first.count))),
        (false, true) => return Ok(by_lost(0.0, (0.0, second.undefined))),
        (false, false) => {}
    }
    let [(of, measure), (to, measure_of_to)] = medians;
    let mut pairs = cell.medians.iter();
    let pair = pairs.find(|pair| {
        let table = &pair.table;
        (table.output.as_str(), table.measure) == (of, measure)
            && (table.to.as_str(), table.measure_of_to) == (to, measure_of_to)
    });
    let correlation = pair.map_or(0.0, |pair| pair.correlation);
    let (first, second) = (first.q50, second.q50);
    let ratio = first.value / second.value;
    let (a, b) = (first.mcse / first.value, second.mcse / second.value);
    let square = a * a + b * b - 2.0 * correlation * a * b;
    let of_bins = 2.0 * (SKETCH_ERROR / Z).powi(2);
    // Not a number if there are too few trials for the error of a median.
    let relative = if square < of_bins { of_bins } else { square }.sqrt();
    let error = if cell.deterministic {
        0.0
    } else {
        ratio * relative
    };
    known((ratio, error), Freedom::of_quantile(0.5, cell.trials), true)
}

/// Returns the ratio of a median or root mean square to that of theory or of a bound, which has no error.
pub(crate) fn over_theory(
    cell: &CellSummary,
    output: &OutputSummary,
    [measure, of_theory]: [Measure; 2],
    reference: TheoryReference,
    statistic: RatioStatistic,
) -> Result<Number, Missing> {
    let theory = output.theory.get(&of_theory);
    let theory = theory.and_then(|theory| theory.reference(reference));
    let theory = theory.ok_or_else(|| {
        let label = output.label();
        format!("there is no {reference} of {of_theory} for '{label}' here")
    })?;
    let statistics = statistics(output, measure)?;
    if statistic == RatioStatistic::Rms {
        let mut number = moment(cell, statistics, 2, measure)?;
        number.known = number.known.over(theory.rms);
        return Ok(number);
    }
    let median = statistics.q50;
    if median.lost {
        let known = Known::Ranks {
            value: f64::INFINITY,
            q: 0.5,
            total: cell.trials,
            points: vec![(f64::INFINITY, statistics.count)],
        };
        return Ok(known.into());
    }
    let error = if cell.deterministic { 0.0 } else { median.mcse };
    let ratio = (median.value / theory.median, error / theory.median);
    Ok(known(ratio, Freedom::of_quantile(0.5, cell.trials), true)?.into())
}
