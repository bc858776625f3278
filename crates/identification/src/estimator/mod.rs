//! Estimators of (a, b, h, x0) from a window of u and y: stages 1 to 11.
//!
//! There is one file per mathematical object: [`regressors`] (stages 1 and 8), [`information`] (2 and 9), [`solver`] (3
//! and 10), [`parameters`] (4 and 5), [`initial_state`] (6), [`auxiliary`] and [`reflection`] (7). There is one file
//! per method: [`LeastSquares`] and [`InstrumentalVariables`] (stage 11). [`KnownModel`] returns the true plant
//! instead.

mod autoregression;
pub mod auxiliary;
mod band;
mod chosen;
mod covariance;
mod excitation;
mod fixed_model;
mod fixed_point;
mod general_iv;
mod hankel;
pub mod information;
pub mod initial_state;
mod initial_state_choice;
pub mod instruments;
mod iv_options;
mod kinship;
mod known_model;
mod lag_sums;
mod last_samples;
mod least_value;
mod loop_input;
mod method;
mod method_kind;
pub mod methods;
mod noise_fit;
mod null_space;
mod numerator;
mod offset;
mod option_error;
#[cfg(feature = "json")]
mod options;
mod order_choice;
mod other_tools;
mod output_gradient;
pub mod parameters;
mod pass;
mod prediction;
mod prediction_error;
pub mod reflection;
pub mod regression;
pub mod regressors;
mod runs;
mod scale;
#[cfg(feature = "json")]
mod schema;
mod single_pass;
pub mod solver;
mod sorted_qr;
#[cfg(test)]
mod test_setup;
mod triangular;

pub use crate::failure::{FailureKind, Reason};
pub(crate) use autoregression::Autoregression;
pub use autoregression::spectrum;
pub(crate) use band::BandRoot;
pub use chosen::{OrderRule, first_part};
pub use covariance::Covariance;
pub use excitation::excitation_order;
pub use fixed_model::FixedModel;
pub use general_iv::GeneralIv;
pub use initial_state_choice::{StartState, StateEstimate};
pub use iv_options::{Auxiliary, Drive, InstrumentSource, IvOptions, MOST_ITERATIONS};
pub use kinship::Kinship;
pub use known_model::KnownModel;
pub use method::Method;
pub use method_kind::{MethodKind, Needs, OptionUnits, Output, Problem};
pub use methods::*;
pub(crate) use null_space::long_autoregression_order;
pub use offset::OffsetChoice;
pub use option_error::OptionError;
#[cfg(feature = "json")]
pub use options::{OptionEntry, option_keys};
pub use order_choice::{Candidate, Criterion, OrderComparison};
pub use other_tools::Reading;
pub use pass::{Failure, Offset, Pass, Progress, Stage};
pub use prediction::{errors_ahead, prediction_errors};
pub(crate) use prediction_error::PredictionGradient;
pub use prediction_error::{Beside, InitialCondition, PredictionError, SearchStarts, initial_numbers};
pub use reflection::{PoleReflection, Stabilise};
pub use regression::{Regression, Rows};
pub use runs::Runs;
pub use scale::unit_of;
#[cfg(feature = "json")]
pub use schema::inline_schema;
pub use single_pass::{Iteration, SinglePass};
pub use solver::{Instruments, Solver, Stage10};

use crate::model::Orders;
use crate::observer::{ObserverKind, RiccatiError};
use crate::plant::ORDER_LIMIT;
use std::ops::Range;

/// The largest dimension that `dual` and `augmented` accept: a matrix of 128 MiB.
pub const NAIVE_LIMIT: usize = 4096;

/// The samples that an estimator sees: `u(k)`, `y(k)` and `r(k)` for k = 0 ... N-1.
#[derive(Clone, Copy, Debug)]
pub struct Window<'a> {
    /// The input.
    pub u: &'a [f64],
    /// The measured output.
    pub y: &'a [f64],
    /// The external reference of a closed loop; u itself in open loop.
    pub r: &'a [f64],
}

impl<'a> Window<'a> {
    /// Returns the first `length` samples of a record in open loop: r = u.
    ///
    /// # Panics
    /// If the record is shorter.
    pub fn new(u: &'a [f64], y: &'a [f64], length: usize) -> Self {
        Self::with_reference(u, y, u, length)
    }

    /// Returns the first `length` samples of a record with its reference r.
    ///
    /// # Panics
    /// If the record is shorter.
    pub fn with_reference(u: &'a [f64], y: &'a [f64], r: &'a [f64], length: usize) -> Self {
        Self {
            u: &u[..length],
            y: &y[..length],
            r: &r[..length],
        }
    }

