//! The trials file: Parquet, written row group by row group, read column by column.

use super::row::{Figure, Row};
use super::{Block, Experiment};
use crate::estimator::Output;
use polars::prelude::{
    BatchedWriter, Column, DataFrame, DataType, Field, NamedFrom, ParquetCompression,
    ParquetReader, ParquetWriter, PolarsError, PolarsResult, Schema, SerReader, Series,
};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Rows in a row group, at least; groups end with a trial. No figure depends on it.
const GROUP_ROWS: usize = 1 << 16;

/// Why trials could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file system.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error.
        source: std::io::Error,
    },
    /// The file's content or its encoding.
    #[error("{}: {source}", .path.display())]
    Parquet {
        /// The file.
        path: PathBuf,
        /// The error.
        source: PolarsError,
    },
}

/// Writes the trials of an experiment to one Parquet file.
///
/// Columns: `cell, claim, eta, window, trial, estimator, pass, status, failed_pass, failed_stage,
/// unstable`, then every [`Figure`]; eta in per cent; null where undefined.
pub struct TrialWriter<'e> {
    experiment: &'e Experiment,
    outputs: Vec<Output>,
    path: PathBuf,
    writer: BatchedWriter<BufWriter<File>>,
    /// Rows that wait for their group, with their cells.
    rows: Vec<Waiting>,
}

/// A row and the index of its cell.
type Waiting = (usize, Row);

/// The columns before the figures, with their types.
fn leading_fields() -> [(&'static str, DataType); 11] {
    [
        ("cell", DataType::UInt32),
        ("claim", DataType::String),
        ("eta", DataType::Float64),
        ("window", DataType::UInt32),
        ("trial", DataType::UInt64),
        ("estimator", DataType::String),
        ("pass", DataType::UInt32),
        ("status", DataType::String),
        ("failed_pass", DataType::UInt32),
        ("failed_stage", DataType::UInt32),
        ("unstable", DataType::Boolean),
    ]
}

fn schema() -> Schema {
    let figures = Figure::ALL.iter().map(|f| (f.name(), DataType::Float64));
    let fields = leading_fields().into_iter().chain(figures);
    fields
        .map(|(name, data_type)| Field::new(name.into(), data_type))
        .collect()
}

impl<'e> TrialWriter<'e> {
    /// Opens a file, replacing one that is there.
    ///
    /// # Errors
    /// If the file cannot be created.
    pub fn create(path: &Path, experiment: &'e Experiment) -> Result<Self, StoreError> {
        let path = path.to_owned();
        let file = match File::create(&path) {
            Ok(file) => file,
            Err(source) => return Err(StoreError::Io { path, source }),
        };
        let writer = ParquetWriter::new(BufWriter::new(file))
            .with_compression(ParquetCompression::Zstd(None))
            .set_parallel(false)
            .batched(&schema());
        match writer {
            Ok(writer) => Ok(Self {
                experiment,
                outputs: experiment.outputs(),
                path,
                writer,
                rows: Vec::with_capacity(GROUP_ROWS),
            }),
            Err(source) => Err(StoreError::Parquet { path, source }),
        }
    }

    /// Appends a block.
    ///
    /// # Errors
    /// If a group that became full cannot be written.
    pub fn write(&mut self, block: &Block) -> Result<(), StoreError> {
        for trial in block.rows.chunks(self.outputs.len()) {
            self.rows.extend(trial.iter().map(|row| (block.cell, *row)));
            if self.rows.len() >= GROUP_ROWS {
                self.write_group()?;
            }
        }
        Ok(())
    }

    /// Writes what waits and closes the file.
    ///
    /// # Errors
    /// If the file cannot be written to its end.
    pub fn finish(mut self) -> Result<(), StoreError> {
        self.write_group()?;
        let finished = self.writer.finish();
        finished.map_err(|source| self.parquet_error(source))?;
        let file = File::open(&self.path).and_then(|file| file.sync_all());
        file.map_err(|source| StoreError::Io {
            path: self.path,
            source,
        })
    }

    fn parquet_error(&self, source: PolarsError) -> StoreError {
        StoreError::Parquet {
            path: self.path.clone(),
            source,
        }
    }

    fn write_group(&mut self) -> Result<(), StoreError> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let frame = frame(self.experiment, &self.outputs, &self.rows);
        let written = frame.and_then(|frame| self.writer.write_batch(&frame));
        self.rows.clear();
        written.map_err(|source| self.parquet_error(source))
    }
}

