//! Rows of consecutive trials, stored by columns.

use crate::design::{Cell, Experiment, Measure};
use crate::outcome::coefficients;
use crate::outcome::row::Row;
use asobench_identification::estimator::Failure;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::ops::Range;

/// Rows of consecutive trials of one cell, with all outputs of each trial.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    first: u64,
    measures: Vec<Measure>,
    outputs: Vec<OutputRows>,
}

/// The rows of one output: every column has one entry per trial.
#[derive(Clone, Debug, Default)]
pub struct OutputRows {
    flags: Vec<Flags>,
    /// The failures, each with the index of its trial; ascending.
    failures: Vec<(usize, Failure)>,
    /// Each measure of [`Rows::measures`], NaN where undefined.
    values: Vec<Vec<f64>>,
    /// The requested values of each coefficient (`coefficients`), NaN if undefined.
    parameters: Vec<Vec<f64>>,
}

/// The stability of an output's A-hat, as far as it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Flags(u8);

impl Flags {
    const KNOWN: u8 = 1;
    const UNSTABLE: u8 = 2;
    const UNSTABLE_SO_FAR: u8 = 4;

    pub(crate) fn new(unstable: Option<bool>, unstable_so_far: bool) -> Self {
        let set = |flag: u8, on: bool| if on { flag } else { 0 };
        Self(
            set(Self::KNOWN, unstable.is_some())
                | set(Self::UNSTABLE, unstable == Some(true))
                | set(Self::UNSTABLE_SO_FAR, unstable_so_far),
        )
    }

    fn has(self, flag: u8) -> bool {
        self.0 & flag != 0
    }

    /// Whether A-hat has a pole on or outside the unit circle; `None` if there is no A-hat.
    pub(crate) fn unstable(self) -> Option<bool> {
        self.has(Self::KNOWN).then(|| self.has(Self::UNSTABLE))
    }

    /// Whether A-hat of this or an earlier pass has such a pole.
    pub(crate) fn unstable_so_far(self) -> bool {
        self.has(Self::UNSTABLE_SO_FAR)
    }
}

impl OutputRows {
    /// Returns the number of trials.
    pub fn len(&self) -> usize {
        self.flags.len()
    }

    /// Whether there are no trials.
    pub fn is_empty(&self) -> bool {
        self.flags.is_empty()
    }

    /// Appends a trial's flags and failure. The caller appends its values to [`Self::columns`].
    pub(crate) fn push(&mut self, flags: Flags, failure: Option<Failure>) {
        let place = self.flags.len();
        self.failures.extend(failure.map(|failure| (place, failure)));
        self.flags.push(flags);
    }

    /// Returns the columns of measures and of parameters, to append to.
    pub(crate) fn columns(&mut self) -> [&mut [Vec<f64>]; 2] {
        [&mut self.values, &mut self.parameters]
    }

    pub(crate) fn flags(&self) -> &[Flags] {
        &self.flags
    }

    /// Returns the failures, each with the index of its trial; ascending.
    pub(crate) fn failures(&self) -> &[(usize, Failure)] {
        &self.failures
    }

    /// Returns a column of [`Self::parameters`] or of a measure as statistics use it: failed trials become NaN, even if
    /// they have a value.
    pub(crate) fn counted<'a>(&self, column: &'a [f64]) -> Cow<'a, [f64]> {
        if self.failures.is_empty() {
            return Cow::Borrowed(column);
        }
        let mut counted = column.to_vec();
        for (place, failure) in &self.failures {
            if !failure.kind.is_counted() {
                counted[*place] = f64::NAN;
            }
        }
        Cow::Owned(counted)
    }

    /// Returns the columns of measures, in the order of [`Rows::measures`].
    pub(crate) fn values(&self) -> &[Vec<f64>] {
        &self.values
    }

    /// Returns the requested values of each coefficient (`coefficients`).
    pub fn parameters(&self) -> &[Vec<f64>] {
        &self.parameters
    }

    /// Returns the failure of a trial, if it failed.
    pub(crate) fn failure(&self, place: usize) -> Option<Failure> {
        let found = self.failures.binary_search_by_key(&place, |(at, _)| *at);
        found.ok().map(|index| self.failures[index].1)
    }
}

