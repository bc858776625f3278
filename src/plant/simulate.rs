//! Simulation of the canonical plant.

use crate::signal::arithmetic::with_fma;

/// One step in place: `x <- A x + b u + g e`.
///
/// `x_i <- x_(i+1) + b_i u + g_i e` and `x_n <- b_n u + g_n e + a_1 x_1 + ... + a_n x_n`, every product
/// fused, in this order. Pass an empty `g` for a plain simulation.
#[inline(always)]
fn advance<const FEEDBACK: bool>(a: &[f64], b: &[f64], g: &[f64], x: &mut [f64], u: f64, e: f64) {
    let n = x.len();
    let mut last = b[n - 1] * u;
    if FEEDBACK {
        last = g[n - 1].mul_add(e, last);
    }
    for i in 0..n {
        last = a[i].mul_add(x[i], last);
    }
    for i in 0..n - 1 {
        x[i] = b[i].mul_add(u, x[i + 1]);
        if FEEDBACK {
            x[i] = g[i].mul_add(e, x[i]);
        }
    }
    x[n - 1] = last;
}

/// Calls `visit(k, x(k))` for k = 0 ... u.len() - 1 and leaves the state after the last input in `x`:
/// `x(k+1) = A x(k) + b u(k)`, from the `x` given.
///
/// # Panics
/// If `a`, `b` and `x` are not of one length n >= 1.
#[inline(always)]
pub fn simulate(
    a: &[f64],
    b: &[f64],
    x: &mut [f64],
    u: &[f64],
    mut visit: impl FnMut(usize, &[f64]),
) {
    let n = x.len();
    assert!(n > 0 && a.len() == n && b.len() == n);
    with_fma(
        #[inline(always)]
        || {
            for (k, &u) in u.iter().enumerate() {
                visit(k, x);
                advance::<false>(a, b, &[], x, u, 0.0);
            }
        },
    );
}

/// The same where every input depends on the state: `u(k) = visit(k, x(k))`, k = 0 ... samples - 1.
///
/// # Panics
/// If `a`, `b` and `x` are not of one length n >= 1.
#[inline(always)]
pub fn drive(
    a: &[f64],
    b: &[f64],
    x: &mut [f64],
    samples: usize,
    mut visit: impl FnMut(usize, &[f64]) -> f64,
) {
    let n = x.len();
    assert!(n > 0 && a.len() == n && b.len() == n);
    with_fma(
        #[inline(always)]
        || {
            for k in 0..samples {
                let u = visit(k, x);
                advance::<false>(a, b, &[], x, u, 0.0);
            }
        },
    );
}

/// The same with output feedback, stage 12: `x(k+1) = A x(k) + b u(k) + g (y(k) - x_1(k))`, which is
/// `F x + b u + g y` with `F = A - g c'`.
///
/// # Panics
/// If `a`, `b`, `g` and `x` are not of one length n >= 1, or `u` and `y` differ in length.
#[inline(always)]
pub fn observe(
    a: &[f64],
    b: &[f64],
    g: &[f64],
    x: &mut [f64],
    u: &[f64],
    y: &[f64],
    mut visit: impl FnMut(usize, &[f64]),
) {
    let n = x.len();
    assert!(n > 0 && a.len() == n && b.len() == n && g.len() == n && u.len() == y.len());
    with_fma(
        #[inline(always)]
        || {
            for k in 0..u.len() {
                visit(k, x);
                let innovation = y[k] - x[0];
                advance::<true>(a, b, g, x, u[k], innovation);
            }
        },
    );
}
