//! Why a run is refused, and how large one may be.

use super::delay::LONGEST_DELAY;
use super::expansion::HIGHEST_ORDER;
use crate::signal::SignalError;
use crate::text::number;

/// The largest number of base steps of a run.
pub const LARGEST_STEPS: f64 = 1e7;

/// The largest number of breakpoints of a run.
pub const LARGEST_BREAKPOINTS: f64 = 1e6;

/// The largest number of different step lengths of a run. Each length needs propagators of its own.
pub const LARGEST_LENGTHS: usize = 4096;

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
        /// The mistake in its settings.
        source: SettingError,
    },
    /// A signal is wrong.
    #[error("{what}: {source}")]
    Signal {
        /// `input` or `disturbance`.
        what: &'static str,
        /// The mistake in the signal.
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
