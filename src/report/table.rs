//! The verdict table, at most 80 columns wide.

use super::number::uncertain;
use super::summary::{BoundSummary, CellSummary, EstimatorShare, Quantiles, Summary};
use crate::metric::Share;
use std::fmt::{self, Write};

/// The verdicts on every bound, with the figures behind them.
///
/// # Panics
/// Never: writing to a string does not fail.
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
        let claim = &cell.settings.claim;
        for bound in summary.bounds.iter().filter(|b| b.claim == claim) {
            write_bound(text, bound)?;
        }
    }
    writeln!(text, "{rule}")
}

fn write_cell(text: &mut String, cell: &CellSummary) -> fmt::Result {
    let settings = &cell.settings;
    let noise = if settings.eta == 0.0 {
        "noise-free".to_owned()
    } else {
        format!("eta = {} %", settings.eta)
    };
    let trials = cell
        .outputs
        .first()
        .map_or(0, |output| output.outcomes.trials);
    write!(
        text,
        "{}  {noise}, N = {}, {trials} trials",
        settings.claim, settings.window
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

fn write_bound(text: &mut String, bound: &BoundSummary) -> fmt::Result {
    let [first, last] = &bound.estimators;
    write_line(
        text,
        &format!("    {:<7} {}", bound.label, bound.bound),
        first,
    )?;
    write_line(text, &format!("    {}", bound.verdict), last)
}

fn write_line(text: &mut String, left: &str, of: &EstimatorShare) -> fmt::Result {
    let (label, spread, share) = (of.label(), spread(&of.quantiles), share(of.met));
    let line = format!("{left:<20} {label:<5} {spread:<39} {share:>13}");
    writeln!(text, "{}", line.trim_end())
}

/// A share in per cent with its standard error; where that is 0, because no trial or every trial counts, the
/// other end of the 95 % interval instead.
fn share(met: Share) -> String {
    let percent = |share: f64| 100.0 * share;
    if met.count == 0 {
        format!("0 (<{:.2} %)", percent(met.high))
    } else if met.count == met.of {
        format!("all (>{:.1} %)", (10.0 * percent(met.low)).floor() / 10.0)
    } else {
        format!(
            "{:.1} \u{b1} {:.1} %",
            percent(met.share),
            percent(met.mcse)
        )
    }
}

/// `median [5 %, 95 %]`, each with its standard error.
fn spread(quantiles: &Quantiles) -> String {
    let text = |q: crate::metric::Quantile| uncertain(q.value, q.mcse);
    format!(
        "{} [{}, {}]",
        text(quantiles.q50),
        text(quantiles.q05),
        text(quantiles.q95)
    )
}
