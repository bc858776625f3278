//! `asobench suite published`: published Monte-Carlo tables beside ours.

use super::part::wrong;
use crate::cli::error::Error;
use crate::cli::execute::threads;
use crate::cli::output::print;
use crate::number::uncertain;
use crate::report::html::{CellText, Column, Table};
use crate::suite::{PublishedTable, Reproduced, published};
use std::process::ExitCode;

/// Runs where the source has a single one.
const RUNS: u64 = 500;

/// Reproduce the published Monte-Carlo tables of the suite's systems: printed beside ours, with both standard errors
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Threads [default: one per processor]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let threads = threads(arguments.threads);
    for table in published().map_err(|error| wrong(&error))? {
        let runs = if table.runs > 1 { table.runs } else { RUNS };
        let found = table
            .reproduce(runs, threads)
            .map_err(|error| wrong(&error))?;
        print(&shown(&table, runs, &found))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A table with its source.
fn shown(of: &PublishedTable, runs: u64, found: &[Reproduced]) -> String {
    let columns = vec![
        Column::text("").width(4),
        Column::number("printed mean", "").width(13),
        Column::number("ours", "").width(13),
        Column::number("printed SD", "").width(12),
        Column::number("ours", "").width(12),
        Column::number("bound", "").width(8),
        Column::text("").width(7),
    ];
    let mut table = Table::new("", columns);
    for row in found {
        let ((mean, sd), (our_mean, our_sd)) = (row.printed, row.ours);
        let number =
            |of: crate::suite::Estimated| CellText::number(uncertain(of.value, of.error), of.value);
        table.row([
            CellText::text(row.name.clone()),
            number(mean),
            number(our_mean),
            sd.map_or(CellText::text("-"), number),
            number(our_sd),
            row.bound.map_or(CellText::text("-"), |sd| {
                CellText::number(format!("{sd:.3e}"), sd)
            }),
            CellText::text(if row.agrees() { "agrees" } else { "DIFFERS" }),
        ]);
    }
    let kept = found.first().map_or(0, |row| row.kept);
    let rows = table.rows.iter().map(|row| table.text_row(row));
    format!(
        "{}, {} ({}), {} runs; ours {}, {kept} of {runs} runs\n{}\n{}{}\n",
        of.scenario,
        of.printed_as,
        of.method,
        of.runs,
        of.method,
        of.source,
        table.text_head(),
        rows.collect::<String>()
    )
}
