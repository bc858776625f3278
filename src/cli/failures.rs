//! `asobench failures`: which trials of a study failed, how, and the command that shows the first of each kind.

use super::error::{Error, bad_input};
use super::output::print;
use crate::report::{Study, failures};
use std::path::PathBuf;

/// List the trials of a study that failed, by cell, output and kind, with the command that shows the
/// first of each
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Results folder, such as results/window
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Only this output or method, such as oe or iv(4)
    #[arg(long, value_name = "NAME")]
    method: Option<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let study = Study::read(&arguments.folder).map_err(bad_input)?;
    let text =
        failures(&study, arguments.method.as_deref()).map_err(|error| Error::Input(format!("--method: {error}")))?;
    print(&text)
}
