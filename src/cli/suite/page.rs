//! The page of the suite and its numbers: `asobench suite scores`.

use super::part::Part;
use crate::cli::error::Error;
use crate::cli::files::cannot_write;
use crate::cli::output::print;
use crate::files;
use crate::report::{SuitePage, prepare_report, suite_page, suite_tables, write_report};
use crate::suite::{MethodResults, ResultsError, Suite, of_folder, shipped};
use crate::text::visible;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

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

/// What a page shows.
pub(super) struct Beside<'a> {
    pub(super) methods: &'a [MethodResults],
    pub(super) newcomer: Option<&'a str>,
    pub(super) command: String,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let Arguments { folder, part, page } = arguments;
    let suite = part.suite()?;
    let methods = match folder {
        None => shipped(&suite),
        Some(folder) => of_folder(&suite, folder),
    };
    let methods = methods.map_err(|error| refused(&error))?;
    let of = folder
        .as_ref()
        .map_or_else(String::new, |folder| format!(" {}", folder.display()));
    let beside = Beside {
        methods: &methods,
        newcomer: None,
        command: format!("asobench suite scores{of} {}", part.flags()),
    };
    if let Some(out) = page {
        write(&suite, &beside, out)?;
    }
    let tables = suite_tables(&of_page(&suite, &beside, false));
    let texts: Vec<String> = tables
        .iter()
        .map(crate::report::html::Table::markdown)
        .collect();
    print(&(texts.join("\n") + "\n"))?;
    Ok(ExitCode::SUCCESS)
}

pub(super) fn refused(error: &ResultsError) -> Error {
    Error::Input(format!("suite: {error}"))
}

fn of_page<'a>(suite: &'a Suite, beside: &'a Beside<'_>, has_studies: bool) -> SuitePage<'a> {
    SuitePage {
        suite,
        methods: beside.methods,
        newcomer: beside.newcomer,
        has_studies,
        command: &beside.command,
    }
}

/// Writes the page into a folder, beside the studies of a run if there are any.
pub(super) fn write(suite: &Suite, beside: &Beside<'_>, out: &Path) -> Result<(), Error> {
    let has_studies = files::is_there(&out.join("studies"));
    prepare_report(out).map_err(|error| cannot_write(&error))?;
    let files = suite_page(&of_page(suite, beside, has_studies));
    write_report(out, &files).map_err(|error| cannot_write(&error))?;
    print(&format!(
        "the page is {}\n",
        visible(out.join("report.html").display())
    ))
}

/// Prints the first tables as text: the scores, and the newcomer beside the others.
pub(super) fn print_scores(suite: &Suite, beside: &Beside<'_>) -> Result<(), Error> {
    let tables = suite_tables(&of_page(suite, beside, false));
    let shown = if beside.newcomer.is_some() { 2 } else { 1 };
    for table in tables.iter().take(shown) {
        let rows = table.rows.iter().map(|row| table.text_row(row));
        let text = format!(
            "{}\n{}{}",
            table.caption,
            table.text_head(),
            rows.collect::<String>()
        );
        print(&format!("\n{text}"))?;
    }
    Ok(())
}
