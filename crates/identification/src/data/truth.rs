//! The system that made a record.

use crate::names::named_enum;
use crate::plant::StateSpace;
use crate::plant::canonical::multiply_toeplitz;

/// The true system of a trial, each part of length n. Of a plant that changes, a, b and h are those of k = N - 1.
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

    /// Sets h to `T b`.
    pub(super) fn follow_b(&mut self) {
        self.h.copy_from_slice(&self.b);
        multiply_toeplitz(&self.a, &mut self.h);
    }

    /// Forgets the previous trial: sets each part to n NaN.
    pub(super) fn forget(&mut self, order: usize) {
        for part in [&mut self.a, &mut self.b, &mut self.h, &mut self.x0] {
            part.clear();
            part.resize(order, f64::NAN);
        }
    }
}

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
