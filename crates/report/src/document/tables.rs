//! The tables of a study.

use super::extremes::LongTable;
use super::lead::{lead_figures, lead_outputs};
use crate::html::{CellText, Column};
use crate::results::Study;
use asobench_identification::metric::{Estimate, Quantile, Share, Statistic, Statistics};
use asobench_identification::number::uncertain;
use asobench_study::study::file::{Key, Scalar};
use asobench_study::study::{CellSummary, OutputSummary};

/// Columns for the settings that vary.
fn columns(study: &Study, keys: &[Key]) -> Vec<Column> {
    let column = |key: &Key| {
        let title = key.title();
        if study.is_numeric(*key) {
            Column::number(title, key.unit())
        } else {
            Column::text(title)
        }
    };
    keys.iter().map(column).collect()
}

/// The values of the settings that vary, for one cell.
fn settings(cell: &CellSummary, keys: &[Key]) -> Vec<CellText> {
    let text = |key: &Key| {
        let value = cell.setting(*key);
        match value.parse() {
            Ok(number) if cell.is_number(*key) => CellText::number(value, number),
            _ => CellText::text(value),
        }
    };
    keys.iter().map(text).collect()
}

fn count(value: u64) -> CellText {
    CellText::number(value.to_string(), value as f64)
}

fn percent(share: Share) -> CellText {
    let percent = 100.0 * share.share;
    CellText::number(uncertain(percent, 100.0 * share.mcse), tidy(percent))
}

fn quantile(quantile: Quantile) -> CellText {
    CellText::number(
        asobench_identification::number::quantile(quantile),
        quantile.value,
    )
}

/// The RMSE, or "tail" if one trial dominates it.
fn rmse(statistics: &Statistics) -> CellText {
    if statistics.dominated {
        CellText::number("tail", f64::NAN)
    } else {
        CellText::number(
            uncertain(statistics.rmse.value, statistics.rmse.mcse),
            statistics.rmse.value,
        )
    }
}

/// Medians and RMSE of the leading measures and outputs, for the page.
pub(super) fn overview(study: &Study) -> LongTable {
    let keys = study.varying();
    let (figures, outputs) = (lead_figures(study), lead_outputs(study));
    let first = figures.first().map(|measure| measure.label());
    let mut all = columns(study, &keys);
    all.push(Column::text("output"));
    for measure in &figures {
        let (name, unit) = (measure.label(), measure.unit());
        all.push(Column::number(format!("median {name}"), unit));
        all.push(Column::number(format!("RMSE {name}"), unit));
    }
    all.extend([
        Column::number("failed", "%"),
        Column::number("unstable", "%"),
    ]);
    let mut table = LongTable::new(
        "Medians and RMSE with their standard errors in units of the last digit. \"tail\": one \
        trial has more than a tenth of the sum of squares, so the RMSE means nothing; read the \
        median. \"none\": the median falls among trials without the measure.",
        all,
        &format!("median {}", first.unwrap_or_default()),
    );
    for cell in &study.summary.cells {
        let settings = settings(cell, &keys);
        for (_, label) in &outputs {
            let Some(output) = study.output(cell, label) else {
                continue;
            };
            let mut row = settings.clone();
            row.push(CellText::text(label));
            for measure in &figures {
                let statistics = output.measures.get(measure);
                row.push(
                    statistics
                        .map_or_else(CellText::default, |statistics| quantile(statistics.q50)),
                );
                row.push(statistics.map_or_else(CellText::default, rmse));
            }
            row.extend([percent(output.failed), percent(output.unstable)]);
            table.row(row);
        }
    }
    table
}

/// All results, for the CSV file.
pub(super) fn everything(study: &Study) -> LongTable {
    let keys = study.varying();
    let mut all = columns(study, &keys);
    let texts = ["output", "measure"].map(Column::text);
    all.extend(texts);
    all.extend(
        ["trials", "failed", "unstable", "with measure"].map(|name| Column::number(name, "")),
    );
    for statistic in statistics_in_csv() {
        let title = statistic.title();
        all.extend([title, &format!("{title} MCSE")].map(|name| Column::number(name, "")));
    }
    all.push(Column::number("dominated", ""));
    let mut table = LongTable::new("", all, "median");
    for cell in &study.summary.cells {
        let settings = settings(cell, &keys);
        for output in &cell.outputs {
            let label = output.label();
            let parameters = output
                .parameters
                .iter()
                .map(|(name, statistics)| (format!("error of {name}"), statistics));
            let figures = output
                .measures
                .iter()
                .map(|(measure, statistics)| (measure.to_string(), statistics));
            for (name, statistics) in figures.chain(parameters) {
                let mut row = settings.clone();
                row.extend([CellText::text(&label), CellText::text(name)]);
                row.extend(
                    numbers(output, statistics)
                        .into_iter()
                        .map(|value| CellText::number("", value)),
                );
                table.row(row);
            }
        }
    }
    table
}

