//! Least squares with rows of widely different size, by Householder QR with column pivoting and rows sorted by size.
//! This is backward stable row by row (Powell and Reid 1969; Cox and Higham 1998).

use super::FailureKind;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::householder;
use faer::linalg::qr::col_pivoting::factor;
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::reborrow::ReborrowMut;
use faer::{Conj, Mat, Par};

/// Columns that are factorised together. The number is fixed, so that the result does not depend on earlier problems in
/// the same buffers.
const BLOCK: usize = 8;

/// Buffers for problems with any number of rows; they grow to the largest one so far.
///
/// Each row is passed twice: first its size ([`Self::announce`]), then, after [`Self::sort`], its entries
/// ([`Self::set`]), which are written directly to their place.
pub(super) struct SortedQr {
    rows: usize,
    /// Whether every entry so far is finite.
    finite: bool,
    /// The largest entry of each row, in the given order.
    sizes: Vec<f64>,
    /// Indices of the given rows, in descending order of size.
    order: Vec<u32>,
    /// The sorted place of each given row.
    places: Vec<u32>,
    sorted: Mat<f64>,
    rhs: Mat<f64>,
    factors: Mat<f64>,
    permutation: Vec<usize>,
    permutation_inverse: Vec<usize>,
    memory: MemBuffer,
}

impl SortedQr {
    /// Makes buffers for rows of `columns` entries.
    pub(super) fn new(columns: usize) -> Self {
        Self {
            rows: 0,
            finite: true,
            sizes: Vec::new(),
            order: Vec::new(),
            places: Vec::new(),
            sorted: Mat::zeros(0, columns),
            rhs: Mat::zeros(0, 1),
            factors: Mat::zeros(BLOCK.min(columns), columns),
            permutation: vec![0; columns],
            permutation_inverse: vec![0; columns],
            memory: MemBuffer::new(StackReq::EMPTY),
        }
    }

    /// Begins a problem of `rows` rows; there must be at least as many as columns.
    pub(super) fn begin(&mut self, rows: usize) {
        self.rows = rows;
        self.finite = true;
        self.sizes.resize(rows, 0.0);
        self.order.resize(rows, 0);
        self.places.resize(rows, 0);
        if self.sorted.nrows() < rows {
            self.grow(rows);
        }
    }

    fn grow(&mut self, rows: usize) {
        let columns = self.sorted.ncols();
        let block = self.factors.nrows();
        let qr = factor::qr_in_place_scratch::<usize, f64>(rows, columns, block, Par::Seq, Default::default());
        let apply =
            householder::apply_block_householder_sequence_transpose_on_the_left_in_place_scratch::<f64>(rows, block, 1);
        self.sorted = Mat::zeros(rows, columns);
        self.rhs = Mat::zeros(rows, 1);
        self.memory = MemBuffer::new(StackReq::any_of(&[qr, apply]));
    }

    /// Announces the size of row k.
    pub(super) fn announce(&mut self, k: usize, row: &[f64]) {
        self.sizes[k] = row.iter().fold(0.0, |size, r| r.abs().max(size));
    }

    /// Computes the place of every row: descending order of size; equal ones keep their order.
    pub(super) fn sort(&mut self) {
        for (k, order) in self.order.iter_mut().enumerate() {
            *order = k as u32;
        }
        let sizes = &self.sizes;
        self.order.sort_unstable_by(|&i, &j| {
            let descending = sizes[j as usize].total_cmp(&sizes[i as usize]);
            descending.then(i.cmp(&j))
        });
        for (place, &k) in self.order.iter().enumerate() {
            self.places[k as usize] = place as u32;
        }
    }

    /// Sets row k and its right-hand side.
    pub(super) fn set(&mut self, k: usize, row: &[f64], rhs: f64) {
        let place = self.places[k] as usize;
        for (j, r) in row.iter().enumerate() {
            self.sorted[(place, j)] = *r;
        }
        self.rhs[(place, 0)] = rhs;
        self.finite &= rhs.is_finite() && row.iter().all(|r| r.is_finite());
    }

    /// Computes `x = argmin || rows x - rhs ||`.
    pub(super) fn solve(&mut self, x: &mut [f64]) -> Result<(), FailureKind> {
        let mut sorted = self.sorted.get_mut(..self.rows, ..);
        let mut rhs = self.rhs.get_mut(..self.rows, ..);
        if !self.finite {
            return Err(FailureKind::NonFinite);
        }
        let stack = MemStack::new(&mut self.memory);
        let (_, permutation) = factor::qr_in_place(
            sorted.rb_mut(),
            self.factors.as_mut(),
            &mut self.permutation,
            &mut self.permutation_inverse,
            Par::Seq,
            stack,
            Default::default(),
        );
        let n = x.len();
        if (0..n).any(|i| sorted[(i, i)] == 0.0) {
            return Err(FailureKind::RankDeficient);
        }
        householder::apply_block_householder_sequence_transpose_on_the_left_in_place_with_conj(
            sorted.as_ref(),
            self.factors.as_ref(),
            Conj::No,
            rhs.rb_mut(),
            Par::Seq,
            stack,
        );
        let top = rhs.rb_mut().get_mut(..n, ..);
        solve_upper_triangular_in_place(sorted.as_ref().get(..n, ..), top, Par::Seq);
        let (forward, _) = permutation.arrays();
        for (i, &column) in forward.iter().enumerate() {
            x[column] = rhs[(i, 0)];
        }
        Ok(())
    }
}
