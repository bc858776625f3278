//! summary.parquet: the summary as a table.

use crate::design::file::Scalar;
use crate::design::{Cell, Experiment};
use crate::files::PathError;
use crate::outcome::summary::{CellSummary, OutputSummary, Summary};
use crate::outcome::trial_table::{GROUP_ROWS, Setting, StoreError, numeric_settings};
use asobench_identification::metric::{Statistic, Statistics};
use polars::prelude::{
    BatchedWriter, Column, DataFrame, NamedFrom, ParquetCompression, ParquetWriter, PolarsResult, Series,
};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Makes a writer of row groups with the columns of a table.
fn batched(to: BufWriter<File>, table: &DataFrame) -> PolarsResult<BatchedWriter<BufWriter<File>>> {
    ParquetWriter::new(to)
        .with_compression(ParquetCompression::Zstd(None))
        .set_parallel(false)
        .batched(table.schema())
}

/// Returns the columns that identify the cell of a row.
fn cell_columns<'e, R>(
    experiment: &'e Experiment,
    settings: &[Setting],
    rows: &[R],
    cell_of: impl Fn(&R) -> usize,
) -> Vec<Column> {
    let cell = |row: &R| -> &'e Cell { &experiment.cells[cell_of(row)] };
    let mut columns = vec![
        column(rows, "cell", |row| cell_of(row) as i32),
        column(rows, "claim", |row| cell(row).claim.as_str()),
        column(rows, "eta", |row| cell(row).columns().0),
        column(rows, "window", |row| cell(row).columns().1 as i32),
    ];
    for (key, numeric) in settings {
        let number = |scalar: Option<&Scalar>| match scalar {
            Some(Scalar::Number(number)) => Some(*number),
            _ => None,
        };
        let setting = |row: &R| cell(row).settings.get(key);
        if *numeric {
            columns.push(column(rows, key.name(), |row| number(setting(row))));
        } else {
            columns.push(column(rows, key.name(), |row| setting(row).map(ToString::to_string)));
        }
    }
    columns
}

/// Returns a number; `None` (null) if it is undefined.
fn defined(x: f64) -> Option<f64> {
    Some(x).filter(|x| !x.is_nan())
}

/// Writes the summary as a table to a new file, with a row for every cell, output and measure.
///
/// # Errors
/// If the file cannot be written.
pub fn write_summary(file: &File, path: &Path, experiment: &Experiment, summary: &Summary) -> Result<(), StoreError> {
    let parquet = |source| StoreError::Parquet {
        path: path.to_owned(),
        source,
    };
    let io = PathError::io(path);
    let to = BufWriter::new(file.try_clone().map_err(io)?);
    let settings = numeric_settings(experiment);
    let table = |cells| summary_frame(experiment, &settings, cells).map_err(parquet);
    let mut writer = batched(to, &table(&[])?).map_err(parquet)?;
    for cells in summary.cells.chunks(group_cells(summary)) {
        writer.write_batch(&table(cells)?).map_err(parquet)?;
    }
    writer.finish().map_err(parquet)?;
    Ok(file.sync_all().map_err(PathError::io(path))?)
}

/// Returns a table of some cells alone.
///
/// # Errors
/// If a name cannot be the name of a column.
pub(crate) fn table_of(experiment: &Experiment, cells: &[CellSummary]) -> PolarsResult<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut frame = summary_frame(experiment, &numeric_settings(experiment), cells)?;
    ParquetWriter::new(&mut bytes)
        .with_compression(ParquetCompression::Zstd(None))
        .finish(&mut frame)?;
    Ok(bytes)
}

/// A row of the summary's table: cell, output, name of the measure and its statistics.
type SummaryRow<'a> = (usize, &'a OutputSummary, String, &'a Statistics);

/// Returns the number of cells in a group of the summary's table.
fn group_cells(summary: &Summary) -> usize {
    let rows = |cell: &CellSummary| -> usize {
        let outputs = cell.outputs.iter();
        outputs
            .map(|output| output.measures.len() + output.parameters.len())
            .sum()
    };
    let most = summary.cells.iter().map(rows).max().unwrap_or(0);
    (GROUP_ROWS / most.max(1)).max(1)
}

fn summary_frame(experiment: &Experiment, settings: &[Setting], cells: &[CellSummary]) -> PolarsResult<DataFrame> {
    let mut rows: Vec<SummaryRow<'_>> = Vec::new();
    for cell in cells {
        for output in &cell.outputs {
            let measures = output
                .measures
                .iter()
                .map(|(measure, statistics)| (measure.to_string(), statistics));
            let parameters = output
                .parameters
                .iter()
                .map(|(name, statistics)| (format!("error of {name}"), statistics));
            rows.extend(
                measures
                    .chain(parameters)
                    .map(|(name, statistics)| (cell.cell, output, name, statistics)),
            );
        }
    }
    let rows = &rows[..];
    let mut columns = cell_columns(experiment, settings, rows, |row| row.0);
    columns.extend([
        column(rows, "estimator", |row| row.1.estimator.as_str()),
        column(rows, "pass", |row| row.1.pass as i32),
        column(rows, "trials", |row| row.1.outcomes.trials as i64),
        column(rows, "failed", |row| row.1.outcomes.failed() as i64),
        column(rows, "unstable", |row| row.1.outcomes.unstable as i64),
        column(rows, "measure", |row| row.2.as_str()),
        column(rows, "count", |row| row.3.count as i64),
    ]);
    for statistic in Statistic::ALL {
        let estimate = |row: &SummaryRow<'_>| statistic.of(row.3);
        columns.push(column(rows, statistic.name(), |row| defined(estimate(row).value)));
        columns.push(column(rows, &format!("{statistic}_mcse"), |row| {
            defined(estimate(row).mcse)
        }));
    }
    columns.extend([
        column(rows, "min", |row| defined(row.3.min)),
        column(rows, "max", |row| defined(row.3.max)),
        column(rows, "largest_share", |row| defined(row.3.largest_share)),
        column(rows, "dominated", |row| row.3.dominated),
    ]);
    DataFrame::new(rows.len(), columns)
}

fn column<'a, R, T>(rows: &'a [R], name: &str, value: impl Fn(&'a R) -> T) -> Column
where
    Series: NamedFrom<Vec<T>, [T]>,
{
    let values: Vec<T> = rows.iter().map(value).collect();
    Series::new(name.into(), values).into()
}
