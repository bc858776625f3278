//! Recursive estimators: theta(k) from theta(k-1) and one more sample, with memory that does not grow.
//!
//! There is one file per method: [`RecursiveLeastSquares`], [`ExtendedLeastSquares`], [`RecursiveIv`],
//! [`RecursiveSriv`], [`RecursivePrediction`], each a [`Recursion`]; [`Rerun`] is their rival, a whole estimate made
//! anew. The recursions share the square root of the information ([`SquareRoot`]) and the start.
//!
//! Conventions. The first equation is that of `k0 = max(na + nf, nb + nk - 1)`: signals before the record are not used.
//! theta is in the order A, B, C, D, F. Before the first equation theta is theta0, and P is `p0 I`. Without p0 the
//! start is exact, the limit of p0 to infinity: least squares solves the first equations, and theta stays theta0 until
//! they determine it.

pub(in crate::estimator) mod batch;
mod coefficients;
mod elimination;
mod extended;
mod first_equations;
mod instrumental;
mod lags;
mod least_squares;
mod options;
mod prediction;
mod predictor;
mod recursion;
mod refined;
mod rerun;
mod settings;
mod square_root;
mod start;
mod weights;

pub use coefficients::Coefficients;
pub(crate) use elimination::Elimination;
pub use extended::{ExtendedLeastSquares, RelsOptions};
pub use instrumental::{RecursiveInstruments, RecursiveIv, RecursiveIvOptions};
pub use least_squares::{RecursiveForm, RecursiveLeastSquares, RlsOptions};
pub use prediction::{RecursivePrediction, RpemOptions};
pub use recursion::Recursion;
pub use refined::{RecursiveSriv, RecursiveSrivOptions};
pub use rerun::{Rerun, RerunWindow};
pub use settings::RecursiveSettings;
pub use square_root::SquareRoot;

use crate::estimator::FailureKind;
use crate::model::Orders;

/// The end of a recursion: what happened, and at which sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{kind} at k = {k}")]
pub struct Diverged {
    /// The sample, counted from 0.
    pub k: usize,
    /// The failure.
    pub kind: FailureKind,
}

/// Estimates a model sample by sample. Nothing is allocated after it is made, unless its docs say so.
pub trait RecursiveEstimator: Send {
    /// Returns the orders of the model.
    fn orders(&self) -> Orders;

    /// Takes u(k) and y(k), k = 0, 1, ... Where theta(k) is not `wanted`, a method that does not need it itself may
    /// leave theta as it was.
    ///
    /// # Errors
    /// [`Diverged`] if a number is not finite. From then on every call returns the same, and theta must not be used.
    fn advance(&mut self, u: f64, y: f64, wanted: bool) -> Result<(), Diverged>;

    /// Takes u(k) and y(k), and finds theta(k).
    ///
    /// # Errors
    /// As for [`Self::advance`].
    fn update(&mut self, u: f64, y: f64) -> Result<(), Diverged> {
        self.advance(u, y, true)
    }

    /// Returns theta(k) after the last sample, in the order A, B, C, D, F.
    fn theta(&self) -> &[f64];

    /// Whether the equations so far determine theta; before, it is theta0.
    fn is_determined(&self) -> bool;

    /// Returns the variance of the residuals so far, their sum of squares over equations less parameters; NaN where
    /// there are too few, or with forgetting. After early forgetting it is `S / (sum w - d sum w^2 / sum w)`, S being
    /// the sum with the weights w that are left: right for white errors and regressors of a stationary signal.
    fn noise_variance(&self) -> f64;

    /// Fills `to` with the covariance of theta, row by row, for white equation errors and no forgetting, or early
    /// forgetting as in [`Self::noise_variance`]; NaN if there is none.
    ///
    /// # Panics
    /// If `to` is not as large as the square of the number of parameters.
    fn covariance(&mut self, to: &mut [f64]);

    /// Returns the number of samples taken, the one that failed not among them.
    fn samples(&self) -> usize;

    /// Forgets all samples.
    fn restart(&mut self);
}

/// Counts samples, and remembers the failure that ended a recursion.
#[derive(Clone, Copy, Debug, Default)]
struct Clock {
    samples: usize,
    ended: Option<Diverged>,
}

impl Clock {
    /// Begins a sample.
    fn begin(&mut self, u: f64, y: f64) -> Result<(), Diverged> {
        self.check(&[u, y])
    }

    /// Ends a sample, after which theta is this, and the size of the information that.
    fn end(&mut self, theta: &[f64], size: f64) -> Result<(), Diverged> {
        self.check(theta)?;
        self.check(&[size])?;
        self.samples += 1;
        Ok(())
    }

    fn check(&mut self, numbers: &[f64]) -> Result<(), Diverged> {
        if self.ended.is_none() && !numbers.iter().all(|number| number.is_finite()) {
            self.ended = Some(Diverged {
                k: self.samples,
                kind: FailureKind::NonFinite,
            });
        }
        self.ended.map_or(Ok(()), Err)
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
