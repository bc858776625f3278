//! trials.parquet, read again: by replays, and by pictures of single trials.

use crate::design::Experiment;
use crate::files::{self, Column, Table, Values};
use crate::outcome::coefficients::Kept;
use crate::outcome::publication::current;
use crate::outcome::rows::Rows;
use crate::outcome::stored_results::{check_result, lists, read_manifest, read_results};
use crate::outcome::trial_table::{StoreError, TrialTable};
use std::fs::File;
use std::io::Cursor;
use std::ops::Range;
use std::path::{Path, PathBuf};

const NAME: &str = "trials.parquet";

/// The stored trials of a folder: the file with the checksum that the manifest has of it, and with the rows of its
/// trials.
pub struct StoredTrials {
    path: PathBuf,
    table: Table<File>,
}

/// The rows of a cell: the number of the first one and how many there are. The file has the cells in their order, each
/// trial with a row for each output.
#[derive(Clone, Copy, Debug)]
pub struct CellRows {
    /// The cell's number.
    pub cell: usize,
    /// The number of its first row.
    pub first: u64,
    /// The number of its rows.
    pub count: u64,
}

impl StoredTrials {
    /// Opens the trials in a folder, which are to have so many rows; `None` if it has none.
    ///
    /// # Errors
    /// If the manifest or the file cannot be read, or the file is not what the manifest describes.
    pub fn open(folder: &Path, rows: u64) -> Result<Option<Self>, StoreError> {
        match read_manifest(folder)? {
            None => Self::found(folder, rows),
            // A file of the study that was replaced may wait to be removed.
            Some(_) => read_results(folder, |manifest| {
                if !lists(manifest, NAME) {
                    return Ok(None);
                }
                if files::is_there(&current(folder, NAME)?) {
                    check_result(folder, manifest, NAME, None)?;
                }
                Self::found(folder, rows)
            }),
        }
    }

    fn found(folder: &Path, rows: u64) -> Result<Option<Self>, StoreError> {
        let path = current(folder, NAME)?;
        let Some(file) = files::open_own(&path)? else {
            return Ok(None);
        };
        let found = Table::open(file).and_then(|table| match table.rows() {
            found if found == rows => Ok(table),
            found => Err(format!("damaged: {found} rows; expected {rows}, those of its trials")),
        });
        match found {
            Ok(table) => Ok(Some(Self { path, table })),
            Err(reason) => Err(StoreError::Table { path, reason }),
        }
    }

    fn wrong(&self, reason: impl Into<String>) -> StoreError {
        StoreError::Table {
            path: self.path.clone(),
            reason: reason.into(),
        }
    }

    /// Reads rows of a column; `None` if there is none of this name.
    fn column(&mut self, name: &str, rows: &Range<u64>) -> Result<Option<Values>, StoreError> {
        let Some(place) = self.table.columns().iter().position(|column| column.name == name) else {
            return Ok(None);
        };
        let values = self.table.read_rows(place, rows);
        values.map(Some).map_err(|reason| self.wrong(reason))
    }

    /// The signed error of a coefficient such as `a_1` and its standard error, in each trial of a cell in which an
    /// output has both. `None` if there are no such columns: the study was run without `coverage = true`.
    ///
    /// # Errors
    /// If the file cannot be read, or has not the rows of the cell where they are expected.
    pub fn errors(
        &mut self,
        of: CellRows,
        (estimator, pass): (&str, usize),
        coefficient: &str,
    ) -> Result<Option<Vec<[f64; 2]>>, StoreError> {
        let rows = of.first..of.first.saturating_add(of.count);
        let [error, se] = ["error", "se"].map(|kind| format!("{kind}_{coefficient}"));
        let (Some(errors), Some(ses)) = (self.column(&error, &rows)?, self.column(&se, &rows)?) else {
            return Ok(None);
        };
        let mut known = |name: &str| {
            let column = self.column(name, &rows)?;
            column.ok_or_else(|| self.wrong(format!("damaged: no column {name}")))
        };
        let (cells, estimators, passes) = (known("cell")?, known("estimator")?, known("pass")?);
        let is = |number: &Option<f64>, expected: usize| *number == Some(expected as f64);
        let all = [&cells, &estimators, &passes, &errors, &ses];
        if all.iter().any(|column| column.len() as u64 != of.count)
            || !cells.numbers().iter().all(|cell| is(cell, of.cell))
        {
            return Err(self.wrong("damaged: rows of another cell"));
        }
        let of_output = estimators.texts().zip(passes.numbers());
        let both = errors.numbers().iter().zip(ses.numbers());
        let pairs = of_output.zip(both).filter_map(|((name, number), pair)| match pair {
            (Some(error), Some(se)) if name == Some(estimator) && is(number, pass) => Some([*error, *se]),
            _ => None,
        });
        let known = |[error, se]: &[f64; 2]| error.is_finite() && se.is_finite() && *se > 0.0;
        Ok(Some(pairs.filter(known).collect()))
    }

    /// Whether the file contains `rows`, all outputs of one trial of a cell, bit for bit. `trials` is the number of
    /// trials of each of its cells. `None` if the file does not have this trial. Files of older builds have no
    /// coefficients, and are compared without them.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn alike(
        &mut self,
        experiment: &Experiment,
        cell: usize,
        trials: &[u64],
        rows: &Rows,
    ) -> Result<Option<bool>, StoreError> {
        let Some(first) = first_row(cell, trials, rows) else {
            return Ok(None);
        };
        let stored = first..first + rows.len() as u64;
        let replayed = TrialTable::new(experiment).and_then(|table| table.file_of(cell, rows.clone()));
        let replayed = replayed.map_err(|error| self.wrong(error.to_string()))?;
        let mut replayed = Table::open(Cursor::new(replayed)).map_err(|reason| self.wrong(reason))?;
        let coefficients = Kept::new(&experiment.file, &experiment.cells).names();
        let is_coefficient = |column: &&Column| coefficients.contains(&column.name);
        let is_older = !self.table.columns().iter().any(|column| is_coefficient(&column));
        let own = self.table.columns().iter().map(Column::is);
        let others = replayed.columns().iter().enumerate();
        let others = others.filter(|(_, column)| !(is_older && is_coefficient(column)));
        let (places, others): (Vec<usize>, Vec<_>) = others.map(|(place, column)| (place, column.is())).unzip();
        if !own.eq(others) {
            return Ok(Some(false));
        }
        for (own, other) in places.into_iter().enumerate() {
            let stored = self
                .table
                .read_rows(own, &stored)
                .map_err(|reason| self.wrong(reason))?;
            let now = replayed.read(0, other).map_err(|reason| self.wrong(reason))?;
            if !stored.are(&now) {
                return Ok(Some(false));
            }
        }
        Ok(Some(true))
    }
}

/// Returns the index of the first row of a trial in a file whose cells have these numbers of trials; `None` if it does
/// not have the trial.
fn first_row(cell: usize, trials: &[u64], rows: &Rows) -> Option<u64> {
    let (before, of_cell) = (trials.get(..cell)?, trials.get(cell)?);
    let trial = rows.trials().next()?;
    if trial >= *of_cell {
        return None;
    }
    let mut before = before.iter();
    let before = before.try_fold(trial, |sum, n| sum.checked_add(*n))?;
    before.checked_mul(rows.len() as u64)
}
