//! Monte-Carlo benchmarks of estimators and adaptive state observers of SISO linear discrete
//! systems.
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
//! | [`plant`] | the true system: forms, simulation, poles |
//! | [`signal`] | inputs, coloured noise, random streams; arithmetic with the same bits on every machine |
//! | [`data`] | records: simulated with their true parameters, or read from a file |
//! | [`model`] | the general linear model: polynomials, realisation, difference equation |
//! | [`estimator`] | stages 1 to 11, and solvers for p |
//! | [`theory`] | limits, asymptotic covariances and bounds of a cell |
//! | [`observer`] | stage 12 and its gain |
//! | [`metric`] | errors, and summaries with their Monte-Carlo standard errors |
//! | [`files`] | the only access to the file system |
//! | [`worker`] | methods that are external programs |
//! | [`study`] | experiment, trial, runner, store |
//! | [`suite`] | the reference suite: scenarios, scores, shipped results |
//! | [`claim`] | verdicts on the claims of an experiment file from its results |
//! | [`report`] | claims, tables and figures from stored results |
//! | [`cli`] | the command line |
//!
//! # Example
//!
//! ```
//! use asobench::estimator::{Estimator, IvOptions, InstrumentalVariables, Pass, Shape, Window};
//! use asobench::study::{Experiment, Measure, Trial};
//!
//! // One trial of the paper's experiment: cell C2, trial 0.
//! let experiment = Experiment::nikolov2023(2023);
//! let mut trial = Trial::new(&experiment, &experiment.cells[1])?;
//! let rows = trial.run(0)?;
//! assert!(rows[4][Measure::Ea] < 1.0);
//!
//! // The same estimator on that record.
//! let record = trial.record().realisation;
//! let shape = Shape { order: 6, window: 98 };
//! let mut passes = vec![Pass::new(6); 5];
//! let mut estimator = InstrumentalVariables::new(shape, &IvOptions::default())?;
//! estimator.estimate(Window::new(&record.u, &record.y, 98), &mut passes);
//! assert_eq!(passes[4].a, trial.record().passes[4].1.a);
//! # Ok::<(), asobench::estimator::SetupError>(())
//! ```

// Only `cli` prints, and only `files` touches files.
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod cli;
mod run_in;

pub use asobench_identification::{
    adaptive, data, diagnosis, estimator, metric, model, observer, plant, real, signal, theory,
};
use asobench_identification::{names, number};
pub use asobench_lanes as lanes;
pub use asobench_report as report;
use asobench_study::text;
pub use asobench_study::{claim, files, study, suite, worker};

pub use run_in::{RunInError, run_in};
