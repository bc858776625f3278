//! The one door to the user's records: text in any dialect, and Parquet.

use super::{Kind, ParquetText, open_named};
use asobench_identification::data::csv::{ReadOptions, RecordError, Table, read_table, uses};
use std::path::Path;

/// Reads a record.
///
/// # Errors
/// [`RecordError`], of a file in a form of another program with the way to one that is read.
pub fn read_record(path: &Path, options: &ReadOptions) -> Result<Table, RecordError> {
    let form = path
        .extension()
        .and_then(|form| form.to_str())
        .unwrap_or_default()
        .to_lowercase();
    if let Some(way) = way_from(&form) {
        return Err(RecordError::File(way.to_owned()));
    }
    let from =
        open_named(path, Kind::Record).map_err(|error| RecordError::File(error.to_string()))?;
    if form != "parquet" {
        return read_table(from, options);
    }
    let text = ParquetText::open(from, |names| uses(names, options)).map_err(RecordError::File)?;
    read_table(text, options)
}

/// Returns how a record is written as text by the program whose own form the file has.
fn way_from(form: &str) -> Option<&'static str> {
    Some(match form {
        "xlsx" | "xls" | "ods" => {
            "a spreadsheet; expected CSV or Parquet: save the sheet as \"CSV UTF-8\", or in Python: \
             pandas.read_excel(FILE).to_csv('record.csv')"
        }
        "mat" => {
            "MATLAB's own form; expected text: load FILE, then writetable(table(u, y), 'record.csv') or save -ascii \
             record.txt z"
        }
        "npy" | "npz" | "pkl" | "pickle" => {
            "Python's own form; expected CSV or Parquet: numpy.savetxt, or to_csv and to_parquet of pandas"
        }
        "h5" | "hdf5" | "feather" | "arrow" | "rds" => "expected CSV or Parquet",
        _ => return None,
    })
}