/// The table of some rows.
fn frame(experiment: &Experiment, outputs: &[Output], rows: &[Waiting]) -> PolarsResult<DataFrame> {
    let cell = |row: &Waiting| &experiment.cells[row.0];
    let output = |row: &Waiting| &outputs[row.1.output];
    let failure = |row: &Waiting| row.1.failure;
    let mut columns = vec![
        column(rows, "cell", |row| row.0 as u32),
        column(rows, "claim", |row| cell(row).claim.as_str()),
        column(rows, "eta", |row| cell(row).eta),
        column(rows, "window", |row| cell(row).window as u32),
        column(rows, "trial", |row| row.1.trial),
        column(rows, "estimator", |row| output(row).estimator.as_str()),
        column(rows, "pass", |row| output(row).pass as u32),
        column(rows, "status", |row| row.1.status()),
        column(rows, "failed_pass", |row| {
            failure(row).map(|f| f.pass as u32)
        }),
        column(rows, "failed_stage", |row| {
            failure(row).map(|f| f.stage as u32)
        }),
        column(rows, "unstable", |row| row.1.unstable),
    ];
    for &figure in Figure::ALL {
        let defined = |row: &Waiting| Some(row.1[figure]).filter(|value| !value.is_nan());
        columns.push(column(rows, figure.name(), defined));
    }
    DataFrame::new(rows.len(), columns)
}

fn column<'a, T>(rows: &'a [Waiting], name: &str, value: impl Fn(&'a Waiting) -> T) -> Column
where
    Series: NamedFrom<Vec<T>, [T]>,
{
    let values: Vec<T> = rows.iter().map(value).collect();
    Series::new(name.into(), values).into()
}

/// One output of one method in one cell: what a summary is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// The cell's index.
    pub cell: u32,
    /// The estimator's name.
    pub estimator: String,
    /// The pass.
    pub pass: u32,
}

/// A stored trials file, read one column at a time.
pub struct TrialTable {
    path: PathBuf,
    groups: Vec<Group>,
    /// For every row, the index of its group.
    group_of: Vec<u32>,
}

impl TrialTable {
    /// Opens a file and reads which rows belong together.
    ///
    /// # Errors
    /// If the file cannot be read or lacks a column.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        let mut table = Self {
            path: path.to_owned(),
            groups: Vec::new(),
            group_of: Vec::new(),
        };
        let frame = table.read(&["cell", "estimator", "pass"])?;
        let found = table.index(&frame);
        found.map_err(|source| table.parquet_error(source))?;
        Ok(table)
    }

    fn index(&mut self, frame: &DataFrame) -> PolarsResult<()> {
        let cells = frame.column("cell")?.u32()?;
        let estimators = frame.column("estimator")?.str()?;
        let passes = frame.column("pass")?.u32()?;
        let mut known: BTreeMap<(u32, String, u32), u32> = BTreeMap::new();
        for ((cell, estimator), pass) in cells.iter().zip(estimators.iter()).zip(passes.iter()) {
            let key = (
                cell.unwrap_or_default(),
                estimator.unwrap_or_default().to_owned(),
                pass.unwrap_or_default(),
            );
            let next = known.len() as u32;
            let group = *known
                .entry(key)
                .or_insert_with_key(|(cell, estimator, pass)| {
                    self.groups.push(Group {
                        cell: *cell,
                        estimator: estimator.clone(),
                        pass: *pass,
                    });
                    next
                });
            self.group_of.push(group);
        }
        Ok(())
    }

    /// The groups, in the order of the file.
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// A figure of every row, NaN where it is null.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn figure(&self, figure: Figure) -> Result<Vec<f64>, StoreError> {
        let frame = self.read(&[figure.name()])?;
        let column = frame.column(figure.name()).and_then(|column| column.f64());
        let values = column.map(|c| c.iter().map(|v| v.unwrap_or(f64::NAN)).collect());
        values.map_err(|source| self.parquet_error(source))
    }

    /// Indices of a group's rows, in the order of trials.
    pub fn rows_of(&self, group: usize) -> impl Iterator<Item = usize> {
        let rows = self.group_of.iter().enumerate();
        rows.filter(move |(_, of)| **of as usize == group)
            .map(|(row, _)| row)
    }

    /// For every group, how many rows have each status, and how many an unstable A-hat.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn outcomes(&self) -> Result<Vec<Outcomes>, StoreError> {
        let frame = self.read(&["status", "unstable"])?;
        let mut outcomes = vec![Outcomes::default(); self.groups.len()];
        let counted = (|| {
            let statuses = frame.column("status")?.str()?;
            let unstable = frame.column("unstable")?.bool()?;
            let rows = statuses.iter().zip(unstable.iter()).zip(&self.group_of);
            for ((status, unstable), group) in rows {
                let outcome = &mut outcomes[*group as usize];
                outcome.trials += 1;
                outcome.unstable += u64::from(unstable == Some(true));
                let status = status.unwrap_or_default();
                if status != "ok" {
                    *outcome.failures.entry(status.to_owned()).or_default() += 1;
                }
            }
            Ok(())
        })();
        counted.map_err(|source| self.parquet_error(source))?;
        Ok(outcomes)
    }

    fn read(&self, columns: &[&str]) -> Result<DataFrame, StoreError> {
        let columns = columns.iter().map(|&name| name.to_owned()).collect();
        read_columns(&self.path, Some(columns), None)
    }

    fn parquet_error(&self, source: PolarsError) -> StoreError {
        StoreError::Parquet {
            path: self.path.clone(),
            source,
        }
    }
}

