//! Least squares: iteration 0 of the algorithm, stages 1 to 6.

use crate::estimator::covariance::Covariance;
use crate::estimator::covariance::freedom;
use crate::estimator::initial_state_choice::{StartState, StateEstimate};
use crate::estimator::method_kind::{MethodKind, Problem, options};
use crate::estimator::regression::{Regression, Rows};
use crate::estimator::solver::{Solution, SolveLeastSquares};
use crate::estimator::{Estimator, FailureKind, IvOptions, Pass, SetupError, Shape, Solver, Stage, Window};
use crate::model::Orders;

options! {
    /// The choices of least squares.
    #[derive(Copy)]
    pub struct LsOptions {
        /// Solver for the parameters: partitioned, lu, cholesky (ls only), qr, svd, dual, augmented.
        pub solver: Solver,
        /// Stage 6: estimate, or zero.
        pub initial_state: StartState,
        /// The equation errors that standard errors assume: white (the default), coloured (and independent of the
        /// regressors), robust.
        pub covariance: Option<Covariance>,
    }
}

impl MethodKind for LsOptions {
    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let estimator = LeastSquares::new(problem.shape, self.solver)?;
        let mut estimator = estimator.with_start(self.initial_state);
        if problem.covariance {
            let kind = self.covariance.unwrap_or_default();
            estimator.errors = Some(LeastSquaresErrors::new(problem.shape, kind)?);
        }
        Ok(Box::new(estimator))
    }

    /// Least squares is IV without passes.
    fn in_lanes(&self) -> Option<Result<IvOptions, String>> {
        let Self {
            solver,
            initial_state,
            covariance,
        } = *self;
        IvOptions {
            solver,
            initial_state,
            covariance,
            ..IvOptions::default()
        }
        .in_lanes()
    }
}

/// Least squares `p = argmin || y - Phi p ||`, then b (stage 5) and x0 (stage 6).
pub struct LeastSquares {
    solver: Box<dyn SolveLeastSquares>,
    solution: Solution,
    state: StateEstimate,
    /// Present if standard errors are wanted.
    errors: Option<LeastSquaresErrors>,
}

/// Computes the covariance of least squares in the paper's form.
pub(super) struct LeastSquaresErrors {
    pub(super) kind: Covariance,
    regression: Regression,
}

impl LeastSquaresErrors {
    pub(super) fn new(shape: Shape, kind: Covariance) -> Result<Self, SetupError> {
        let orders = Orders::arx(shape.order, shape.order, 1);
        Ok(Self {
            kind,
            regression: Regression::new(orders, Rows::Complete, shape.window)?,
        })
    }

    /// Sets the covariance and the variance of the equation errors; does nothing if the estimate failed.
    pub(super) fn set(&mut self, window: Window<'_>, pass: &mut Pass) {
        let regression = &mut self.regression;
        pass.model.covariance.clear();
        let solved = regression.solve(window.u, window.y);
        let freedom = freedom(regression.rows(), regression.theta().len());
        let Some(freedom) = freedom.filter(|_| solved.is_ok()) else {
            return;
        };
        let variance = regression.residual_sum() / freedom;
        pass.model.noise_variance = variance;
        regression.covariance(self.kind, variance, &mut pass.model.covariance);
    }
}

impl LeastSquares {
    /// Makes buffers for a shape.
    ///
    /// # Errors
    /// As for [`Solver::least_squares`].
    pub fn new(shape: Shape, solver: Solver) -> Result<Self, SetupError> {
        Ok(Self {
            solver: solver.least_squares(shape)?,
            solution: Solution::new(shape.order),
            state: StateEstimate::new(shape.order, StartState::default()),
            errors: None,
        })
    }

    /// Returns the same estimator with x0 either estimated or zero.
    #[must_use]
    pub fn with_start(mut self, start: StartState) -> Self {
        self.state.start = start;
        self
    }
}

impl Estimator for LeastSquares {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        let Some(pass) = passes.first_mut() else {
            return;
        };
        pass.clear();
        let (solution, state) = (&mut self.solution, &mut self.state);
        iteration_zero(&mut *self.solver, solution, state, window, pass);
        if let Some(errors) = &mut self.errors {
            errors.set(window, pass);
        }
    }

    /// Without standard errors, iteration 0 of another method is all.
    fn estimate_from(&mut self, known: &[Pass], window: Window<'_>, passes: &mut [Pass]) {
        match (known.first(), passes.first_mut()) {
            (Some(known), Some(pass)) if self.errors.is_none() => pass.assign(known),
            _ => self.estimate(window, passes),
        }
    }
}

/// Runs iteration 0 of every method, stages 1 to 6, into a cleared pass.
pub(super) fn iteration_zero(
    solver: &mut (impl SolveLeastSquares + ?Sized),
    solution: &mut Solution,
    state: &mut StateEstimate,
    window: Window<'_>,
    pass: &mut Pass,
) {
    solution.condition = f64::NAN;
    let solved = solver.least_squares(window, solution);
    if conclude(solved, solution, Stage::LeastSquares, 0, pass) {
        state.estimate(window, 0, pass);
    }
}

/// Stores a solution in a pass (stages 4 and 5) or records its failure. Returns whether a, b, h are set.
pub(super) fn conclude(
    solved: Result<(), FailureKind>,
    solution: &Solution,
    stage: Stage,
    number: usize,
    pass: &mut Pass,
) -> bool {
    let parameters = solved.and_then(|()| pass.set_parameters(&solution.p, solution.condition));
    if let Err(kind) = parameters {
        pass.fail_at(stage, number, kind);
    }
    parameters.is_ok()
}
