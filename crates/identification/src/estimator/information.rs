//! The information blocks of stages 2 and 9, `G = Z'Phi` and `Z'y`, by a shift recurrence.
//!
//! With `S(i, j) = sum_(k=n)^(N-1) z(k-1-i) w(k-1-j)` for signals z and w,
//!
//! `S(i+1, j+1) = S(i, j) + z(n-2-i) w(n-2-j) - z(N-2-i) w(N-2-j)`,
//!
//! Hence one row and one column of lag sums make an n x n block, in O(N n) operations instead of O(N n^2). `Z'y` is the
//! column j = -1 of a block against y, and yields the first column of that block too.

use super::regressors::fill_rows;
use super::{Instruments, Window};
use crate::signal::arithmetic::dot;
use faer::linalg::matmul::matmul;
use faer::reborrow::ReborrowMut;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// `G = Z'Phi` (2n x 2n, blocks G11, G12, G21, G22) and `r = Z'y` (2n).
pub struct Information {
    order: usize,
    matrix: Mat<f64>,
    rhs: Vec<f64>,
}

/// Returns `S(i, j)`; `column` is j + 1, so that 0 stands for w(k) itself.
#[inline(always)]
fn lag_sum(z: &[f64], w: &[f64], order: usize, i: usize, column: usize) -> f64 {
    let length = z.len() - order;
    let (z_from, w_from) = (order - 1 - i, order - column);
    dot(&z[z_from..z_from + length], &w[w_from..w_from + length])
}

/// Returns `sign S(i+1, j+1)` by the recurrence, given `sum = sign S(i, j)`; `column` is j + 1.
#[inline(always)]
fn shift(z: &[f64], w: &[f64], order: usize, i: usize, column: usize, sign: f64, sum: f64) -> f64 {
    let last = z.len() - 1;
    let entering = (sign * z[order - 2 - i]).mul_add(w[order - 1 - column], sum);
    (-sign * z[last - 1 - i]).mul_add(w[last - column], entering)
}

/// Fills `block[1.., 1..]` from its first row and first column.
#[inline(always)]
fn extend(mut block: MatMut<'_, f64>, z: &[f64], w: &[f64], sign: f64) {
    let order = block.nrows();
    for j in 0..order - 1 {
        for i in 0..order - 1 {
            block[(i + 1, j + 1)] = shift(z, w, order, i, j + 1, sign, block[(i, j)]);
        }
    }
}

/// Fills a block `sign * z'W` and `rhs_i = S(i, -1)`, if `w` is also the signal of the right-hand side.
#[inline(always)]
fn block_with_rhs(mut block: MatMut<'_, f64>, rhs: &mut [f64], z: &[f64], w: &[f64], sign: f64) {
    let order = rhs.len();
    for i in 0..order {
        rhs[i] = lag_sum(z, w, order, i, 0);
        block[(0, i)] = sign * lag_sum(z, w, order, 0, i + 1);
    }
    for i in 0..order - 1 {
        block[(i + 1, 0)] = shift(z, w, order, i, 0, sign, sign * rhs[i]);
    }
    extend(block, z, w, sign);
}

/// Fills a block `sign * z'W`.
#[inline(always)]
fn block(mut block: MatMut<'_, f64>, z: &[f64], w: &[f64], sign: f64) {
    let order = block.nrows();
    block[(0, 0)] = sign * lag_sum(z, w, order, 0, 1);
    for i in 1..order {
        block[(0, i)] = sign * lag_sum(z, w, order, 0, i + 1);
        block[(i, 0)] = sign * lag_sum(z, w, order, i, 1);
    }
    extend(block, z, w, sign);
}

impl Information {
    /// Makes buffers for order n.
    pub fn new(order: usize) -> Self {
        Self {
            order,
            matrix: Mat::zeros(2 * order, 2 * order),
            rhs: vec![0.0; 2 * order],
        }
    }

