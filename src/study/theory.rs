//! What theory says of an experiment's cells.

use super::{Cell, Experiment, Source};
use crate::theory::{CellTheory, NoTheory};

impl Experiment {
    /// What theory says of a cell as N grows, for every output.
    ///
    /// # Errors
    /// Why there is none.
    pub fn theory(&self, cell: &Cell) -> Result<CellTheory, NoTheory> {
        match &cell.source {
            Source::Continuous(_) => Err(NoTheory::ContinuousTime),
            Source::Record(process) => {
                CellTheory::new(process, cell.eta, cell.order, &self.methods)
            }
        }
    }
}
