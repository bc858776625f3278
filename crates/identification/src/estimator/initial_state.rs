//! Stage 6: the initial state `x0 = argmin || y - y_u - D x0 ||`.
//!
//! Row k of D is `c'A^k`, and y_u is the zero-state response `Q u`. Both come from recursions, so neither Q nor any N x
//! N matrix is formed.
//!
//! The first n rows of D are the identity. Hence `D'D >= I`, and cond(D'D) is at most the trace of D'D. If the trace is
//! below 10^4, the normal equations are well conditioned and Cholesky is used. Otherwise A is unstable, with rows that
//! grow like the spectral radius to the power k, or has clustered poles near the unit circle. D is then factorised by
//! Householder QR with column pivoting, rows sorted by size (`sorted_qr.rs`).

use super::sorted_qr::SortedQr;
use super::{FailureKind, Window};
use crate::failure::all_finite;
use crate::plant::simulate;
use crate::real::Real;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::{Mat, MatMut, Par};

/// Once every entry of `c'A^k` of a stable A is below this, later rows change no digit of x0. Their terms are below
/// 2^-160 of `D'D >= I`, far below the rounding of earlier terms.
pub const NEGLIGIBLE: f64 = 8.271_806_125_530_277e-25; // 2^-80

/// The largest trace of D'D for which x0 is computed by Cholesky: at most four of the sixteen digits are lost.
pub const TRACE_LIMIT: f64 = 1e4;

/// Buffers for stage 6.
pub struct InitialState {
    /// `c'A^k`.
    row: Vec<f64>,
    /// State of the zero-state response.
    state: Vec<f64>,
    /// `D'D`.
    gram: Mat<f64>,
    memory: MemBuffer,
    /// Made when the first ill-conditioned model occurs.
    sorted_qr: Option<SortedQr>,
}

impl InitialState {
    /// Makes buffers for order n.
    pub fn new(order: usize) -> Self {
        let scratch = llt::factor::cholesky_in_place_scratch::<f64>(order, Par::Seq, Default::default());
        Self {
            row: vec![0.0; order],
            state: vec![0.0; order],
            gram: Mat::zeros(order, order),
            memory: MemBuffer::new(scratch),
            sorted_qr: None,
        }
    }

    /// Computes `x0` (n numbers) for the model (a, b) on the window.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if D or the zero-state response overflows, [`FailureKind::RankDeficient`] if D is
    /// rank deficient after rounding.
    ///
    /// # Panics
    /// If `a`, `b`, `x0` are not of the order that the buffers were made for.
    pub fn estimate(&mut self, a: &[f64], b: &[f64], window: Window<'_>, x0: &mut [f64]) -> Result<(), FailureKind> {
        let rows = self.relevant_rows(a, window.len());
        let window = Window::with_reference(window.u, window.y, window.r, rows);
        self.form_normal_equations(a, b, window, x0);
        let trace: f64 = (0..x0.len()).map(|i| self.gram[(i, i)]).sum();
        // An overflow makes the trace infinite or NaN. Only sorted QR can then decide whether D is finite.
        if trace <= TRACE_LIMIT {
            self.solve_normal_equations(x0)?;
        } else {
            self.by_sorted_qr(a, b, window, x0)?;
        }
        all_finite(&*x0)
    }

    fn start(&mut self) {
        self.row.fill(0.0);
        self.row[0] = 1.0;
        self.state.fill(0.0);
    }

    /// Returns how many rows of D matter, at most `rows`: those before the first row, from row n on, whose entries are
    /// all below [`NEGLIGIBLE`].
    fn relevant_rows(&mut self, a: &[f64], rows: usize) -> usize {
        self.start();
        let row = &mut self.row;
        with_fma!(|| {
            for k in 0..rows {
                if k >= row.len() && row.iter().all(|r| r.abs() < NEGLIGIBLE) {
                    return k;
                }
                next_row(a, row);
            }
            rows
        })
    }

    /// Computes `D'D`, and `D'(y - y_u)` in `rhs`.
    fn form_normal_equations(&mut self, a: &[f64], b: &[f64], window: Window<'_>, rhs: &mut [f64]) {
        let n = rhs.len();
        self.start();
        self.gram.fill(0.0);
        rhs.fill(0.0);
        match n {
            1 => return accumulate::<1>(a, b, window, rhs, &mut self.gram),
            2 => return accumulate::<2>(a, b, window, rhs, &mut self.gram),
            3 => return accumulate::<3>(a, b, window, rhs, &mut self.gram),
            4 => return accumulate::<4>(a, b, window, rhs, &mut self.gram),
            5 => return accumulate::<5>(a, b, window, rhs, &mut self.gram),
            6 => return accumulate::<6>(a, b, window, rhs, &mut self.gram),
            _ => {}
        }
        let (row, gram) = (&mut self.row, &mut self.gram);
        simulate(
            a,
            b,
            &mut self.state,
            window.u,
            #[inline(always)]
            |k, state| {
                let residual = window.y[k] - state[0];
                for j in 0..n {
                    let column = gram.col_as_slice_mut(j);
                    for i in j..n {
                        column[i] = row[i].mul_add(row[j], column[i]);
                    }
                    rhs[j] = row[j].mul_add(residual, rhs[j]);
                }
                next_row(a, row);
            },
        );
    }