    /// Returns G, 2n x 2n.
    pub fn matrix(&self) -> MatRef<'_, f64> {
        self.matrix.as_ref()
    }

    /// Returns the right-hand side, 2n.
    pub fn rhs(&self) -> &[f64] {
        &self.rhs
    }

    /// Computes stage 2: `G = Phi'Phi`, `r = Phi'y`, in 4n + 1 lag sums.
    ///
    /// # Panics
    /// If the window is shorter than n + 1.
    pub fn least_squares(&mut self, window: Window<'_>) {
        let n = self.order;
        let (u, y) = (window.u, window.y);
        let (rhs1, rhs2) = self.rhs.split_at_mut(n);
        let (mut g11, mut g12, mut g21, mut g22) = self.matrix.as_mut().split_at_mut(n, n);
        with_fma!(|| {
            // G11 = Y'Y and Y'y; the signs of Y cancel in G11.
            block_symmetric_with_rhs(g11.rb_mut(), rhs1, y);
            // G21 = U'Y and U'y.
            block_with_rhs(g21.rb_mut(), rhs2, u, y, -1.0);
            // G22 = U'U.
            for j in 0..n {
                g22[(0, j)] = lag_sum(u, u, n, 0, j + 1);
                g22[(j, 0)] = g22[(0, j)];
            }
            extend(g22.rb_mut(), u, u, 1.0);
        });
        g12.copy_from(g21.transpose());
    }

    /// Computes stage 9: `G = Z'Phi`, `r = Z'y` with yhat instead of y in the instruments. This changes G11, G12 and
    /// the first half of r. If u itself stays in Z, the rest remains from the last [`Self::least_squares`] on this
    /// window. If another signal replaces u, G21, G22 and the second half of r change too.
    ///
    /// # Panics
    /// If an instrument is not as long as the window.
    pub fn instruments(&mut self, window: Window<'_>, instruments: Instruments<'_>) {
        let yhat = instruments.output;
        assert_eq!(yhat.len(), window.len());
        let n = self.order;
        let (rhs1, rhs2) = self.rhs.split_at_mut(n);
        let (g11, g12, g21, g22) = self.matrix.as_mut().split_at_mut(n, n);
        with_fma!(|| {
            block_with_rhs(g11, rhs1, yhat, window.y, 1.0);
            for r in rhs1 {
                *r = -*r;
            }
            block(g12, yhat, window.u, -1.0);
        });
        if let Some(input) = instruments.input {
            assert_eq!(input.len(), window.len());
            with_fma!(|| {
                block_with_rhs(g21, rhs2, input, window.y, -1.0);
                block(g22, input, window.u, 1.0);
            });
        }
    }

    /// Computes the same blocks by the plain product of the data matrices, to check and time the recurrence. For stage
    /// 2 the instruments are y and u themselves.
    ///
    /// # Panics
    /// If an instrument is not as long as the window.
    pub fn by_product(&mut self, window: Window<'_>, instruments: Instruments<'_>) {
        let rows = window.len() - self.order;
        let mut phi = Mat::zeros(rows, 2 * self.order);
        let mut z = Mat::zeros(rows, 2 * self.order);
        fill_rows(window.y, window.u, self.order, 0, phi.as_mut());
        let (output, input) = (instruments.output, instruments.input(window));
        fill_rows(output, input, self.order, 0, z.as_mut());
        let product = Accum::Replace;
        matmul(self.matrix.as_mut(), product, z.transpose(), &phi, 1.0, Par::Seq);
        for (i, r) in self.rhs.iter_mut().enumerate() {
            let y = window.y[self.order..].iter();
            *r = z.col(i).iter().zip(y).map(|(z, y)| z * y).sum();
        }
    }
}

/// Fills the symmetric block `Y'Y` and `rhs = Y'y`, Y with entries -y.
#[inline(always)]
fn block_symmetric_with_rhs(mut block: MatMut<'_, f64>, rhs: &mut [f64], y: &[f64]) {
    let n = rhs.len();
    for (i, r) in rhs.iter_mut().enumerate() {
        *r = -lag_sum(y, y, n, i, 0);
    }
    block[(0, 0)] = lag_sum(y, y, n, 0, 1);
    for i in 1..n {
        block[(i, 0)] = shift(y, y, n, i - 1, 0, 1.0, -rhs[i - 1]);
        block[(0, i)] = block[(i, 0)];
    }
    extend(block, y, y, 1.0);
}
