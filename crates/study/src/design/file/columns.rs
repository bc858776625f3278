//! Columns of CSV files from which a study takes its input or its noise. Their numbers become part of the file. So
//! results can be replayed, extended and merged without the CSV file, and are not mixed with those of a changed one.

use crate::design::file::{Axis, ExperimentFile, FileError, Key, Scalar};
use crate::files;
use asobench_identification::data::csv::ReadOptions;
use std::path::Path;

/// The prefix of a column's name: `file:PATH` (its column u) or `file:PATH#COLUMN`.
const FILE: &str = "file:";

/// The largest number of samples in a column. Every manifest contains them all.
const LONGEST: usize = 1_000_000;

/// Splits a name into path and column; `None` if it is not the name of a column.
fn parts(name: &str) -> Option<(&str, &str)> {
    let rest = name.strip_prefix(FILE)?;
    Some(rest.rsplit_once('#').unwrap_or((rest, "u")))
}

impl ExperimentFile {
    /// Returns the columns that settings and noises name, each with the key that names it.
    fn named_columns(&self) -> Vec<(String, String)> {
        let axes = [Some(&self.settings), self.quick.as_ref().map(|quick| &quick.settings)];
        let axes = axes.into_iter().flatten();
        let values = axes
            .filter_map(|axes| axes.get(&Key::Input))
            .flat_map(|axis: &Axis| axis.values(false));
        let inputs = values.filter_map(|value| match value {
            Scalar::Text(name) => Some((Key::Input.name().to_owned(), name)),
            Scalar::Number(_) => None,
        });
        let noises = self.noises.iter();
        let noises =
            noises.filter_map(|(name, noise)| Some((format!("noises.{name}.residuals"), noise.residuals.clone()?)));
        inputs.chain(noises).filter(|(_, name)| parts(name).is_some()).collect()
    }

    /// Reads the named columns that are not yet there. Their paths are relative to `folder`.
    pub(crate) fn read_columns(&mut self, folder: &Path) -> Result<(), FileError> {
        for (key, name) in self.named_columns() {
            let Some((path, column)) = parts(&name).filter(|_| !self.columns.contains_key(&name)) else {
                continue;
            };
            let path = folder.join(path);
            let wrong = |message: String| FileError::key(&key, format!("{}: {message}", path.display()));
            let read = files::read_record(&path, None, &ReadOptions::column(column));
            let samples = read.map_err(|error| wrong(error.to_string()))?.record.y;
            if samples.len() > LONGEST {
                return Err(wrong(format!("{} samples; expected at most {LONGEST}", samples.len())));
            }
            self.columns.insert(name, samples);
        }
        Ok(())
    }

    /// Removes columns that nothing names.
    pub(crate) fn drop_columns(&mut self) {
        let named = self.named_columns();
        self.columns
            .retain(|column, _| named.iter().any(|(_, name)| name == column));
    }

    /// Returns the samples of a column; `None` if `name` is not the name of a column.
    pub(crate) fn column(&self, key: &str, name: &str) -> Option<Result<&[f64], FileError>> {
        parts(name)?;
        let missing = || {
            FileError::key(
                key,
                format!("'{name}' was not read; expected an experiment file beside it"),
            )
        };
        Some(self.columns.get(name).map(Vec::as_slice).ok_or_else(missing))
    }
}
