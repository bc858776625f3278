//! `asobench suite export` and `asobench suite add`: results as a file for others, and those of others on a page.

use super::page::{self, Beside};
use super::part::{Part, TIMES, write};
use crate::cli::cluster::word;
use crate::cli::error::Error;
use crate::cli::files::cannot_write;
use crate::cli::output::print;
use crate::files::{self, Kind};
use crate::suite::{ARCHIVE, Contribution, ResultsError, shipped};
use crate::text::visible;
use std::path::{Path, PathBuf};

/// Write the results of a method into one file that can be contributed: with versions, commit, times and checksums
#[derive(clap::Args)]
pub(super) struct Export {
    /// Results of a method: methods/NAME.json in the folder of a run of the suite
    #[arg(value_name = "METHOD.json")]
    file: PathBuf,
    /// File to write [default: NAME.json in this folder]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Show the results of others on a page, beside the results that the program carries
#[derive(clap::Args)]
pub(super) struct Add {
    /// Files of suite export
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    part: Part,
    /// Folder of the page [default: results/suite-TIER-archive]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(super) fn export(arguments: &Export) -> Result<(), Error> {
    let Export { file, out } = arguments;
    let found = Contribution::of_run(file, &text(file)?, TIMES);
    let found = found.map_err(|error| refused(file, &error))?;
    let out = out.clone().unwrap_or_else(|| PathBuf::from(found.file()));
    let written = files::replace(&out, Kind::Suite, found.text().as_bytes());
    written.map_err(|error| cannot_write(&error))?;
    print(&format!("the contribution is {}\n", visible(out.display())))
}

pub(super) fn add(arguments: &Add) -> Result<(), Error> {
    let Add { files, part, out } = arguments;
    let suite = part.suite()?;
    let mut methods = shipped(&suite).map_err(|error| page::refused(&error))?;
    let mut contributed: Vec<Contribution> = Vec::new();
    for path in files {
        let read = Contribution::parse(&text(path)?, &suite);
        let found = read.map_err(|error| refused(path, &error))?;
        let name = &found.results.method;
        if methods.iter().any(|of| of.method == *name) {
            return Err(Error::Input(format!(
                "{}: a method '{}' is there already; expected another name",
                visible(path.display()),
                visible(name)
            )));
        }
        methods.push(found.results.clone());
        contributed.push(found);
    }
    let default = || PathBuf::from(format!("{}-{ARCHIVE}", part.folder()));
    let out = out.clone().unwrap_or_else(default);
    files::make_folder(&out).map_err(|error| cannot_write(&error))?;
    for of in &contributed {
        write(&out.join(ARCHIVE), &of.file(), &of.text())?;
    }
    let given: Vec<String> = files.iter().map(|path| word(path)).collect();
    let beside = Beside {
        methods: &methods,
        newcomer: None,
        contributed: &contributed,
        part,
        command: format!(
            "asobench suite add {} {} --out {}",
            given.join(" "),
            part.flags(),
            word(&out)
        ),
    };
    page::conclude(&suite, &beside, &out)
}

fn text(path: &Path) -> Result<String, Error> {
    let read = files::read_named(path, Kind::Suite);
    read.map_err(|error| Error::Input(format!("{}: {error}", visible(path.display()))))
}

fn refused(path: &Path, error: &ResultsError) -> Error {
    Error::Input(format!("{}: {error}", visible(path.display())))
}
