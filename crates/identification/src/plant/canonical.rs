//! Maps between the forms of the canonical SISO plant: (a, b), (a, h) and polynomials (alpha, beta).
//!
//! T is the n x n lower-triangular Toeplitz matrix with first column `(1, -a_n, -a_(n-1), ..., -a_2)`; `T b = h`, Eq.
//! (5). `alpha_i = -a_(n+1-i)` and `beta_i = h_i` give the usual `A(q) = 1 + alpha_1 q^-1 + ...` and
//! `B(q) = beta_1 q^-1 + ...`.

use crate::real::Real;

/// Solves `T x = r` in place: `x_i = r_i + sum_(j<i) a_(n+1-(i-j)) x_j`. Stage 5 with r = h.
///
/// # Panics
/// In debug builds, if the lengths differ.
#[inline(always)]
pub fn solve_toeplitz<R: Real>(a: &[R], x: &mut [R]) {
    debug_assert_eq!(a.len(), x.len());
    let n = a.len();
    for i in 1..n {
        let mut sum = x[i];
        for j in 0..i {
            sum = a[n - (i - j)].mul_add(x[j], sum);
        }
        x[i] = sum;
    }
}

/// Computes `T x` in place: `(T x)_i = x_i - sum_(j<i) a_(n+1-(i-j)) x_j`. Hence `h = T b`, Eq. (5).
///
/// # Panics
/// In debug builds, if the lengths differ.
#[inline(always)]
pub fn multiply_toeplitz<R: Real>(a: &[R], x: &mut [R]) {
    debug_assert_eq!(a.len(), x.len());
    let n = a.len();
    for i in (1..n).rev() {
        let mut sum = x[i];
        for j in 0..i {
            sum = a[n - (i - j)].neg_mul_add(x[j], sum);
        }
        x[i] = sum;
    }
}

/// Computes alpha from a, `alpha_i = -a_(n+1-i)`; the same map takes alpha back to a.
#[inline(always)]
pub fn reverse_negated<R: Real>(from: &[R], to: &mut [R]) {
    debug_assert_eq!(from.len(), to.len());
    for (to, from) in to.iter_mut().zip(from.iter().rev()) {
        *to = -*from;
    }
}
