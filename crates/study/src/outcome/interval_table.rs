//! The errors of single trials with their standard errors, read from trials.parquet.

use crate::files::{self, PathError};
use crate::outcome::publication::current;
use crate::outcome::trial_table::StoreError;
use polars::prelude::{DataFrame, ParquetReader, PolarsResult, SerReader};
use std::io::ErrorKind;
use std::path::Path;

/// The rows of a cell in trials.parquet: the number of the first one and how many there are. The file has the cells in
/// their order, each trial with a row for each output.
#[derive(Clone, Copy, Debug)]
pub struct CellRows {
    /// The cell's number.
    pub cell: usize,
    /// The number of its first row.
    pub first: usize,
    /// The number of its rows.
    pub count: usize,
}

/// The signed error of a coefficient such as `a_1` and its standard error, in each trial of a cell in which an output
/// has both. `None` if the folder has no trials.parquet, or that has no such columns: the study then kept no trials, or
/// was run without `coverage = true`.
///
/// # Errors
/// If the file cannot be read, or has not the rows of the cell where they are expected.
pub fn errors_of_trials(
    folder: &Path,
    rows: CellRows,
    (estimator, pass): (&str, usize),
    coefficient: &str,
) -> Result<Option<Vec<[f64; 2]>>, StoreError> {
    let path = current(folder, "trials.parquet")?;
    let wrong = |source| StoreError::Parquet {
        path: path.clone(),
        source,
    };
    let Some(mut file) = files::open_own(&path)? else {
        return Ok(None);
    };
    let [error, se] = ["error", "se"].map(|kind| format!("{kind}_{coefficient}"));
    let schema = ParquetReader::new(&mut file).schema().map_err(wrong)?;
    if !schema.contains(&error) || !schema.contains(&se) {
        return Ok(None);
    }
    let names = ["cell", "estimator", "pass", &error, &se].map(str::to_owned);
    let table = ParquetReader::new(file)
        .with_slice(Some((rows.first, rows.count)))
        .with_columns(Some(names.to_vec()))
        .finish();
    let found = table.and_then(|table| pairs(&table, rows.cell, (estimator, pass), [&error, &se]));
    match found.map_err(wrong)? {
        Some(pairs) => Ok(Some(pairs)),
        None => Err(PathError::io(&path)(ErrorKind::InvalidData.into()).into()),
    }
}

/// The pairs of an output; `None` if there is a row of another cell.
fn pairs(
    table: &DataFrame,
    cell: usize,
    (estimator, pass): (&str, usize),
    [error, se]: [&str; 2],
) -> PolarsResult<Option<Vec<[f64; 2]>>> {
    let (cells, passes) = (table.column("cell")?.u32()?, table.column("pass")?.u32()?);
    let estimators = table.column("estimator")?.str()?;
    let (errors, ses) = (table.column(error)?.f64()?, table.column(se)?.f64()?);
    if cells.iter().any(|other| other != Some(cell as u32)) {
        return Ok(None);
    }
    let of_output = |row: &usize| {
        estimators.get(*row) == Some(estimator) && passes.get(*row) == Some(pass as u32)
    };
    let pair = |row: usize| Some([errors.get(row)?, ses.get(row)?]);
    let rows = (0..table.height()).filter(of_output).filter_map(pair);
    let known = |[error, se]: &[f64; 2]| error.is_finite() && se.is_finite() && *se > 0.0;
    Ok(Some(rows.filter(known).collect()))
}
