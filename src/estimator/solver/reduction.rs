//! Householder QR of a tall data matrix by blocks of rows, in memory that does not grow with N.

use super::Instruments;
use crate::estimator::regressors::fill_rows;
use crate::estimator::{FailureKind, Window};
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::householder;
use faer::linalg::qr::no_pivoting::factor;
use faer::reborrow::ReborrowMut;
use faer::{Conj, Mat, MatMut, MatRef, Par};

/// Rows that are reduced at a time.
const BLOCK_ROWS: usize = 512;

/// Reduces `[Z | companions]`: `Z = Q R`, and `Q'` applied to the companion columns.
///
/// R and the top of the companions are carried from block to block, with the next block's rows below
/// them; Householder QR of the stack is backward stable whatever the number of blocks. A window of up
/// to 512 + n samples is one block, that is plain QR.
pub(super) struct Reduction {
    order: usize,
    /// Z's rows: 2n carried, then a block.
    z: Mat<f64>,
    /// The companions' rows; the last column belongs to y, those before it to Phi where asked for.
    companions: Mat<f64>,
    /// Householder block factors.
    factors: Mat<f64>,
    memory: MemBuffer,
}

impl Reduction {
    /// Buffers for order n and windows of N samples; with Phi's 2n columns as companions or only y.
    pub(super) fn new(order: usize, window: usize, with_phi: bool) -> Self {
        let width = 2 * order;
        let rows = width + BLOCK_ROWS.min(window - order);
        let columns = if with_phi { width + 1 } else { 1 };
        let block = factor::recommended_block_size::<f64>(rows, width);
        let qr =
            factor::qr_in_place_scratch::<f64>(rows, width, block, Par::Seq, Default::default());
        let apply =
            householder::apply_block_householder_sequence_transpose_on_the_left_in_place_scratch::<
                f64,
            >(rows, block, columns);
        Self {
            order,
            z: Mat::zeros(rows, width),
            companions: Mat::zeros(rows, columns),
            factors: Mat::zeros(block, width),
            memory: MemBuffer::new(StackReq::any_of(&[qr, apply])),
        }
    }

    /// Reduces the window; for regressors `z` holds y and u themselves.
    pub(super) fn run(
        &mut self,
        window: Window<'_>,
        z: Instruments<'_>,
    ) -> Result<(), FailureKind> {
        let (n, width) = (self.order, 2 * self.order);
        let total = window.len() - n;
        let (mut first, mut carried) = (0, 0);
        while first < total {
            let fresh = BLOCK_ROWS.min(total - first);
            let rows = carried + fresh;
            let block = self.z.get_mut(carried..rows, ..);
            fill_rows(z.output, z.input(window), n, first, block);
            let phi_columns = self.companions.ncols() - 1;
            let companions = self.companions.get_mut(carried..rows, ..);
            let (mut phi, mut y) = companions.split_at_col_mut(phi_columns);
            if phi.ncols() > 0 {
                fill_rows(window.y, window.u, n, first, phi.rb_mut());
            }
            for row in 0..fresh {
                y[(row, 0)] = window.y[n + first + row];
            }
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

    /// QR of the first `rows` rows, `Q'` applied to their companions.
    fn reduce(&mut self, rows: usize) {
        let rank = rows.min(2 * self.order);
        let stack = MemStack::new(&mut self.memory);
        let mut factors: MatMut<'_, f64> = self.factors.get_mut(.., ..rank);
        let mut z = self.z.get_mut(..rows, ..);
        factor::qr_in_place(
            z.rb_mut(),
            factors.rb_mut(),
            Par::Seq,
            stack,
            Default::default(),
        );
        householder::apply_block_householder_sequence_transpose_on_the_left_in_place_with_conj(
            z.as_ref().get(.., ..rank),
            factors.as_ref(),
            Conj::No,
            self.companions.get_mut(..rows, ..),
            Par::Seq,
            stack,
        );
    }

    /// R, 2n x 2n upper triangular.
    pub(super) fn r(&self) -> MatRef<'_, f64> {
        self.z.get(..2 * self.order, ..)
    }

    /// The first 2n rows of `Q' [companions]`: `Q'Phi` where asked for, then `Q'y`.
    pub(super) fn top(&self) -> MatRef<'_, f64> {
        self.companions.get(..2 * self.order, ..)
    }
}
