//! The gradient of an output-error model's output `B/F u`.

use super::FailureKind;
use super::prediction_error::kernels::{Triangle, divide, filter};
use crate::model::{LinearModel, Orders};

/// The gradient psi with respect to (b, f): delays of `u/F` and of `-B/F^2 u`, with its triangle.
pub(super) struct OutputGradient {
    /// `u/F`.
    pub(super) of_b: Vec<f64>,
    /// `B/F^2 u`.
    pub(super) of_f: Vec<f64>,
    /// `psi = Q R`.
    pub(super) psi: Triangle,
}

impl OutputGradient {
    /// Computes the gradient at a model, and its triangle.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`].
    pub(super) fn new(model: &LinearModel, u: &[f64]) -> Result<Self, FailureKind> {
        let Orders { nb, nf, nk, .. } = model.orders();
        let (mut of_b, mut of_f) = (u.to_vec(), vec![0.0; u.len()]);
        divide(&model.f, &mut of_b);
        filter(&model.b, &of_b, &mut of_f);
        divide(&model.f, &mut of_f);
        let mut psi = Triangle::new(nb + nf);
        psi.run(u.len(), |j, first, to| {
            let (signal, lag, sign) = match j.checked_sub(nb) {
                None => (&of_b, nk + j, 1.0),
                Some(i) if i < nf => (&of_f, i + 1, -1.0),
                Some(_) => return to.fill(0.0),
            };
            for (to, k) in to.iter_mut().zip(first..) {
                *to = k.checked_sub(lag).map_or(0.0, |k| sign * signal[k]);
            }
        })?;
        Ok(Self { of_b, of_f, psi })
    }
}
