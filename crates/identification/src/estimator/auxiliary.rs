//! Stage 7: the output of the auxiliary model, from which the instruments are formed.

use super::{Drive, FailureKind, Window};
use crate::failure::all_finite;
use crate::observer::Gain;
use crate::plant::{observe, simulate};

/// Buffers for stage 7.
pub struct AuxiliaryModel {
    drive: Drive,
    gain: Gain,
    g: Vec<f64>,
    x: Vec<f64>,
    /// `yhat(k)`, k = 0 ... N-1.
    pub yhat: Vec<f64>,
}

impl AuxiliaryModel {
    /// Makes buffers for order n and windows of N samples. `gain` is used if the observer is the auxiliary model.
    pub fn new(order: usize, window: usize, drive: Drive, gain: Gain) -> Self {
        Self {
            drive,
            gain,
            g: vec![0.0; order],
            x: vec![0.0; order],
            yhat: vec![0.0; window],
        }
    }

    /// Computes `yhat` for the model (a, b) from x0.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if the output overflows.
    pub fn run(&mut self, a: &[f64], b: &[f64], x0: &[f64], window: Window<'_>) -> Result<(), FailureKind> {
        self.run_driven(a, b, x0, window, window.u, 0)
    }

    /// Does the same as [`Self::run`] with `input` instead of u, for a part of the record whose first sample is the
    /// sample `first` of `yhat`.
    ///
    /// # Errors
    /// As for [`Self::run`].
    ///
    /// # Panics
    /// If `input` is not as long as the window.
    pub fn run_driven(
        &mut self,
        a: &[f64],
        b: &[f64],
        x0: &[f64],
        window: Window<'_>,
        input: &[f64],
        first: usize,
    ) -> Result<(), FailureKind> {
        assert_eq!(input.len(), window.len());
        self.x.copy_from_slice(x0);
        let yhat = &mut self.yhat[first..first + input.len()];
        match self.drive {
            Drive::Model => simulate(
                a,
                b,
                &mut self.x,
                input,
                #[inline(always)]
                |k, x| yhat[k] = x[0],
            ),
            Drive::Observer => {
                self.gain.compute(a, &mut self.g);
                observe(
                    a,
                    b,
                    &self.g,
                    &mut self.x,
                    input,
                    window.y,
                    #[inline(always)]
                    |k, x| yhat[k] = x[0],
                );
            }
        }
        all_finite(&*yhat)
    }
}
