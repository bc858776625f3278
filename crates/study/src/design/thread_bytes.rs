//! The memory that a thread takes before its first trial.

use crate::design::file::Engine;
use crate::design::{Experiment, Source, curve_bytes};
use asobench_identification::real::MOST_LANES;

impl Experiment {
    /// Returns the bytes that a thread allocates for trials of a cell before it draws the first, as far as they grow
    /// with the settings: the record, the window of every method, and curves; in continuous time the disturbance.
    pub fn thread_bytes(&self, cell: usize) -> usize {
        const NUMBER: usize = size_of::<f64>();
        let engine = self.engine(cell);
        let cell = match &self.cells[cell].source {
            Source::Discrete(cell) => cell,
            Source::Continuous(cell) => return NUMBER * cell.disturbance_numbers(),
        };
        let (order, window, horizon) = (cell.order, cell.window, cell.horizon);
        // Stage 7's output, and the rows of stage 6 that are solved by themselves.
        let methods = self.methods.len() * window * (order + 2) * NUMBER;
        // The batch of a program's records, as it is drawn and as it is sent.
        let batches = self.programs.iter().map(|program| program.options.batch as usize);
        let methods = methods + batches.sum::<usize>() * window * 3 * 2 * NUMBER;
        let curve = if self.file.curves { horizon } else { 0 };
        let (samples, lanes) = match engine {
            Ok(Engine::Lanes) => (2 * horizon + window + 4 * curve, MOST_LANES),
            // The noise filter's scratch.
            _ => (cell.record_bytes() / NUMBER + horizon + curve, 1),
        };
        let curves = if curve > 0 { curve_bytes(horizon) } else { 0 };
        samples * lanes * NUMBER + methods * lanes + curves
    }
}