/// Counts of a group.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Outcomes {
    /// Rows.
    pub trials: u64,
    /// Rows by failure.
    pub failures: BTreeMap<String, u64>,
    /// Rows with an unstable A-hat.
    pub unstable: u64,
}

impl Outcomes {
    /// Rows with a failure.
    pub fn failed(&self) -> u64 {
        self.failures.values().sum()
    }
}

fn read_columns(
    path: &Path,
    columns: Option<Vec<String>>,
    slice: Option<(usize, usize)>,
) -> Result<DataFrame, StoreError> {
    let file = File::open(path).map_err(|source| StoreError::Io {
        path: path.to_owned(),
        source,
    })?;
    let reader = ParquetReader::new(file)
        .with_columns(columns)
        .with_slice(slice);
    reader.finish().map_err(|source| StoreError::Parquet {
        path: path.to_owned(),
        source,
    })
}

/// Whether `rows`, all outputs of one trial of a cell, stand bit for bit in a stored file of `trials`
/// trials a cell; `None` where the file has no such trial.
///
/// # Errors
/// If the file cannot be read.
pub fn stored_alike(
    path: &Path,
    experiment: &Experiment,
    cell: usize,
    trials: u64,
    rows: &[Row],
) -> Result<Option<bool>, StoreError> {
    let Some(trial) = rows.first().map(|row| row.trial).filter(|t| *t < trials) else {
        return Ok(None);
    };
    let first = (cell as u64 * trials + trial) as usize * rows.len();
    let stored = read_columns(path, None, Some((first, rows.len())))?;
    let waiting: Vec<Waiting> = rows.iter().map(|row| (cell, *row)).collect();
    let alike = frame(experiment, &experiment.outputs(), &waiting)
        .and_then(|replayed| same_bits(&replayed, &stored));
    alike.map(Some).map_err(|source| StoreError::Parquet {
        path: path.to_owned(),
        source,
    })
}

/// Whether two tables are equal, numbers bit for bit.
fn same_bits(left: &DataFrame, right: &DataFrame) -> PolarsResult<bool> {
    if left.schema() != right.schema() || left.height() != right.height() {
        return Ok(false);
    }
    for (left, right) in left.columns().iter().zip(right.columns()) {
        let alike = if let Ok(left) = left.f64() {
            let bits = |value: Option<f64>| value.map(f64::to_bits);
            left.iter().map(bits).eq(right.f64()?.iter().map(bits))
        } else {
            left.equals_missing(right)
        };
        if !alike {
            return Ok(false);
        }
    }
    Ok(true)
}