impl Rows {
    /// Makes an empty set of rows with the measures that a file or its bounds ask for.
    pub fn new(experiment: &Experiment, cell: &Cell) -> Self {
        Self::with(experiment.measures_asked(), experiment, cell)
    }

    /// Makes an empty set of rows with every measure.
    pub fn of_all_measures(experiment: &Experiment, cell: &Cell) -> Self {
        Self::with(Measure::ALL.to_vec(), experiment, cell)
    }

    fn with(measures: Vec<Measure>, experiment: &Experiment, cell: &Cell) -> Self {
        let file = &experiment.file;
        let width = coefficients::columns(file, cell.order()) + coefficients::course_columns(file, cell);
        let output = OutputRows {
            values: vec![Vec::new(); measures.len()],
            parameters: vec![Vec::new(); width],
            ..OutputRows::default()
        };
        Self {
            first: 0,
            measures,
            outputs: vec![output; experiment.output_count()],
        }
    }

    /// Returns the trials.
    pub fn trials(&self) -> Range<u64> {
        self.first..self.first + self.trial_count() as u64
    }

    /// Returns the number of measures and coefficients of a trial.
    pub(crate) fn values_of_trial(&self) -> usize {
        let of_output = |of: &OutputRows| of.values.len() + of.parameters.len();
        self.outputs.iter().map(of_output).sum()
    }

    /// Returns the number of trials.
    pub fn trial_count(&self) -> usize {
        self.outputs.first().map_or(0, OutputRows::len)
    }

    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.trial_count() * self.outputs.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the measures that are kept.
    pub fn measures(&self) -> &[Measure] {
        &self.measures
    }

    /// Returns the rows of every output.
    pub fn outputs(&self) -> &[OutputRows] {
        &self.outputs
    }

    /// Returns the measures that are kept, and the outputs to which the trials from `trial` on are appended.
    pub(crate) fn next(&mut self, trial: u64) -> (&[Measure], &mut [OutputRows]) {
        if self.is_empty() {
            self.first = trial;
        }
        debug_assert!(trial <= self.trials().end, "trials follow each other");
        (&self.measures, &mut self.outputs)
    }

    /// Appends the row of an output of the next trial, with the requested values of each coefficient.
    pub(crate) fn push(&mut self, row: &Row, parameters: &[f64]) {
        let (measures, outputs) = self.next(row.trial);
        let output = &mut outputs[row.output];
        output.push(Flags::new(row.unstable, row.unstable_so_far), row.failure);
        for (column, measure) in output.values.iter_mut().zip(measures) {
            column.push(row[*measure]);
        }
        for (column, error) in output.parameters.iter_mut().zip(parameters) {
            column.push(*error);
        }
    }

    /// Returns one row; measures that are not kept are NaN.
    ///
    /// # Panics
    /// If there is no such trial or output.
    pub fn row(&self, place: usize, output: usize) -> Row {
        let columns = &self.outputs[output];
        let mut row = Row::new(self.first + place as u64, output);
        row.failure = columns.failure(place);
        row.unstable = columns.flags[place].unstable();
        row.unstable_so_far = columns.flags[place].unstable_so_far();
        for (measure, column) in self.measures.iter().zip(&columns.values) {
            row[*measure] = column[place];
        }
        row
    }

    /// Returns the requested values of each coefficient in one row (`coefficients`).
    ///
    /// # Panics
    /// If there is no such trial or output.
    pub fn parameters(&self, place: usize, output: usize) -> Vec<f64> {
        let columns = self.outputs[output].parameters.iter();
        columns.map(|column| column[place]).collect()
    }

