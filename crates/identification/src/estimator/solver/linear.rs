//! Dense factorisations with their own buffers, shared by the solvers.

use super::rank::{Equilibration, check_rank, inverse_norm1_estimate, norm1};
use crate::estimator::FailureKind;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::lu::partial_pivoting::{factor, inverse, solve};
use faer::perm::PermRef;
use faer::{Mat, MatMut, MatRef, Par};

/// Inverse of small matrices by LU with partial pivoting.
pub(super) struct Inverter {
    lu: Mat<f64>,
    permutation: Vec<usize>,
    permutation_inverse: Vec<usize>,
    memory: MemBuffer,
}

impl Inverter {
    pub(super) fn new(dimension: usize) -> Self {
        let lu = factor::lu_in_place_scratch::<usize, f64>(dimension, dimension, Par::Seq, Default::default());
        let inverse = inverse::inverse_scratch::<usize, f64>(dimension, Par::Seq);
        Self {
            lu: Mat::zeros(dimension, dimension),
            permutation: vec![0; dimension],
            permutation_inverse: vec![0; dimension],
            memory: MemBuffer::new(StackReq::any_of(&[lu, inverse])),
        }
    }

    /// Computes `out = A^-1`.
    pub(super) fn invert(&mut self, a: MatRef<'_, f64>, out: MatMut<'_, f64>) -> Result<(), FailureKind> {
        self.lu.copy_from(a);
        let stack = MemStack::new(&mut self.memory);
        let (_, permutation) = factor::lu_in_place(
            self.lu.as_mut(),
            &mut self.permutation,
            &mut self.permutation_inverse,
            Par::Seq,
            stack,
            Default::default(),
        );
        check_pivots(self.lu.as_ref())?;
        let lu = self.lu.as_ref();
        inverse::inverse(out, lu, lu, permutation, Par::Seq, stack);
        Ok(())
    }
}

/// Fails if a pivot is zero (a singularity that rounding did not hide) or not finite.
fn check_pivots(lu: MatRef<'_, f64>) -> Result<(), FailureKind> {
    for i in 0..lu.nrows() {
        let pivot = lu[(i, i)];
        if pivot == 0.0 {
            return Err(FailureKind::RankDeficient);
        }
        if !pivot.is_finite() {
            return Err(FailureKind::NonFinite);
        }
    }
    Ok(())
}

/// Solves square systems by LU with partial pivoting of the equilibrated matrix, and estimates its 1-norm condition
/// number.
pub(super) struct EquilibratedLu {
    order: usize,
    matrix: Mat<f64>,
    equilibration: Equilibration,
    permutation: Vec<usize>,
    permutation_inverse: Vec<usize>,
    estimate: [Vec<f64>; 2],
    memory: MemBuffer,
}

impl EquilibratedLu {
    /// Makes buffers for systems of a dimension; `order` is n of the rank rule.
    pub(super) fn new(dimension: usize, order: usize) -> Self {
        let par = Par::Seq;
        let lu = factor::lu_in_place_scratch::<usize, f64>(dimension, dimension, par, Default::default());
        let forward = solve::solve_in_place_scratch::<usize, f64>(dimension, 1, par);
        let transposed = solve::solve_transpose_in_place_scratch::<usize, f64>(dimension, 1, par);
        Self {
            order,
            matrix: Mat::zeros(dimension, dimension),
            equilibration: Equilibration::new(dimension, dimension),
            permutation: vec![0; dimension],
            permutation_inverse: vec![0; dimension],
            estimate: [vec![0.0; dimension], vec![0.0; dimension]],
            memory: MemBuffer::new(StackReq::any_of(&[lu, forward, transposed])),
        }
    }

    /// Returns the matrix to fill before [`Self::solve`], which overwrites it.
    pub(super) fn matrix(&mut self) -> MatMut<'_, f64> {
        self.matrix.as_mut()
    }

    /// Overwrites `rhs` by the solution. Sets `condition` even if the rank rule fails.
    pub(super) fn solve(&mut self, rhs: &mut [f64], condition: &mut f64) -> Result<(), FailureKind> {
        self.equilibration.of(self.matrix.as_ref())?;
        self.equilibration.apply(self.matrix.as_mut());
        let norm = norm1(self.matrix.as_ref());
        let stack = MemStack::new(&mut self.memory);
        factor::lu_in_place(
            self.matrix.as_mut(),
            &mut self.permutation,
            &mut self.permutation_inverse,
            Par::Seq,
            stack,
            Default::default(),
        );
        check_pivots(self.matrix.as_ref())?;
        let lu = self.matrix.as_ref();
        let dimension = lu.nrows();
        // The factorisation has just made this permutation.
        let permutation = PermRef::new_checked(&self.permutation, &self.permutation_inverse, dimension);
        let mut substitute = |x: &mut [f64], transposed: bool| {
            let x = MatMut::from_column_major_slice_mut(x, dimension, 1);
            if transposed {
                solve::solve_transpose_in_place(lu, lu, permutation, x, Par::Seq, stack);
            } else {
                solve::solve_in_place(lu, lu, permutation, x, Par::Seq, stack);
            }
        };
        let [x, z] = &mut self.estimate;
        *condition = norm * inverse_norm1_estimate(x, z, &mut substitute);
        check_rank(*condition, self.order)?;
        for (rhs, scale) in rhs.iter_mut().zip(&self.equilibration.rows) {
            *rhs *= scale;
        }
        substitute(rhs, false);
        for (x, scale) in rhs.iter_mut().zip(&self.equilibration.columns) {
            *x *= scale;
        }
        Ok(())
    }
}
