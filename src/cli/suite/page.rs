//! The page of the suite and its numbers: `asobench suite scores`.

use super::part::{Part, TIMES};
use crate::cli::error::Error;
use crate::cli::files::cannot_write;
use crate::cli::methods::filled;
use crate::cli::output::print;
use crate::files::{self, Kind};
use crate::report::{SuitePage, prepare_report, suite_page, suite_tables, write_report};
use crate::suite::{
    Contribution, Division, Laws, MethodResults, RecordedFits, ResultsError, Suite, Times, of_folder, shipped,
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

/// The times, fits and open division that stand beside the results of methods.
struct Shipped {
    times: Option<Times>,
    recorded: Option<RecordedFits>,
    laws: Option<Laws>,
    /// The open division of the same part, beside the closed one.
    open: Option<(Suite, Vec<MethodResults>)>,
}

/// The times in the folder of a run.
fn own_times(out: &Path) -> Result<Option<Times>, Error> {
    let path = out.join(TIMES);
    let text = files::read_own(&path, Kind::Suite);
    let text = text.map_err(|error| Error::Input(error.to_string()))?;
    let times = text.map(|text| Times::parse(&String::from_utf8_lossy(&text)));
    let named = |error| Error::Input(format!("{}: {error}", path.display()));
    times.transpose().map_err(named)
}

impl Shipped {
    /// `out`: the folder of a run, whose own times come first. The open division and recorded data stand on the page of
    /// the shipped results alone.
    fn new(suite: &Suite, part: &Part, out: Option<&Path>) -> Result<Self, Error> {
        let times = match out.map(own_times).transpose()?.flatten() {
            Some(own) => Some(own),
            None => Times::shipped().map_err(|error| refused(&error))?,
        };
        let is_whole = out.is_none() && part.division.is_none_or(|of| !of.is_open());
        let recorded = RecordedFits::shipped().map_err(|error| refused(&error))?;
        let open = if is_whole {
            let part = Part {
                division: Some(Division::Open),
                ..part.clone()
            };
            let suite = part.suite()?;
            // Where fewer trials of it are shipped than the tier has, the page is without it.
            let methods = shipped(&suite).unwrap_or_default();
            (!methods.is_empty()).then_some((suite, methods))
        } else {
            None
        };
        Ok(Self {
            times,
            recorded: recorded.filter(|_| is_whole),
            laws: Laws::shipped(suite).map_err(|error| refused(&error))?,
            open,
        })
    }

    /// Calls a function with the page of some results.
    fn page<T>(
        &self,
        suite: &Suite,
        beside: &Beside<'_>,
        has_studies: bool,
        then: impl FnOnce(&SuitePage<'_>) -> T,
    ) -> T {
        let page = SuitePage {
            suite,
            methods: beside.methods,
            newcomer: beside.newcomer,
            contributed: beside.contributed,
            has_studies,
            command: &beside.command,
            times: self.times.as_ref().filter(|_| !suite.division.is_open()),
            laws: self.laws.as_ref(),
            open: None,
            recorded: self.recorded.as_ref(),
        };
        let Some((suite, methods)) = &self.open else {
            return then(&page);
        };
        let open = SuitePage {
            suite,
            methods,
            contributed: &[],
            times: None,
            laws: None,
            recorded: None,
            ..page
        };
        then(&SuitePage {
            open: Some(&open),
            ..page
        })
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let Arguments { folder, part, page } = arguments;
    let suite = part.suite()?;
    let methods = match folder {
        None => shipped(&suite),
        Some(folder) => of_folder(&suite, folder),
    };
    let methods = methods.map_err(|error| refused(&error))?;
    if methods.is_empty() {
        return Err(Error::Input(format!(
            "suite: the program carries no results of edition {} in the contest {}; asobench suite run {} makes them",
            suite.manifest.edition,
            suite.division,
            part.flags()
        )));
    }
    let of = folder
        .as_ref()
        .map_or_else(String::new, |folder| format!(" {}", folder.display()));
    let beside = Beside {
        methods: &methods,
        newcomer: None,
        contributed: &[],
        part,
        command: format!("asobench suite scores{of} {}", part.flags()),
    };
    let more = Shipped::new(&suite, part, folder.as_deref())?;
    if let Some(out) = page {
        write_page(&suite, &beside, &more, out)?;
    }
    let tables = more.page(&suite, &beside, false, suite_tables);
    let texts: Vec<String> = tables.iter().map(|of| of.table.markdown()).collect();
    print(&(texts.join("\n") + "\n"))
}

pub(super) fn refused(error: &ResultsError) -> Error {
    Error::Input(format!("suite: {error}"))
}

/// Writes the page of a run into its folder, beside the studies, and prints the first tables as text: the ranking, and
/// the newcomer beside the others with the reasons for its lost runs.
pub(super) fn conclude(suite: &Suite, beside: &Beside<'_>, out: &Path) -> Result<(), Error> {
    let more = Shipped::new(suite, beside.part, Some(out))?;
    write_page(suite, beside, &more, out)?;
    let tables = more.page(suite, beside, false, suite_tables);
    let tables = tables
        .iter()
        .filter(|of| FIRST.contains(&&*of.name))
        .map(|of| &of.table);
    for table in tables.filter(|table| !table.rows.is_empty()) {
        print(&format!("\n{}{}", filled("", &table.caption, 0), table.text()))?;
    }
    Ok(())
}

fn write_page(suite: &Suite, beside: &Beside<'_>, more: &Shipped, out: &Path) -> Result<(), Error> {
    let has_studies = files::is_there(&out.join("studies"));
    prepare_report(out).map_err(|error| cannot_write(&error))?;
    let files = more.page(suite, beside, has_studies, suite_page);
    write_report(out, &files).map_err(|error| cannot_write(&error))?;
    print(&format!("the page is {}\n", visible(out.join("report.html").display())))
}
