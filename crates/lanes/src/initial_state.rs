//! Stage 6 in lock step: [`asobench_identification::estimator::initial_state`] by the normal equations. Lanes with
//! ill-conditioned normal equations are solved again by sorted QR, one by one.
//!
//! Rows of D are `r(k) = c'A^k`. With K rows, `M = D'D` obeys Stein's equation `M = A'MA + c c' - r(K)'r(K)`. A is a
//! companion matrix, so the last column of M, n sums over k, yields all others:
//! `M_ij = M_(i-1)(j-1) + a_j M_(i-1)n + a_i M_(j-1)n + a_i a_j M_nn - r_i(K) r_j(K)`, plus 1 for `M_11`.

use super::{Square, lane as lane_of, order, sorted_qr};
use asobench_identification::estimator::FailureKind;
use asobench_identification::estimator::initial_state::{NEGLIGIBLE, TRACE_LIMIT, next_row};
use asobench_identification::real::{Mask, Real};

/// Number of rows of D between two checks for lanes whose rows have become negligible.
const LOOK: usize = 32;

/// Advances `B(q)/A(q)` by one step in transposed direct form; it starts at rest and its output is `state[0]`.
#[inline(always)]
fn step<R: Real>(a: &[R], h: &[R], state: &mut [R], u: R) {
    let n = state.len();
    let y = state[0];
    for i in 0..n - 1 {
        state[i] = a[n - 1 - i].mul_add(y, h[i].mul_add(u, state[i + 1]));
    }
    state[n - 1] = a[0].mul_add(y, h[n - 1] * u);
}

/// Computes x0 of all lanes. The mask holds the lanes whose numbers must not be used; see [`solve_alone`].
#[inline(always)]
pub(crate) fn solve<R: Real, const N: usize>(n: usize, a: &[R; N], h: &[R; N], u: &[R], y: &[R]) -> ([R; N], R::Mask) {
    let n = order::<N>(n);
    let zero = [R::zero(); N];
    let (mut last_column, mut rhs, mut state) = (zero, zero, zero);
    let mut row = zero;
    row[0] = R::splat(1.0);
    let (mut k, samples) = (0, u.len());
    let y = &y[..samples];
    while k < samples {
        let end = samples.min(k + LOOK);
        for k in k..end {
            let residual = y[k] - state[0];
            let last = row[n - 1];
            for i in 0..n {
                last_column[i] = row[i].mul_add(last, last_column[i]);
                rhs[i] = row[i].mul_add(residual, rhs[i]);
            }
            step(&a[..n], &h[..n], &mut state[..n], u[k]);
            next_row(&a[..n], &mut row[..n]);
        }
        k = end;
        if k >= n {
            // A lane's rows are taken as zero from the same k on, whatever its neighbours do.
            let mut largest = R::zero();
            for i in 0..n {
                largest = largest.maximum(row[i].abs());
            }
            let negligible = largest.less(R::splat(NEGLIGIBLE));
            for i in 0..n {
                row[i] = R::select(negligible, R::zero(), row[i]);
            }
            if !(!negligible).any() {
                break;
            }
        }
    }
    let mut gram = [zero; N];
    form_gram(n, a, &last_column, &row, &mut gram);
    let mut trace = R::zero();
    for i in 0..n {
        trace = trace + gram[i][i];
    }
    let x0 = solve_definite(n, &mut gram, rhs);
    let mut check = R::zero();
    for i in 0..n {
        check = x0[i].mul_add(R::zero(), check);
    }
    (x0, !(trace.at_most(R::splat(TRACE_LIMIT)) & check.is_finite()))
}

/// Computes the lower triangle of `D'D` from its last column and from the row after the last row of D.
#[inline(always)]
fn form_gram<R: Real, const N: usize>(
    n: usize,
    a: &[R; N],
    last_column: &[R; N],
    end: &[R; N],
    gram: &mut Square<R, N>,
) {
    let corner = last_column[n - 1];
    // Row and column 0 have no predecessors.
    gram[0][0] = a[0] * a[0] * corner + R::splat(1.0) - end[0] * end[0];
    for i in 1..n - 1 {
        // a_i M_nn + M_(i-1)n, which is multiplied by a_j.
        let by_column = a[i].mul_add(corner, last_column[i - 1]);
        gram[i][0] = a[0].mul_add(by_column, -(end[i] * end[0]));
        for j in 1..=i {
            let sum = a[j].mul_add(by_column, gram[i - 1][j - 1]);
            let sum = a[i].mul_add(last_column[j - 1], sum);
            gram[i][j] = end[i].neg_mul_add(end[j], sum);
        }
    }
    gram[n - 1] = *last_column;
}

/// Solves `gram x = rhs` by `L D L'`, using the lower triangle of a positive definite matrix.
#[inline(always)]
fn solve_definite<R: Real, const N: usize>(n: usize, gram: &mut Square<R, N>, mut x: [R; N]) -> [R; N] {
    let one = R::splat(1.0);
    let mut inverse = [one; N];
    for k in 0..n {
        inverse[k] = one / gram[k][k];
        for i in k + 1..n {
            let factor = gram[i][k] * inverse[k];
            for j in k + 1..=i {
                gram[i][j] = factor.neg_mul_add(gram[j][k], gram[i][j]);
            }
            x[i] = factor.neg_mul_add(x[k], x[i]);
        }
    }
    for i in (0..n).rev() {
        for j in i + 1..n {
            x[i] = gram[j][i].neg_mul_add(x[j], x[i]);
        }
        x[i] = x[i] * inverse[i];
    }
    x
}

/// Computes x0 of one lane, backward stable row by row. `rows` is scratch memory, which grows to the window.
pub(crate) fn solve_alone<R: Real, const N: usize>(
    n: usize,
    a: &[R; N],
    h: &[R; N],
    u: &[R],
    y: &[R],
    lane: usize,
    rows: &mut Vec<([f64; N], f64)>,
) -> Result<[f64; N], FailureKind> {
    let (a, h) = (lane_of(a, lane), lane_of(h, lane));
    rows.clear();
    let (mut row, mut state) = ([0.0; N], [0.0; N]);
    row[0] = 1.0;
    f64::run(
        #[inline(always)]
        || {
            for (u, y) in u.iter().zip(y) {
                rows.push((row, y.lane(lane) - state[0]));
                step(&a[..n], &h[..n], &mut state[..n], u.lane(lane));
                next_row(&a[..n], &mut row[..n]);
            }
        },
    );
    sorted_qr::solve(n, rows)
}
