//! `asobench suite law`: whether d has the law of an efficient method.

use super::part::{Part, write};
use crate::claim::Verdict;
use crate::cli::error::Error;
use crate::cli::execute::threads;
use crate::cli::output::{note, print};
use crate::report::law_table;
use crate::suite::{Laws, Stored, law};
use std::path::PathBuf;

/// The file with the laws.
const LAWS: &str = "law.json";

/// Show whether d has the law of an efficient method: maximum likelihood from the truth in many runs of each scenario,
/// the mean of d and Kolmogorov's test, corrected over all scenarios (Holm)
#[derive(clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    part: Part,
    /// Runs of each scenario
    #[arg(
        long,
        value_name = "R",
        default_value_t = 1000,
        value_parser = clap::value_parser!(u64).range(10..=1_000_000)
    )]
    runs: u64,
    /// Threads [default: one per processor]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Write law.json into this folder too
    #[arg(long, value_name = "OUT")]
    out: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let suite = arguments.part.suite()?;
    let mut found = Vec::new();
    for study in &suite.studies {
        found.extend(law(study, arguments.runs, threads(arguments.threads))?);
        note(&study.name);
    }
    let laws = Laws::new((suite.manifest.edition, suite.division), arguments.runs, found);
    print(&shown(&laws))?;
    if let Some(out) = &arguments.out {
        write(out, LAWS, &laws.text())?;
    }
    Ok(())
}

fn shown(laws: &Laws) -> String {
    let count = |verdict| laws.scenarios.iter().filter(|of| of.verdict() == verdict).count();
    format!(
        "{} runs of each of {} scenarios: the law holds in {}, does not in {}, and {} are undecided\n{}",
        laws.runs,
        laws.scenarios.len(),
        count(Verdict::Holds),
        count(Verdict::DoesNotHold),
        count(Verdict::Undecided),
        law_table(laws).text()
    )
}
