//! The settings of a run, and why they may be refused.

use super::delay::{LONGEST_DELAY, Operator, whole_steps};
use super::expansion::{Factor, HIGHEST_ORDER};
use super::grid::{Grid, LARGEST_BREAKPOINTS, LARGEST_LENGTHS, LARGEST_STEPS};
use crate::signal::{Signal, SignalError};
use crate::text::number;

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

/// Why a setting is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SettingError {
    /// A vector has the wrong length.
    #[error("{what}: expected {expected} number{}, not {found}", if *.expected == 1 { "" } else { "s" })]
    Length {
        /// The setting.
        what: &'static str,
        /// The required length.
        expected: usize,
        /// The actual length.
        found: usize,
    },
    /// A number is not finite.
    #[error("{0}: expected finite numbers")]
    NotFinite(&'static str),
    /// A number is not positive.
    #[error("{what}: expected positive numbers, not {}", number(*.value))]
    NotPositive {
        /// The setting.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// Two filters are equal, so the extended regressor would always be singular.
    #[error("{what}: expected distinct numbers, but {} occurs twice", number(*.value))]
    NotDistinct {
        /// The setting.
        what: &'static str,
        /// The repeated number.
        value: f64,
    },
    /// A delay is not a whole number of steps, or has too many.
    #[error(
        "{what}: a delay of {} s; expected a whole number of steps of {} s, from 1 to {LONGEST_DELAY}",
        number(*.delay), number(*.step)
    )]
    Delay {
        /// The setting.
        what: &'static str,
        /// The delay, seconds.
        delay: f64,
        /// The step, seconds.
        step: f64,
    },
    /// There is a delay, and steps differ in length.
    #[error(
        "{what}: a delay of {} s among steps of {} s and {} s; expected steps of one length: an end, a start of the \
        score and switches of signals that are multiples of it",
        number(*.delay), number(.steps[0]), number(.steps[1])
    )]
    UnequalSteps {
        /// The setting.
        what: &'static str,
        /// The delay, seconds.
        delay: f64,
        /// Two of the steps, seconds.
        steps: [f64; 2],
    },
    /// The share of a finite-time estimator is out of range.
    #[error("share: expected a number above 0 and below 1, not {}", number(*.0))]
    Share(f64),
    /// The order of the expansion is not supported.
    #[error("the order of the expansion must be 1 to {HIGHEST_ORDER}, not {0}")]
    Order(usize),
}

/// Why a run is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CascadeError {
    /// A setting of the scenario or of the shared options is wrong.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A setting of an observer is wrong.
    #[error("observer {number}: {source}")]
    Observer {
        /// Its number, from 1.
        number: usize,
        /// What is wrong.
        source: SettingError,
    },
    /// A signal is wrong.
    #[error("{what}: {source}")]
    Signal {
        /// `input` or `disturbance`.
        what: &'static str,
        /// What is wrong.
        source: SignalError,
    },
    /// The step is longer than the horizon.
    #[error("the step of {step} s must not be longer than the horizon of {horizon} s")]
    Step {
        /// The longest step.
        step: f64,
        /// T.
        horizon: f64,
    },
    /// There would be too many steps.
    #[error("the run would take about {0:.1e} steps; at most {LARGEST_STEPS:.0e} are allowed")]
    Steps(f64),
    /// There would be too many breakpoints.
    #[error(
        "the signals have about {0:.1e} switches and samples; at most {LARGEST_BREAKPOINTS:.0e} are \
        allowed"
    )]
    Breakpoints(f64),
    /// There would be too many different step lengths.
    #[error(
        "the signals' switches and samples have more than {LARGEST_LENGTHS} different distances: \
        use intervals that are multiples of a common one"
    )]
    Lengths,
}

fn vector(what: &'static str, v: &[f64], expected: usize) -> Result<(), SettingError> {
    if v.len() != expected {
        return Err(SettingError::Length {
            what,
            expected,
            found: v.len(),
        });
    }
    if v.iter().all(|v| v.is_finite()) {
        Ok(())
    } else {
        Err(SettingError::NotFinite(what))
    }
}

