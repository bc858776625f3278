//! The one door to the user's records: text in any dialect, workbooks and Parquet.

use super::workbook::Workbook;
use super::{Kind, ParquetText, open_named};
use asobench_identification::data::csv::{ReadOptions, RecordError, Table, read_table, uses};
use asobench_identification::text::visible;
use std::io::Read;
use std::path::Path;

/// Reads a record; of a workbook the worksheet of this name, or the first one that has the columns.
///
/// # Errors
/// [`RecordError`], of a file in a form of another program with the way to one that is read.
pub fn read_record(path: &Path, sheet: Option<&str>, options: &ReadOptions) -> Result<Table, RecordError> {
    let form = path
        .extension()
        .and_then(|form| form.to_str())
        .unwrap_or_default()
        .to_lowercase();
    if let Some(way) = way_from(&form) {
        return Err(RecordError::File(way.to_owned()));
    }
    let is_workbook = matches!(form.as_str(), "xlsx" | "xlsm");
    if sheet.is_some() && !is_workbook {
        return Err(RecordError::File("--sheet is for .xlsx".to_owned()));
    }
    let from = open_named(path, Kind::Record).map_err(|error| RecordError::File(error.to_string()))?;
    if is_workbook {
        return of_workbook(from, sheet, options);
    }
    if form != "parquet" {
        return read_table(from, options);
    }
    let text = ParquetText::open(from, |names| uses(names, options)).map_err(RecordError::File)?;
    read_table(text, options)
}

/// Reads the worksheet of this name, or the first one that has the columns.
fn of_workbook(from: impl Read, sheet: Option<&str>, options: &ReadOptions) -> Result<Table, RecordError> {
    let mut book = Workbook::open(from).map_err(RecordError::File)?;
    let names = book.worksheets(sheet).map_err(RecordError::File)?;
    let mut first_error = None;
    for name in &names {
        let text = book.text(name).map_err(RecordError::File)?;
        if text.is_empty() {
            continue;
        }
        match read_table(text.as_bytes(), options) {
            Ok(mut table) => {
                if names.len() > 1 {
                    let (name, count) = (visible(name), names.len());
                    let which = format!("worksheet '{name}' of {count} (--sheet chooses)");
                    table.form.insert(0, which);
                }
                return Ok(table);
            }
            // Another worksheet may have the columns; of one that has them an error is the user's to see.
            Err(
                error @ (RecordError::NoHeader(_)
                | RecordError::UnknownColumn { .. }
                | RecordError::MissingColumn { .. }),
            ) => {
                first_error.get_or_insert(error);
            }
            Err(error) => return Err(error),
        }
    }
    Err(first_error.unwrap_or_else(|| RecordError::File("no worksheet with a cell".to_owned())))
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