    /// Returns a part of the samples.
    ///
    /// # Panics
    /// If it is not within the window.
    #[must_use]
    pub fn part(self, of: Range<usize>) -> Self {
        Self {
            u: &self.u[of.clone()],
            y: &self.y[of.clone()],
            r: &self.r[of],
        }
    }

    /// Returns the number of samples, N.
    pub fn len(self) -> usize {
        self.y.len()
    }

    /// Returns whether there are no samples.
    pub fn is_empty(self) -> bool {
        self.y.is_empty()
    }
}

/// The order n and the window N for which an estimator's buffers are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// The order n of the plant.
    pub order: usize,
    /// The number of samples N.
    pub window: usize,
}

impl Shape {
    /// Checks that n is 1 to [`ORDER_LIMIT`] and that the N - n rows are at least as many as the 2n unknowns, i.e. N >=
    /// 3n.
    ///
    /// # Errors
    /// [`SetupError::ZeroOrder`], [`SetupError::LargeOrder`] or [`SetupError::ShortWindow`].
    pub fn check(self) -> Result<(), SetupError> {
        if self.order == 0 {
            return Err(SetupError::ZeroOrder);
        }
        if self.order > ORDER_LIMIT {
            return Err(SetupError::LargeOrder(self.order));
        }
        if self.window < 3 * self.order {
            return Err(SetupError::ShortWindow(self));
        }
        Ok(())
    }
}

/// Why an estimator cannot be set up: an error in the request, not a numerical failure.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetupError {
    /// A cell in continuous time has observers and no record.
    #[error("a study in continuous time has no records to estimate from")]
    ContinuousTime,
    /// The order is 0.
    #[error("the order must be at least 1")]
    ZeroOrder,
    /// The order is above [`crate::plant::ORDER_LIMIT`].
    #[error("an order of {0}; expected at most {ORDER_LIMIT}")]
    LargeOrder(usize),
    /// N - n is below 2n.
    #[error(
        "a window of {} samples is too short for order {}: expected any whole number from 3n = {} on, even or odd",
        .0.window, .0.order, 3 * .0.order
    )]
    ShortWindow(Shape),
    /// There are fewer equations than needed.
    #[error(
        "a window of {window} samples is too short for orders {orders}: {rows} equations, at least {needed} are needed"
    )]
    ShortRecord {
        /// The orders.
        orders: Orders,
        /// The samples.
        window: usize,
        /// The number of equations that they yield.
        rows: usize,
        /// The number of parameters, or of instruments.
        needed: usize,
    },
    /// A dead time as long as the record.
    #[error("a dead time of {seconds} s; expected one below the {record} s of the record")]
    LongDeadTime {
        /// The dead time, or the end of its range.
        seconds: f64,
        /// The samples times the time between them.
        record: f64,
    },
    /// theta0 does not fit the orders.
    #[error("theta0 has {given} numbers; orders {orders} have {} parameters", .orders.parameters())]
    ParameterCount {
        /// The orders.
        orders: Orders,
        /// The numbers given.
        given: usize,
    },
    /// The Hankel matrices have fewer columns than rows, or too few block rows for the order.
    #[error("a window of {window} samples with {rows} block rows is too short for order {order}: at least {} samples, \
             and more block rows than the order, are needed", 6 * .rows - 1)]
    ShortHankel {
        /// Block rows of the past and of the future.
        rows: usize,
        /// The samples.
        window: usize,
        /// The order.
        order: usize,
    },
    /// The method cannot fit one model to several records.
    #[error("takes one record without gaps; one model is fitted to several records by arx, iv, oe, armax and bj")]
    OneRecord,
    /// The matrix of `dual` or `augmented` would be too large.
    #[error(
        "solver '{solver}' would need a matrix of dimension {dimension} ({} MiB); its limit is {}",
        (dimension * dimension * 8).div_ceil(1 << 20), NAIVE_LIMIT
    )]
    SolverDimension {
        /// The solver.
        solver: Solver,
        /// The dimension that the solver would need.
        dimension: usize,
    },
    /// The solver needs a symmetric matrix.
    #[error("solver '{solver}' serves least squares only: Z'Phi is not symmetric")]
    SolverCannotUseInstruments {
        /// The solver.
        solver: Solver,
    },
    /// The gain does not fit the order.
    #[error(transparent)]
    Gain(#[from] crate::observer::GainError),
    /// Instruments from r need the simulation that r drives.
    #[error("instruments formed from 'r' need drive 'model', not '{0}'")]
    ReferenceNeedsModel(Drive),
    /// The estimator `known` is used where no true plant is known.
    #[error(
        "the true plant (estimator 'known', starts = \"truth\") is available only in studies with one plant for \
         all trials and samples, of the setting's order, without state feedback"
    )]
    NoKnownPlant,
    /// The true plant, from which a search is to start, is not a model of these orders.
    #[error("starts = \"truth\": the true plant is not a model of orders {orders}")]
    TruthOfOtherOrders {
        /// The given orders.
        orders: Orders,
    },
    /// A Kalman filter with known noise, but the variance of the noise is 0 or differs between trials.
    #[error(
        "observer '{0}' with the known plant needs the variance of the measurement noise, the same in every trial: eta \
         = 0, or eta_over = \"nominal\" or \"absolute\""
    )]
    NoKnownNoise(ObserverKind),
    /// The Kalman filter does not exist for these coefficients.
    #[error(transparent)]
    Riccati(#[from] RiccatiError),
    /// A program cannot be run.
    #[error(transparent)]
    Program(#[from] ProgramError),
    /// A printed stage 10 is used without the blocks of stage 3.
    #[error("stage 10 '{stage10}' exists for solver 'partitioned' only, not '{solver}'")]
    Stage10NeedsPartitioned {
        /// The reading.
        stage10: Stage10,
        /// The solver.
        solver: Solver,
    },
}

/// Checks that a window yields as many equations as are needed.
fn enough_equations(orders: Orders, window: usize, rows: usize, needed: usize) -> Result<(), SetupError> {
    if rows < needed {
        return Err(SetupError::ShortRecord {
            orders,
            window,
            rows,
            needed,
        });
    }
    Ok(())
}

/// The records of other trials of the same cell, for a method that works on many at a time.
pub trait Records {
    /// Returns the window of a trial; it is valid until the next is drawn. `None` if its record cannot be drawn.
    fn draw(&mut self, trial: u64) -> Option<Window<'_>>;

    /// Returns a number below 2^53 that belongs to a trial but reveals nothing of its record.
    fn seed(&self, trial: u64) -> u64;
}

/// Why a program that is a method cannot be run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ProgramError {
    /// The user did not agree to run it.
    #[error("method '{0}' is a program that you have not agreed to run")]
    NotAgreed(String),
    /// It does not start, or it speaks another protocol.
    #[error("method '{name}': {reason}")]
    Failed {
        /// The method.
        name: String,
        /// The failure.
        reason: String,
    },
    /// The flag that stops the run was raised.
    #[error("interrupted")]
    Stopped,
}

