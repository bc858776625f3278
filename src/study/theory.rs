//! What theory says of an experiment's cells.

use super::{Cell, Experiment, Source};
use crate::theory::{CellTheory, NoTheory};
use std::collections::HashMap;
use std::sync::Arc;

/// What theory says of a cell, or why there is none.
pub type FoundTheory = Result<Arc<CellTheory>, NoTheory>;

impl Experiment {
    /// What theory says of every cell as N grows, for every output: computed once for cells that differ in nothing that
    /// it depends on, such as the window.
    pub fn theories(&self) -> Vec<FoundTheory> {
        let mut known: HashMap<String, FoundTheory> = HashMap::new();
        let of_cell = |cell: &Cell| {
            let Source::Record(process) = &cell.source else {
                return Err(NoTheory::ContinuousTime);
            };
            let mut of_process = process.describe();
            // Where a record starts is forgotten.
            of_process["x0"].take();
            of_process["x0_deviation"].take();
            let key = format!("{of_process} {} {}", cell.eta, cell.order);
            let found = known.entry(key).or_insert_with(|| {
                CellTheory::new(process, cell.eta, cell.order, &self.methods).map(Arc::new)
            });
            found.clone()
        };
        self.cells.iter().map(of_cell).collect()
    }
}
