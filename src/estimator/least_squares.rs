//! Least squares: iteration 0 of the algorithm, stages 1 to 6.

use super::initial_state::InitialState;
use super::solver::{Solution, SolveLeastSquares};
use super::{Estimator, Failure, FailureKind, Pass, SetupError, Shape, Solver, Stage, Window};

/// `p = argmin || y - Phi p ||`, then b (stage 5) and x0 (stage 6).
pub struct LeastSquares {
    solver: Box<dyn SolveLeastSquares>,
    solution: Solution,
    state: StateEstimate,
}

impl LeastSquares {
    /// Buffers for a shape.
    ///
    /// # Errors
    /// As for [`Solver::least_squares`].
    pub fn new(shape: Shape, solver: Solver) -> Result<Self, SetupError> {
        Ok(Self {
            solver: solver.least_squares(shape)?,
            solution: Solution::new(shape.order),
            state: StateEstimate::new(shape.order),
        })
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
    }
}

/// Iteration 0 of every method, stages 1 to 6, into a cleared pass.
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

/// Takes a solution into a pass (stages 4 and 5) or records its failure; true where a, b, h stand.
pub(super) fn conclude(
    solved: Result<(), FailureKind>,
    solution: &Solution,
    stage: Stage,
    number: usize,
    pass: &mut Pass,
) -> bool {
    pass.condition = solution.condition;
    let parameters = solved.and_then(|()| pass.set_parameters(&solution.p, solution.condition));
    if let Err(kind) = parameters {
        pass.fail(Failure {
            kind,
            stage,
            pass: number,
        });
    }
    parameters.is_ok()
}

/// Stage 6 for one pass.
pub(super) struct StateEstimate {
    initial_state: InitialState,
    x0: Vec<f64>,
}

impl StateEstimate {
    pub(super) fn new(order: usize) -> Self {
        Self {
            initial_state: InitialState::new(order),
            x0: vec![0.0; order],
        }
    }

    /// Estimates x0 of a pass whose a, b, h stand, or records the failure.
    pub(super) fn estimate(&mut self, window: Window<'_>, number: usize, pass: &mut Pass) {
        let found = self
            .initial_state
            .estimate(&pass.a, &pass.b, window, &mut self.x0);
        match found {
            Ok(()) => pass.set_initial_state(&self.x0),
            Err(kind) => pass.fail(Failure {
                kind,
                stage: Stage::InitialState,
                pass: number,
            }),
        }
    }
}
