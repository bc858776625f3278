//! The (N-n)-dimensional forms with which the paper compares its partitioned inverse.

use super::linear::EquilibratedLu;
use super::{Instruments, Solution, SolveInstruments, SolveLeastSquares};
use crate::estimator::regressors::fill_rows;
use crate::estimator::{FailureKind, Window};
use faer::linalg::matmul::matmul;
use faer::reborrow::ReborrowMut;
use faer::{Accum, Mat, Par};

/// The regularisation of `dual`, as a multiple of the Frobenius norm of `Phi Z'`: 2^-26, the square root of eps.
const REGULARISATION: f64 = 1.490_116_119_384_765_6e-8;

/// Solves `p = Z' (Phi Z' + eps I)^-1 y`, which equals `(Z'Phi + eps I)^-1 Z'y` (push-through identity).
///
/// `Phi Z'` is (N-n) x (N-n) and has rank 2n, so eps > 0 is needed. The relative error is about
/// `2^-26 |Phi Z'|_F |(Z'Phi)^-1|`. The regularised matrix never looks rank deficient, so this form hides a
/// rank-deficient `Z'Phi`.
pub struct Dual {
    order: usize,
    phi: Mat<f64>,
    z: Mat<f64>,
    rhs: Vec<f64>,
    lu: EquilibratedLu,
}

impl Dual {
    /// Makes buffers for order n and windows of N samples.
    pub fn new(order: usize, window: usize) -> Self {
        let rows = window - order;
        Self {
            order,
            phi: Mat::zeros(rows, 2 * order),
            z: Mat::zeros(rows, 2 * order),
            rhs: vec![0.0; rows],
            lu: EquilibratedLu::new(rows, order),
        }
    }

    fn solve(&mut self, window: Window<'_>, z: Instruments<'_>, solution: &mut Solution) -> Result<(), FailureKind> {
        fill_rows(window.y, window.u, self.order, 0, self.phi.as_mut());
        fill_rows(z.output, z.input(window), self.order, 0, self.z.as_mut());
        let mut matrix = self.lu.matrix();
        matmul(
            matrix.rb_mut(),
            Accum::Replace,
            self.phi.as_ref(),
            self.z.transpose(),
            1.0,
            Par::Seq,
        );
        let epsilon = REGULARISATION * matrix.norm_l2();
        for i in 0..matrix.nrows() {
            matrix[(i, i)] += epsilon;
        }
        self.rhs.copy_from_slice(&window.y[self.order..]);
        self.lu.solve(&mut self.rhs, &mut solution.condition)?;
        for (j, p) in solution.p.iter_mut().enumerate() {
            let column = self.z.col_as_slice(j);
            *p = column.iter().zip(&self.rhs).map(|(z, r)| z * r).sum();
        }
        Ok(())
    }
}

impl SolveLeastSquares for Dual {
    fn least_squares(&mut self, window: Window<'_>, solution: &mut Solution) -> Result<(), FailureKind> {
        self.solve(window, Instruments::new(window.y), solution)
    }
}

impl SolveInstruments for Dual {
    fn instruments(
        &mut self,
        window: Window<'_>,
        instruments: Instruments<'_>,
        solution: &mut Solution,
    ) -> Result<(), FailureKind> {
        self.solve(window, instruments, solution)
    }
}

/// Solves `[I, Phi; Z', 0] [r; p] = [y; 0]` of dimension (N-n) + 2n. Its Schur complement is the 2n x 2n system.
pub struct Augmented {
    order: usize,
    rhs: Vec<f64>,
    lu: EquilibratedLu,
    z: Mat<f64>,
}

impl Augmented {
    /// Makes buffers for order n and windows of N samples.
    pub fn new(order: usize, window: usize) -> Self {
        let rows = window - order;
        Self {
            order,
            rhs: vec![0.0; rows + 2 * order],
            lu: EquilibratedLu::new(rows + 2 * order, order),
            z: Mat::zeros(rows, 2 * order),
        }
    }

    fn solve(&mut self, window: Window<'_>, z: Instruments<'_>, solution: &mut Solution) -> Result<(), FailureKind> {
        let rows = window.len() - self.order;
        let mut matrix = self.lu.matrix();
        matrix.fill(0.0);
        let (mut identity, phi, z_transposed, _) = matrix.split_at_mut(rows, rows);
        for i in 0..rows {
            identity[(i, i)] = 1.0;
        }
        fill_rows(window.y, window.u, self.order, 0, phi);
        fill_rows(z.output, z.input(window), self.order, 0, self.z.as_mut());
        let mut z_transposed = z_transposed;
        z_transposed.copy_from(self.z.transpose());
        self.rhs[..rows].copy_from_slice(&window.y[self.order..]);
        self.rhs[rows..].fill(0.0);
        self.lu.solve(&mut self.rhs, &mut solution.condition)?;
        solution.p.copy_from_slice(&self.rhs[rows..]);
        Ok(())
    }
}

impl SolveLeastSquares for Augmented {
    fn least_squares(&mut self, window: Window<'_>, solution: &mut Solution) -> Result<(), FailureKind> {
        self.solve(window, Instruments::new(window.y), solution)
    }
}

impl SolveInstruments for Augmented {
    fn instruments(
        &mut self,
        window: Window<'_>,
        instruments: Instruments<'_>,
        solution: &mut Solution,
    ) -> Result<(), FailureKind> {
        self.solve(window, instruments, solution)
    }
}