fn positive(what: &'static str, v: &[f64], expected: usize) -> Result<(), SettingError> {
    vector(what, v, expected)?;
    match v.iter().find(|v| **v <= 0.0) {
        Some(&value) => Err(SettingError::NotPositive { what, value }),
        None => Ok(()),
    }
}

const FIRST: &str = "filters in [continuous]";
const SECOND: &str = "filters of the observer";

fn filters(what: &'static str, v: &[Operator], expected: usize) -> Result<(), SettingError> {
    let numbers: Vec<f64> = v.iter().map(Operator::number).collect();
    positive(what, &numbers, expected)?;
    let twice = (0..v.len()).find(|&k| v[..k].contains(&v[k]));
    match twice {
        Some(k) => Err(SettingError::NotDistinct {
            what,
            value: numbers[k],
        }),
        None => Ok(()),
    }
}

/// Refuses delays that are not whole numbers of equal steps.
pub(super) fn check_delays(
    grid: &Grid,
    options: &GpeboOptions,
    observers: &[ObserverSpec],
) -> Result<(), CascadeError> {
    let check = |what: &'static str, filters: &[Operator]| {
        for delay in filters.iter().filter_map(Operator::delay) {
            match grid.lengths[..] {
                [step] if whole_steps(delay, step).is_some() => {}
                [step] => return Err(SettingError::Delay { what, delay, step }),
                [first, second, ..] => {
                    let steps = [first, second];
                    return Err(SettingError::UnequalSteps { what, delay, steps });
                }
                [] => {}
            }
        }
        Ok(())
    };
    check(FIRST, &options.filters)?;
    for (number, observer) in (1..).zip(observers) {
        if let ObserverSpec::Proposed { filters, .. } = observer {
            check(SECOND, filters).map_err(|source| CascadeError::Observer { number, source })?;
        }
    }
    Ok(())
}

impl ObserverSpec {
    fn check(&self, n: usize) -> Result<(), SettingError> {
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
            Self::Filter { p0, q, r, x0 } => {
                positive("the prior variance p0", &[*p0], 1)?;
                positive("the process noise's intensity q", &[*q], 1)?;
                positive("the noise intensity r", &[*r], 1)?;
                vector("the initial estimate", x0, n)
            }
            Self::KalmanBucy { p0, r } => {
                positive("the prior variance p0", &[*p0], 1)?;
                positive("the noise intensity r", &[*r], 1)
            }
        }
    }
}

/// Refuses settings that cannot be run for a plant of order n.
pub(super) fn check(
    n: usize,
    scenario: &Scenario,
    options: &GpeboOptions,
    observers: &[ObserverSpec],
) -> Result<(), CascadeError> {
    let Scenario { horizon, step, .. } = *scenario;
    positive("the horizon", &[horizon], 1)?;
    positive("the step", &[step], 1)?;
    vector("the start of the score", &[scenario.scored_from], 1)?;
    if step > horizon {
        return Err(CascadeError::Step { step, horizon });
    }
    vector("the initial state", &scenario.x0, n)?;
    vector("xi(0)", &options.xi0, n)?;
    filters(FIRST, &options.filters, n - 1)?;
    for (what, signal) in [("input", &scenario.u), ("disturbance", &scenario.delta)] {
        signal
            .check(horizon)
            .map_err(|source| CascadeError::Signal { what, source })?;
    }
    let breakpoints =
        scenario.u.breakpoint_bound(horizon) + scenario.delta.breakpoint_bound(horizon);
    if !(breakpoints <= LARGEST_BREAKPOINTS) {
        return Err(CascadeError::Breakpoints(breakpoints));
    }
    // Each breakpoint may add one step.
    let steps = horizon / step + breakpoints + 1.0;
    if !(steps <= LARGEST_STEPS) {
        return Err(CascadeError::Steps(steps));
    }
    for (k, observer) in observers.iter().enumerate() {
        observer.check(n).map_err(|source| CascadeError::Observer {
            number: k + 1,
            source,
        })?;
    }
    Ok(())
}
