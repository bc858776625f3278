//! One realisation of a process: the record, its truth and its parts.

use super::controller::Kept;
use super::{DrawFailure, PlantCourse, Truth};

/// Buffers for one realisation of a process. All samples are k = 0 ... K-1 of the record. With
/// [`super::Feedback::Controlled`] the record begins where the loop is closed ([`Self::origin`]).
#[derive(Clone, Debug, Default)]
pub struct Realisation {
    /// The measured input u(k), which estimators and observers see.
    pub u: Vec<f64>,
    /// The measured output `y(k) = x_1(k) + s f(k)`.
    pub y: Vec<f64>,
    /// The external reference r(k); in open loop the input as it was measured, u(k).
    pub r: Vec<f64>,
    /// The true input, which drives the plant. It equals `u` if there is no input-measurement noise.
    pub u0: Vec<f64>,
    /// The plant's output x_1(k) before measurement noise; noise-free in open loop.
    pub y0: Vec<f64>,
    /// The unscaled noise f(k).
    pub f: Vec<f64>,
    /// The true states, n numbers a row: row k holds x(k).
    pub states: Vec<f64>,
    /// The estimates of the states that a controller fed back, n numbers a row, as in `states`; empty without them.
    pub estimates: Vec<f64>,
    /// The factor s of the noise; NaN if the noise level cannot be reached.
    pub scale: f64,
    /// The true system of this trial.
    pub truth: Truth,
    /// The true plant of every sample.
    pub plants: PlantCourse,
    /// The number of samples drawn before the record's first one: the open-loop part before a controller starts.
    pub origin: usize,
    /// Why there is no record, if there is none. Then `u` and `y` are NaN, and so is the truth if no plant was drawn.
    pub failure: Option<DrawFailure>,
    /// Scratch for the noise filter's inner signal v.
    pub(super) scratch: Vec<f64>,
    /// The current state during a simulation.
    pub(super) x: Vec<f64>,
    /// The output `K(q) y` of the output feedback.
    pub(super) fed_back: Vec<f64>,
    /// The controller of the process last drawn from.
    pub(super) controller: Kept,
}

impl Realisation {
    /// The signals with one number for each sample.
    fn signals(&mut self) -> [&mut Vec<f64>; 6] {
        let Self { u, y, r, u0, y0, f, .. } = self;
        [u, y, r, u0, y0, f]
    }

    /// Makes room for `samples` samples of a plant of order n.
    pub(super) fn resize(&mut self, order: usize, samples: usize) {
        for signal in self.signals() {
            signal.resize(samples, 0.0);
        }
        self.states.resize(samples * order, 0.0);
        self.estimates.clear();
        self.truth.forget(order);
        self.scale = f64::NAN;
        self.origin = 0;
        self.failure = None;
    }

    /// Drops the first `count` samples: the record begins at k = `count`, from the state there.
    pub(super) fn begin_at(&mut self, order: usize, count: usize) {
        for signal in self.signals() {
            signal.drain(..count);
        }
        self.states.drain(..count * order);
        self.origin = count;
        if let Some(state) = self.states.get(..order) {
            self.truth.x0.copy_from_slice(state);
        }
    }

    /// Marks the trial as failed; no number of its record may then be used.
    pub(super) fn fail(&mut self, failure: DrawFailure) {
        self.failure = Some(failure);
        self.u.fill(f64::NAN);
        self.y.fill(f64::NAN);
    }
}
