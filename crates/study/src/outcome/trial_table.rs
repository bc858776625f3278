//! trials.parquet: groups of rows, encoded on any thread and written in order.

use crate::design::file::{Key, Scalar};
use crate::design::{Experiment, Measure};
use crate::files::PathError;
use crate::files::parquet::{EncodedAs, Group, Schema, TableWriter, defined_numbers, numbers, texts};
use crate::outcome::coefficients::Kept;
use crate::outcome::folder_error::FolderError;
use crate::outcome::rows::{OutputRows, Rows};
use asobench_identification::estimator::{FailureKind, Output};
use polars_arrow::array::{Array, BooleanArray, DictionaryArray, PrimitiveArray};
use polars_arrow::datatypes::ArrowDataType;
use polars_error::{PolarsError, PolarsResult};
use polars_parquet::write::Encoding;
use rayon::Scope;
use std::borrow::Cow;
use std::collections::{BTreeSet, VecDeque};
use std::fs::File;
use std::io::BufWriter;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};

/// The least number of rows in a group. Groups end with a trial. No measure depends on it.
pub(crate) const GROUP_ROWS: usize = 1 << 16;

/// The columns of trials.parquet for an experiment.
///
/// `cell, claim, eta, window`, every other setting that varies, `trial, estimator, pass, status, failed_pass,
/// failed_stage, unstable, unstable_so_far`, then every measure, then what is kept of the coefficients ([`Kept`]). eta
/// is in per cent; undefined values are null.
pub(crate) struct TrialTable<'e> {
    experiment: &'e Experiment,
    /// The settings that vary, each with whether all its values are numbers.
    settings: Vec<(Key, bool)>,
    outputs: Vec<Output>,
    coefficients: Kept,
    schema: Schema,
}

/// Trials of a cell that belong to a group, as indices into their rows.
#[derive(Clone)]
pub(crate) struct Part {
    cell: usize,
    rows: Arc<Rows>,
    places: Range<usize>,
}

impl<'e> TrialTable<'e> {
    /// # Errors
    /// If a name cannot be the name of a column.
    pub(crate) fn new(experiment: &'e Experiment) -> PolarsResult<Self> {
        use ArrowDataType::{Boolean, Float64, Int32, Int64, Utf8View};
        // Signed: other programs let differences of unsigned numbers wrap.
        let settings = numeric_settings(experiment);
        let mut fields = vec![
            ("cell", Int32),
            ("claim", Utf8View),
            ("eta", Float64),
            ("window", Int32),
        ];
        let varying = settings.iter();
        fields.extend(varying.map(|(key, numeric)| (key.name(), if *numeric { Float64 } else { Utf8View })));
        fields.extend([
            ("trial", Int64),
            ("estimator", Utf8View),
            ("pass", Int32),
            ("status", Utf8View),
            ("failed_pass", Int32),
            ("failed_stage", Int32),
            ("unstable", Boolean),
            ("unstable_so_far", Boolean),
        ]);
        let measures = experiment.file.measures.iter();
        fields.extend(measures.map(|measure| (measure.name(), Float64)));
        let coefficients = Kept::new(&experiment.file, &experiment.cells);
        let names = coefficients.names();
        fields.extend(names.iter().map(|name| (name.as_str(), Float64)));
        Ok(Self {
            experiment,
            settings,
            outputs: experiment.outputs(),
            coefficients,
            schema: Schema::new(&fields)?,
        })
    }

    /// Returns the number of trials in a group.
    fn group_trials(&self) -> usize {
        GROUP_ROWS.div_ceil(self.outputs.len())
    }

    /// Returns the bytes of a complete file with some rows of a cell.
    pub(crate) fn file_of(&self, cell: usize, rows: Rows) -> PolarsResult<Vec<u8>> {
        let places = 0..rows.trial_count();
        let rows = Arc::new(rows);
        let part = Part { cell, rows, places };
        self.schema.file_of(&self.columns(&[part])?)
    }

    /// Encodes and compresses a group.
    fn encode(&self, group: &[Part]) -> PolarsResult<Group> {
        self.schema.encode(&self.columns(group)?)
    }

