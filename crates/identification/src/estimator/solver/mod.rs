//! Ways to solve for p, with one interface for iteration 0 (least squares) and for passes with instruments.

mod linear;
mod naive;
mod orthogonal;
mod partitioned;
pub mod rank;
mod reduction;
mod square;

use super::{FailureKind, NAIVE_LIMIT, SetupError, Shape, Window};
use crate::names::named_enum;

pub use naive::{Augmented, Dual};
pub use orthogonal::{Qr, Svd};
pub use partitioned::Partitioned;
pub(crate) use reduction::{Reduction, column};
pub use square::{Cholesky, Lu};

named_enum! {
    /// A way to solve `Z'Phi p = Z'y` for p.
    Solver, "solver" {
        /// Stages 3 and 10: two n x n inverses (the default).
        Partitioned = "partitioned",
        /// LU of the 2n x 2n information matrix.
        Lu = "lu",
        /// Cholesky of the 2n x 2n information matrix; least squares only.
        Cholesky = "cholesky",
        /// QR of the (N-n) x 2n data matrix.
        Qr = "qr",
        /// SVD of the (N-n) x 2n data matrix.
        Svd = "svd",
        /// The naive (N-n) x (N-n) system, regularised.
        Dual = "dual",
        /// The naive system of dimension (N-n) + 2n.
        Augmented = "augmented",
    }
}

named_enum! {
    /// The formula of stage 10: reading E2. Only `partitioned` has it.
    Stage10, "reading of stage 10" {
        /// Stage 3's formula with the new blocks (the default).
        Corrected = "corrected",
        /// As the 2023 article prints it.
        AsPrinted = "as-printed",
        /// As the 2024 article prints it.
        AsPrinted2024 = "as-printed-2024",
    }
}

/// The result of a solver: p (2n numbers), and the condition number of the factorised matrix.
#[derive(Clone, Debug)]
pub struct Solution {
    /// `p = (alpha_1 ... alpha_n, beta_1 ... beta_n)`.
    pub p: Vec<f64>,
    /// The 1-norm condition number of the row- and column-equilibrated matrix that the solver factorises; the worse one
    /// if there are two. It is set once computed, even if the rank rule then fails.
    pub condition: f64,
}

impl Solution {
    /// Makes buffers for order n.
    pub fn new(order: usize) -> Self {
        Self {
            p: vec![0.0; 2 * order],
            condition: f64::NAN,
        }
    }
}

/// Solves for p by least squares (iteration 0), with its own buffers.
pub trait SolveLeastSquares: Send {
    /// Computes `p = argmin || y - Phi p ||` on the window.
    ///
    /// # Errors
    /// The kind of failure; `solution.p` is then undefined.
    fn least_squares(&mut self, window: Window<'_>, solution: &mut Solution) -> Result<(), FailureKind>;
}

/// The signals that replace y and u in the instruments Z, as long as the window.
#[derive(Clone, Copy, Debug)]
pub struct Instruments<'a> {
    /// yhat, instead of y.
    pub output: &'a [f64],
    /// The signal instead of u, such as r; `None` if u itself stays (stage 9: "G21, G22 unchanged").
    pub input: Option<&'a [f64]>,
}

impl<'a> Instruments<'a> {
    /// Makes instruments with yhat instead of y, and u itself.
    pub const fn new(output: &'a [f64]) -> Self {
        Self { output, input: None }
    }

    /// Returns the signal that is used as u on a window.
    pub fn input(self, window: Window<'a>) -> &'a [f64] {
        self.input.unwrap_or(window.u)
    }
}

/// Solves for p with instruments as well.
pub trait SolveInstruments: SolveLeastSquares {
    /// Solves `Z'Phi p = Z'y`, with Z equal to Phi except for the instruments' signals instead of y and u.
    ///
    /// Must follow [`SolveLeastSquares::least_squares`] on the same window, whose blocks it reuses if u itself stays in
    /// Z.
    ///
    /// # Errors
    /// The kind of failure; `solution.p` is then undefined.
    fn instruments(
        &mut self,
        window: Window<'_>,
        instruments: Instruments<'_>,
        solution: &mut Solution,
    ) -> Result<(), FailureKind>;

    /// Prepares for [`Self::instruments`] instead of [`SolveLeastSquares::least_squares`], where p of iteration 0
    /// is known. The numbers left in `solution` say nothing.
    fn begin(&mut self, window: Window<'_>, solution: &mut Solution) {
        // A failure shows in the pass that is known.
        let _ = self.least_squares(window, solution);
    }
}

impl Solver {
    /// Checks that the solver's matrices for a shape stay below [`NAIVE_LIMIT`].
    ///
    /// # Errors
    /// [`SetupError::SolverDimension`] with the required dimension.
    fn check_dimension(self, shape: Shape) -> Result<(), SetupError> {
        let rows = shape.window - shape.order;
        let dimension = match self {
            Self::Dual => rows,
            Self::Augmented => rows + 2 * shape.order,
            _ => return Ok(()),
        };
        if dimension > NAIVE_LIMIT {
            return Err(SetupError::SolverDimension {
                solver: self,
                dimension,
            });
        }
        Ok(())
    }

    /// Makes a solver for least squares alone.
    ///
    /// # Errors
    /// If the shape is invalid, or too large for `dual` or `augmented`.
    pub fn least_squares(self, shape: Shape) -> Result<Box<dyn SolveLeastSquares>, SetupError> {
        if self != Self::Cholesky {
            return Ok(self.instruments(shape, Stage10::Corrected)?);
        }
        shape.check()?;
        Ok(Box::new(Cholesky::new(shape.order)))
    }

    /// Makes a solver for least squares and instruments.
    ///
    /// # Errors
    /// As for [`Self::least_squares`]. Also for `cholesky`, which cannot use instruments, and for a printed stage 10
    /// with a solver other than `partitioned`.
    pub fn instruments(self, shape: Shape, stage10: Stage10) -> Result<Box<dyn SolveInstruments>, SetupError> {
        shape.check()?;
        self.check_dimension(shape)?;
        if stage10 != Stage10::Corrected && self != Self::Partitioned {
            return Err(SetupError::Stage10NeedsPartitioned { stage10, solver: self });
        }
        let Shape { order, window } = shape;
        Ok(match self {
            Self::Partitioned => Box::new(Partitioned::new(order, stage10)),
            Self::Lu => Box::new(Lu::new(order)),
            Self::Cholesky => return Err(SetupError::SolverCannotUseInstruments { solver: self }),
            Self::Qr => Box::new(Qr::new(order, window)),
            Self::Svd => Box::new(Svd::new(order, window)),
            Self::Dual => Box::new(Dual::new(order, window)),
            Self::Augmented => Box::new(Augmented::new(order, window)),
        })
    }
}
