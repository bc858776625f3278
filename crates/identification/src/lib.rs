//! Identification of SISO linear discrete systems: records, estimators with standard errors, diagnosis, observers, and
//! what estimates tend to as the record grows.
//!
//! [`fit`] is the way in: a method's options and a record give a model `A y = B/F u + C/D e`. Beneath it are buffers
//! that Monte-Carlo studies make once ([`estimator::Window`], [`estimator::Pass`], [`estimator::Estimator`]).
//!
//! The plant is in phase-coordinate canonical form, of known order n:
//!
//! ```text
//! x(k+1) = A x(k) + b u(k),   y(k) = x_1(k) + f(k),   x(0) = x0,   A = [0 | I; a'],
//! W(z) = (h_1 z^(n-1) + ... + h_n) / (z^n - a_n z^(n-1) - ... - a_1),   T b = h.
//! ```
//!
//! From a window of N samples of u and y an estimator finds a, b, h and x0. An observer then computes x(k). The
//! algorithm under study (Nikolov et al. 2023) has twelve stages: least squares as iteration 0 (stages 1 to 6), passes
//! of instrumental variables (7 to 10, repeated by 11), and a pole-placed observer (12). Doc comments name stages and
//! equations as `Stage 3` and `Eq. (7)`.
//!
//! | symbol | shape | what |
//! |---|---|---|
//! | `u`, `y`, `f` | K | input, measured output, noise |
//! | `x`, `x0` | n | state, initial state |
//! | `a`, `b`, `h` | n | last row of A, input vector, numerator |
//! | `alpha` | n | A(q) = 1 + alpha_1 q^-1 + ...; alpha_i = -a_(n+1-i) |
//! | `beta` | n | B(q) = beta_1 q^-1 + ...; beta = h |
//! | `p` | 2n | (alpha, beta), the paper's p, the field's theta |
//! | `Phi`, `Z` | (N-n) x 2n | regressors -y, u; instruments -yhat, u |
//! | `G` | 2n x 2n | Z'Phi, in blocks G11, G12, G21, G22 of n x n |
//! | `T` | n x n | lower-triangular Toeplitz, first column (1, -a_n, ..., -a_2) |
//! | `D` | N x n | rows c'A^k |
//! | `g` | n | the observer's gain, F = A - g c' |
//! | `e_a`, ... | | relative errors, Eq. (7) |
//! | `eta` | | noise level 100 sigma_f / sigma_y, per cent, Eq. (6) |
//!
//! | module | what |
//! |---|---|
//! | [`signal`] | inputs, coloured noise, random streams; arithmetic with the same bits on every machine |
//! | [`plant`] | the true system: forms, simulation, poles |
//! | [`model`] | the general linear model: polynomials, realisation, difference equation |
//! | [`data`] | records: simulated with their true parameters, or read from a file |
//! | [`estimator`] | stages 1 to 11 and all other methods, and solvers for p |
//! | [`observer`] | stage 12 and its gain, Kalman filters, GPEBO |
//! | [`diagnosis`] | tests of residuals; poles, zeros and responses with their errors |
//! | [`adaptive`] | observers that estimate state and parameters together |
//! | [`theory`] | limits, asymptotic covariances and bounds |
//! | [`metric`] | errors, and summaries with their Monte-Carlo standard errors |
//! | [`real`] | what arithmetic is written over: f64, or several numbers in lock step |
//! | [`names`] | enumerations with names, from which parsing and output follow |
//! | [`number`] | numbers with their standard errors as text |
//! | [`text`] | texts of others made safe to show |

/// Runs a closure by [`real::with_fma`], inlined there: else it is not compiled with these instructions.
macro_rules! with_fma {
    (|| $body:expr) => {
        $crate::real::with_fma(
            #[inline(always)]
            || $body,
        )
    };
}

/// The same by [`real::Real::run`] of a type.
macro_rules! run {
    ($real:ty, || $body:expr) => {
        <$real as $crate::real::Real>::run(
            #[inline(always)]
            || $body,
        )
    };
}

pub mod data;
pub mod diagnosis;
pub mod estimator;
mod failure;
mod fitted;
pub mod metric;
pub mod model;
pub mod names;
pub mod number;
pub mod observer;
pub mod plant;
pub mod real;
pub mod signal;
mod step_down;
pub mod text;
pub mod theory;

pub use estimator::adaptive;
pub use fitted::observation::{ModelObserver, NoiseCovariances, Observation, ObservationError, observe_adaptively};
pub use fitted::{FitError, Fitted, fit, fit_in_loop, fit_records};
