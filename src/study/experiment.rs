//! What is studied: a process, cells, methods.

use crate::data::{Process, ProcessError};
use crate::estimator::{IvOptions, Method, Output, SetupError, Shape};
use crate::observer::{Gain, GainError};
use crate::plant::{Numerator, nikolov2023};
use crate::signal::{LevelReading, NoiseFilter, RandomSigns, Sequence};
use serde_json::{Value, json};

/// One combination of settings under which trials are drawn.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Cell {
    /// The claim that the cell tests, such as "C2".
    pub claim: String,
    /// The noise level eta, per cent.
    pub eta: f64,
    /// The window N, samples.
    pub window: usize,
    /// The record's length K, samples.
    pub horizon: usize,
}

impl Cell {
    /// A cell with the default length of its record, K = max(400, N + 200).
    pub fn new(claim: &str, eta: f64, window: usize) -> Self {
        Self {
            claim: claim.to_owned(),
            eta,
            window,
            horizon: 400.max(window + 200),
        }
    }
}

/// A Monte-Carlo experiment. A trial is a pure function of the experiment, a cell and a trial index.
pub struct Experiment {
    /// Draws the records.
    pub process: Process,
    /// Settings, each with trials of its own on common random numbers.
    pub cells: Vec<Cell>,
    /// What is compared, all on the same records.
    pub methods: Vec<Method>,
    /// The observer's gain, stage 12.
    pub gain: Gain,
    /// Names the random streams.
    pub seed: u64,
}

/// Why an experiment was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExperimentError {
    /// No cell or no method.
    #[error("an experiment needs at least one cell and one method")]
    Empty,
    /// eta is negative or not finite.
    #[error("eta must be a finite percentage of at least 0, not {0}")]
    Level(f64),
    /// The record is shorter than the window.
    #[error("the record of K = {1} samples is shorter than the window N = {0}")]
    Horizon(usize, usize),
    /// The process.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// The gain does not fit the order.
    #[error(transparent)]
    Gain(#[from] GainError),
    /// A method cannot serve a cell.
    #[error(transparent)]
    Setup(#[from] SetupError),
}

impl Experiment {
    /// The experiment of Nikolov et al. (2023): claims C1 (noise-free, N = 18), C2 (eta 10.018 %, N = 98)
    /// and C3 (eta 10.014 %, N = 218), K = 400 samples, least squares and four IV passes, every
    /// reading at its default.
    ///
    /// # Panics
    /// Never: the paper's numbers are valid.
    pub fn nikolov2023(seed: u64) -> Self {
        let plant = nikolov2023(Numerator::default());
        let noise = NoiseFilter::new(&[1.0], &plant.denominator()).expect("the plant is stable");
        let input = RandomSigns {
            amplitude: 10.0,
            sequence: Sequence::default(),
        };
        let process = Process::new(plant, vec![1.0; 6], input, noise, LevelReading::default());
        // The paper's figures end at k = 400, also where N + 200 is more.
        let cell = |claim: &str, eta, window: usize| Cell {
            horizon: 400,
            ..Cell::new(claim, eta, window)
        };
        Self {
            process: process.expect("the paper's process is valid"),
            cells: vec![
                cell("C1", 0.0, 18),
                cell("C2", 10.018, 98),
                cell("C3", 10.014, 218),
            ],
            methods: vec![Method::instrumental_variables(IvOptions::default())],
            gain: Gain::default(),
            seed,
        }
    }

    /// The order n and window N of a cell.
    pub fn shape(&self, cell: &Cell) -> Shape {
        Shape {
            order: self.process.order(),
            window: cell.window,
        }
    }

    /// The outputs of all methods, in the order of a trial's rows.
    pub fn outputs(&self) -> Vec<Output> {
        let outputs = self.methods.iter().flat_map(Method::outputs);
        outputs.cloned().collect()
    }

    /// Checks every cell with every method.
    ///
    /// # Errors
    /// What is wrong, the first that is found.
    pub fn validate(&self) -> Result<(), ExperimentError> {
        if self.cells.is_empty() || self.methods.is_empty() {
            return Err(ExperimentError::Empty);
        }
        self.gain.check(self.process.order())?;
        for cell in &self.cells {
            if !(cell.eta >= 0.0 && cell.eta.is_finite()) {
                return Err(ExperimentError::Level(cell.eta));
            }
            if cell.horizon < cell.window {
                return Err(ExperimentError::Horizon(cell.window, cell.horizon));
            }
            for method in &self.methods {
                method.prepare(self.shape(cell))?;
            }
        }
        Ok(())
    }

    /// Every setting, for a manifest.
    pub fn describe(&self) -> Value {
        json!({
            "process": self.process.describe(),
            "cells": self.cells,
            "methods": self.methods.iter().map(Method::describe).collect::<Vec<_>>(),
            "gain": self.gain,
            "seed": self.seed,
        })
    }
}
