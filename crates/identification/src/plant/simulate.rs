//! Simulation of the canonical plant.

use crate::real::Real;

/// Advances one step in place: `x <- A x + b u + g e`.
///
/// `x_i <- x_(i+1) + b_i u + g_i e` and `x_n <- b_n u + a_1 x_1 + ... + a_n x_n + g_n e`, every product fused, in this
/// order. For a plain simulation pass an empty `g`.
#[inline(always)]
fn advance<const FEEDBACK: bool, R: Real>(a: &[R], b: &[R], g: &[R], x: &mut [R], u: R, e: R) {
    let n = x.len();
    let mut last = b[n - 1] * u;
    for i in 0..n {
        last = a[i].mul_add(x[i], last);
    }
    // The innovation is known last, so it enters last.
    if FEEDBACK {
        last = g[n - 1].mul_add(e, last);
    }
    for i in 0..n - 1 {
        x[i] = b[i].mul_add(u, x[i + 1]);
        if FEEDBACK {
            x[i] = g[i].mul_add(e, x[i]);
        }
    }
    x[n - 1] = last;
}

/// Simulates `x(k+1) = A x(k) + b u(k)` from the given `x` and calls `visit(k, x(k))` for k = 0 ... u.len() - 1. Leaves
/// the state after the last input in `x`.
///
/// # Panics
/// If `a`, `b` and `x` are not of one length n >= 1.
#[inline(always)]
pub fn simulate<R: Real>(a: &[R], b: &[R], x: &mut [R], u: &[R], visit: impl FnMut(usize, &[R])) {
    let n = x.len();
    assert!(n > 0 && a.len() == n && b.len() == n);
    run!(R, || match n {
        1 => of_order::<R, 1>(a, b, x, u, visit),
        2 => of_order::<R, 2>(a, b, x, u, visit),
        3 => of_order::<R, 3>(a, b, x, u, visit),
        4 => of_order::<R, 4>(a, b, x, u, visit),
        5 => of_order::<R, 5>(a, b, x, u, visit),
        6 => of_order::<R, 6>(a, b, x, u, visit),
        _ => inlined::simulate(a, b, x, u, visit),
    });
}

/// Does [`simulate`] for a constant order: the steps are unrolled, and the state stays in registers.
#[inline(always)]
fn of_order<R: Real, const N: usize>(a: &[R], b: &[R], x: &mut [R], u: &[R], visit: impl FnMut(usize, &[R])) {
    let mut state = [R::zero(); N];
    state.copy_from_slice(x);
    inlined::simulate(&a[..N], &b[..N], &mut state, u, visit);
    x.copy_from_slice(&state);
}

/// Does the same with process noise, `x(k+1) = A x(k) + b u(k) + w(k)`. On entry, row k of `rows` (n numbers a row)
/// holds w(k); it is overwritten by x(k).
///
/// # Panics
/// If `a`, `b` and `x` are not of one length n >= 1, or `rows` has fewer than n numbers per input.
pub fn simulate_disturbed(a: &[f64], b: &[f64], x: &mut [f64], u: &[f64], rows: &mut [f64]) {
    let n = x.len();
    assert!(n > 0 && a.len() == n && b.len() == n && rows.len() >= n * u.len());
    with_fma!(|| {
        for (row, &u) in rows.chunks_exact_mut(n).zip(u) {
            // Now x is w(k), and the row is x(k).
            x.swap_with_slice(row);
            let mut last = b[n - 1] * u;
            for i in 0..n {
                last = a[i].mul_add(row[i], last);
            }
            for i in 0..n - 1 {
                x[i] += b[i].mul_add(u, row[i + 1]);
            }
            x[n - 1] += last;
        }
    });
}

/// Does the same as [`simulate`] with inputs that depend on the state: `u(k) = visit(k, x(k))`, k = 0 ... samples - 1.
///
/// # Panics
/// If `a`, `b` and `x` are not of one length n >= 1.
#[inline(always)]
pub fn drive<R: Real>(a: &[R], b: &[R], x: &mut [R], samples: usize, mut visit: impl FnMut(usize, &[R]) -> R) {
    let n = x.len();
    assert!(n > 0 && a.len() == n && b.len() == n);
    run!(R, || {
        for k in 0..samples {
            let u = visit(k, x);
            advance::<false, R>(a, b, &[], x, u, R::zero());
        }
    });
}

