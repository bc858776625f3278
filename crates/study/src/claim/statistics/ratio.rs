//! Ratios of two outputs of a cell on the same trials, of their medians, and to theory.

use crate::claim::known::{Bound, Known};
use crate::claim::ranked::Ranked;
use crate::claim::statistics::number::{Missing, Number, not_kept};
use crate::claim::statistics::of_output::{count_of, kept, moment, number, quantile, statistics};
use crate::design::Measure;
use crate::design::file::{Assumption, ClaimTest, RatioStatistic, TheoryReference};
use crate::outcome::summary::{CellSummary, ComparisonSummary, Joint, OutputSummary};
use asobench_identification::metric::{Estimate, PairedStatistics, Sketch, Worse, correlation_of_medians};

fn comparison<'a>(
    cell: &'a CellSummary,
    [output, to]: [&str; 2],
    measure: Measure,
) -> Result<(&'a ComparisonSummary, &'a PairedStatistics), Missing> {
    let mut pairs = cell.comparisons.iter();
    let pair = pairs.find(|pair| pair.first == output && pair.second == to);
    let found = pair.and_then(|pair| Some((pair, pair.measures.get(&measure)?)));
    found.ok_or_else(|| not_kept(&format!("the comparison of '{output}' with '{to}' in {measure}")))
}

pub(crate) fn wins(cell: &CellSummary, outputs: [&str; 2], measure: Measure) -> Result<Known, Missing> {
    let smaller = comparison(cell, outputs, measure)?.1.share_smaller;
    let count = match measure.worse() {
        Worse::Larger => smaller.count,
        Worse::Smaller => smaller.total - smaller.count,
    };
    if smaller.total == 0 {
        return Err("all trials are ties".to_owned());
    }
    count_of(count, smaller.total)
}

/// Returns the median ratio of two outputs of a cell over all trials, or of two measures.
pub(crate) fn median_ratio(
    cell: &CellSummary,
    outputs: [&str; 2],
    [measure, measure_of_to]: [Measure; 2],
) -> Result<Known, Missing> {
    if measure != measure_of_to {
        let joint = joint(cell, (outputs[0], measure), (outputs[1], measure_of_to))?;
        return paired_median(&joint.ratio, &joint.ratios, measure);
    }
    let (comparison, pair) = comparison(cell, outputs, measure)?;
    let [of, to] = outputs;
    let what = || not_kept(&format!("the ratios of {measure}, '{of}' over '{to}'"));
    let ratios = comparison.ratios.get(&measure).ok_or_else(what)?;
    paired_median(pair, ratios, measure)
}

/// Returns the median ratio of two outputs, or of two cells, over all trials. A trial in which one of them fails makes
/// the ratio infinite or 0.
pub(crate) fn paired_median(pair: &PairedStatistics, ratios: &Sketch, measure: Measure) -> Result<Known, Missing> {
    let ranked = Ranked::of_ratios(pair, ratios, measure);
    if ranked.total() == 0 {
        return Err("there are no trials".to_owned());
    }
    let median = pair.median_ratio;
    Ok(Known::Quantile {
        q: 0.5,
        value: if median.lost {
            ranked.quantile(0.5)
        } else {
            median.value
        },
        error: median.mcse,
        ranked,
    })
}

/// Returns the two measures that are compared trial by trial.
fn joint<'a>(cell: &'a CellSummary, of: (&str, Measure), to: (&str, Measure)) -> Result<&'a Joint, Missing> {
    let found = cell.joint.iter().find(|joint| {
        let table = &joint.table;
        (table.output.as_str(), table.measure) == of && (table.to.as_str(), table.measure_of_to) == to
    });
    let what = || not_kept(&format!("{} of '{}' beside {} of '{}'", of.1, of.0, to.1, to.0));
    found.ok_or_else(what)
}

/// Returns both values of each trial; infinitely bad where an output is lost.
fn both(cell: &CellSummary, of: (&str, Measure), to: (&str, Measure)) -> Result<Vec<[f64; 2]>, Missing> {
    let lost = |measure: Measure| match measure.worse() {
        Worse::Larger => f64::INFINITY,
        Worse::Smaller => f64::NEG_INFINITY,
    };
    let joint = joint(cell, of, to)?;
    if joint.trials.is_empty() {
        return Err(not_kept(&format!("the trials of {} and {}", of.1, to.1)));
    }
    let pairs = joint.trials.iter();
    let ranked = pairs.map(|[a, b]| [a.unwrap_or(lost(of.1)), b.unwrap_or(lost(to.1))]);
    Ok(ranked.collect())
}

