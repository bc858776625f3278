//! Estimators of (a, b, h, x0) from a window of u and y: stages 1 to 11.
//!
//! One file per mathematical object: [`regressors`] (stages 1 and 8), [`information`] (2 and 9),
//! [`solver`] (3 and 10), [`parameters`] (4 and 5), [`initial_state`] (6), [`auxiliary`] and [`reflection`] (7); one per
//! method: [`LeastSquares`] and [`InstrumentalVariables`] (stage 11); [`KnownModel`] is the true plant in their place.

mod arx;
mod autoregression;
pub mod auxiliary;
mod covariance;
mod failure;
mod general_iv;
pub mod information;
pub mod initial_state;
mod instrumental_variables;
pub mod instruments;
mod iv4;
mod iv_delayed;
mod known;
mod least_squares;
mod limit;
mod method;
mod order_choice;
mod output_error_iteration;
pub mod parameters;
mod pass;
mod prediction_error;
mod reading;
pub mod reflection;
mod registry;
pub mod regression;
pub mod regressors;
mod riv;
pub mod solver;
mod sorted_qr;
mod subspace;

pub use arx::{Arx, ArxOptions};
pub use autoregression::autoregression;
pub use covariance::Covariance;
pub use failure::{FailureKind, Reason};
pub use general_iv::{FixedModel, GeneralIv};
pub use instrumental_variables::{
    Auxiliary, Drive, InstrumentSource, InstrumentalVariables, IvOptions, MOST_ITERATIONS,
};
pub use iv_delayed::{IvDelayed, IvDelayedOptions};
pub use iv4::{Iv4, Iv4Options};
pub use known::{KnownModel, KnownOptions};
pub(crate) use least_squares::StateEstimate;
pub use least_squares::{LeastSquares, LsOptions, StartState};
pub use limit::{LimitError, least_squares_limit};
pub use method::{Method, MethodKind, Needs, OptionError, Output, Problem};
pub use order_choice::{Candidate, Criterion, OrderComparison};
pub use output_error_iteration::{OutputErrorIteration, SrivOptions, StmcbOptions};
pub use pass::{Failure, Pass, Progress, Stage};
pub use prediction_error::{
    ArmaxOptions, BjOptions, InitialCondition, OeOptions, PredictionError, SearchStarts,
};
pub use reading::Reading;
pub use reflection::{PoleReflection, Stabilise};
pub(crate) use registry::inline_schema;
pub use registry::{EstimatorName, MethodOptions, OptionEntry, option_keys};
pub use regression::{Regression, Rows};
pub use riv::{RefinedIv, RivOptions};
pub use solver::{Instruments, Solver, Stage10};
pub use subspace::{MoespOptions, N4sidOptions, Subspace, SubspaceReading, Weights};

use crate::model::Orders;
use crate::observer::{ObserverKind, RiccatiError};
use crate::plant::ORDER_LIMIT;

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
    /// The first `length` samples of a record in open loop: r = u.
    ///
    /// # Panics
    /// If the record is shorter.
    pub fn new(u: &'a [f64], y: &'a [f64], length: usize) -> Self {
        Self::with_reference(u, y, u, length)
    }

    /// The first `length` samples of a record with its reference r.
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

    /// The number of samples, N.
    pub fn len(self) -> usize {
        self.y.len()
    }

    /// Whether there is no sample.
    pub fn is_empty(self) -> bool {
        self.y.is_empty()
    }
}

/// The order n and the window N that an estimator's buffers are made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// The order n of the plant.
    pub order: usize,
    /// The number of samples N.
    pub window: usize,
}

