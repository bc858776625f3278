//! One realisation of a process: the record, its truth and its parts.

use super::controller::Kept;
use crate::names::named_enum;
use crate::plant::StateSpace;
use crate::plant::canonical::multiply_toeplitz;

named_enum! {
    /// Why a trial has no record.
    DrawFailure, "failure of the draw" {
        /// A value is not finite, or a random plant is so near the unit circle that rounding leaves the noise `1/A`
        /// without a stationary start.
        NonFinite = "non-finite",
        /// A matrix of the controller's model is exactly singular.
        Singular = "singular",
        /// A matrix of the controller's model is singular up to rounding.
        RankDeficient = "rank-deficient",
    }
}

/// The true system of a trial, each part of length n.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// Last row of A.
    pub a: Vec<f64>,
    /// Input vector.
    pub b: Vec<f64>,
    /// Numerator `h = T b`.
    pub h: Vec<f64>,
    /// The state at the record's first sample.
    pub x0: Vec<f64>,
}

impl Truth {
    /// Copies a plant and its initial state, without allocation once the buffers have grown.
    pub(super) fn set(&mut self, plant: &StateSpace, x0: &[f64]) {
        for (to, from) in [
            (&mut self.a, plant.a()),
            (&mut self.b, plant.b()),
            (&mut self.h, plant.b()),
            (&mut self.x0, x0),
        ] {
            to.clear();
            to.extend_from_slice(from);
        }
        multiply_toeplitz(&self.a, &mut self.h);
    }

    /// Forgets the previous trial: sets each part to n NaN.
    fn forget(&mut self, order: usize) {
        for part in [&mut self.a, &mut self.b, &mut self.h, &mut self.x0] {
            part.clear();
            part.resize(order, f64::NAN);
        }
    }
}

/// Buffers for one realisation of a process. All samples are k = 0 ... K-1 of the record. With
/// [`super::Feedback::Controlled`] the record begins where the loop is closed ([`Self::origin`]).
#[derive(Clone, Debug, Default)]
pub struct Realisation {
    /// The measured input u(k), which estimators and observers see.
    pub u: Vec<f64>,
    /// The measured output `y(k) = x_1(k) + s f(k)`.
    pub y: Vec<f64>,
    /// The external reference r(k); in open loop the input itself.
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
    /// Makes room for `samples` samples of a plant of order n.
    pub(super) fn resize(&mut self, order: usize, samples: usize) {
        for buffer in [
            &mut self.u,
            &mut self.y,
            &mut self.r,
            &mut self.u0,
            &mut self.y0,
            &mut self.f,
        ] {
            buffer.resize(samples, 0.0);
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
        for buffer in [
            &mut self.u,
            &mut self.y,
            &mut self.r,
            &mut self.u0,
            &mut self.y0,
            &mut self.f,
        ] {
            buffer.drain(..count);
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
