//! The engines that compute a cell's trials: packs of [`asobench_lanes`], or [`Trial`] by faer.

use crate::design::file::Engine;
use crate::design::{Cell, Experiment, Plan, Source};
use crate::outcome::trials::Trials;
use crate::run::continuous_trial::ContinuousTrial;
use crate::run::pack_trial::PackTrial;
use crate::run::trial::Trial;
use asobench_identification::estimator::SetupError;
use asobench_identification::observer::gpebo::CascadeError;
use asobench_identification::real::MOST_LANES;
use asobench_lanes::Isa;
use std::ops::Range;

/// Why a cell has no worker.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WorkerError {
    /// A method cannot serve the cell.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The parts of a trial in continuous time do not fit.
    #[error(transparent)]
    Continuous(#[from] CascadeError),
    /// Lanes were asked for and do not cover the cell.
    #[error("engine: \"lanes\" do not cover {0}; expected \"auto\" or \"faer\"")]
    NotCovered(String),
}

/// Buffers to run trials of one cell, for any engine.
pub enum Worker<'e> {
    /// One trial after the other.
    Faer(Box<Trial<'e>>),
    /// One pack at a time.
    Lanes(Box<PackTrial<'e>>),
    /// Courses in continuous time, one pack at a time.
    Continuous(Box<ContinuousTrial<'e>>),
}

impl<'e> Worker<'e> {
    /// Makes buffers for a cell, on the engine that the experiment asks for.
    ///
    /// # Errors
    /// If a method cannot serve the cell, or lanes are asked for that do not cover it.
    pub fn new(experiment: &'e Experiment, cell: &'e Cell) -> Result<Self, WorkerError> {
        if let Source::Continuous(cell) = &cell.source {
            let trial = ContinuousTrial::new(experiment, cell)?;
            return Ok(Self::Continuous(Box::new(trial)));
        }
        let engine = experiment.file.engine.of(experiment, cell);
        match engine.map_err(WorkerError::NotCovered)? {
            Engine::Lanes => {
                let plan = Plan::new(experiment, cell).map_err(WorkerError::NotCovered)?;
                Ok(Self::Lanes(Box::new(plan.pack(Isa::best()))))
            }
            Engine::Auto | Engine::Faer => Ok(Self::Faer(Box::new(Trial::new(experiment, cell)?))),
        }
    }

    /// Returns how many trials to compute at a time; for packs, as many as take a few milliseconds.
    pub fn stride(&self, cell: &Cell) -> u64 {
        const SAMPLES: usize = 1 << 16;
        match self {
            Self::Faer(_) => 1,
            Self::Continuous(_) => MOST_LANES as u64,
            Self::Lanes(pack) => {
                let (_, _, horizon) = cell.columns();
                pack.lanes() as u64 * (SAMPLES / horizon).clamp(1, 32) as u64
            }
        }
    }

    /// Runs trials and appends the requested results.
    ///
    /// # Errors
    /// If an external program fails; the trials before it are appended then.
    pub fn run_into(&mut self, mut trials: Range<u64>, to: &mut Trials) -> Result<(), WorkerError> {
        match self {
            Self::Faer(trial) => trials.try_for_each(|index| trial.run_into(index, to))?,
            Self::Lanes(pack) => pack.run_into(trials, to),
            Self::Continuous(trial) => trial.run_into(trials, to),
        }
        Ok(())
    }
}
