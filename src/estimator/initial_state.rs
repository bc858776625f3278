//! Stage 6: the initial state `x0 = argmin || y - y_u - D x0 ||`.
//!
//! Row k of D is `c'A^k` and y_u is the zero-state response `Q u`; both come from recursions, so
//! neither Q nor any N x N matrix is formed. The first n rows of D are the identity, hence `D'D >= I`:
//! for a stable A the normal equations are well conditioned and Cholesky serves. For an unstable A the
//! rows grow like the spectral radius to the power k and `D'D` loses everything; there D is
//! factorised by Householder QR with column pivoting, rows sorted by size (`sorted_qr.rs`).

use super::sorted_qr::SortedQr;
use super::{FailureKind, Window};
use crate::plant::simulate;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::{Mat, MatMut, Par};

/// Once every entry of `c'A^k` of a stable A is below this, later rows change no digit of x0: their
/// terms are below 2^-160 of `D'D >= I`, and far below the rounding of the terms before them.
const NEGLIGIBLE: f64 = 8.271_806_125_530_277e-25; // 2^-80

/// Buffers for stage 6.
pub struct InitialState {
    /// `c'A^k`.
    row: Vec<f64>,
    /// State of the zero-state response.
    state: Vec<f64>,
    /// `D'D`.
    gram: Mat<f64>,
    memory: MemBuffer,
    /// Made when the first unstable model is met.
    sorted_qr: Option<SortedQr>,
}

impl InitialState {
    /// Buffers for order n.
    pub fn new(order: usize) -> Self {
        let scratch =
            llt::factor::cholesky_in_place_scratch::<f64>(order, Par::Seq, Default::default());
        Self {
            row: vec![0.0; order],
            state: vec![0.0; order],
            gram: Mat::zeros(order, order),
            memory: MemBuffer::new(scratch),
            sorted_qr: None,
        }
    }

    /// Fills `x0` (n) for the model (a, b) on the window.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] where D or the zero-state response overflows.
    ///
    /// # Panics
    /// If `a`, `b`, `x0` are not of the order that the buffers were made for.
    pub fn estimate(
        &mut self,
        a: &[f64],
        b: &[f64],
        unstable: bool,
        window: Window<'_>,
        x0: &mut [f64],
    ) -> Result<(), FailureKind> {
        if unstable {
            self.by_sorted_qr(a, b, window, x0)?;
        } else {
            self.by_normal_equations(a, b, window, x0)?;
        }
        if x0.iter().all(|x| x.is_finite()) {
            Ok(())
        } else {
            Err(FailureKind::NonFinite)
        }
    }

    fn start(&mut self) {
        self.row.fill(0.0);
        self.row[0] = 1.0;
        self.state.fill(0.0);
    }

    fn by_normal_equations(
        &mut self,
        a: &[f64],
        b: &[f64],
        window: Window<'_>,
        x0: &mut [f64],
    ) -> Result<(), FailureKind> {
        let n = x0.len();
        self.start();
        self.gram.fill(0.0);
        x0.fill(0.0);
        let rows = relevant_rows(a, &mut self.row, window.len());
        self.start();
        let (row, gram) = (&mut self.row, &mut self.gram);
        simulate(
            a,
            b,
            &mut self.state,
            &window.u[..rows],
            #[inline(always)]
            |k, state| {
                let residual = window.y[k] - state[0];
                for j in 0..n {
                    let column = gram.col_as_slice_mut(j);
                    for i in j..n {
                        column[i] = row[i].mul_add(row[j], column[i]);
                    }
                    x0[j] = row[j].mul_add(residual, x0[j]);
                }
                next_row(a, row);
            },
        );
        if !(self.gram.as_ref().norm_max().is_finite() && x0.iter().all(|x| x.is_finite())) {
            return Err(FailureKind::NonFinite);
        }
        let stack = MemStack::new(&mut self.memory);
        let gram = self.gram.as_mut();
        llt::factor::cholesky_in_place(
            gram,
            Default::default(),
            Par::Seq,
            stack,
            Default::default(),
        )
        .map_err(|_| FailureKind::Singular)?;
        let rhs = MatMut::from_column_major_slice_mut(x0, n, 1);
        llt::solve::solve_in_place(self.gram.as_ref(), rhs, Par::Seq, stack);
        Ok(())
    }

    fn by_sorted_qr(
        &mut self,
        a: &[f64],
        b: &[f64],
        window: Window<'_>,
        x0: &mut [f64],
    ) -> Result<(), FailureKind> {
        self.start();
        let (n, rows) = (x0.len(), window.len());
        let problem = self.sorted_qr.get_or_insert_with(|| SortedQr::new(rows, n));
        problem.clear();
        let row = &mut self.row;
        simulate(
            a,
            b,
            &mut self.state,
            window.u,
            #[inline(always)]
            |k, state| {
                problem.push(row, window.y[k] - state[0]);
                next_row(a, row);
            },
        );
        problem.solve(x0)
    }
}

/// `r <- r A`: `r_1 <- r_n a_1`, `r_i <- r_(i-1) + r_n a_i`.
#[inline(always)]
fn next_row(a: &[f64], row: &mut [f64]) {
    let n = row.len();
    let last = row[n - 1];
    for i in (1..n).rev() {
        row[i] = last.mul_add(a[i], row[i - 1]);
    }
    row[0] = last * a[0];
}

/// How many rows of D, at least n and at most `rows`, are above [`NEGLIGIBLE`].
fn relevant_rows(a: &[f64], row: &mut [f64], rows: usize) -> usize {
    crate::signal::arithmetic::with_fma(
        #[inline(always)]
        || {
            for k in 0..rows {
                if k >= row.len() && row.iter().all(|r| r.abs() < NEGLIGIBLE) {
                    return k;
                }
                next_row(a, row);
            }
            rows
        },
    )
}