    fn row_count(&self, group: &[Part]) -> usize {
        let trials: usize = group.iter().map(|part| part.places.len()).sum();
        trials * self.outputs.len()
    }

    /// Returns every column of a group, in the order of the schema.
    fn columns(&self, group: &[Part]) -> PolarsResult<Vec<EncodedAs>> {
        let cell = |part: &Part| &self.experiment.cells[part.cell];
        let mut columns = vec![
            self.of_cells(group, |part| Some(part.cell as i32), numbers)?,
            self.of_cells(group, |part| Some(cell(part).claim.clone()), |of| texts(&of))?,
            self.of_cells(group, |part| Some(cell(part).columns().0), numbers)?,
            self.of_cells(group, |part| Some(cell(part).columns().1 as i32), numbers)?,
        ];
        for (key, numeric) in &self.settings {
            let setting = |part: &Part| cell(part).settings.get(key);
            columns.push(if *numeric {
                let number = |part: &Part| match setting(part) {
                    Some(Scalar::Number(number)) => Some(*number),
                    _ => None,
                };
                self.of_cells(group, number, numbers)?
            } else {
                self.of_cells(group, |part| setting(part).map(ToString::to_string), |of| texts(&of))?
            });
        }
        let outputs = self.outputs.iter();
        let estimators: Vec<&str> = outputs.clone().map(|output| output.estimator.as_str()).collect();
        let passes: Vec<i32> = outputs.map(|output| output.pass as i32).collect();
        let names = Self::statuses(group);
        let status = |output: &OutputRows, place: usize| {
            let failure = output.failure(place);
            let name = failure.as_ref().map_or("ok", |of| of.kind.name());
            names.iter().position(|known| *known == name).unwrap_or(0) as u32
        };
        let failed_pass = |output: &OutputRows, place: usize| Some(output.failure(place)?.pass as i32);
        let failed_stage = |output: &OutputRows, place: usize| Some(output.failure(place)?.stage as i32);
        let trials = self.rows(group, |rows, place, _| rows.trials().start as i64 + place as i64);
        columns.extend([
            (PrimitiveArray::from_vec(trials).boxed(), Encoding::Plain),
            self.by_key(group, |_, _, output| Some(output as u32), texts(&estimators))?,
            self.by_key(group, |_, _, output| Some(output as u32), numbers(passes))?,
            self.by_key(
                group,
                |rows, place, output| Some(status(&rows.outputs()[output], place)),
                texts(&names),
            )?,
            self.optional(group, failed_pass),
            self.optional(group, failed_stage),
            self.flags(group, |output, place| output.flags()[place].unstable()),
            self.flags(group, |output, place| Some(output.flags()[place].unstable_so_far())),
        ]);
        let measures = self.experiment.file.measures.iter();
        columns.extend(measures.map(|measure| self.measure(group, *measure)));
        let coefficients = 0..self.coefficients.width;
        columns.extend(coefficients.map(|column| self.coefficient(group, column)));
        Ok(columns)
    }

    /// Returns the values of the column of statuses in a group: all failure kinds of this crate, even if none occurred,
    /// then those reported by programs.
    fn statuses(group: &[Part]) -> Vec<&str> {
        let own = FailureKind::ALL.iter().map(FailureKind::name);
        let mut names: Vec<&str> = std::iter::once("ok").chain(own).collect();
        let found = group.iter().flat_map(|part| {
            let outputs = part.rows.outputs().iter();
            let failures = outputs.flat_map(OutputRows::failures);
            let within = failures.filter(|(place, _)| part.places.contains(place));
            within.map(|(_, failure)| failure.kind.name())
        });
        let found: BTreeSet<&str> = found.filter(|name| !names.contains(name)).collect();
        names.extend(found);
        names
    }

    /// Returns a value for every row: all outputs of the first trial, then of the next.
    fn rows<T>(&self, group: &[Part], value: impl Fn(&Rows, usize, usize) -> T) -> Vec<T> {
        let mut values = Vec::with_capacity(self.row_count(group));
        for Part { rows, places, .. } in group {
            for place in places.clone() {
                values.extend((0..self.outputs.len()).map(|output| value(rows, place, output)));
            }
        }
        values
    }

