//! The page of the suite and its numbers: `asobench suite scores`.

use super::part::{Part, TIMES};
use crate::cli::error::{Error, bad_file, bad_input};
use crate::cli::files::cannot_write;
use crate::cli::methods::filled;
use crate::cli::output::print;
use crate::files::{self, Kind};
use crate::report::{SuitePage, SuiteTable, prepare_report, suite_page, suite_tables, write_report};
use crate::suite::{
    Contribution, Division, Laws, MethodResults, RecordedFits, STUDIES, Suite, Times, of_folder, shipped,
};
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

/// The results on a page, with their part of the suite and the command.
pub(super) struct Beside<'a> {
    pub(super) methods: &'a [MethodResults],
    pub(super) newcomer: Option<&'a str>,
    pub(super) contributed: &'a [Contribution],
    pub(super) part: &'a Part,
    pub(super) command: String,
}

/// The times in the folder of a run.
fn own_times(out: &Path) -> Result<Option<Times>, Error> {
    let path = out.join(TIMES);
    let text = files::read_own(&path, Kind::Suite).map_err(bad_input)?;
    let times = text.map(|text| Times::parse(&String::from_utf8_lossy(&text)));
    times.transpose().map_err(bad_file(&path))
}

/// Makes the page of some results, writes it into the folder `page`, and returns its tables. `own`: the folder of a
/// run, whose own times come first. The open division and recorded data stand on the page of the shipped results alone.
fn tables(
    suite: &Suite,
    beside: &Beside<'_>,
    own: Option<&Path>,
    page: Option<&Path>,
) -> Result<Vec<SuiteTable>, Error> {
    let times = match own.map(own_times).transpose()?.flatten() {
        None => Times::shipped()?,
        own => own,
    };
    let (laws, recorded) = (Laws::shipped(suite)?, RecordedFits::shipped()?);
    let is_whole = own.is_none() && beside.part.division.is_none_or(|of| !of.is_open());
    let open = if is_whole {
        let part = Part {
            division: Some(Division::Open),
            ..beside.part.clone()
        };
        let suite = part.suite()?;
        // Where fewer trials of it are shipped than the tier has, the page is without it.
        let methods = shipped(&suite).unwrap_or_default();
        Some((suite, methods))
    } else {
        None
    };
    let of = SuitePage {
        suite,
        methods: beside.methods,
        newcomer: beside.newcomer,
        contributed: beside.contributed,
        has_studies: page.is_some_and(|page| files::is_there(&page.join(STUDIES))),
        command: &beside.command,
        times: times.as_ref().filter(|_| !suite.division.is_open()),
        laws: laws.as_ref(),
        open: None,
        recorded: recorded.as_ref().filter(|_| is_whole),
    };
    let open = open.as_ref().filter(|(_, methods)| !methods.is_empty());
    let open = open.map(|(suite, methods)| SuitePage {
        suite,
        methods,
        contributed: &[],
        times: None,
        laws: None,
        recorded: None,
        ..of
    });
    let of = SuitePage {
        open: open.as_ref(),
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
    let beside = Beside {
        methods: &methods,
        newcomer: None,
        contributed: &[],
        part,
        command: format!("asobench suite scores{} {}", of.unwrap_or_default(), part.flags()),
    };
    let tables = tables(&suite, &beside, folder.as_deref(), page.as_deref())?;
    let texts: Vec<String> = tables.iter().map(|of| of.table.markdown()).collect();
    print(&(texts.join("\n") + "\n"))
}

/// Writes the page of a run into its folder, beside the studies, and prints the first tables as text: the ranking, and
/// the newcomer beside the others with the reasons for its lost runs.
pub(super) fn conclude(suite: &Suite, beside: &Beside<'_>, out: &Path) -> Result<(), Error> {
    let tables = tables(suite, beside, Some(out), Some(out))?;
    let shown = tables.iter().filter(|of| FIRST.contains(&&*of.name));
    for table in shown.map(|of| &of.table).filter(|table| !table.rows.is_empty()) {
        print(&format!("\n{}{}", filled("", &table.caption, 0), table.text()))?;
    }
    Ok(())
}
