//! A cell: one combination of settings under which trials are drawn.

use crate::design::ContinuousCell;
use crate::design::file::{Settings, StudyKind};
use crate::worker::{Record, seed_of};
use asobench_identification::data::{Process, Realisation, Truth};
use asobench_identification::estimator::{Estimator, KnownModel, Method, Problem, SetupError, Shape};
use asobench_identification::names::named_enum;
use asobench_identification::observer::Gain;
use asobench_identification::plant::StateNoise;
use std::collections::BTreeMap;

named_enum! {
    /// Where the observer starts.
    ObserverStart, "start of the observer" {
        /// From the estimate of x0 (the default).
        Estimate = "x0-hat",
        /// From zero.
        Zero = "zero",
    }
}

/// The source of a cell's trials.
#[derive(Clone, Debug)]
pub enum Source {
    /// Records of a process in discrete time.
    Discrete(Box<DiscreteCell>),
    /// Courses in continuous time.
    Continuous(Box<ContinuousCell>),
}

named_enum! {
    /// The sample from which errors of the state are taken.
    ScoredFrom, "start of the score" {
        /// From k = N on: after the window that the model was estimated from (the default).
        Window = "window",
        /// From k = 0 on, including the transients of filters that know the plant.
        Start = "start",
    }
}

/// One combination of settings under which trials are drawn.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The settings that it was made of.
    pub settings: Settings,
    /// The claim or case, such as "C2".
    pub claim: String,
    /// The source of the trials.
    pub source: Source,
}

/// A cell in discrete time: records of a process, and how its methods and observers see them.
#[derive(Clone, Debug)]
pub struct DiscreteCell {
    /// The process that draws the records.
    pub process: Process,
    /// The noise level eta, per cent.
    pub eta: f64,
    /// The estimators' order n.
    pub order: usize,
    /// The window N, samples.
    pub window: usize,
    /// The record's length K, samples.
    pub horizon: usize,
    /// The observer's gain, stage 12.
    pub gain: Gain,
    /// Where the observer starts.
    pub observer_start: ObserverStart,
    /// The sample from which errors of the state are taken.
    pub scored_from: ScoredFrom,
    /// The samples by which [`Measure::FitAhead`](super::measure::Measure::FitAhead) predicts y ahead, at least 1.
    pub ahead: usize,
    /// The covariances of the noise that Kalman filters take for the true ones, by the names that methods have them by.
    pub covariances: BTreeMap<String, StateNoise>,
}

impl Cell {
    /// The kind of study that it is of.
    pub fn kind(&self) -> StudyKind {
        match &self.source {
            Source::Discrete(_) => StudyKind::Discrete,
            Source::Continuous(_) => StudyKind::Continuous,
        }
    }

    /// Returns the cell in discrete time; `None` if it is in continuous time.
    pub fn discrete(&self) -> Option<&DiscreteCell> {
        match &self.source {
            Source::Discrete(cell) => Some(cell),
            Source::Continuous(_) => None,
        }
    }

    /// Returns the order n of estimators and observers.
    pub fn order(&self) -> usize {
        match &self.source {
            Source::Discrete(cell) => cell.order,
            Source::Continuous(cell) => cell.plant.order(),
        }
    }

    /// Returns the order of the plant.
    pub fn plant_order(&self) -> usize {
        self.discrete().map_or(self.order(), DiscreteCell::plant_order)
    }

    /// Returns eta, N and K as summaries and tables have them: 0 in continuous time, where they do not exist.
    pub(crate) fn columns(&self) -> (f64, usize, usize) {
        let of = self.discrete();
        of.map_or((0.0, 0, 0), |cell| (cell.eta, cell.window, cell.horizon))
    }

    /// Whether nothing is random, so that all trials are identical.
    pub fn is_deterministic(&self) -> bool {
        match &self.source {
            Source::Discrete(cell) => cell.process.is_deterministic(cell.eta),
            Source::Continuous(cell) => cell.is_deterministic(),
        }
    }
}

