//! The verdict table, at most 80 columns wide.

use super::number::{uncertain, uncertain_within};
use super::table::{CellText, Column, Table};
use asobench_identification::metric::{Quantile, Share, Statistics};
use asobench_study::study::{BoundSummary, CellSummary, OutputShare, Summary};
use asobench_study::text::{number, visible};

/// Width of the column `median [5 %, 95 %]`.
const SPREAD: usize = 39;

/// The verdicts on every bound, with the numbers behind them.
pub fn verdict_table(summary: &Summary) -> String {
    let columns = [
        Column::text("claim       bound").width(20),
        Column::text("").width(5),
        Column::text("median [5 %, 95 %]").width(SPREAD),
        Column::number("bound met in", "").width(13),
    ];
    let table = Table::new("", columns.to_vec());
    let rule = "-".repeat(80) + "\n";
    let mut text = table.text_head();
    for cell in &summary.cells {
        text.extend([rule.clone(), heading(cell)]);
        let rows = cell.bounds.iter().flat_map(|bound| rows(cell, bound));
        text.extend(rows.map(|row| table.text_row(&row)));
    }
    text + &rule
}

/// The line above the bounds of a cell.
fn heading(cell: &CellSummary) -> String {
    let noise = if cell.eta == 0.0 {
        "noise-free".to_owned()
    } else {
        format!("eta = {} %", number(cell.eta))
    };
    let ends = [cell.outputs.first(), cell.outputs.last()].into_iter().flatten();
    let failed = ends.map(|output| format!("{} {}", output.label(), output.outcomes.failed()));
    let failed = failed.collect::<Vec<_>>().join(", ");
    let before = if failed.is_empty() { "" } else { "; failed: " };
    format!(
        "{}  {noise}, N = {}, {} trials{before}{failed}\n",
        visible(&cell.claim),
        cell.window,
        cell.trials
    )
}

/// The first and the last output under a bound.
fn rows(cell: &CellSummary, bound: &BoundSummary) -> Vec<[CellText; 4]> {
    let asked = &bound.bound;
    let limit = match asked.rounding {
        Some(_) => "= 0".to_owned(),
        None => asked.text(),
    };
    let lines = [
        (format!("    {:<7} {limit}", asked.label()), bound.outputs.first()),
        (format!("    {}", bound.verdict), bound.outputs.last()),
    ];
    let row = |(left, of): (String, Option<&OutputShare>)| {
        let of = of?;
        let output = cell.output(&of.output);
        let statistics = output.and_then(|output| output.measures.get(&asked.measure));
        let spread = statistics.map_or_else(String::new, spread);
        Some([left, of.output.clone(), spread, share(of.met)].map(CellText::text))
    };
    lines.into_iter().filter_map(row).collect()
}

/// A share in per cent with its standard error, if it has one. If no trial or every trial counts, the other end of the
/// 95 % interval replaces the error.
pub fn share(met: Share) -> String {
    let percent = |share: f64| 100.0 * share;
    if met.count == 0 {
        format!("0 (<{:.2} %)", percent(met.high))
    } else if met.count == met.total {
        format!("all (>{:.1} %)", (10.0 * percent(met.low)).floor() / 10.0)
    } else if met.mcse.is_nan() {
        format!("{:.1} %", percent(met.share))
    } else {
        format!("{:.1} \u{b1} {:.1} %", percent(met.share), percent(met.mcse))
    }
}

/// A share in per cent with its binomial standard error: `9(3)`, and `1(1)` for one trial of 100; `0` and `100` where
/// no trial or every trial counts, which have none.
pub(crate) fn per_cent(of: Share) -> String {
    match of.count {
        _ if of.total == 0 => "-".to_owned(),
        0 => "0".to_owned(),
        count if count == of.total => "100".to_owned(),
        _ => {
            let error = (of.share * (1.0 - of.share) / of.total as f64).sqrt();
            uncertain(100.0 * of.share, 100.0 * error)
        }
    }
}

/// `median [5 %, 95 %]`, each with its standard error, and with fewer digits if the column is too narrow.
fn spread(statistics: &Statistics) -> String {
    let spread = |text: fn(Quantile) -> String| {
        format!(
            "{} [{}, {}]",
            text(statistics.q50),
            text(statistics.q05),
            text(statistics.q95)
        )
    };
    let all = spread(asobench_identification::number::quantile);
    if all.len() <= SPREAD {
        all
    } else {
        spread(|q| uncertain_within(q.value, q.mcse, 3))
    }
}
