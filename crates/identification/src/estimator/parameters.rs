//! Stages 4 and 5: a, h and b from p.

use crate::plant::canonical::{reverse_negated, solve_toeplitz};

/// Computes stage 4: `h_i = p_(n+i)`, `a_i = -p_(n+1-i)`.
///
/// # Panics
/// If `p` is not of length 2n, or `a` and `h` not of length n.
pub fn from_p(p: &[f64], a: &mut [f64], h: &mut [f64]) {
    let (alpha, beta) = p.split_at(a.len());
    reverse_negated(alpha, a);
    h.copy_from_slice(beta);
}

/// Computes stage 5: b from `T b = h`.
///
/// # Panics
/// If the lengths differ.
pub fn input_vector(a: &[f64], h: &[f64], b: &mut [f64]) {
    b.copy_from_slice(h);
    solve_toeplitz(a, b);
}
