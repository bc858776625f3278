//! The tables of a study.

use super::columns::Columns;
use super::extremes::LongTable;
use super::lead::{lead_figures, lead_outputs, shown_at_the_end};
use crate::html::CellText;
use crate::plot::distinct;
use crate::results::{Study, axis_label, place};
use crate::verdict_table::per_cent;
use asobench_identification::metric::{Estimate, Quantile, Share, SlopeOf, Statistic, Statistics, verdict};
use asobench_identification::number::{self, uncertain};
use asobench_study::study::file::{Key, Scalar};
use asobench_study::study::{OutputSummary, SlopeSummary};
use std::collections::BTreeSet;

fn count(value: u64) -> CellText {
    CellText::number(value.to_string(), value as f64)
}

fn percent(share: Share) -> CellText {
    let percent = 100.0 * share.share;
    CellText::number(per_cent(share), tidy(percent))
}

/// One end of the interval of a share, in per cent.
fn end_of_share(end: f64) -> CellText {
    CellText::number(format!("{:.2}", 100.0 * end), brief(100.0 * end))
}

fn quantile(quantile: Quantile) -> CellText {
    CellText::number(number::quantile(quantile), quantile.value)
}

fn estimate(estimate: Estimate) -> CellText {
    CellText::number(uncertain(estimate.value, estimate.mcse), estimate.value)
}

/// A moment, or "tail" if one trial dominates it.
fn moment(of: Estimate, dominated: bool) -> CellText {
    if dominated {
        CellText::number("tail", f64::NAN)
    } else {
        estimate(of)
    }
}

/// Removes the rounding error of a multiplication by 100.
pub(super) fn tidy(x: f64) -> f64 {
    with_digits(x, 12)
}

/// A standard error or an end of an interval has no more meaningful digits.
fn brief(x: f64) -> f64 {
    with_digits(x, 4)
}

fn with_digits(x: f64, digits: usize) -> f64 {
    format!("{x:.*e}", digits - 1).parse().unwrap_or(x)
}

/// The kind of a failure in words.
fn failure(kind: &str) -> String {
    kind.replace(['_', '-'], " ")
}

/// Medians and RMSE of the leading measures and outputs, for the page.
pub(super) fn overview(study: &Study) -> LongTable {
    let labels = lead_outputs(study);
    // The columns of the figures, and of the table that a run ends with.
    let measures = distinct(lead_figures(study).into_iter().chain(shown_at_the_end(study)));
    let rows = study.summary.cells.iter().flat_map(|cell| {
        let outputs = labels.iter().filter_map(|(_, label)| study.output(cell, label));
        outputs.map(move |output| (cell, output))
    });
    let mut columns = Columns::new(rows).settings(study, |of| of.0);
    columns = columns.text("output", |of| of.1.label());
    for measure in &measures {
        let of = |output: &OutputSummary, cell: fn(&Statistics) -> CellText| {
            output.measures.get(measure).map_or_else(CellText::default, cell)
        };
        let (name, unit) = (measure.label(), measure.entry().unit);
        columns = columns
            .number(format!("median {name}"), unit, move |item| {
                of(item.1, |statistics| quantile(statistics.q50))
            })
            .number(format!("RMSE {name}"), unit, move |item| {
                of(item.1, |statistics| moment(statistics.rmse, statistics.dominated))
            });
    }
    let first = measures.first().map_or("", |measure| measure.label());
    columns
        .number("failed", "%", |of| percent(of.1.failed))
        .number("unstable", "%", |of| percent(of.1.unstable))
        .table(
            "Medians and RMSE with their standard errors in units of the last digit. \"tail\": one \
             trial has more than a tenth of the sum of squares, so the RMSE means nothing; read the \
             median. \"none\": the median falls among trials without the measure, \
             which failed, or for a time in which what it times did not come.",
            &format!("median {first}"),
        )
}

