//! The one door to the user's records: text in any dialect, workbooks and Parquet.

use super::workbook::Worksheet;
use super::{Kind, ParquetText, open_named};
use asobench_identification::data::csv::{ReadOptions, RecordError, Table, read_table, uses};
use std::path::Path;

/// Reads a record; of a workbook the worksheet of this name, or the first one that holds anything.
///
/// # Errors
/// [`RecordError`], of a file in a form of another program with the way to one that is read.
pub fn read_record(
    path: &Path,
    sheet: Option<&str>,
    options: &ReadOptions,
) -> Result<Table, RecordError> {
    let form = path
        .extension()
        .and_then(|form| form.to_str())
        .unwrap_or_default()
        .to_lowercase();
    let refused = |message: String| RecordError::File(message);
    if let Some(way) = way_from(&form) {
        return Err(refused(way.to_owned()));
    }
    let from = open_named(path, Kind::Record).map_err(|error| refused(error.to_string()))?;
    let is_workbook = matches!(form.as_str(), "xlsx" | "xlsm");
    match sheet {
        Some(_) if !is_workbook => Err(refused("--sheet is for .xlsx".to_owned())),
        _ if is_workbook => {
            let Worksheet { text, which } = Worksheet::read(from, sheet).map_err(refused)?;
            let mut table = read_table(text.as_bytes(), options)?;
            table.form.splice(0..0, which);
            Ok(table)
        }
        _ if form == "parquet" => {
            let text = ParquetText::open(from, |names| uses(names, options)).map_err(refused)?;
            read_table(text, options)
        }
        _ => read_table(from, options),
    }
}

/// Returns how a record is written as text by the program whose own form the file has.
fn way_from(form: &str) -> Option<&'static str> {
    Some(match form {
        "xls" | "xlsb" | "ods" => "a spreadsheet; expected it saved as .xlsx or as CSV",
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
