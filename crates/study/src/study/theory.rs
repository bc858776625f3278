//! Theoretical results for an experiment's cells.

use super::{Cell, Experiment, Measure};
use asobench_identification::metric::Statistics;
use asobench_identification::names::named_enum;
use asobench_identification::theory::{
    CellTheory, Figure, Missing, NoTheory, SmoothMeasure, Theory,
};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// The theory of a cell, or why there is none.
pub type FoundTheory = Result<CellTheory, NoTheory>;

/// The theories of all cells, each computed when first requested. Cells that differ only in settings that do not matter
/// to it, such as the window, share one theory.
pub(super) struct Theories {
    /// The index of every cell's theory.
    place: Vec<usize>,
    /// The first cell of each theory, and the result.
    found: Vec<(usize, OnceLock<FoundTheory>)>,
    /// Nanoseconds that threads spent on them.
    spent: AtomicU64,
}

impl Theories {
    fn new(cells: &[Cell]) -> Self {
        let mut known: HashMap<String, usize> = HashMap::new();
        let mut found = Vec::new();
        let place = cells.iter().enumerate().map(|(index, cell)| {
            let key = cell.process().map_or_else(String::new, |process| {
                let mut of_process = process.describe();
                // The limit does not depend on the initial state.
                of_process["x0"].take();
                of_process["x0_deviation"].take();
                format!("{of_process} {} {}", cell.eta, cell.order)
            });
            *known.entry(key).or_insert_with(|| {
                found.push((index, OnceLock::new()));
                found.len() - 1
            })
        });
        Self {
            place: place.collect(),
            found,
            spent: AtomicU64::new(0),
        }
    }
}

impl Experiment {
    /// Returns the theory of a cell as N grows, for every output.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn theory(&self, cell: usize) -> &FoundTheory {
        let all = self.theories.get_or_init(|| Theories::new(&self.cells));
        let (first, found) = &all.found[all.place[cell]];
        found.get_or_init(|| {
            let cell = &self.cells[*first];
            let process = cell.process().ok_or(NoTheory::ContinuousTime)?;
            let begin = Instant::now();
            let theory = CellTheory::new(process, cell.eta, cell.order, &self.methods);
            let spent = begin.elapsed().as_nanos() as u64;
            all.spent.fetch_add(spent, Ordering::Relaxed);
            theory
        })
    }

    /// Returns the time that threads have spent on the theory of all cells so far.
    pub(super) fn time_of_theory(&self) -> Duration {
        let spent = self
            .theories
            .get()
            .map_or(0, |all| all.spent.load(Ordering::Relaxed));
        Duration::from_nanos(spent)
    }
}

named_enum! {
    /// The theoretical value with which the results of an output are compared.
    TheoryReference, "reference of theory" {
        /// The theory of the output itself.
        Own = "theory",
        /// The Cramer-Rao bound if plant and noise share A.
        Shared = "bound:shared",
        /// The Cramer-Rao bound if the noise model has its own poles.
        Separate = "bound:separate",
    }
}

impl TheoryReference {
    /// Parses the name of a reference; `None` for the name of an output.
    pub fn named(name: &str) -> Option<Self> {
        name.parse().ok()
    }

    /// Returns its name in sentences.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Own => "its theory",
            Self::Shared => "the Cramer-Rao bound (shared)",
            Self::Separate => "the Cramer-Rao bound (separate)",
        }
    }
}

/// Median and root mean square of an error at the window N, from its limit distribution divided by sqrt(N).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LimitError {
    /// The median.
    pub median: f64,
    /// The root mean square.
    pub rms: f64,
}

impl LimitError {
    fn new(figure: &Figure, window: usize) -> Self {
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

/// Returns the measure of theory with the same name.
pub(super) fn smooth(measure: Measure) -> Option<SmoothMeasure> {
    let mut all = SmoothMeasure::ALL.iter().copied();
    all.find(|smooth| smooth.name() == measure.name())
}

/// Returns the theory of an output's measures, with efficiencies from their statistics.
pub(super) fn beside(
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
            let found = if q50.lost {
                0.0
            } else {
                bound.median / q50.value
            };
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
        let is_there =
            summary.theory.is_some() || bound.shared.is_some() || bound.separate.is_some();
        is_there.then_some((*measure, summary))
    };
    measures.iter().filter_map(summary).collect()
}