/// The statistics of the CSV file in its order: the median, the other quantiles, the moments. The MSE is the RMSE
/// squared.
fn statistics_in_csv() -> impl Iterator<Item = Statistic> {
    let mut all: Vec<Statistic> = Statistic::ALL
        .iter()
        .copied()
        .filter(|of| *of != Statistic::Mse)
        .collect();
    all.sort_by_key(|of| (*of != Statistic::Q50, !of.is_quantile()));
    all.into_iter()
}

/// All results, for the CSV file.
pub(super) fn everything(study: &Study) -> LongTable {
    let exact = |value: f64| CellText::number("", value);
    let count = |value: u64| CellText::number("", value as f64);
    let rows = study.all_outputs().flat_map(|(cell, output)| {
        let measures = output.measures.iter();
        let measures = measures.map(|(measure, statistics)| (measure.to_string(), statistics));
        let errors = output.parameters.iter();
        let errors = errors.map(|(name, statistics)| (format!("error of {name}"), statistics));
        let all = measures.chain(errors);
        all.map(move |(name, statistics)| (cell, output, name, statistics))
    });
    let mut columns = Columns::new(rows)
        .settings(study, |of| of.0)
        .text("output", |of| of.1.label())
        .text("measure", |of| of.2.clone())
        .number("trials", "", |of| count(of.1.outcomes.trials))
        .number("failed", "", |of| count(of.1.outcomes.failed()))
        .number("unstable", "", |of| count(of.1.outcomes.unstable))
        .number("with measure", "", |of| count(of.3.count));
    for statistic in statistics_in_csv() {
        let title = statistic.title();
        columns = columns
            .number(title, "", move |of| exact(statistic.of(of.3).value))
            .number(format!("{title} MCSE"), "", move |of| {
                exact(brief(statistic.of(of.3).mcse))
            });
    }
    columns
        .number("dominated", "", |of| count(u64::from(of.3.dominated)))
        .table("", "median")
}

/// The coverage of the 95 % intervals of the coefficients.
pub(super) fn coverage(study: &Study) -> Option<LongTable> {
    let rows = study.all_outputs().flat_map(|(cell, output)| {
        let coverage = output.coverage.iter();
        coverage.map(move |(name, coverage)| (cell, output, name, coverage))
    });
    Columns::new(rows)
        .settings(study, |of| of.0)
        .text("output", |of| of.1.label())
        .text("coefficient", |of| of.2)
        .number("covered", "%", |of| percent(of.3.covered))
        .number("covered, bias removed", "%", |of| percent(of.3.bias_eliminated))
        .number("bias", "", |of| estimate(of.3.bias))
        .number("SD of the estimates", "", |of| estimate(of.3.empirical_se))
        .number("reported SE", "", |of| estimate(of.3.model_se))
        .number("error of reported SE", "%", |of| {
            let relative = of.3.relative_error;
            let [value, mcse] = [relative.value, relative.mcse].map(|x| tidy(100.0 * x));
            CellText::number(uncertain(value, mcse), value)
        })
        .number("intervals", "trials", |of| count(of.3.covered.total))
        .table(
            "How many of a method's 95 % intervals hold the truth; how many hold the mean of its estimates (coverage \
             without bias); and the relative error of its reported standard error (root mean square) against the \
             standard deviation of its estimates. Trials without an interval are left out; the last column counts the \
             trials with one. a_i is the paper's: minus the coefficient of q^-(n+1-i) in A(q); h_i is that of q^-i in \
             B(q).",
            "covered",
        )
        .unless_empty()
}