impl Shape {
    /// Checks that n is 1 to [`ORDER_LIMIT`] and that the N - n rows are at least the 2n unknowns: N >= 3n.
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

/// Why an estimator cannot be set up: a mistake in what was asked for, not a numerical failure.
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
        "a window of {} samples is too short for order {}: at least 3n = {} are needed",
        .0.window, .0.order, 3 * .0.order
    )]
    ShortWindow(Shape),
    /// Fewer equations than are needed.
    #[error(
        "a window of {window} samples is too short for orders {orders}: {rows} equations, at least {needed} are needed"
    )]
    ShortRecord {
        /// The orders.
        orders: Orders,
        /// The samples.
        window: usize,
        /// The equations that they make.
        rows: usize,
        /// As many as there are parameters, or instruments.
        needed: usize,
    },
    /// Hankel matrices with fewer columns than rows, or too few block rows for the order.
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
    /// `dual` or `augmented` beyond its limit.
    #[error(
        "solver '{solver}' would need a matrix of dimension {dimension} ({} MiB); its limit is {}",
        (dimension * dimension * 8).div_ceil(1 << 20), solver::NAIVE_LIMIT
    )]
    SolverDimension {
        /// The solver.
        solver: Solver,
        /// The dimension that it would need.
        dimension: usize,
    },
    /// A solver that needs a symmetric matrix.
    #[error("solver '{solver}' serves least squares only: Z'Phi is not symmetric")]
    SolverCannotUseInstruments {
        /// The solver.
        solver: Solver,
    },
    /// The gain does not fit the order.
    #[error(transparent)]
    Gain(#[from] crate::observer::GainError),
    /// Instruments from r without the simulation that r drives.
    #[error("instruments formed from 'r' need stage 7 as 'model', not '{0}'")]
    ReferenceNeedsModel(Drive),
    /// The estimator `known` where there is no such plant.
    #[error(
        "the true plant (estimator 'known', starts = \"truth\") is known in studies with one plant for all trials, of the \
         setting's order, in open loop with an exactly measured input"
    )]
    NoKnownPlant,
    /// A search from the true plant whose structure does not hold it.
    #[error("starts = \"truth\": the true plant is no model of orders {orders}")]
    TruthOfOtherOrders {
        /// The orders asked for.
        orders: Orders,
    },
    /// A Kalman filter that knows the noise, where its variance is not the same in every trial or 0.
    #[error(
        "observer '{0}' of the known plant needs the measurement noise's variance: eta above 0 with eta_over = \
         \"nominal\""
    )]
    NoKnownNoise(ObserverKind),
    /// A Kalman filter of coefficients that make none.
    #[error(transparent)]
    Riccati(#[from] RiccatiError),
    /// A program does not run.
    #[error(transparent)]
    Program(#[from] ProgramError),
    /// A printed stage 10 without stage 3's blocks.
    #[error("stage 10 '{stage10}' exists for solver 'partitioned' only, not '{solver}'")]
    Stage10NeedsPartitioned {
        /// The reading.
        stage10: Stage10,
        /// The solver.
        solver: Solver,
    },
}

/// Records of other trials of the same cell, for a method that works on many at a time.
pub trait Records {
    /// The window of a trial, until the next is drawn; `None` where its record cannot be drawn.
    fn draw(&mut self, trial: u64) -> Option<Window<'_>>;

    /// A number below 2^53 of a trial's own, from which nothing of the record can be told.
    fn seed(&self, trial: u64) -> u64;
}

/// Why a program that is a method does not run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ProgramError {
    /// Nobody agreed to it.
    #[error("method '{0}' is a program, and nobody agreed to run it")]
    NotAgreed(String),
    /// It does not start, or speaks another protocol.
    #[error("method '{name}': {reason}")]
    Failed {
        /// The method.
        name: String,
        /// What happened.
        reason: String,
    },
    /// The flag that stops the run was raised.
    #[error("interrupted")]
    Stopped,
}

/// Estimates (a, b, h, x0) from a window, with buffers of its own: one value per worker.
///
/// Implement this to bring a method of your own into a Monte-Carlo comparison (see
/// `examples/own_estimator.rs`).
pub trait Estimator: Send {
    /// Fills `passes`, one entry per output of the method ([`Method::outputs`]), in order.
    ///
    /// Every entry comes cleared and must be set: by [`Pass::set_parameters`] and [`Pass::set_initial_state`], or by
    /// [`Pass::fail`].
    ///
    /// # Panics
    /// The estimators of this crate panic where the window is not of the shape that they were made for.
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]);

    /// Before the record of a trial is estimated: looks at those of other trials too, where the method works on many at
    /// a time. The models must not depend on which trials came before.
    ///
    /// # Errors
    /// If a program that is the method does not run.
    fn gather(&mut self, _trial: u64, _records: &mut dyn Records) -> Result<(), ProgramError> {
        Ok(())
    }
}