/// The statistics of the CSV file in its order: the median, the other quantiles, the moments. The MSE is the RMSE squared.
fn statistics_in_csv() -> impl Iterator<Item = Statistic> {
    let mut all: Vec<Statistic> = Statistic::ALL
        .iter()
        .copied()
        .filter(|of| *of != Statistic::Mse)
        .collect();
    all.sort_by_key(|of| (*of != Statistic::Q50, !of.is_quantile()));
    all.into_iter()
}

fn numbers(output: &OutputSummary, statistics: &Statistics) -> Vec<f64> {
    let outcomes = &output.outcomes;
    let counts = [
        outcomes.trials,
        outcomes.failed(),
        outcomes.unstable,
        statistics.count,
    ]
    .map(|count| count as f64);
    let mut all = counts.to_vec();
    for statistic in statistics_in_csv() {
        let Estimate { value, mcse } = statistic.of(statistics);
        all.extend([value, brief(mcse)]);
    }
    all.push(f64::from(u8::from(statistics.dominated)));
    all
}

/// Removes the rounding error of a multiplication by 100.
pub(super) fn tidy(x: f64) -> f64 {
    format!("{x:.11e}").parse().unwrap_or(x)
}

/// Rounds to four digits: a standard error or an end of an interval has no more meaningful ones.
fn brief(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}

/// The coverage of the 95 % intervals of the coefficients.
pub(super) fn coverage(study: &Study) -> Option<LongTable> {
    let keys = study.varying();
    let mut all = columns(study, &keys);
    all.extend(["output", "coefficient"].map(Column::text));
    for (name, unit) in [
        ("covered", "%"),
        ("covered, bias removed", "%"),
        ("bias", ""),
        ("SD of the estimates", ""),
        ("reported SE", ""),
        ("error of reported SE", "%"),
        ("intervals", "trials"),
    ] {
        all.push(Column::number(name, unit));
    }
    let mut table = LongTable::new(
        "How many of a method's 95 % intervals hold the truth; how many hold the mean of its estimates (coverage \
         without bias); and the relative error of its reported standard error (root mean square) against the standard \
         deviation of its estimates. Trials without an interval are left out; the last column counts the trials with \
         one.",
        all,
        "covered",
    );
    for cell in &study.summary.cells {
        let settings = settings(cell, &keys);
        for output in &cell.outputs {
            for (name, coverage) in &output.coverage {
                let mut row = settings.clone();
                row.extend([CellText::text(output.label()), CellText::text(name)]);
                row.extend([coverage.covered, coverage.bias_eliminated].map(percent));
                let moments = [coverage.bias, coverage.empirical_se, coverage.model_se];
                row.extend(moments.map(|e| CellText::number(uncertain(e.value, e.mcse), e.value)));
                let relative = coverage.relative_error;
                let [value, mcse] = [relative.value, relative.mcse].map(|x| tidy(100.0 * x));
                row.push(CellText::number(uncertain(value, mcse), value));
                let count = coverage.covered.total;
                row.push(CellText::number(count.to_string(), count as f64));
                table.row(row);
            }
        }
    }
    (table.count() > 0).then_some(table)
}

/// Comparisons on the same trials.
pub(super) fn comparisons(study: &Study) -> Option<LongTable> {
    let keys = study.varying();
    let mut all = columns(study, &keys);
    all.extend(["first", "second", "measure"].map(Column::text));
    for (name, unit) in [
        ("median ratio", ""),
        ("5 % of ratios", ""),
        ("95 % of ratios", ""),
        ("first smaller in", "%"),
        ("mean difference", ""),
        ("RMSE ratio", ""),
        ("both", "trials"),
        ("only first", "trials"),
        ("only second", "trials"),
    ] {
        all.push(Column::number(name, unit));
    }
    let mut table = LongTable::new(
        "Ratio of the first to the second output on the same trials; an output that failed in a trial loses the comparison \
         there. \"tail\": one trial dominates.",
        all,
        "median ratio",
    );
    for cell in &study.summary.cells {
        let settings = settings(cell, &keys);
        for pair in &cell.comparisons {
            for (measure, statistics) in &pair.measures {
                let mut row = settings.clone();
                row.extend(
                    [
                        pair.first.clone(),
                        pair.second.clone(),
                        measure.label().to_owned(),
                    ]
                    .map(CellText::text),
                );
                row.extend(
                    [
                        statistics.median_ratio,
                        statistics.ratio_q05,
                        statistics.ratio_q95,
                    ]
                    .map(quantile),
                );
                row.push(percent(statistics.share_smaller));
                let moment = |e: Estimate| {
                    if statistics.dominated {
                        CellText::number("tail", f64::NAN)
                    } else {
                        CellText::number(uncertain(e.value, e.mcse), e.value)
                    }
                };
                row.extend([statistics.mean_difference, statistics.rmse_ratio].map(moment));
                row.extend(
                    [
                        statistics.both,
                        statistics.only_first,
                        statistics.only_second,
                    ]
                    .map(count),
                );
                table.row(row);
            }
        }
    }
    table.unless_empty()
}