/// Comparisons on the same trials.
pub(super) fn comparisons(study: &Study) -> Option<LongTable> {
    let rows = study.summary.cells.iter().flat_map(|cell| {
        let pairs = cell.comparisons.iter().flat_map(|pair| {
            let measures = pair.measures.iter();
            measures.map(move |(measure, paired)| (pair, measure, paired))
        });
        pairs.map(move |(pair, measure, paired)| (cell, pair, measure, paired))
    });
    Columns::new(rows)
        .settings(study, |of| of.0)
        .text("first", |of| &of.1.first)
        .text("second", |of| &of.1.second)
        .text("measure", |of| of.2.label())
        .number("median ratio", "", |of| quantile(of.3.median_ratio))
        .number("5 % of ratios", "", |of| quantile(of.3.ratio_q05))
        .number("95 % of ratios", "", |of| quantile(of.3.ratio_q95))
        .number("first smaller in", "%", |of| percent(of.3.share_smaller))
        .number("mean difference", "", |of| moment(of.3.mean_difference, of.3.dominated))
        .number("RMSE ratio", "", |of| moment(of.3.rmse_ratio, of.3.dominated))
        .number("both", "trials", |of| count(of.3.both))
        .number("only first", "trials", |of| count(of.3.only_first))
        .number("only second", "trials", |of| count(of.3.only_second))
        .table(
            "Ratio of the first to the second output on the same trials; an output that failed in a trial loses the \
             comparison there. \"tail\": one trial dominates.",
            "median ratio",
        )
        .unless_empty()
}

/// Slopes over an axis.
pub(super) fn slopes(study: &Study) -> Option<LongTable> {
    let slopes = &study.summary.slopes;
    let mut keys = study.varying();
    keys.retain(|key| slopes.iter().any(|slope| slope.settings.contains_key(key)));
    let setting = |slope: &&SlopeSummary, key: Key| {
        let value = slope.settings.get(&key);
        let text = value.map_or_else(String::new, ToString::to_string);
        match value {
            Some(Scalar::Number(x)) => CellText::number(text, *x),
            _ => CellText::text(text),
        }
    };
    let is_dominated = |slope: &SlopeSummary| {
        let mut cells = slope.cells.iter().filter_map(|cell| study.summary.cells.get(*cell));
        slope.table.statistic == SlopeOf::Rmse
            && cells.any(|cell| {
                let statistics = study.statistics(cell, &slope.output, slope.table.measure);
                statistics.is_some_and(|statistics| statistics.dominated)
            })
    };
    let without = |text| CellText::number(text, f64::NAN);
    let end = |slope: &SlopeSummary, end: fn((f64, f64)) -> f64| {
        let found = slope.slope.filter(|_| !is_dominated(slope));
        let x = found.map_or(f64::NAN, |found| end(found.interval()));
        let shown = x.is_finite().then(|| format!("{x:.3}"));
        CellText::number(shown.unwrap_or_default(), x)
    };
    Columns::new(slopes.iter())
        .keys(study, &keys, setting)
        .text("measure", |slope| slope.table.measure.label())
        .text("statistic", |slope| slope.table.statistic.to_string())
        .text("over", |slope| axis_label(slope.table.over))
        .text("output", |slope| &slope.output)
        .number("slope", "", |slope| match slope.slope {
            Some(_) if is_dominated(slope) => without("tail"),
            Some(found) => CellText::number(uncertain(found.value, found.mcse), found.value),
            None => without("-"),
        })
        .number("95 % from", "", |slope| end(slope, |ends| ends.0))
        .number("95 % to", "", |slope| end(slope, |ends| ends.1))
        .number("cells", "", |slope| count(slope.cells.len() as u64))
        .table(
            "Slopes in log-log coordinates; standard errors by the jackknife over 20 groups of trials. \
             \"tail\": a trial dominates the RMSE of a cell.",
            "slope",
        )
        .unless_empty()
}

