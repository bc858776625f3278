//! Adaptive observers: state and parameters of `x(k+1) = A x(k) + b u(k)`, `y(k) = x_1(k)`, sample by sample.
//!
//! There is one file per observer: [`Kreisselmeier`], [`Zhang`], [`JointEkf`], and [`FedObserver`], which takes its
//! parameters from any recursive estimator. All but the Kalman filter are linear in the parameters in observer form,
//!
//! ```text
//!     x_o(k+1) = A0 x_o(k) - alpha y(k) + h u(k),  y = (x_o)_1,  A0 the shift,
//! ```
//!
//! with the polynomials of `A(q) y = B(q) u`: `alpha_i` and `h_i` are the coefficients of q^-i. The state that all
//! report is the papers', `T x = x_o`, with the T of the present estimate (stage 5), so it moves with the estimate.
//!
//! xhat(k+1) uses data up to k, as that of every observer of this crate. Nothing is allocated after an observer is
//! made.

mod fed;
mod filters;
mod joint;
mod kreisselmeier;
mod options;
mod zhang;

pub use fed::FedObserver;
pub use filters::StateFilters;
pub use joint::{JointEkf, JointEkfSettings};
pub use kreisselmeier::{Kreisselmeier, KreisselmeierSettings};
pub use options::{JointEkfOptions, KreisselmeierOptions, TuningUnits, ZhangOptions};
pub use zhang::{Zhang, ZhangSettings};

use crate::estimator::recursive::Diverged;

/// Estimates state and parameters sample by sample.
pub trait AdaptiveObserver: Send {
    /// Forgets all samples.
    fn restart(&mut self);

    /// Takes u(k) and y(k), k = 0, 1, ...
    ///
    /// # Errors
    /// [`Diverged`] if a number is not finite; later calls must not be made.
    fn update(&mut self, u: f64, y: f64) -> Result<(), Diverged>;

    /// Returns xhat(k+1), n numbers, after the sample of k.
    fn state(&self) -> &[f64];

    /// Returns `(a_1 ... a_n, b_1 ... b_n)` of the papers' form, after the sample of k.
    fn plant(&self) -> &[f64];
}
