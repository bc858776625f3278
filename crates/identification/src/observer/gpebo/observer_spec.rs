//! The observers that a run may have, with their options.

use super::delay::Operator;
use super::expansion::{Factor, HIGHEST_ORDER};
use super::refusal::SettingError;
use super::setting_checks::{SECOND, filters, positive, vector};
use faer::Mat;

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
    /// The same with finite convergence time: `theta_hat_i / max(1 - w_i, share)`,
    /// `w_i = exp(-gamma_i int Delta^2)`. The gradient's estimate is `(1 - w_i) theta_i` without disturbance, so
    /// that this one is theta_i from the time on at which `1 - w_i >= share`. Source: Ortega, Aranovskiy, Pyrkin,
    /// Astolfi, Bobtsov, IEEE Trans. Automatic Control 66 (2021) 2265.
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
    /// The time-varying Kalman-Bucy filter for white noises in y and in the state, which may be correlated.
    Filter {
        /// P(0) = p0 I.
        p0: f64,
        /// The process noise's intensity Q, n x n.
        q: Mat<f64>,
        /// The intensity S of both noises, n numbers.
        s: Vec<f64>,
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

impl ObserverSpec {
    /// Refuses options that cannot be run for a plant of order n.
    pub(super) fn check(&self, n: usize) -> Result<(), SettingError> {
        match self {
            Self::Luenberger { gain, x0 } => {
                vector("the gain L", gain, n)?;
                vector("the initial estimate", x0, n)
            }
            Self::Gradient { gains } => positive("the gains", gains, n),
            Self::FiniteTime { gains, share } => {
                positive("the gains", gains, n)?;
                if *share > 0.0 && *share < 1.0 {
                    Ok(())
                } else {
                    Err(SettingError::Share(*share))
                }
            }
            Self::LsDrem { gains, p0, r } => {
                positive("the gains", gains, n)?;
                positive("the prior variance p0", &[*p0], 1)?;
                positive("the noise intensity r", &[*r], 1)
            }
            Self::Proposed {
                k,
                order,
                filters: operators,
                gains,
                ..
            } => {
                if !(1..=HIGHEST_ORDER).contains(order) {
                    return Err(SettingError::Order(*order));
                }
                positive("the filter k", &[*k], 1)?;
                filters(SECOND, operators, *order)?;
                positive("the gains", gains, n)
            }
            Self::Filter { p0, q, s, r, x0 } => {
                positive("the prior variance p0", &[*p0], 1)?;
                let by_columns = q.col_iter().flat_map(|column| column.iter().copied());
                let by_columns: Vec<f64> = by_columns.collect();
                vector("the process noise's intensity Q", &by_columns, n * n)?;
                vector("the noises' intensity S", s, n)?;
                positive("the noise intensity r", &[*r], 1)?;
                vector("the initial estimate", x0, n)
            }
            Self::KalmanBucy { p0, r } => {
                positive("the prior variance p0", &[*p0], 1)?;
                positive("the noise intensity r", &[*r], 1)
            }
        }
    }

    /// Whether theta is estimated and the state follows from it, Eq. (8).
    pub fn is_gpebo(&self) -> bool {
        !matches!(self, Self::Luenberger { .. } | Self::Filter { .. })
    }

    /// Whether a signal is delayed.
    pub(super) fn delays(&self) -> bool {
        match self {
            Self::Proposed { filters, .. } => filters.iter().any(|of| of.delay().is_some()),
            _ => false,
        }
    }

    /// The adaptation gains; none of an observer without scalar estimators.
    pub fn gains(&self) -> &[f64] {
        match self {
            Self::Gradient { gains }
            | Self::FiniteTime { gains, .. }
            | Self::LsDrem { gains, .. }
            | Self::Proposed { gains, .. } => gains,
            Self::Luenberger { .. } | Self::Filter { .. } | Self::KalmanBucy { .. } => &[],
        }
    }
}
