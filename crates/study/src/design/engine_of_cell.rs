//! Which engine computes the trials of a cell.

use crate::design::file::{Engine, FileError};
use crate::design::{Cell, Experiment, covered};
use asobench_lanes::Isa;

impl Experiment {
    /// Returns the engine that runs a cell: [`Engine::Lanes`] or [`Engine::Faer`].
    ///
    /// # Errors
    /// If the file asks for lanes and they do not cover the cell.
    pub fn engine(&self, cell: usize) -> Result<Engine, FileError> {
        let engine = self.file.engine.of(self, &self.cells[cell]);
        engine.map_err(|reason| {
            let message = format!("\"lanes\" do not cover {reason} (cell {cell}); expected \"auto\" or \"faer\"");
            FileError::key("engine", message)
        })
    }
}

impl Engine {
    /// Returns the engine of a cell: lanes or faer.
    ///
    /// # Errors
    /// If lanes are asked for: what they do not cover.
    pub(crate) fn of(self, experiment: &Experiment, cell: &Cell) -> Result<Self, String> {
        let covered = match cell.discrete() {
            Some(cell) => covered(experiment, cell).map(|_| ()),
            None => Err("continuous time".to_owned()),
        };
        match (self, covered) {
            (Self::Auto | Self::Lanes, Ok(())) => Ok(Self::Lanes),
            (Self::Lanes, Err(reason)) => Err(reason),
            (Self::Auto | Self::Faer, _) => Ok(Self::Faer),
        }
    }

    /// Returns the vector instructions on which faer's bits depend, for a manifest.
    pub fn faer_instructions() -> &'static str {
        if Isa::Avx512.is_here() {
            Isa::Avx512.name()
        } else if Isa::Avx2.is_here() {
            Isa::Avx2.name()
        } else {
            std::env::consts::ARCH
        }
    }
}
