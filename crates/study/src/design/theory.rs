//! Theoretical results for an experiment's cells.

use crate::design::{Cell, Measure};
use asobench_identification::theory::{CellTheory, NoTheory, SmoothMeasure};
use std::collections::HashMap;
use std::sync::OnceLock;
use std::sync::atomic::AtomicU64;

/// The theory of a cell, or why there is none.
pub type FoundTheory = Result<CellTheory, NoTheory>;

/// The theories of all cells, each computed when first requested. Cells that differ only in settings that do not matter
/// to it, such as the window, share one theory.
pub(crate) struct Theories {
    /// The index of every cell's theory.
    pub(crate) place: Vec<usize>,
    /// The first cell of each theory, and the result.
    pub(crate) found: Vec<(usize, OnceLock<FoundTheory>)>,
    /// Nanoseconds that threads spent on them.
    pub(crate) spent: AtomicU64,
}

impl Theories {
    pub(crate) fn new(cells: &[Cell]) -> Self {
        let mut known: HashMap<String, usize> = HashMap::new();
        let mut found = Vec::new();
        let place = cells.iter().enumerate().map(|(index, cell)| {
            let key = cell.discrete().map_or_else(String::new, |cell| {
                let mut of_process = cell.process.describe();
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

/// Returns the measure of theory with the same name.
pub(crate) fn smooth(measure: Measure) -> Option<SmoothMeasure> {
    let mut all = SmoothMeasure::ALL.iter().copied();
    all.find(|smooth| smooth.name() == measure.name())
}