    /// Iterates over all rows: all outputs of the first trial, then of the next.
    pub fn iter(&self) -> impl Iterator<Item = Row> {
        let outputs = 0..self.outputs.len();
        (0..self.trial_count()).flat_map(move |place| outputs.clone().map(move |output| self.row(place, output)))
    }

    /// Reserves room for so many trials.
    pub fn reserve(&mut self, trials: usize) {
        for output in &mut self.outputs {
            output.flags.reserve_exact(trials);
            let [values, parameters] = output.columns();
            for column in values.iter_mut().chain(parameters) {
                column.reserve_exact(trials);
            }
        }
    }

    /// Takes the rows out and leaves the same columns empty.
    pub(crate) fn take(&mut self) -> Self {
        let output = |columns: &OutputRows| OutputRows {
            values: vec![Vec::new(); columns.values.len()],
            parameters: vec![Vec::new(); columns.parameters.len()],
            ..OutputRows::default()
        };
        let empty = Self {
            first: 0,
            measures: self.measures.clone(),
            outputs: self.outputs.iter().map(output).collect(),
        };
        std::mem::replace(self, empty)
    }

    /// Returns the same trials with other outputs, which have the same columns.
    pub(crate) fn with_outputs(&self, outputs: Vec<OutputRows>) -> Self {
        Self {
            first: self.first,
            measures: self.measures.clone(),
            outputs,
        }
    }

    /// Appends the rows of the trials that follow.
    pub(crate) fn append(&mut self, next: Self) {
        debug_assert_eq!(self.trials().end, next.first, "trials follow each other");
        for (output, next) in self.outputs.iter_mut().zip(next.outputs) {
            let there = output.flags.len();
            let failures = next.failures.into_iter();
            output
                .failures
                .extend(failures.map(|(place, failure)| (place + there, failure)));
            output.flags.extend(next.flags);
            let columns = output.values.iter_mut().chain(&mut output.parameters);
            columns
                .zip(next.values.into_iter().chain(next.parameters))
                .for_each(|(column, next)| column.extend(next));
        }
    }

    /// Removes all rows; the allocated room stays.
    pub fn clear(&mut self) {
        self.truncate(0);
    }

    /// Returns the bytes of the rows in memory.
    pub(crate) fn bytes(&self) -> usize {
        let numbers = |output: &OutputRows| output.values.len() + output.parameters.len();
        let row = |output| size_of::<Flags>() + size_of::<f64>() * numbers(output);
        self.trial_count() * self.outputs.iter().map(row).sum::<usize>()
    }

    /// Adds trials until there are so many. Their values are the last ones, or 1, times one of `factors` for each
    /// trial.
    pub(crate) fn make_up(&mut self, factors: &[f64]) {
        for output in &mut self.outputs {
            let there = output.flags.len();
            let flags = output.flags.last().copied().unwrap_or_default();
            output.flags.resize(factors.len().max(there), flags);
            for column in output.values.iter_mut().chain(&mut output.parameters) {
                let last = column.last().copied().filter(|x| x.is_finite() && *x != 0.0);
                let made_up = factors.iter().skip(there).map(|factor| factor * last.unwrap_or(1.0));
                column.extend(made_up);
            }
        }
    }

    /// Keeps the first `trials` trials.
    pub(crate) fn truncate(&mut self, trials: usize) {
        for output in &mut self.outputs {
            output.flags.truncate(trials);
            output.failures.retain(|(place, _)| *place < trials);
            let OutputRows { values, parameters, .. } = output;
            for column in values.iter_mut().chain(parameters) {
                column.truncate(trials);
            }
        }
    }
}

/// The bytes of rows in a block file: the failures of all outputs, then for each output its flags, the measures of the
/// file, and the errors and standard errors of the coefficients.
///
/// ```text
/// length of failures u64 | failures (postcard) | for each output: flags u8 ... |
/// for each measure: f64 ... | for each error and standard error: f64 ...
/// ```
pub(crate) mod stored {
    use super::{
        Cell, Deserialize, Experiment, Failure, Flags, Measure, OutputRows, Range, Rows, Serialize, coefficients,
    };

