//! LU and Cholesky of the 2n x 2n information matrix.

use super::linear::EquilibratedLu;
use super::rank::{Equilibration, check_rank, inverse_norm1_estimate, norm1};
use super::{Instruments, Solution, SolveInstruments, SolveLeastSquares};
use crate::estimator::information::Information;
use crate::estimator::{FailureKind, Window};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::{Mat, MatMut, Par};

/// Solves `G p = r` by LU with partial pivoting of the equilibrated G.
pub struct Lu {
    information: Information,
    lu: EquilibratedLu,
}

impl Lu {
    /// Makes buffers for order n.
    pub fn new(order: usize) -> Self {
        Self {
            information: Information::new(order),
            lu: EquilibratedLu::new(2 * order, order),
        }
    }

    fn solve(&mut self, solution: &mut Solution) -> Result<(), FailureKind> {
        self.lu.matrix().copy_from(self.information.matrix());
        solution.p.copy_from_slice(self.information.rhs());
        self.lu.solve(&mut solution.p, &mut solution.condition)
    }
}

impl SolveLeastSquares for Lu {
    fn least_squares(&mut self, window: Window<'_>, solution: &mut Solution) -> Result<(), FailureKind> {
        self.information.least_squares(window);
        self.solve(solution)
    }
}

impl SolveInstruments for Lu {
    fn instruments(
        &mut self,
        window: Window<'_>,
        instruments: Instruments<'_>,
        solution: &mut Solution,
    ) -> Result<(), FailureKind> {
        self.information.instruments(window, instruments);
        self.solve(solution)
    }
}

/// Solves `Phi'Phi p = Phi'y` by Cholesky of the matrix scaled to a diagonal near one. Least squares only: `Z'Phi` is
/// not symmetric.
pub struct Cholesky {
    order: usize,
    information: Information,
    matrix: Mat<f64>,
    equilibration: Equilibration,
    estimate: [Vec<f64>; 2],
    memory: MemBuffer,
}

impl Cholesky {
    /// Makes buffers for order n.
    pub fn new(order: usize) -> Self {
        let dimension = 2 * order;
        let scratch = llt::factor::cholesky_in_place_scratch::<f64>(dimension, Par::Seq, Default::default());
        Self {
            order,
            information: Information::new(order),
            matrix: Mat::zeros(dimension, dimension),
            equilibration: Equilibration::new(dimension, dimension),
            estimate: [vec![0.0; dimension], vec![0.0; dimension]],
            memory: MemBuffer::new(scratch),
        }
    }
}

impl SolveLeastSquares for Cholesky {
    fn least_squares(&mut self, window: Window<'_>, solution: &mut Solution) -> Result<(), FailureKind> {
        self.information.least_squares(window);
        self.matrix.copy_from(self.information.matrix());
        self.equilibration.of_symmetric(self.matrix.as_ref())?;
        self.equilibration.apply(self.matrix.as_mut());
        let norm = norm1(self.matrix.as_ref());
        let stack = MemStack::new(&mut self.memory);
        // A pivot that is not positive is a singularity hidden by rounding.
        llt::factor::cholesky_in_place(
            self.matrix.as_mut(),
            Default::default(),
            Par::Seq,
            stack,
            Default::default(),
        )
        .map_err(|_| FailureKind::RankDeficient)?;
        let (l, dimension) = (self.matrix.as_ref(), 2 * self.order);
        let mut substitute = |x: &mut [f64], _transposed: bool| {
            let x = MatMut::from_column_major_slice_mut(x, dimension, 1);
            llt::solve::solve_in_place(l, x, Par::Seq, stack);
        };
        let [x, z] = &mut self.estimate;
        solution.condition = norm * inverse_norm1_estimate(x, z, &mut substitute);
        check_rank(solution.condition, self.order)?;
        let scales = &self.equilibration.rows;
        for i in 0..dimension {
            solution.p[i] = self.information.rhs()[i] * scales[i];
        }
        substitute(&mut solution.p, false);
        for (p, scale) in solution.p.iter_mut().zip(scales) {
            *p *= scale;
        }
        Ok(())
    }
}
