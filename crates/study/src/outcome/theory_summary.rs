//! The theory of the errors of a cell, beside its results.

use crate::design::file::TheoryReference;
use crate::design::{Measure, smooth};
use asobench_identification::metric::Statistics;
use asobench_identification::theory::{CellTheory, Figure, Missing, Theory};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Median and root mean square of an error at the window N, from its limit distribution divided by sqrt(N).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LimitError {
    /// The median.
    pub median: f64,
    /// The root mean square.
    pub rms: f64,
}

impl LimitError {
    pub(crate) fn new(figure: &Figure, window: usize) -> Self {
        let root = (window as f64).sqrt();
        Self {
            median: figure.quantile(0.5) / root,
            rms: figure.sqrt_n_rms / root,
        }
    }
}

/// One value for each bound; null if there is none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OfBounds<T> {
    /// [`TheoryReference::Shared`].
    pub shared: Option<T>,
    /// [`TheoryReference::Separate`].
    pub separate: Option<T>,
}

impl<T> OfBounds<T> {
    fn map<U>(&self, f: impl Fn(&T) -> U) -> OfBounds<U> {
        OfBounds {
            shared: self.shared.as_ref().map(&f),
            separate: self.separate.as_ref().map(&f),
        }
    }
}

/// The theory of a measure of an output, as N grows, to compare with its trials.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TheorySummary {
    /// The theory of the output itself; null if the output is biased or has no theory.
    pub theory: Option<LimitError>,
    /// The theory of an efficient estimate.
    pub bound: OfBounds<LimitError>,
    /// The square of the ratio of the median under the bound to the median of all trials, failed ones ranked last. Null
    /// if the output is biased.
    pub efficiency: OfBounds<f64>,
}

impl TheorySummary {
    /// Returns the error of a reference.
    pub fn reference(&self, of: TheoryReference) -> Option<LimitError> {
        match of {
            TheoryReference::Own => self.theory,
            TheoryReference::Shared => self.bound.shared,
            TheoryReference::Separate => self.bound.separate,
        }
    }
}

/// Returns the theory of an output's measures, with efficiencies from their statistics.
pub(crate) fn beside(
    theory: &CellTheory,
    output: &Result<Theory, Missing>,
    window: usize,
    measures: &BTreeMap<Measure, Statistics>,
) -> BTreeMap<Measure, TheorySummary> {
    let is_biased = match output {
        Ok(theory) => !theory.is_consistent,
        // The user knows whether a method without theory is biased.
        Err(Missing::Method(_)) => false,
        Err(_) => true,
    };
    let of = |theory: &Result<Theory, Missing>, measure| {
        let figure = theory.as_ref().ok()?.figure(measure)?;
        (figure.sqrt_n_rms > 0.0).then(|| LimitError::new(figure, window))
    };
    let summary = |(measure, statistics): (&Measure, &Statistics)| {
        let smooth = smooth(*measure)?;
        let bound = OfBounds {
            shared: of(&theory.shared, smooth),
            separate: of(&theory.separate, smooth),
        };
        let q50 = statistics.q50;
        let efficiency = bound.map(|bound: &LimitError| {
            let found = if q50.lost { 0.0 } else { bound.median / q50.value };
            Some(found * found).filter(|efficiency| efficiency.is_finite() && !is_biased)
        });
        let summary = TheorySummary {
            theory: of(output, smooth).filter(|_| !is_biased),
            bound,
            efficiency: OfBounds {
                shared: efficiency.shared.flatten(),
                separate: efficiency.separate.flatten(),
            },
        };
        let is_there = summary.theory.is_some() || bound.shared.is_some() || bound.separate.is_some();
        is_there.then_some((*measure, summary))
    };
    measures.iter().filter_map(summary).collect()
}