/// The function that [`Estimator::run_along`] calls.
pub type Visit<'a> = dyn FnMut(usize, &Pass, Option<&[f64]>) + 'a;

/// Estimates (a, b, h, x0) from a window. It owns its buffers; each worker has its own estimator.
///
/// Implement this to bring a method of your own into a Monte-Carlo comparison (see
/// `examples/own_estimator.rs`).
pub trait Estimator: Send {
    /// Fills `passes`, one entry per output of the method ([`Method::outputs`]), in order.
    ///
    /// Every entry comes cleared. Each must be set by [`Pass::set_parameters`] and [`Pass::set_initial_state`], or by
    /// [`Pass::fail`].
    ///
    /// # Panics
    /// The estimators of this crate panic if the window does not have the shape that they were made for.
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]);

    /// Does the same where another method has found passes that the two have in common ([`Kinship::Passes`]),
    /// which need not be computed again; by default everything is.
    fn estimate_from(&mut self, _known: &[Pass], window: Window<'_>, passes: &mut [Pass]) {
        self.estimate(window, passes);
    }

    /// Fills `passes` for a method that differs in `covariance` alone, after [`Self::estimate`] of the same window
    /// found `found`. Returns false if it cannot: `passes` must be estimated then.
    fn estimate_again(
        &mut self,
        _covariance: Covariance,
        _window: Window<'_>,
        _found: &[Pass],
        _passes: &mut [Pass],
    ) -> bool {
        false
    }

    /// Runs once over the window, for methods that take a record sample by sample ([`Method::runs_along`]); others do
    /// nothing. Calls `visit(k, pass, state)` for each k of `at`, ascending: the pass has the parameters after the
    /// first k samples, or none if there are none, and the state is xhat(k) if the method estimates it itself.
    fn run_along(&mut self, _: Window<'_>, _at: &[usize], _: &mut Pass, _visit: &mut Visit<'_>) {}

    /// Called before the record of a trial is estimated. A method that works on many trials at a time can look at the
    /// records of others here. The models must not depend on which trials came before.
    ///
    /// # Errors
    /// If the method is a program that cannot be run.
    fn gather(&mut self, _trial: u64, _records: &mut dyn Records) -> Result<(), ProgramError> {
        Ok(())
    }
}
