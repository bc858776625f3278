//! `asobench suite export` and `asobench suite add`: results as a file for others, and those of others on a page.

use super::page;
use super::part::{Part, TIMES, write};
use crate::cli::cluster::word;
use crate::cli::error::Error;
use crate::cli::files::cannot_write;
use crate::cli::output::print;
use crate::files::{self, Kind};
use crate::report::SuitePage;
use crate::suite::{ARCHIVE, Contribution, Stored, shipped};
use crate::text::visible;
use std::fmt::Display;
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
    let found = Contribution::of_run(file, &text(file)?, TIMES).map_err(refused(file))?;
    let out = out.clone().unwrap_or_else(|| PathBuf::from(found.file()));
    let written = files::replace(&out, Kind::Suite, found.text().as_bytes());
    written.map_err(|error| cannot_write(&error))?;
    print(&format!("the contribution is {}\n", visible(out.display())))
}

pub(super) fn add(arguments: &Add) -> Result<(), Error> {
    let Add { files, part, out } = arguments;
    let suite = part.suite()?;
    let mut methods = shipped(&suite)?;
    let mut contributed: Vec<Contribution> = Vec::new();
    for path in files {
        let found = Contribution::of_text(&text(path)?, &suite).map_err(refused(path))?;
        let name = &found.results.method;
        if methods.iter().any(|of| of.method == *name) {
            let name = visible(name);
            let why = format!("a method '{name}' is there already; expected another name");
            return Err(refused(path)(why));
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
    let command = format!(
        "asobench suite add {} {} --out {}",
        given.join(" "),
        part.flags(),
        word(&out)
    );
    let of = SuitePage {
        contributed: &contributed,
        ..SuitePage::new(&suite, &methods, &command)
    };
    page::conclude(of, part, &out)
}

fn text(path: &Path) -> Result<String, Error> {
    files::read_named(path, Kind::Suite).map_err(refused(path))
}

fn refused<E: Display>(path: &Path) -> impl Fn(E) -> Error {
    move |error| Error::Input(format!("{}: {error}", visible(path.display())))
}