/// Returns the ratio of the root mean squares of two outputs, each over the trials that both have; with a cap over all.
pub(crate) fn ratio_of_rms(
    cell: &CellSummary,
    [output, to]: [&str; 2],
    measure: Measure,
    test: &ClaimTest,
) -> Result<Number, Missing> {
    let Some(Assumption::Cap(cap)) = test.assumption else {
        let (_, pair) = comparison(cell, [output, to], measure)?;
        let unknown = [Bound::Unknown, Bound::Unknown];
        return Ok(Number {
            kept: kept(pair.both, pair.trials()),
            ..number(pair.rmse_ratio, 2, unknown, test)?
        });
    };
    let pairs = both(cell, (output, measure), (to, measure))?.into_iter();
    let square = |x: f64| x.min(cap) * x.min(cap);
    let pairs: Vec<[f64; 2]> = pairs.map(|pair| pair.map(square)).collect();
    let n = pairs.len() as f64;
    let mean = |at: usize| pairs.iter().map(|pair| pair[at]).sum::<f64>() / n;
    let (x, y) = (mean(0), mean(1));
    let terms = pairs.iter().map(|[a, b]| (a / x - b / y).powi(2));
    let value = (x / y).sqrt();
    let mcse = value / 2.0 * (terms.sum::<f64>() / n / (n - 1.0)).sqrt();
    let top = cap * cap;
    let bound = || Bound::Squares {
        pairs: pairs.clone(),
        top,
    };
    number(Estimate { value, mcse }, 2, [bound(), bound()], test)
}

/// Returns the ratio of two medians on the same trials. With the relative errors a and b of the medians and their
/// correlation rho, the square of its own is `a^2 + b^2 - 2 rho a b`. A median among failed trials makes the ratio
/// infinite or 0.
pub(crate) fn ratio_of_medians(cell: &CellSummary, of: (&str, Measure), to: (&str, Measure)) -> Result<Known, Missing> {
    let median = |(label, measure): (&str, Measure)| {
        let output = cell.output(label);
        let output = output.ok_or_else(|| format!("the results have no output '{label}'"))?;
        Ok::<_, Missing>(statistics(output, measure)?.q50)
    };
    let (first, second) = (median(of)?, median(to)?);
    let value = match (first.lost, second.lost) {
        (true, true) => return Err("both medians are those of failed trials".to_owned()),
        (true, false) => f64::INFINITY,
        (false, true) => 0.0,
        (false, false) => first.value / second.value,
    };
    let pairs = both(cell, of, to)?;
    let column = |at: usize| pairs.iter().map(|pair| pair[at]).collect::<Vec<f64>>();
    let (a, b) = (column(0), column(1));
    let correlation = correlation_of_medians((&a, of.1.worse()), (&b, to.1.worse()));
    let (a, b) = (first.mcse / first.value, second.mcse / second.value);
    let square = a * a + b * b - 2.0 * correlation.unwrap_or(0.0) * a * b;
    let error = value * square.max(0.0).sqrt();
    Ok(Known::Medians { value, error, pairs })
}

/// Returns the ratio of a median or root mean square to that of theory or of a bound, which has no error.
pub(crate) fn over_theory(
    cell: &CellSummary,
    output: &OutputSummary,
    (measure, of_theory): (Measure, Measure),
    (reference, statistic): (TheoryReference, RatioStatistic),
    test: &ClaimTest,
) -> Result<Number, Missing> {
    let theory = output.theory.get(&of_theory);
    let theory = theory.and_then(|theory| theory.reference(reference));
    let theory = theory.ok_or_else(|| {
        let label = output.label();
        format!("there is no {reference} of {of_theory} for '{label}' here")
    })?;
    let (number, by) = if statistic == RatioStatistic::Rms {
        (moment(cell, output, (measure, 2), test)?, theory.rms)
    } else {
        let median = statistics(output, measure)?.q50;
        let known = quantile(output, measure, (0.5, median))?;
        (known.into(), theory.median)
    };
    Ok(Number {
        known: number.known.over(by),
        ..number
    })
}
