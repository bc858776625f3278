//! `asobench suite published`: published Monte-Carlo tables beside ours.

use crate::cli::error::Error;
use crate::cli::execute::threads;
use crate::cli::methods::filled;
use crate::cli::output::print;
use crate::report::published_table;
use crate::suite::{PublishedTable, Reproduced, published};

/// Reproduce the published Monte-Carlo tables of the suite's systems: printed beside ours, with both standard errors
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Threads [default: one per processor]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Only this scenario or system, such as P16-white-500 or P13; may be repeated
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let threads = threads(arguments.threads);
    // Printed numbers, and bounds that we evaluated ourselves: rows that agree, and all.
    let mut counts = [[0, 0]; 2];
    for table in published()? {
        if !arguments.only.is_empty() && !arguments.only.contains(&table.scenario) {
            continue;
        }
        let found = table.reproduce(threads)?;
        let count = &mut counts[usize::from(table.evaluated)];
        count[0] += found.iter().filter(|row| row.agrees()).count();
        count[1] += found.len();
        print(&shown(&table, &found))?;
    }
    let [[agree, rows], [met, bounds]] = counts;
    if rows > 0 {
        print(&format!(
            "{agree} of {rows} printed rows agree: neither mean nor standard deviation differs by more than four \
             standard errors\n"
        ))?;
    }
    if bounds > 0 {
        print(&format!(
            "{met} of {bounds} rows of a bound agree that no source prints: we evaluated its formula ourselves\n"
        ))?;
    }
    Ok(())
}

/// A table with its source, and what is known of its differences.
fn shown(of: &PublishedTable, found: &[Reproduced]) -> String {
    let kept = found.first().map_or(0, |row| row.kept);
    let mut text = format!(
        "{}, {} ({}){}; ours {}, {kept} of {} runs\n{}\n{}",
        of.scenario,
        of.printed_as,
        of.method,
        match (of.evaluated, of.rounding) {
            (true, _) => ", not printed but evaluated by us".to_owned(),
            (false, Some(_)) => String::new(),
            (false, None) => format!(", {} runs", of.runs),
        },
        of.method,
        of.our_runs(),
        of.source,
        published_table(found).text()
    );
    if !found.iter().all(Reproduced::agrees) {
        for row in found {
            if let Some(error) = row.of_one_input {
                text.extend([format!(
                    "{}: means differ by {:.1} standard errors; if the printed runs had one input, by {:.1}\n",
                    row.name,
                    row.apart(row.printed.0.mcse),
                    row.apart(error)
                )]);
            }
        }
        let why = of.why.as_deref().unwrap_or("not known");
        text += &filled("why: ", why, 5);
    }
    text + "\n"
}
