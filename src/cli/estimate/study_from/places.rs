//! The files that `asobench study-from` writes.

use super::case::Case;
use crate::cli::error::Error;
use crate::files::{self, Kind, Staged};
use crate::text::name_fault;
use std::path::{Path, PathBuf};

/// A column of a CSV file: its name and its samples.
pub(super) type Column<'a> = (&'a str, &'a [f64]);

/// The paths of the files.
pub(super) struct Places {
    pub(super) file: PathBuf,
    pub(super) record: PathBuf,
    pub(super) residuals: PathBuf,
}

impl Places {
    pub(super) fn new(out: &Path) -> Result<Self, Error> {
        let refused = |message: &str| Err(Error::Input(format!("--out {}: {message}", out.display())));
        let (Some(name), Some("toml")) = (
            out.file_stem().and_then(|name| name.to_str()),
            out.extension().and_then(|extension| extension.to_str()),
        ) else {
            return refused("expected a name that ends in .toml");
        };
        if let Some(fault) = name_fault(name) {
            return refused(&fault);
        }
        if files::is_there(out) {
            return refused("exists already; expected the name of a new file");
        }
        Ok(Self {
            file: out.to_owned(),
            record: out.with_file_name(format!("{name}-record.csv")),
            residuals: out.with_file_name(format!("{name}-residuals.csv")),
        })
    }

    /// Returns the name of a file without its folder, which all files share.
    pub(super) fn name(path: &Path) -> String {
        path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Returns the CSV files with their columns.
    pub(super) fn columns<'a>(&'a self, case: &'a Case) -> Vec<(&'a Path, Vec<Column<'a>>)> {
        let mut files = Vec::new();
        if case.spectrum.is_none() {
            let (record, n) = (&case.report.record, case.report.window);
            let mut columns = vec![("u", &record.u[..n]), ("y", &record.y[..n])];
            if case.feedback.is_some() {
                columns.push((case.input.0, &case.input.1));
            }
            files.push((self.record.as_path(), columns));
        }
        if let Some(drawn) = &case.drawn {
            files.push((self.residuals.as_path(), vec![("e", drawn.as_slice())]));
        }
        files
    }

    /// Writes all files, or none.
    pub(super) fn write(&self, case: &Case, text: &[u8]) -> Result<(), Error> {
        let attempt = || {
            let mut staged = Staged::default();
            for (path, columns) in self.columns(case) {
                let mut content = Vec::new();
                let comments = [
                    format!(
                        "asobench record of {}, {}",
                        case.report.file.display(),
                        case.detrended()
                    ),
                    format!("order: {}", case.plant.order()),
                ];
                let written = crate::data::csv::write_columns(&mut content, &comments, &columns);
                written.map_err(files::PathError::io(path))?;
                staged.write(path, Kind::Record, &content)?;
            }
            staged.write(&self.file, Kind::Experiment, text)?;
            staged.publish()
        };
        attempt().map_err(|error| Error::Input(format!("--out {error}")))
    }
}