    /// The failures of each output, each with the index of its trial.
    #[derive(Serialize, Deserialize)]
    struct Failures(Vec<Vec<(u32, Failure)>>);

    /// Appends the rows of a cell with the measures of the experiment's file.
    pub fn encode(rows: &Rows, experiment: &Experiment, cell: &Cell, to: &mut Vec<u8>) -> postcard::Result<()> {
        let kept = coefficients::kept(&experiment.file, cell.order());
        let places = |output: &OutputRows| -> Vec<(u32, Failure)> {
            output
                .failures
                .iter()
                .map(|(place, failure)| (*place as u32, *failure))
                .collect()
        };
        let failures = postcard::to_stdvec(&Failures(rows.outputs.iter().map(places).collect()))?;
        to.extend((failures.len() as u64).to_le_bytes());
        to.extend(failures);
        for output in &rows.outputs {
            to.extend(output.flags.iter().map(|flags| flags.0));
            for measure in &experiment.file.measures {
                let at = rows.measures.iter().position(|other| other == measure);
                let column = at.map(|at| &output.values[at]);
                append(to, column.map_or(&[], |column| column));
            }
            for column in output.parameters.iter().take(kept) {
                append(to, column);
            }
        }
        Ok(())
    }

    fn append(to: &mut Vec<u8>, column: &[f64]) {
        let begin = to.len();
        to.resize(begin + 8 * column.len(), 0);
        for (bytes, x) in to[begin..].as_chunks_mut::<8>().0.iter_mut().zip(column) {
            *bytes = x.to_le_bytes();
        }
    }

    /// Decodes the rows of these trials of a cell. The error says what is wrong.
    pub fn decode(
        mut bytes: &[u8],
        experiment: &Experiment,
        cell: &Cell,
        trials: &Range<u64>,
    ) -> Result<Rows, &'static str> {
        const SHORT: &str = "rows that end too early";
        let mut take = |count: usize| bytes.split_off(..count).ok_or(SHORT);
        let mut length = [0; 8];
        length.copy_from_slice(take(8)?);
        let length = usize::try_from(u64::from_le_bytes(length)).map_err(|_| SHORT)?;
        let Failures(failures) = postcard::from_bytes(take(length)?).map_err(|_| "failures that cannot be decoded")?;
        let count = usize::try_from(trials.end - trials.start).map_err(|_| SHORT)?;
        let outputs = experiment.output_count();
        if failures.len() != outputs {
            return Err("failures for a wrong number of outputs");
        }
        let measures: Vec<Measure> = experiment.file.measures.clone();
        let kept = coefficients::kept(&experiment.file, cell.order());
        let mut rows = Rows {
            first: trials.start,
            measures,
            outputs: Vec::with_capacity(outputs),
        };
        let width = count.checked_mul(8).ok_or(SHORT)?;
        for failures in failures {
            let places = failures.iter().map(|(place, _)| *place as usize);
            if !places.clone().is_sorted_by(|a, b| a < b) || places.max() >= Some(count) {
                return Err("failures of other trials");
            }
            let flags = take(count)?.iter().map(|byte| Flags(*byte)).collect();
            let mut columns = |count: usize| -> Result<Vec<Vec<f64>>, &'static str> {
                let column = |_| Ok(numbers(take(width)?));
                (0..count).map(column).collect()
            };
            let values = columns(rows.measures.len())?;
            let parameters = columns(kept)?;
            rows.outputs.push(OutputRows {
                flags,
                failures: failures
                    .into_iter()
                    .map(|(place, failure)| (place as usize, failure))
                    .collect(),
                values,
                parameters,
            });
        }
        if bytes.is_empty() {
            Ok(rows)
        } else {
            Err("data after its rows")
        }
    }

    fn numbers(bytes: &[u8]) -> Vec<f64> {
        let numbers = bytes.as_chunks::<8>().0.iter();
        numbers.map(|bytes| f64::from_le_bytes(*bytes)).collect()
    }
}
