//! The page of the suite and its numbers: `asobench suite scores`.

use super::part::{Part, TIMES};
use crate::cli::error::{Error, bad_input};
use crate::cli::files::cannot_write;
use crate::cli::methods::filled;
use crate::cli::output::print;
use crate::files;
use crate::report::{SuitePage, SuiteTable, prepare_report, suite_page, suite_tables, write_report};
use crate::suite::{Division, Laws, RecordedFits, STUDIES, Stored, Times, of_folder, shipped};
use crate::text::visible;
use std::path::{Path, PathBuf};

/// Print every number of the suite's page: of the results that the program carries, or of a folder
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Folder of a run of the suite [default: the results that the program carries]
    #[arg(value_name = "DIR")]
    folder: Option<PathBuf>,
    #[command(flatten)]
    part: Part,
    /// Write the page into this folder too
    #[arg(long, value_name = "OUT")]
    page: Option<PathBuf>,
}

/// The tables that a run ends with.
const FIRST: [&str; 5] = ["ranking", "partial", "newcomer", "lost", "choosing-ranking"];

/// Makes the page of some results, writes it into the folder `page`, and returns its tables. `own`: the folder of a
/// run, whose own times come first. The open division and recorded data stand on the page of the shipped results alone.
fn tables(of: SuitePage<'_>, part: &Part, own: Option<&Path>, page: Option<&Path>) -> Result<Vec<SuiteTable>, Error> {
    let own_times = own.map(|own| Times::read(&own.join(TIMES))).transpose();
    let times = match own_times.map_err(bad_input)?.flatten() {
        None => Times::shipped()?,
        own => own,
    };
    let (laws, recorded) = (Laws::shipped(of.suite)?, RecordedFits::shipped()?);
    let is_whole = own.is_none() && part.division.is_none_or(|of| !of.is_open());
    let open = Part {
        division: Some(Division::Open),
        ..part.clone()
    };
    let open = is_whole.then(|| open.suite()).transpose()?;
    // Where fewer trials of it are shipped than the tier has, the page is without it.
    let methods = open.as_ref().and_then(|suite| shipped(suite).ok()).unwrap_or_default();
    let of = SuitePage {
        has_studies: page.is_some_and(|page| files::is_there(&page.join(STUDIES))),
        ..of
    };
    let open = open.as_ref().filter(|_| !methods.is_empty());
    let open = open.map(|suite| SuitePage {
        suite,
        methods: &methods,
        contributed: &[],
        ..of
    });
    let of = SuitePage {
        times: times.as_ref().filter(|_| !of.suite.division.is_open()),
        laws: laws.as_ref(),
        open: open.as_ref(),
        recorded: recorded.as_ref().filter(|_| is_whole),
        ..of
    };
    if let Some(page) = page {
        prepare_report(page).map_err(|error| cannot_write(&error))?;
        write_report(page, &suite_page(&of)).map_err(|error| cannot_write(&error))?;
        print(&format!(
            "the page is {}\n",
            visible(page.join("report.html").display())
        ))?;
    }
    Ok(suite_tables(&SuitePage {
        has_studies: false,
        ..of
    }))
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let Arguments { folder, part, page } = arguments;
    let suite = part.suite()?;
    let methods = match folder {
        None => shipped(&suite)?,
        Some(folder) => of_folder(&suite, folder)?,
    };
    if methods.is_empty() {
        return Err(Error::Input(format!(
            "suite: the program carries no results of edition {} in the contest {}; asobench suite run {} makes them",
            suite.manifest.edition,
            suite.division,
            part.flags()
        )));
    }
    let of = folder.as_ref().map(|folder| format!(" {}", folder.display()));
    let command = format!("asobench suite scores{} {}", of.unwrap_or_default(), part.flags());
    let of = SuitePage::new(&suite, &methods, &command);
    let tables = tables(of, part, folder.as_deref(), page.as_deref())?;
    let texts: Vec<String> = tables.iter().map(|of| of.table.markdown()).collect();
    print(&(texts.join("\n") + "\n"))
}

/// Writes the page of a run into its folder, beside the studies, and prints the first tables as text: the ranking, and
/// the newcomer beside the others with the reasons for its lost runs.
pub(super) fn conclude(of: SuitePage<'_>, part: &Part, out: &Path) -> Result<(), Error> {
    let tables = tables(of, part, Some(out), Some(out))?;
    let shown = tables.iter().filter(|of| FIRST.contains(&&*of.name));
    for table in shown.map(|of| &of.table).filter(|table| !table.rows.is_empty()) {
        print(&format!("\n{}{}", filled("", &table.caption, 0), table.text()))?;
    }
    Ok(())
}