    /// Returns a column of few distinct values, chosen for each row by a key.
    fn by_key(
        &self,
        group: &[Part],
        key: impl Fn(&Rows, usize, usize) -> Option<u32>,
        values: Box<dyn Array>,
    ) -> PolarsResult<EncodedAs> {
        let keys = PrimitiveArray::from(self.rows(group, key));
        let array = DictionaryArray::try_from_keys(keys, values, false)?;
        Ok((Box::new(array), Encoding::RleDictionary))
    }

    /// Returns a column whose value all rows of a cell share.
    fn of_cells<T>(
        &self,
        group: &[Part],
        value: impl Fn(&Part) -> Option<T>,
        array: impl Fn(Vec<T>) -> Box<dyn Array>,
    ) -> PolarsResult<EncodedAs> {
        let (mut keys, mut values) = (Vec::with_capacity(self.row_count(group)), Vec::new());
        let mut last = None;
        for part in group {
            if last.is_none_or(|(cell, _)| cell != part.cell) {
                let value = value(part);
                let key = value.is_some().then_some(values.len() as u32);
                values.extend(value);
                last = Some((part.cell, key));
            }
            let key = last.and_then(|(_, key)| key);
            let rows = part.places.len() * self.outputs.len();
            keys.extend(std::iter::repeat_n(key, rows));
        }
        let array = DictionaryArray::try_from_keys(PrimitiveArray::from(keys), array(values), false)?;
        Ok((Box::new(array), Encoding::RleDictionary))
    }

    /// Returns a column of numbers that most rows lack.
    fn optional(&self, group: &[Part], value: impl Fn(&OutputRows, usize) -> Option<i32>) -> EncodedAs {
        let values = self.rows(group, |rows, place, output| value(&rows.outputs()[output], place));
        (PrimitiveArray::from(values).boxed(), Encoding::Plain)
    }

    fn flags(&self, group: &[Part], value: impl Fn(&OutputRows, usize) -> Option<bool>) -> EncodedAs {
        let values = self.rows(group, |rows, place, output| value(&rows.outputs()[output], place));
        (BooleanArray::from(values).boxed(), Encoding::Plain)
    }

    /// Returns the column of a measure of the file, null where undefined.
    pub(crate) fn measure(&self, group: &[Part], measure: Measure) -> EncodedAs {
        self.numbers(group, |part, output| {
            let mut measures = part.rows.measures().iter();
            let at = measures.position(|other| *other == measure)?;
            Some(Cow::Borrowed(&output.values().get(at)?[..]))
        })
    }

    /// Returns a column of [`Self::coefficients`], null where undefined and for failed trials.
    fn coefficient(&self, group: &[Part], column: usize) -> EncodedAs {
        self.numbers(group, |part, output| {
            let order = self.experiment.cells[part.cell].order();
            let place = self.coefficients.place(column, order)?;
            Some(output.counted(output.parameters().get(place)?))
        })
    }

    /// Returns a column of numbers: NaN, and what an output does not have, is null.
    fn numbers(
        &self,
        group: &[Part],
        of_output: impl for<'a> Fn(&Part, &'a OutputRows) -> Option<Cow<'a, [f64]>>,
    ) -> EncodedAs {
        let mut values = Vec::with_capacity(self.row_count(group));
        for part in group {
            let outputs = part.rows.outputs().iter();
            let columns: Vec<_> = outputs.map(|output| of_output(part, output)).collect();
            for place in part.places.clone() {
                values.extend(
                    columns
                        .iter()
                        .map(|column| column.as_ref().map_or(f64::NAN, |column| column[place])),
                );
            }
        }
        (defined_numbers(values), Encoding::Plain)
    }
}

/// Writes the trials of an experiment to one file, cell by cell. Groups are encoded on the threads of a scope.
pub(crate) struct TrialWriter<'t> {
    table: &'t TrialTable<'t>,
    path: PathBuf,
    /// The same file, to flush it to the disk.
    file: File,
    writer: TableWriter<BufWriter<File>>,
    /// Trials that wait until their group is full.
    waiting: Vec<Part>,
    /// Groups being encoded, in order.
    encoding: VecDeque<Receiver<PolarsResult<Group>>>,
    /// The largest number of these.
    most: usize,
}

