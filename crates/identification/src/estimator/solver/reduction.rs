//! Householder QR of a tall data matrix by blocks of rows, in memory independent of N.

use crate::estimator::FailureKind;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::householder;
use faer::linalg::qr::no_pivoting::factor;
use faer::reborrow::ReborrowMut;
use faer::{Conj, Mat, MatMut, MatRef, Par};

/// Number of rows that are reduced at a time.
const BLOCK_ROWS: usize = 512;

/// Reduces `[Z | companions]`: `Z = Q R`, and `Q'` applied to the companion columns.
///
/// R and the top of the companions are carried from block to block, with the rows of the next block below them.
/// Householder QR of the stack is backward stable for any number of blocks. Up to 512 rows form one block, which is
/// plain QR.
pub(crate) struct Reduction {
    /// Rows of Z: first as many carried rows as it has columns, then a block.
    z: Mat<f64>,
    /// The corresponding rows of the companions.
    companions: Mat<f64>,
    /// Householder block factors.
    factors: Mat<f64>,
    memory: MemBuffer,
}

/// Returns a column of the rows that [`Reduction::run`] asks for.
pub(crate) fn column<'a>(z: &'a mut MatMut<'_, f64>, j: usize) -> &'a mut [f64] {
    let column = z.rb_mut().col_mut(j).try_as_col_major_mut();
    column.expect("columns are contiguous").as_slice_mut()
}

impl Reduction {
    /// Makes buffers for `rows` rows of Z with `width` columns, and `companions` companion columns.
    pub(crate) fn new(width: usize, rows: usize, companions: usize) -> Self {
        let rows = width + BLOCK_ROWS.min(rows);
        let block = factor::recommended_block_size::<f64>(rows, width);
        let qr = factor::qr_in_place_scratch::<f64>(rows, width, block, Par::Seq, Default::default());
        let apply = householder::apply_block_householder_sequence_transpose_on_the_left_in_place_scratch::<f64>(
            rows, block, companions,
        );
        Self {
            z: Mat::zeros(rows, width),
            companions: Mat::zeros(rows, companions),
            factors: Mat::zeros(block, width),
            memory: MemBuffer::new(StackReq::any_of(&[qr, apply])),
        }
    }

    /// Reduces `total` rows; `fill(first, z, companions)` writes the rows from `first` on.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if an entry overflows.
    pub(crate) fn run(
        &mut self,
        total: usize,
        mut fill: impl FnMut(usize, MatMut<'_, f64>, MatMut<'_, f64>),
    ) -> Result<(), FailureKind> {
        let width = self.z.ncols();
        let (mut first, mut carried) = (0, 0);
        while first < total {
            let fresh = BLOCK_ROWS.min(total - first);
            let rows = carried + fresh;
            let block = self.z.get_mut(carried..rows, ..);
            fill(first, block, self.companions.get_mut(carried..rows, ..));
            self.reduce(rows);
            carried = rows.min(width);
            for j in 0..width {
                self.z.get_mut(j + 1..carried.max(j + 1), j).fill(0.0);
            }
            first += fresh;
        }
        if self.r().norm_max().is_finite() && self.top().norm_max().is_finite() {
            Ok(())
        } else {
            Err(FailureKind::NonFinite)
        }
    }

    /// Computes QR of the first `rows` rows and applies `Q'` to their companions.
    fn reduce(&mut self, rows: usize) {
        let rank = rows.min(self.z.ncols());
        let stack = MemStack::new(&mut self.memory);
        let mut factors: MatMut<'_, f64> = self.factors.get_mut(.., ..rank);
        let mut z = self.z.get_mut(..rows, ..);
        factor::qr_in_place(z.rb_mut(), factors.rb_mut(), Par::Seq, stack, Default::default());
        householder::apply_block_householder_sequence_transpose_on_the_left_in_place_with_conj(
            z.as_ref().get(.., ..rank),
            factors.as_ref(),
            Conj::No,
            self.companions.get_mut(..rows, ..),
            Par::Seq,
            stack,
        );
    }

    /// Returns R, square and upper triangular.
    pub(crate) fn r(&self) -> MatRef<'_, f64> {
        self.z.get(..self.z.ncols(), ..)
    }

    /// Returns the top rows of `Q' [companions]`, as many as R has.
    pub(crate) fn top(&self) -> MatRef<'_, f64> {
        self.companions.get(..self.z.ncols(), ..)
    }
}