/// Bounds and the shares of trials that satisfy them.
pub(super) fn bounds(study: &Study) -> Option<LongTable> {
    let rows = study.summary.cells.iter().flat_map(|cell| {
        let bounds = cell.bounds.iter();
        let shares = bounds.flat_map(|of| of.outputs.iter().map(move |share| (&of.bound, share)));
        shares.map(move |(bound, share)| (cell, bound, share))
    });
    Columns::new(rows)
        .settings(study, |of| of.0)
        .text("bound", |of| format!("{} {}", of.1.measure.label(), of.1.text()))
        .text("output", |of| &of.2.output)
        .number("met in", "%", |of| percent(of.2.met))
        .number("95 % from", "%", |of| end_of_share(of.2.met.low))
        .number("95 % to", "%", |of| end_of_share(of.2.met.high))
        .text("typical", |of| verdict(of.2.met).to_string())
        .table(
            "Shares of all trials that meet a bound. Typical: Wilson's 95 % interval lies above one \
             half.",
            "met in",
        )
        .unless_empty()
}

/// Failures by kind and output, with the cell that has the most of them.
pub(super) fn failures(study: &Study) -> Option<LongTable> {
    let keys = study.varying();
    let rows = study.labels().iter().flat_map(|label| {
        let outputs = study.summary.cells.iter().filter_map(|cell| study.output(cell, label));
        let kinds: BTreeSet<&String> = outputs.flat_map(|output| output.outcomes.failures.keys()).collect();
        let found = kinds.into_iter().filter_map(move |kind| {
            let share = |output: &OutputSummary| {
                let failed = output.outcomes.failures.get(kind).copied().unwrap_or(0);
                Share::new(failed, output.outcomes.trials)
            };
            Some((label, kind, study.over_cells(label, share)?))
        });
        found.collect::<Vec<_>>()
    });
    Columns::new(rows)
        .text("output", |of| of.0)
        .text("failure", |of| failure(of.1))
        .number("trials", "", |of| count(of.2.all.count))
        .number("share", "%", |of| percent(of.2.all))
        .text("most in", |of| place(of.2.most.0, &keys))
        .number("share there", "%", |of| percent(of.2.most.1))
        .table("Failed trials by kind, over all cells.", "share")
        .unless_empty()
}

/// The first failed trials of every cell, output and kind, with the command that replays the first of them. Empty for
/// results of older builds, which do not list them.
pub(super) fn failed_trials(study: &Study) -> Option<LongTable> {
    let rows = study.all_outputs().flat_map(|(cell, output)| {
        let kinds = output.outcomes.failed_trials.iter();
        let kinds = kinds.filter(|(_, trials)| !trials.is_empty());
        kinds.map(move |(kind, trials)| {
            let failed = output.outcomes.failures.get(kind).copied().unwrap_or(0);
            (cell, output, kind, trials, failed)
        })
    });
    Columns::new(rows)
        .settings(study, |of| of.0)
        .text("output", |of| of.1.label())
        .text("failure", |of| failure(of.2))
        .number("trials", "", |of| count(of.4))
        .text("first failed trials", |of| {
            let listed: Vec<String> = of.3.iter().map(u64::to_string).collect();
            let more = if of.4 > listed.len() as u64 { ", ..." } else { "" };
            format!("{}{more}", listed.join(", "))
        })
        .text("to see the first", |of| study.replay_command(of.0.cell, of.3[0]))
        .table(
            "The numbers of the first failed trials of each kind, at most ten, and the command that computes the first \
             of them again and prints every stage.",
            "trials",
        )
        .unless_empty()
}

/// Times of the methods.
pub(super) fn times(study: &Study) -> Option<LongTable> {
    let rows = study.times.iter();
    let rows = rows.filter_map(|time| Some((study.summary.cells.get(time.cell)?, time)));
    let micro = |seconds: f64| CellText::number(format!("{:.1}", 1e6 * seconds), 1e6 * seconds);
    Columns::new(rows)
        .settings(study, |of| of.0)
        .text("method", |of| &of.1.method)
        .number("median", "µs", |of| micro(of.1.median_seconds))
        .number("quartile", "µs", |of| micro(of.1.q25_seconds))
        .number("third quartile", "µs", |of| micro(of.1.q75_seconds))
        .table(
            "Times of all passes on one thread of the machine that ran the study.",
            "median",
        )
        .unless_empty()
}
