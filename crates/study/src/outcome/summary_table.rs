//! summary.parquet: the summary as a table.

use crate::design::file::Scalar;
use crate::design::{Cell, Experiment};
use crate::files::PathError;
use crate::files::parquet::{Named, Schema, defined_numbers, numbers, parquet_of, plain, texts};
use crate::outcome::summary::{CellSummary, OutputSummary, Summary};
use crate::outcome::trial_table::{GROUP_ROWS, Setting, StoreError, numeric_settings};
use asobench_identification::metric::{Statistic, Statistics};
use polars_arrow::array::{Array, BooleanArray, PrimitiveArray, Utf8ViewArray};
use polars_error::PolarsResult;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

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
    let schema = Schema::of(&table(experiment, &settings, &[])).map_err(parquet)?;
    let mut writer = schema.begin(to).map_err(parquet)?;
    for cells in summary.cells.chunks(group_cells(summary)) {
        let group = schema.encode(&plain(table(experiment, &settings, cells)));
        writer.append(&group.map_err(parquet)?).map_err(parquet)?;
    }
    writer.end().map_err(parquet)?;
    Ok(file.sync_all().map_err(PathError::io(path))?)
}

/// Returns a table of some cells alone.
///
/// # Errors
/// If a name cannot be the name of a column.
pub(crate) fn table_of(experiment: &Experiment, cells: &[CellSummary]) -> PolarsResult<Vec<u8>> {
    parquet_of(table(experiment, &numeric_settings(experiment), cells))
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

/// Returns the columns with their names.
fn table(experiment: &Experiment, settings: &[Setting], cells: &[CellSummary]) -> Vec<Named> {
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
    let mut columns: Vec<Named> = Vec::new();
    let mut add = |name: &str, column: Box<dyn Array>| columns.push((name.to_owned(), column));
    let cell = |row: &SummaryRow<'_>| -> &Cell { &experiment.cells[row.0] };
    add("cell", numbers(each(rows, |row| row.0 as i32)));
    add("claim", texts(&each(rows, |row| cell(row).claim.as_str())));
    add("eta", numbers(each(rows, |row| cell(row).columns().0)));
    add("window", numbers(each(rows, |row| cell(row).columns().1 as i32)));
    for (key, numeric) in settings {
        let setting = |row: &SummaryRow<'_>| cell(row).settings.get(key);
        let number = |row: &SummaryRow<'_>| match setting(row) {
            Some(Scalar::Number(number)) => Some(*number),
            _ => None,
        };
        let text = |row: &SummaryRow<'_>| setting(row).map(ToString::to_string);
        add(
            key.name(),
            if *numeric {
                PrimitiveArray::from(each(rows, number)).boxed()
            } else {
                Utf8ViewArray::from_slice(each(rows, text)).boxed()
            },
        );
    }
    add("estimator", texts(&each(rows, |row| row.1.estimator.as_str())));
    add("pass", numbers(each(rows, |row| row.1.pass as i32)));
    add("trials", numbers(each(rows, |row| row.1.outcomes.trials as i64)));
    add("failed", numbers(each(rows, |row| row.1.outcomes.failed() as i64)));
    add("unstable", numbers(each(rows, |row| row.1.outcomes.unstable as i64)));
    add("measure", texts(&each(rows, |row| row.2.as_str())));
    add("count", numbers(each(rows, |row| row.3.count as i64)));
    for statistic in Statistic::ALL {
        let value = each(rows, |row| statistic.of(row.3).value);
        add(statistic.name(), defined_numbers(value));
        let error = each(rows, |row| statistic.of(row.3).mcse);
        add(&format!("{statistic}_mcse"), defined_numbers(error));
    }
    add("min", defined_numbers(each(rows, |row| row.3.min)));
    add("max", defined_numbers(each(rows, |row| row.3.max)));
    add("largest_share", defined_numbers(each(rows, |row| row.3.largest_share)));
    add(
        "dominated",
        BooleanArray::from_slice(each(rows, |row| row.3.dominated)).boxed(),
    );
    columns
}

fn each<'a, T>(rows: &'a [SummaryRow<'a>], value: impl Fn(&'a SummaryRow<'a>) -> T) -> Vec<T> {
    rows.iter().map(value).collect()
}
