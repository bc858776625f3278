//! The settings of a run.

use super::delay::Operator;
use super::expansion::Factor;
use crate::signal::Signal;

/// Input, disturbance, initial state and time.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// The input u(t).
    pub u: Signal,
    /// The disturbance delta(t) of the output.
    pub delta: Signal,
    /// x(0), of length n.
    pub x0: Vec<f64>,
    /// T in seconds.
    pub horizon: f64,
    /// The mean squares of errors start at this time, in seconds; no step crosses it.
    pub scored_from: f64,
    /// The longest step in seconds.
    pub step: f64,
}

/// The options that the estimators share.
#[derive(Clone, Debug, PartialEq)]
pub struct GpeboOptions {
    /// xi(0), of length n, Eq. (5).
    pub xi0: Vec<f64>,
    /// The n - 1 distinct operators H_i of the first extension.
    pub filters: Vec<Operator>,
}

/// An observer to be run.
#[derive(Clone, Debug, PartialEq)]
pub enum ObserverSpec {
    /// `xhat' = A xhat + B u + L (y - C'xhat)`, Eq. (4).
    Luenberger {
        /// L, of length n.
        gain: Vec<f64>,
        /// xhat(0), of length n.
        x0: Vec<f64>,
    },
    /// Eq. (8) with `theta_i' = gamma_i Delta (mbar_i - Delta theta_i)` on Eq. (10), starting from zero.
    Gradient {
        /// gamma, n positive numbers.
        gains: Vec<f64>,
    },
    /// The same with finite convergence time: `theta_hat_i / max(1 - w_i, share)`, `w_i = exp(-gamma_i int Delta^2)`.
    /// The gradient's estimate is `(1 - w_i) theta_i` without disturbance, so that this one is theta_i from the time on
    /// at which `1 - w_i >= share`. Source: Ortega, Aranovskiy, Pyrkin, Astolfi, Bobtsov, IEEE Trans. Automatic Control
    /// 66 (2021) 2265.
    FiniteTime {
        /// gamma, n positive numbers.
        gains: Vec<f64>,
        /// From which share learnt on the estimate is corrected in full, above 0 and below 1.
        share: f64,
    },
    /// Eq. (8) with theta from least squares on Eq. (9), mixed: `H theta = theta_g`, `H = (r / p0 I + S)^-1 S` with
    /// `theta_g = (r / p0 I + S)^-1 s` of [`Self::KalmanBucy`], and a scalar gradient estimator for each component of
    /// `adj(H) theta_g = det(H) theta`, starting from zero. Source: Ortega, Romero, Aranovskiy, A new least squares
    /// parameter estimator, arXiv 2205.00099, Eqs. (8) to (12) without forgetting, where H is `I - f0 F`.
    LsDrem {
        /// gamma, n positive numbers.
        gains: Vec<f64>,
        /// Prior variance of least squares.
        p0: f64,
        /// Its intensity of the noise.
        r: f64,
    },
    /// Eq. (8) with theta from Eq. (17), starting from zero.
    Proposed {
        /// Pole (1/s) of the filter of Eq. (11).
        k: f64,
        /// q, 1 or 2.
        order: usize,
        /// The q distinct operators of the second extension.
        filters: Vec<Operator>,
        /// gamma, n positive numbers.
        gains: Vec<f64>,
        /// The treatment of `g = e^m`.
        factor: Factor,
    },
    /// The time-varying Kalman-Bucy filter for white noise in y and in the state.
    Filter {
        /// P(0) = p0 I.
        p0: f64,
        /// The process noise's intensity: Q = q I.
        q: f64,
        /// Intensity of the noise in y.
        r: f64,
        /// xhat(0), of length n.
        x0: Vec<f64>,
    },
    /// The Kalman-Bucy filter for white noise in y and none in the state: recursive least squares on Eq. (9).
    KalmanBucy {
        /// Prior variance: `theta ~ N(0, p0 I)`.
        p0: f64,
        /// Intensity of the noise.
        r: f64,
    },
}
