//! The settings of a run, the observers that it may have, and why settings are refused.

use super::operators::Operator;
use super::proposed::{Factor, HIGHEST_ORDER};
use crate::signal::{Signal, SignalError};
use crate::text::number;
use faer::Mat;

/// The largest number of base steps of a run.
const LARGEST_STEPS: f64 = 1e7;

/// The largest number of breakpoints of a run.
const LARGEST_BREAKPOINTS: f64 = 1e6;

/// The filters of the first extension, and those of an observer, in messages.
pub(super) const FIRST: &str = "filters in [continuous]";
pub(super) const SECOND: &str = "filters of the observer";

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
    fn check(&self, n: usize) -> Result<(), String> {
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
                    Err(format!(
                        "share: expected a number above 0 and below 1, not {}",
                        number(*share)
                    ))
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
                    return Err(format!(
                        "the order of the expansion must be 1 to {HIGHEST_ORDER}, not {order}"
                    ));
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

/// Why a run is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CascadeError {
    /// A setting of the scenario or of the shared options is wrong, or the run would be too large.
    #[error("{0}")]
    Setting(String),
    /// A setting of an observer is wrong.
    #[error("observer {number}: {mistake}")]
    Observer {
        /// Its number, from 1.
        number: usize,
        /// The mistake in its settings.
        mistake: String,
    },
    /// A signal is wrong.
    #[error("{what}: {source}")]
    Signal {
        /// `input` or `disturbance`.
        what: &'static str,
        /// The mistake in the signal.
        source: SignalError,
    },
}

/// Refuses settings that cannot be run for a plant of order n.
pub(super) fn check(
    n: usize,
    scenario: &Scenario,
    options: &GpeboOptions,
    observers: &[ObserverSpec],
) -> Result<(), CascadeError> {
    check_shared(n, scenario, options).map_err(CascadeError::Setting)?;
    let horizon = scenario.horizon;
    for (what, signal) in [("input", &scenario.u), ("disturbance", &scenario.delta)] {
        signal
            .check(horizon)
            .map_err(|source| CascadeError::Signal { what, source })?;
    }
    let breakpoints = scenario.u.breakpoint_bound(horizon) + scenario.delta.breakpoint_bound(horizon);
    // Each breakpoint may add one step.
    let steps = horizon / scenario.step + breakpoints + 1.0;
    if !(breakpoints <= LARGEST_BREAKPOINTS) {
        return Err(CascadeError::Setting(format!(
            "the signals have about {breakpoints:.1e} switches and samples; at most {LARGEST_BREAKPOINTS:.0e} are \
             allowed"
        )));
    }
    if !(steps <= LARGEST_STEPS) {
        return Err(CascadeError::Setting(format!(
            "the run would take about {steps:.1e} steps; at most {LARGEST_STEPS:.0e} are allowed"
        )));
    }
    for (number, observer) in (1..).zip(observers) {
        observer
            .check(n)
            .map_err(|mistake| CascadeError::Observer { number, mistake })?;
    }
    Ok(())
}

/// Checks all but the signals and the observers.
fn check_shared(n: usize, scenario: &Scenario, options: &GpeboOptions) -> Result<(), String> {
    let Scenario { horizon, step, .. } = *scenario;
    positive("the horizon", &[horizon], 1)?;
    positive("the step", &[step], 1)?;
    vector("the start of the score", &[scenario.scored_from], 1)?;
    if step > horizon {
        return Err(format!(
            "the step of {step} s must not be longer than the horizon of {horizon} s"
        ));
    }
    vector("the initial state", &scenario.x0, n)?;
    vector("xi(0)", &options.xi0, n)?;
    filters(FIRST, &options.filters, n - 1)
}

fn vector(what: &str, v: &[f64], expected: usize) -> Result<(), String> {
    if v.len() != expected {
        let plural = if expected == 1 { "" } else { "s" };
        return Err(format!("{what}: expected {expected} number{plural}, not {}", v.len()));
    }
    if v.iter().all(|v| v.is_finite()) {
        Ok(())
    } else {
        Err(format!("{what}: expected finite numbers"))
    }
}

fn positive(what: &str, v: &[f64], expected: usize) -> Result<(), String> {
    vector(what, v, expected)?;
    match v.iter().find(|v| **v <= 0.0) {
        Some(&value) => Err(format!("{what}: expected positive numbers, not {}", number(value))),
        None => Ok(()),
    }
}

/// Two equal filters would make the extended regressor singular at all times.
fn filters(what: &str, v: &[Operator], expected: usize) -> Result<(), String> {
    let numbers: Vec<f64> = v.iter().map(Operator::number).collect();
    positive(what, &numbers, expected)?;
    match (0..v.len()).find(|&k| v[..k].contains(&v[k])) {
        Some(k) => Err(format!(
            "{what}: expected distinct numbers, but {} occurs twice",
            number(numbers[k])
        )),
        None => Ok(()),
    }
}