impl DiscreteCell {
    /// The order of the plant.
    pub fn plant_order(&self) -> usize {
        self.process.order()
    }

    /// The shape of the estimators' problem.
    pub fn shape(&self) -> Shape {
        Shape {
            order: self.order,
            window: self.window,
        }
    }

    /// Returns the first sample at which the error of the state is scored.
    pub fn first_scored(&self) -> usize {
        match self.scored_from {
            ScoredFrom::Window => self.window,
            ScoredFrom::Start => 0,
        }
    }

    /// Whether x(k) follows from the true plant, x(0) and the measured input: without noise of the process and of the
    /// input, and without a change of the plant.
    pub fn follows_input(&self) -> bool {
        let of = self.process.settings();
        !of.is_disturbed() && of.input_noise == 0.0 && of.change.is_none()
    }

    /// Returns the model that a method with the true plant receives: the plant, and the mean of its initial states.
    ///
    /// # Errors
    /// [`SetupError::NoKnownPlant`] unless all trials share one plant of the cell's order, which does not change, and
    /// no estimate of it is fed back.
    pub fn known_model(&self) -> Result<KnownModel, SetupError> {
        let plant = self.process.plant();
        let plant = plant.filter(|plant| plant.order() == self.order);
        let plant = plant.ok_or(SetupError::NoKnownPlant)?;
        Ok(KnownModel::new(plant, &self.process.settings().x0))
    }

    /// Prepares a method's estimator for this cell. `covariance`: whether standard errors are wanted.
    ///
    /// # Errors
    /// If the method cannot serve the cell.
    pub fn prepare(&self, method: &Method, covariance: bool) -> Result<Box<dyn Estimator>, SetupError> {
        self.prepare_for(self.window, method, covariance)
    }

    /// Does the same for another window.
    ///
    /// # Errors
    /// If the method cannot serve the cell with that window.
    pub(crate) fn prepare_for(
        &self,
        window: usize,
        method: &Method,
        covariance: bool,
    ) -> Result<Box<dyn Estimator>, SetupError> {
        let known = if method.needs().plant {
            Some(self.known_model()?)
        } else {
            None
        };
        method.prepare(Problem {
            known: known.as_ref(),
            covariance,
            ..self.problem(window)
        })
    }

    /// Returns the problem that a method without knowledge of the plant is prepared for, with a window of this length.
    pub fn problem(&self, window: usize) -> Problem<'_> {
        Problem {
            shape: Shape {
                order: self.order,
                window,
            },
            known: None,
            process: Some((&self.process, self.eta)),
            covariance: false,
            reported: None,
            runs: &[],
            is_start: false,
        }
    }

    /// Draws a trial into buffers.
    pub fn realise(&self, seed: u64, trial: u64, into: &mut Realisation) {
        let (eta, window, horizon) = (self.eta, self.window, self.horizon);
        self.process.realise(seed, trial, eta, window, horizon, into);
    }

    /// Draws a trial and returns the record that a program receives, with the true plant.
    pub fn record_for_program(&self, seed: u64, trial: u64) -> (Record, Truth) {
        let (mut drawn, window) = (Realisation::default(), self.window);
        self.realise(seed, trial, &mut drawn);
        let cut = |signal: &[f64]| signal[..window].to_vec();
        let record = Record {
            trial,
            seed: seed_of(seed, trial),
            u: cut(&drawn.u),
            y: cut(&drawn.y),
            r: cut(&drawn.r),
        };
        (record, drawn.truth)
    }

    /// Returns the size in bytes of a record with its truth: u, y, r, u0, y0, f and n states for every sample.
    pub fn record_bytes(&self) -> usize {
        size_of::<f64>() * (6 + self.plant_order()) * self.horizon
    }
}

/// The number of Markov parameters in [`Measure::ImpulseResponse`], and of samples in [`Measure::FreshFit`].
pub(crate) const RESPONSE_SAMPLES: usize = 200;
