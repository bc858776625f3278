//! Columns of numbers as Parquet.

use polars::prelude::{Column, DataFrame, ParquetCompression, ParquetWriter, PolarsResult};
use std::io;

/// Returns a table of columns of equal length, with null for NaN.
///
/// # Errors
/// If two columns have one name, or differ in length.
pub fn numbers_as_parquet(columns: &[(String, Vec<f64>)]) -> io::Result<Vec<u8>> {
    let write = || -> PolarsResult<Vec<u8>> {
        let column = |(name, values): &(String, Vec<f64>)| -> Column {
            let known = values.iter().map(|x| Some(*x).filter(|x| !x.is_nan()));
            Column::new(name.as_str().into(), known.collect::<Vec<Option<f64>>>())
        };
        let rows = columns.first().map_or(0, |(_, values)| values.len());
        let mut frame = DataFrame::new(rows, columns.iter().map(column).collect())?;
        let mut bytes = Vec::new();
        let to = ParquetWriter::new(&mut bytes);
        to.with_compression(ParquetCompression::Zstd(None)).finish(&mut frame)?;
        Ok(bytes)
    };
    write().map_err(io::Error::other)
}
