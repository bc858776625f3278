//! Stage 12: the observer on a record.

use super::Gain;
use crate::failure::{FailureKind, all_finite};
use crate::plant::observe;

/// The full-order observer `xhat(k+1) = F xhat(k) + b u(k) + g y(k)`, `F = A - g c'`,
/// `xhat(0) = x0`, with buffers for one order.
#[derive(Clone, Debug)]
pub struct Observer {
    gain: Gain,
    g: Vec<f64>,
    x: Vec<f64>,
}

/// A model as the observer needs it; each vector has length n.
#[derive(Clone, Copy, Debug)]
pub struct ObservedModel<'a> {
    /// Last row of A.
    pub a: &'a [f64],
    /// Input vector.
    pub b: &'a [f64],
    /// Initial state.
    pub x0: &'a [f64],
}

impl Observer {
    /// Returns an observer of order n.
    pub fn new(gain: Gain, order: usize) -> Self {
        Self {
            gain,
            g: vec![0.0; order],
            x: vec![0.0; order],
        }
    }

    /// Calls `visit(k, xhat(k))` for k = 0 ... K-1. Afterwards [`Self::state`] is xhat(K).
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if the state overflows; the visited values must then not be used.
    ///
    /// # Panics
    /// If the model is of another order, or u and y differ in length.
    #[inline(always)]
    pub fn run(
        &mut self,
        model: ObservedModel<'_>,
        u: &[f64],
        y: &[f64],
        visit: impl FnMut(usize, &[f64]),
    ) -> Result<(), FailureKind> {
        self.gain.compute(model.a, &mut self.g);
        self.x.copy_from_slice(model.x0);
        observe(model.a, model.b, &self.g, &mut self.x, u, y, visit);
        // An infinite state stays infinite or becomes NaN, so checking the last one is enough.
        all_finite(self.x.iter().chain(&self.g))
    }

    /// Advances one more step on the model of the last [`Self::run`], from xhat(k) to xhat(k+1), given u(k) and y(k).
    ///
    /// # Panics
    /// If the model is of another order.
    pub fn advance(&mut self, model: ObservedModel<'_>, u: f64, y: f64) {
        observe(model.a, model.b, &self.g, &mut self.x, &[u], &[y], |_, _| {});
    }

    /// Returns the gain g of the last run.
    pub fn g(&self) -> &[f64] {
        &self.g
    }

    /// Returns the state after the last sample of the last run.
    pub fn state(&self) -> &[f64] {
        &self.x
    }
}