    /// Overwrites the right-hand side by x0.
    fn solve_normal_equations(&mut self, x0: &mut [f64]) -> Result<(), FailureKind> {
        let stack = MemStack::new(&mut self.memory);
        let factored = llt::factor::cholesky_in_place(
            self.gram.as_mut(),
            Default::default(),
            Par::Seq,
            stack,
            Default::default(),
        );
        factored.map_err(|_| FailureKind::RankDeficient)?;
        let n = x0.len();
        let rhs = MatMut::from_column_major_slice_mut(x0, n, 1);
        llt::solve::solve_in_place(self.gram.as_ref(), rhs, Par::Seq, stack);
        Ok(())
    }

    fn by_sorted_qr(&mut self, a: &[f64], b: &[f64], window: Window<'_>, x0: &mut [f64]) -> Result<(), FailureKind> {
        self.start();
        let problem = self.sorted_qr.get_or_insert_with(|| SortedQr::new(x0.len()));
        problem.begin(window.len());
        let row = &mut self.row;
        with_fma!(|| {
            for k in 0..window.len() {
                problem.announce(k, row);
                next_row(a, row);
            }
        });
        problem.sort();
        row.fill(0.0);
        row[0] = 1.0;
        simulate(a, b, &mut self.state, window.u, |k, state| {
            problem.set(k, row, window.y[k] - state[0]);
            next_row(a, row);
        });
        problem.solve(x0)
    }
}

/// Does [`InitialState::form_normal_equations`] for a constant order: the sums stay in registers.
fn accumulate<const N: usize>(a: &[f64], b: &[f64], window: Window<'_>, rhs: &mut [f64], gram: &mut Mat<f64>) {
    let (mut a_hat, mut row) = ([0.0; N], [0.0; N]);
    a_hat.copy_from_slice(a);
    row[0] = 1.0;
    let (mut sums, mut right, mut state) = ([[0.0; N]; N], [0.0; N], [0.0; N]);
    let y = &window.y[..window.u.len()];
    simulate(
        a,
        b,
        &mut state,
        window.u,
        #[inline(always)]
        |k, state| {
            let residual = y[k] - state[0];
            for j in 0..N {
                for i in j..N {
                    sums[j][i] = row[i].mul_add(row[j], sums[j][i]);
                }
                right[j] = row[j].mul_add(residual, right[j]);
            }
            next_row(&a_hat, &mut row);
        },
    );
    for (j, sums) in sums.iter().enumerate() {
        gram.col_as_slice_mut(j)[j..].copy_from_slice(&sums[j..]);
    }
    rhs.copy_from_slice(&right);
}

/// Computes `r <- r A`: `r_1 <- r_n a_1`, `r_i <- r_(i-1) + r_n a_i`.
#[inline(always)]
pub fn next_row<R: Real>(a: &[R], row: &mut [R]) {
    let n = row.len();
    let last = row[n - 1];
    for i in (1..n).rev() {
        row[i] = last.mul_add(a[i], row[i - 1]);
    }
    row[0] = last * a[0];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Purpose, fill_white, stream};

    /// det(D'D) is never zero for c = e_1 and a companion A, stable or not, for any N >= n: the first n rows of D are
    /// the identity, so `D'D - I` is a sum of squares, and the eigenvalues of D'D are at least 1.
    #[test]
    fn the_determinant_of_stage_6_is_at_least_one() {
        let mut numbers = stream(1, 0, Purpose::Input);
        for (order, window) in [(1, 1), (1, 9), (2, 2), (3, 10), (6, 6), (6, 18), (6, 30)] {
            let signal = vec![0.0; window];
            for scale in [0.0, 0.1, 0.3, 1.5] {
                let mut a = vec![0.0; order];
                if scale > 0.0 {
                    fill_white(&mut numbers, scale, &mut a);
                }
                let mut problem = InitialState::new(order);
                problem.start();
                for k in 0..order {
                    let identity: Vec<f64> = (0..order).map(|i| f64::from(u8::from(i == k))).collect();
                    assert_eq!(problem.row, identity);
                    next_row(&a, &mut problem.row);
                }
                let window = Window::new(&signal, &signal, window);
                problem.form_normal_equations(&a, &vec![0.0; order], window, &mut vec![0.0; order]);
                let gram = Mat::from_fn(order, order, |i, j| problem.gram[(i.max(j), i.min(j))]);
                let eigenvalues = gram.self_adjoint_eigenvalues(faer::Side::Lower).unwrap();
                let largest = eigenvalues.iter().fold(1.0_f64, |most, e| most.max(*e));
                let rounding = order as f64 * f64::EPSILON * largest;
                assert!(scale > 1.0 || rounding < 1e-9, "the check says nothing");
                assert!(
                    eigenvalues.iter().all(|e| *e >= 1.0 - rounding),
                    "n {order}, a {a:?}: {eigenvalues:?}"
                );
            }
        }
    }
}
