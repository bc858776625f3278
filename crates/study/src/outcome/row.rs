//! One line of results: one output of one method on one trial.

use crate::design::Measure;
use asobench_identification::estimator::Failure;
use std::ops::{Index, IndexMut};

/// One output of one method on one trial.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The trial's index.
    pub trial: u64,
    /// The output's index in [`crate::design::experiment::Experiment::outputs`].
    pub output: usize,
    /// The failure that stopped the pass, if any.
    pub failure: Option<Failure>,
    /// Whether A-hat has a pole on or outside the unit circle; `None` if there is no A-hat.
    pub unstable: Option<bool>,
    /// Whether this or an earlier pass of the method had such an A-hat, reported or not.
    pub unstable_so_far: bool,
    values: [f64; Measure::ALL.len()],
}

impl Row {
    /// Makes a row without values.
    pub fn new(trial: u64, output: usize) -> Self {
        Self {
            trial,
            output,
            failure: None,
            unstable: None,
            unstable_so_far: false,
            values: [f64::NAN; Measure::ALL.len()],
        }
    }

    /// Returns "ok" or the failure's kind.
    pub fn status(&self) -> &str {
        let failure = self.failure.as_ref();
        failure.map_or("ok", |failure| failure.kind.name())
    }

    /// Whether two rows are equal bit for bit.
    pub fn same_bits(&self, other: &Self) -> bool {
        let bits = |row: &Self| row.values.map(f64::to_bits);
        let rest = |row: &Self| {
            let unstable = (row.unstable, row.unstable_so_far);
            (row.trial, row.output, row.failure, unstable)
        };
        rest(self) == rest(other) && bits(self) == bits(other)
    }

    /// Returns a measure as statistics use it: NaN for a failed row, even if it has a value.
    pub fn counted(&self, measure: Measure) -> f64 {
        match self.failure {
            Some(failure) if !failure.kind.is_counted() => f64::NAN,
            _ => self[measure],
        }
    }

    /// Whether the trial failed or left an unstable A-hat.
    pub fn is_lost(&self) -> bool {
        self.failure.is_some_and(|of| !of.kind.is_counted()) || self.unstable == Some(true)
    }
}

impl Index<Measure> for Row {
    type Output = f64;

    fn index(&self, measure: Measure) -> &f64 {
        &self.values[measure as usize]
    }
}

impl IndexMut<Measure> for Row {
    fn index_mut(&mut self, measure: Measure) -> &mut f64 {
        &mut self.values[measure as usize]
    }
}