/// Slopes over an axis.
pub(super) fn slopes(study: &Study) -> Option<LongTable> {
    let slopes = &study.summary.slopes;
    let keys: Vec<Key> = study
        .varying()
        .into_iter()
        .filter(|key| slopes.iter().any(|s| s.settings.contains_key(key)))
        .collect();
    let mut all = columns(study, &keys);
    all.extend(["measure", "statistic", "over", "output"].map(Column::text));
    for name in ["slope", "95 % from", "95 % to", "cells"] {
        all.push(Column::number(name, ""));
    }
    let mut table = LongTable::new(
        "Slopes in log-log coordinates; standard errors by the jackknife over 20 groups of trials. \
        \"tail\": a trial dominates the RMSE of a cell.",
        all,
        "slope",
    );
    for slope in slopes {
        let text = |key: &Key| {
            let value = slope.settings.get(key);
            let text = value.map_or_else(String::new, ToString::to_string);
            match value {
                Some(Scalar::Number(x)) => CellText::number(text, *x),
                _ => CellText::text(text),
            }
        };
        let asked = &slope.table;
        let mut row: Vec<CellText> = keys.iter().map(text).collect();
        row.extend(
            [
                asked.measure.label().to_owned(),
                asked.statistic.to_string(),
                crate::results::axis_label(asked.over),
                slope.output.clone(),
            ]
            .map(CellText::text),
        );
        let dominated = asked.statistic == asobench_identification::metric::SlopeOf::Rmse
            && slope
                .cells
                .iter()
                .filter_map(|cell| study.summary.cells.get(*cell))
                .any(|cell| {
                    let statistics = study.statistics(cell, &slope.output, asked.measure);
                    statistics.is_some_and(|statistics| statistics.dominated)
                });
        match slope.slope {
            Some(_) if dominated => {
                row.extend(["tail", "", ""].map(|text| CellText::number(text, f64::NAN)));
            }
            Some(found) => {
                let (low, high) = found.interval();
                row.push(CellText::number(
                    uncertain(found.value, found.mcse),
                    found.value,
                ));
                let shown = |x: f64| x.is_finite().then(|| format!("{x:.3}"));
                row.extend([low, high].map(|x| CellText::number(shown(x).unwrap_or_default(), x)));
            }
            None => row.extend(["-", "", ""].map(|text| CellText::number(text, f64::NAN))),
        }
        row.push(count(slope.cells.len() as u64));
        table.row(row);
    }
    table.unless_empty()
}

/// Bounds and the shares of trials that satisfy them.
pub(super) fn bounds(study: &Study) -> Option<LongTable> {
    let keys = study.varying();
    let mut all = columns(study, &keys);
    all.extend(["bound", "output"].map(Column::text));
    all.extend(
        [("met in", "%"), ("95 % from", "%"), ("95 % to", "%")]
            .map(|(name, unit)| Column::number(name, unit)),
    );
    all.push(Column::text("typical"));
    let mut table = LongTable::new(
        "Shares of all trials that meet a bound. Typical: Wilson's 95 % interval lies above one \
        half.",
        all,
        "met in",
    );
    for cell in &study.summary.cells {
        let settings = settings(cell, &keys);
        for bound in &cell.bounds {
            let name = format!("{} {}", bound.bound.measure.label(), bound.bound.text());
            for share in &bound.outputs {
                let mut row = settings.clone();
                row.extend([name.clone(), share.output.clone()].map(CellText::text));
                row.push(percent(share.met));
                row.extend(
                    [share.met.low, share.met.high]
                        .map(|x| CellText::number(format!("{:.2}", 100.0 * x), brief(100.0 * x))),
                );
                row.push(CellText::text(
                    asobench_identification::metric::verdict(share.met).to_string(),
                ));
                table.row(row);
            }
        }
    }
    table.unless_empty()
}

