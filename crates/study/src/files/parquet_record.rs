//! Records in Parquet, as the tables that records are read from.

use polars::prelude::{
    ArrowDataType, DataType, ParquetReader, PolarsError, PolarsResult, SerReader,
};
use std::fmt::Write as _;
use std::io::{Cursor, Read};
use std::panic;

/// Returns a Parquet table as CSV with a header. Numbers have all their digits, missing ones are empty; a cell of a
/// column that holds something else is that column's type, which is no number.
///
/// # Errors
/// If it is no Parquet table, or cannot be read.
pub fn parquet_as_csv(mut from: impl Read) -> Result<String, String> {
    let mut bytes = Vec::new();
    let read = from.read_to_end(&mut bytes);
    read.map_err(|error| error.to_string())?;
    if !(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1")) {
        return Err("not a whole Parquet file; it begins and ends with PAR1".to_owned());
    }
    // polars panics on some damaged files. Nothing else runs yet, so nobody else's panic is silenced.
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|_| {}));
    let table = panic::catch_unwind(|| table(bytes));
    panic::set_hook(hook);
    match table {
        Err(_) => Err("a damaged Parquet file".to_owned()),
        Ok(table) => table.map_err(|error| {
            let text = error.to_string();
            text.lines().next().unwrap_or_default().to_owned()
        }),
    }
}

fn table(bytes: Vec<u8>) -> PolarsResult<String> {
    let mut reader = ParquetReader::new(Cursor::new(bytes));
    let schema = reader.schema()?;
    // Others, such as timestamps, are not even read.
    let numbers = schema.iter().filter(|(_, field)| is_number(&field.dtype));
    let numbers: Vec<String> = numbers.map(|(name, _)| name.to_string()).collect();
    if numbers.is_empty() {
        return Err(PolarsError::NoData("no column of numbers".into()));
    }
    let table = reader.with_columns(Some(numbers)).finish()?;
    let mut header = Vec::new();
    let mut columns = Vec::new();
    for (name, field) in schema.iter() {
        header.push(named(name));
        if is_number(&field.dtype) {
            let numbers = table.column(name)?.cast(&DataType::Float64)?;
            columns.push((String::new(), numbers.f64()?.iter().collect()));
        } else {
            columns.push((format!("{:?}", field.dtype).replace(',', ";"), Vec::new()));
        }
    }
    let mut text = header.join(",");
    for row in 0..table.height() {
        for (place, (kind, numbers)) in columns.iter().enumerate() {
            text.push(if place == 0 { '\n' } else { ',' });
            match numbers.get(row) {
                None => text.push_str(kind),
                Some(None) => {}
                Some(Some(number)) => write!(text, "{number:?}")
                    .map_err(|error| PolarsError::ComputeError(error.to_string().into()))?,
            }
        }
    }
    text.push('\n');
    Ok(text)
}

fn is_number(kind: &ArrowDataType) -> bool {
    use ArrowDataType as A;
    matches!(
        kind,
        A::Boolean
            | A::Int8
            | A::Int16
            | A::Int32
            | A::Int64
            | A::UInt8
            | A::UInt16
            | A::UInt32
            | A::UInt64
            | A::Float32
            | A::Float64
    )
}

/// A column's name between quotes. A number is no name of a header.
fn named(name: &str) -> String {
    let name = name.replace(['"', '\n', '\r'], "_");
    match name.parse::<f64>() {
        Ok(_) => format!("\"column {name}\""),
        Err(_) => format!("\"{name}\""),
    }
}
