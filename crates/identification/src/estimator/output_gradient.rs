//! The gradient of an output-error model's output `B/F u`.

use super::FailureKind;
use super::prediction_error::kernels::{Triangle, divide, filter};
use crate::model::{LinearModel, Orders};

/// The gradient psi with respect to (b, f): delays of `u/F` and of `-B/F^2 u`, with its triangle.
pub(super) struct OutputGradient {
    orders: Orders,
    /// `u/F`.
    pub(super) of_b: Vec<f64>,
    /// `B/F^2 u`.
    pub(super) of_f: Vec<f64>,
    /// `psi = Q R`.
    pub(super) psi: Triangle,
}

impl OutputGradient {
    /// Makes buffers for models of these nb, nf and nk and windows of `window` samples.
    pub(super) fn new(orders: Orders, window: usize) -> Self {
        Self {
            orders,
            of_b: vec![0.0; window],
            of_f: vec![0.0; window],
            psi: Triangle::new(orders.nb + orders.nf),
        }
    }

    /// Computes the gradient at a model, and its triangle.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`].
    pub(super) fn run(&mut self, model: &LinearModel, u: &[f64]) -> Result<(), FailureKind> {
        let Orders { nb, nf, nk, .. } = self.orders;
        self.of_b.copy_from_slice(u);
        divide(&model.f, &mut self.of_b);
        filter(&model.b, &self.of_b, &mut self.of_f);
        divide(&model.f, &mut self.of_f);
        let (of_b, of_f) = (&self.of_b, &self.of_f);
        self.psi.run(u.len(), |j, first, to| {
            let (signal, lag, sign) = match j.checked_sub(nb) {
                None => (of_b, nk + j, 1.0),
                Some(i) if i < nf => (of_f, i + 1, -1.0),
                Some(_) => return to.fill(0.0),
            };
            for (to, k) in to.iter_mut().zip(first..) {
                *to = k.checked_sub(lag).map_or(0.0, |k| sign * signal[k]);
            }
        })
    }
}