/// Failures by kind and output, with the cell that has the most of them.
pub(super) fn failures(study: &Study) -> Option<LongTable> {
    let keys = study.varying();
    let mut all = vec![
        Column::text("output"),
        Column::text("failure"),
        Column::number("trials", ""),
        Column::number("share", "%"),
    ];
    all.extend([Column::text("most in"), Column::number("share there", "%")]);
    let mut table = LongTable::new("Failed trials by kind, over all cells.", all, "share");
    for label in study.labels() {
        let outputs: Vec<(&CellSummary, &OutputSummary)> = study
            .summary
            .cells
            .iter()
            .filter_map(|cell| Some((cell, study.output(cell, label)?)))
            .collect();
        let mut kinds: Vec<&String> = outputs
            .iter()
            .flat_map(|(_, output)| output.outcomes.failures.keys())
            .collect();
        kinds.sort();
        kinds.dedup();
        let trials: u64 = outputs
            .iter()
            .map(|(_, output)| output.outcomes.trials)
            .sum();
        for kind in kinds {
            let failed =
                |output: &OutputSummary| output.outcomes.failures.get(kind).copied().unwrap_or(0);
            let total: u64 = outputs.iter().map(|(_, output)| failed(output)).sum();
            let share = |output: &OutputSummary| Share::new(failed(output), output.outcomes.trials);
            let most = outputs
                .iter()
                .max_by(|a, b| share(a.1).share.total_cmp(&share(b.1).share));
            let mut row = vec![
                CellText::text(label),
                CellText::text(kind.replace(['_', '-'], " ")),
                count(total),
                percent(Share::new(total, trials)),
            ];
            row.extend(most.map(|(cell, _)| CellText::text(crate::results::place(cell, &keys))));
            row.extend(most.map(|(_, output)| percent(share(output))));
            table.row(row);
        }
    }
    table.unless_empty()
}

/// The first failed trials of every cell, output and kind, with the command that replays the first of them. Empty for
/// results of older builds, which do not list them.
pub(super) fn failed_trials(study: &Study) -> Option<LongTable> {
    let keys = study.varying();
    let mut all = columns(study, &keys);
    all.extend(["output", "failure"].map(Column::text));
    all.push(Column::number("trials", ""));
    all.extend(["first failed trials", "to see the first"].map(Column::text));
    let mut table = LongTable::new(
        "The numbers of the first failed trials of each kind, at most ten, and the command that computes the first of \
        them again and prints every stage.",
        all,
        "trials",
    );
    for cell in &study.summary.cells {
        let settings = settings(cell, &keys);
        for output in &cell.outputs {
            for (kind, trials) in &output.outcomes.failed_trials {
                let Some(first) = trials.first() else {
                    continue;
                };
                let failed = output.outcomes.failures.get(kind).copied().unwrap_or(0);
                let listed: Vec<String> = trials.iter().map(u64::to_string).collect();
                let more = if failed > listed.len() as u64 {
                    ", ..."
                } else {
                    ""
                };
                let mut row = settings.clone();
                row.extend([output.label(), kind.replace(['_', '-'], " ")].map(CellText::text));
                row.push(count(failed));
                let listed = format!("{}{more}", listed.join(", "));
                let command = study.replay_command(cell.cell, *first);
                row.extend([listed, command].map(CellText::text));
                table.row(row);
            }
        }
    }
    table.unless_empty()
}

/// Times of the methods.
pub(super) fn times(study: &Study) -> Option<LongTable> {
    let keys = study.varying();
    let mut all = columns(study, &keys);
    all.push(Column::text("method"));
    all.extend(["median", "quartile", "third quartile"].map(|name| Column::number(name, "µs")));
    let mut table = LongTable::new(
        "Times of all passes on one thread of the machine that ran the study.",
        all,
        "median",
    );
    for time in &study.times {
        let Some(cell) = study.summary.cells.get(time.cell) else {
            continue;
        };
        let mut row = settings(cell, &keys);
        row.push(CellText::text(&time.method));
        let micro = |seconds: f64| CellText::number(format!("{:.1}", 1e6 * seconds), 1e6 * seconds);
        row.extend([time.median_seconds, time.q25_seconds, time.q75_seconds].map(micro));
        table.row(row);
    }
    table.unless_empty()
}