/// Does the same with output feedback, stage 12: `x(k+1) = A x(k) + b u(k) + g (y(k) - x_1(k))`, which is
/// `F x + b u + g y` with `F = A - g c'`.
///
/// # Panics
/// If `a`, `b`, `g` and `x` are not of one length n >= 1, or `u` and `y` differ in length.
#[inline(always)]
pub fn observe<R: Real>(a: &[R], b: &[R], g: &[R], x: &mut [R], u: &[R], y: &[R], visit: impl FnMut(usize, &[R])) {
    let n = x.len();
    assert!(n > 0 && a.len() == n && b.len() == n && g.len() == n && u.len() == y.len());
    run!(R, || match n {
        1 => observe_of_order::<R, 1>(a, b, g, x, [u, y], visit),
        2 => observe_of_order::<R, 2>(a, b, g, x, [u, y], visit),
        3 => observe_of_order::<R, 3>(a, b, g, x, [u, y], visit),
        4 => observe_of_order::<R, 4>(a, b, g, x, [u, y], visit),
        5 => observe_of_order::<R, 5>(a, b, g, x, [u, y], visit),
        6 => observe_of_order::<R, 6>(a, b, g, x, [u, y], visit),
        _ => inlined::observe(a, b, g, x, u, y, visit),
    });
}

/// Does [`observe`] for a constant order.
#[inline(always)]
fn observe_of_order<R: Real, const N: usize>(
    a: &[R],
    b: &[R],
    g: &[R],
    x: &mut [R],
    [u, y]: [&[R]; 2],
    visit: impl FnMut(usize, &[R]),
) {
    let mut state = [R::zero(); N];
    state.copy_from_slice(x);
    inlined::observe(&a[..N], &b[..N], &g[..N], &mut state, u, y, visit);
    x.copy_from_slice(&state);
}

/// The same functions for callers that are already inside [`Real::run`], so that a constant order remains constant.
pub mod inlined {
    use super::{Real, advance};

    /// Does [`super::simulate`].
    ///
    /// # Panics
    /// If the lengths do not fit.
    #[inline(always)]
    pub fn simulate<R: Real>(a: &[R], b: &[R], x: &mut [R], u: &[R], mut visit: impl FnMut(usize, &[R])) {
        let n = x.len();
        assert!(n > 0 && a.len() == n && b.len() == n);
        for (k, &u) in u.iter().enumerate() {
            visit(k, x);
            advance::<false, R>(a, b, &[], x, u, R::zero());
        }
    }

    /// Does the same without input for some samples: `x(k+1) = A x(k)`.
    #[inline(always)]
    pub(crate) fn decay<R: Real>(a: &[R], x: &mut [R], samples: usize, mut visit: impl FnMut(usize, &[R])) {
        let n = x.len();
        assert!(n > 0 && a.len() == n);
        for k in 0..samples {
            visit(k, x);
            let mut last = a[0] * x[0];
            for i in 1..n {
                last = a[i].mul_add(x[i], last);
                x[i - 1] = x[i];
            }
            x[n - 1] = last;
        }
    }

    /// Does [`super::observe`].
    ///
    /// # Panics
    /// If the lengths do not fit.
    #[inline(always)]
    pub fn observe<R: Real>(
        a: &[R],
        b: &[R],
        g: &[R],
        x: &mut [R],
        u: &[R],
        y: &[R],
        mut visit: impl FnMut(usize, &[R]),
    ) {
        let n = x.len();
        assert!(n > 0 && a.len() == n && b.len() == n && g.len() == n && u.len() == y.len());
        for k in 0..u.len() {
            visit(k, x);
            observe_step(a, b, g, x, u[k], y[k]);
        }
    }

    /// Does one step of [`super::observe`].
    #[inline(always)]
    pub fn observe_step<R: Real>(a: &[R], b: &[R], g: &[R], x: &mut [R], u: R, y: R) {
        advance::<true, R>(a, b, g, x, u, y - x[0]);
    }
}
