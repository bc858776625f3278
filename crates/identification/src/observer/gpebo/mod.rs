//! The observer of Bobtsov, Vorobyev, Nikolaev, Pyrkin and Ortega 2023 (GPEBO + DREM), the observers it is compared
//! with, and their integration.
//!
//! Plant of order n, Eqs. (1), (2): `x' = A x + B u`, `y = C'x + delta`, delta small and otherwise unknown. Then:
//!
//! - Eqs. (5) to (8): `xi' = A xi + B u`, `Phi' = A Phi`, `Phi(0) = I` (xi: n; Phi: n x n),
//!   `x = xi + Phi theta` with the unknown constant `theta = x(0) - xi(0)` (n);
//!   `xhat = xi + Phi theta_hat`.
//! - Eq. (9): `z = y - C'xi = phi theta + delta` (z scalar, phi = C'Phi a row of n).
//! - Eq. (10): with n - 1 operators H_i, lags `a_i / (p + a_i)` or delays, `zbar = M theta + deltabar` (zbar, deltabar:
//!   n; M: n x n, rows phi and H_i phi); mixed, `mbar = adj(M) zbar`, `Delta = det M`: n
//!   scalar regressions `mbar_i = Delta theta_i + dbar_i`.
//! - Eq. (11): `m = k / (p + k) mbar`, `phi = k / (p + k) Delta`, `d = k / (p + k) dbar`:
//!   `m_i = phi theta_i + d_i`, phi scalar from here on.
//! - Eqs. (12) to (17): `g = e^m`, `e^d` expanded to order q:
//!   `zeta = psi'(theta_i, ..., theta_i^(q+1))` (psi: q + 1), neglecting `(g / q!) d^q d'`; solved
//!   by q operators of the same kinds, a second mixing and a scalar gradient estimator for each i.
//!
//! Everything linear is integrated exactly (`linear`). The rest uses exponential steps of second order or better.
//! Errors are scored (`score`) by formulas of higher order. Source: Mekhatronika, Avtomatizatsiya, Upravlenie 24 (2023)
//! 339-345, DOI 10.17587/mau.24.339-345.

mod cascade;
mod estimators;
#[cfg(test)]
mod exp_table;
mod exponentials;
mod grid;
mod halving;
mod least_squares;
mod linear;
mod matrices;
mod mixed_signals;
mod mixing;
mod operators;
mod oscillators;
mod proposed;
mod run;
mod runs;
mod scalar;
mod score;
mod settings;
mod state_observer;
mod summary;

pub use cascade::Cascade;
pub use grid::REFINEMENTS;
pub use halving::{Convergence, Halving, StepError, halve, halve_pack};
pub use linear::Propagators;
pub(super) use mixing::Mixer;
pub use operators::Operator;
pub use proposed::Factor;
pub use score::{Accuracy, BAND};
pub use settings::{CascadeError, GpeboOptions, ObserverSpec, Scenario};
pub use summary::{Excitation, ObserverEstimate, ObserverSummary, Outcome, Sample, Summary};