impl<'t> TrialWriter<'t> {
    /// Begins a table in a new file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn new(
        table: &'t TrialTable<'t>,
        file: File,
        path: PathBuf,
        threads: usize,
    ) -> Result<Self, StoreError> {
        let to = BufWriter::new(file.try_clone().map_err(PathError::io(&path))?);
        match table.schema.begin(to) {
            Ok(writer) => Ok(Self {
                table,
                path,
                file,
                writer,
                waiting: Vec::new(),
                encoding: VecDeque::new(),
                most: threads + 1,
            }),
            Err(source) => Err(StoreError::Parquet { path, source }),
        }
    }

    /// Appends trials of a cell.
    ///
    /// # Errors
    /// If a group cannot be encoded or written.
    pub(crate) fn write<'s>(&mut self, scope: &Scope<'s>, cell: usize, rows: Rows) -> Result<(), StoreError>
    where
        't: 's,
    {
        let (count, whole) = (rows.trial_count(), self.table.group_trials());
        let rows = Arc::new(rows);
        let mut from = 0;
        while from < count {
            let waiting: usize = self.waiting.iter().map(|part| part.places.len()).sum();
            let to = count.min(from + whole - waiting);
            self.waiting.push(Part {
                cell,
                rows: rows.clone(),
                places: from..to,
            });
            if waiting + to - from == whole {
                self.encode(scope)?;
            }
            from = to;
        }
        Ok(())
    }

    /// Passes the waiting group to a thread of the scope.
    fn encode<'s>(&mut self, scope: &Scope<'s>) -> Result<(), StoreError>
    where
        't: 's,
    {
        let group = std::mem::take(&mut self.waiting);
        if group.is_empty() {
            return Ok(());
        }
        if self.encoding.len() == self.most {
            self.append_next()?;
        }
        let (sender, receiver) = sync_channel(1);
        let table = self.table;
        // If the receiver is gone, the writer has failed.
        scope.spawn(move |_| drop(sender.send(table.encode(&group))));
        self.encoding.push_back(receiver);
        Ok(())
    }

    /// Appends the first of the groups being encoded.
    fn append_next(&mut self) -> Result<(), StoreError> {
        let Some(receiver) = self.encoding.pop_front() else {
            return Ok(());
        };
        let lost = |_| PolarsError::ComputeError("a group of rows was lost".into());
        let group = receiver.recv().map_err(lost).and_then(|group| group);
        let appended = group.and_then(|group| self.writer.append(&group));
        appended.map_err(|source| self.parquet_error(source))
    }

    /// Writes the waiting groups and closes the file.
    ///
    /// # Errors
    /// If the file cannot be completed.
    pub(crate) fn finish<'s>(mut self, scope: &Scope<'s>) -> Result<(), StoreError>
    where
        't: 's,
    {
        self.encode(scope)?;
        while !self.encoding.is_empty() {
            self.append_next()?;
        }
        let (file, path) = (self.file, self.path);
        if let Err(source) = self.writer.end() {
            return Err(StoreError::Parquet { path, source });
        }
        Ok(file.sync_all().map_err(PathError::io(&path))?)
    }

    fn parquet_error(&self, source: PolarsError) -> StoreError {
        StoreError::Parquet {
            path: self.path.clone(),
            source,
        }
    }
}

/// Why trials could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// A file failed.
    #[error(transparent)]
    File(#[from] PathError),
    /// The manifest cannot be read, or has another checksum of a file.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The content of a file is wrong.
    #[error("{}: {reason}", .path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// The fault.
        reason: String,
    },
    /// A table cannot be encoded.
    #[error("{}: {source}", .path.display())]
    Parquet {
        /// The file.
        path: PathBuf,
        /// The error.
        source: PolarsError,
    },
}

/// A setting that varies, and whether all its values are numbers.
pub(crate) type Setting = (Key, bool);

pub(crate) fn numeric_settings(experiment: &Experiment) -> Vec<Setting> {
    let axes = experiment.axes().into_iter();
    let numeric = |key: Key| {
        let mut cells = experiment.cells.iter();
        cells.all(|cell| matches!(cell.settings.get(&key), Some(Scalar::Number(_))))
    };
    axes.map(|key| (key, numeric(key))).collect()
}
