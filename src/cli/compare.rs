//! `asobench compare`: results of two or more studies beside each other.

use super::error::{Error, bad_input};
use super::output::print;
use crate::report::{Study, compared};
use crate::study::Measure;
use std::path::PathBuf;

/// Compare the results of studies: the differences of their experiments, and the medians of a measure
/// in the same cells
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Results folders, such as results/window results/window-2
    #[arg(required = true, num_args = 2.., value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// The measure [default: the first that all have]
    #[arg(long, value_name = "NAME")]
    measure: Option<Measure>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    if let Some(file) = arguments.folders.iter().find(|folder| folder.is_file()) {
        return Err(Error::Input(format!(
            "{}: a file; expected folders of results. Of records: asobench estimate A.csv --validate B.csv",
            file.display()
        )));
    }
    let studies: Result<Vec<Study>, _> = arguments.folders.iter().map(|folder| Study::read(folder)).collect();
    let studies = studies.map_err(bad_input)?;
    let text = compared(&studies, arguments.measure).map_err(Error::Input)?;
    print(&text)
}
