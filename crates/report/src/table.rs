//! The verdict table, at most 80 columns wide.

use super::number::uncertain_within;
use asobench_identification::metric::{Quantile, Share, Statistics};
use asobench_study::study::{BoundSummary, CellSummary, OutputShare, Summary};
use asobench_study::text::{number, visible};
use std::fmt::{self, Write};

/// Width of the column `median [5 %, 95 %]`.
const SPREAD: usize = 39;

/// The verdicts on every bound, with the numbers behind them.
///
/// # Panics
/// Never: writing to a string cannot fail.
pub fn verdict_table(summary: &Summary) -> String {
    let mut text = String::new();
    write_table(&mut text, summary).expect("writing to a string does not fail");
    text
}

fn write_table(text: &mut String, summary: &Summary) -> fmt::Result {
    let rule = "-".repeat(80);
    writeln!(
        text,
        "{:<11} {:<8} {:<5} {:<39} {:>13}",
        "claim", "bound", "", "median [5 %, 95 %]", "bound met in"
    )?;
    for cell in &summary.cells {
        writeln!(text, "{rule}")?;
        write_cell(text, cell)?;
        for bound in &cell.bounds {
            write_bound(text, cell, bound)?;
        }
    }
    writeln!(text, "{rule}")
}

fn write_cell(text: &mut String, cell: &CellSummary) -> fmt::Result {
    let noise = if cell.eta == 0.0 {
        "noise-free".to_owned()
    } else {
        format!("eta = {} %", number(cell.eta))
    };
    write!(
        text,
        "{}  {noise}, N = {}, {} trials",
        visible(&cell.claim),
        cell.window,
        cell.trials
    )?;
    for (i, output) in [cell.outputs.first(), cell.outputs.last()]
        .iter()
        .flatten()
        .enumerate()
    {
        let before = if i == 0 { "; failed:" } else { "," };
        write!(
            text,
            "{before} {} {}",
            output.label(),
            output.outcomes.failed()
        )?;
    }
    writeln!(text)
}

fn write_bound(text: &mut String, cell: &CellSummary, bound: &BoundSummary) -> fmt::Result {
    let asked = &bound.bound;
    let limit = match asked.rounding {
        Some(_) => "= 0".to_owned(),
        None => asked.text(),
    };
    let lines = [
        (
            format!("    {:<7} {}", asked.label(), limit),
            bound.outputs.first(),
        ),
        (format!("    {}", bound.verdict), bound.outputs.last()),
    ];
    for (left, output) in lines {
        let Some(OutputShare { output, met }) = output else {
            continue;
        };
        let statistics = cell
            .output(output)
            .and_then(|o| o.measures.get(&asked.measure));
        let (label, spread, share) = (
            output,
            statistics.map_or_else(String::new, spread),
            share(*met),
        );
        let line = format!("{left:<20} {label:<5} {spread:<39} {share:>13}");
        writeln!(text, "{}", line.trim_end())?;
    }
    Ok(())
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
        format!(
            "{:.1} \u{b1} {:.1} %",
            percent(met.share),
            percent(met.mcse)
        )
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
