//! Least squares with rows of widely different size: Householder QR with column pivoting, rows
//! sorted by size, which is backward stable row by row (Powell and Reid 1969; Cox and Higham 1998).

use super::FailureKind;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::householder;
use faer::linalg::qr::col_pivoting::factor;
use faer::linalg::qr::no_pivoting::factor::recommended_block_size;
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::{Conj, Mat, Par};

/// Buffers for problems of one size.
pub(super) struct SortedQr {
    /// The rows as given, one after the other.
    rows: Vec<f64>,
    /// The right-hand side as given.
    rhs: Vec<f64>,
    /// Largest entries of the rows.
    sizes: Vec<f64>,
    order: Vec<u32>,
    sorted: Mat<f64>,
    sorted_rhs: Mat<f64>,
    factors: Mat<f64>,
    permutation: Vec<usize>,
    permutation_inverse: Vec<usize>,
    memory: MemBuffer,
}

impl SortedQr {
    /// Buffers for `rows` >= `columns`.
    pub(super) fn new(rows: usize, columns: usize) -> Self {
        let block = recommended_block_size::<f64>(rows, columns);
        let qr = factor::qr_in_place_scratch::<usize, f64>(
            rows,
            columns,
            block,
            Par::Seq,
            Default::default(),
        );
        let apply =
            householder::apply_block_householder_sequence_transpose_on_the_left_in_place_scratch::<
                f64,
            >(rows, block, 1);
        Self {
            rows: Vec::with_capacity(rows * columns),
            rhs: Vec::with_capacity(rows),
            sizes: Vec::with_capacity(rows),
            order: (0..rows as u32).collect(),
            sorted: Mat::zeros(rows, columns),
            sorted_rhs: Mat::zeros(rows, 1),
            factors: Mat::zeros(block, columns),
            permutation: vec![0; columns],
            permutation_inverse: vec![0; columns],
            memory: MemBuffer::new(StackReq::any_of(&[qr, apply])),
        }
    }

    /// Forgets the rows.
    pub(super) fn clear(&mut self) {
        self.rows.clear();
        self.rhs.clear();
        self.sizes.clear();
    }

    /// Adds a row and its right-hand side.
    pub(super) fn push(&mut self, row: &[f64], rhs: f64) {
        self.rows.extend_from_slice(row);
        self.rhs.push(rhs);
        self.sizes
            .push(row.iter().fold(0.0, |size, r| r.abs().max(size)));
    }

    /// Fills `x = argmin || rows x - rhs ||`.
    pub(super) fn solve(&mut self, x: &mut [f64]) -> Result<(), FailureKind> {
        if !self.rows.iter().chain(&self.rhs).all(|v| v.is_finite()) {
            return Err(FailureKind::NonFinite);
        }
        self.sort();
        let stack = MemStack::new(&mut self.memory);
        let (_, permutation) = factor::qr_in_place(
            self.sorted.as_mut(),
            self.factors.as_mut(),
            &mut self.permutation,
            &mut self.permutation_inverse,
            Par::Seq,
            stack,
            Default::default(),
        );
        let n = x.len();
        if (0..n).any(|i| self.sorted[(i, i)] == 0.0) {
            return Err(FailureKind::Singular);
        }
        householder::apply_block_householder_sequence_transpose_on_the_left_in_place_with_conj(
            self.sorted.as_ref(),
            self.factors.as_ref(),
            Conj::No,
            self.sorted_rhs.as_mut(),
            Par::Seq,
            stack,
        );
        let top = self.sorted_rhs.get_mut(..n, ..);
        solve_upper_triangular_in_place(self.sorted.get(..n, ..), top, Par::Seq);
        let (forward, _) = permutation.arrays();
        for (i, &column) in forward.iter().enumerate() {
            x[column] = self.sorted_rhs[(i, 0)];
        }
        Ok(())
    }

    /// Copies the rows in descending order of size; equal ones keep their order.
    fn sort(&mut self) {
        let columns = self.sorted.ncols();
        for (position, k) in self.order.iter_mut().enumerate() {
            *k = position as u32;
        }
        let sizes = &self.sizes;
        self.order.sort_unstable_by(|&i, &j| {
            let descending = sizes[j as usize].total_cmp(&sizes[i as usize]);
            descending.then(i.cmp(&j))
        });
        for (position, &k) in self.order.iter().enumerate() {
            let k = k as usize;
            for j in 0..columns {
                self.sorted[(position, j)] = self.rows[k * columns + j];
            }
            self.sorted_rhs[(position, 0)] = self.rhs[k];
        }
    }
}
