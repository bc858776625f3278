//! The last samples of a signal, the newest first, and stability of a polynomial.

use crate::plant::canonical::reverse_negated;
use crate::plant::stability::is_stable;

/// Puts the newest sample first; the oldest is dropped.
pub(super) fn push(lags: &mut [f64], newest: f64) {
    if let Some(last) = lags.len().checked_sub(1) {
        lags.copy_within(..last, 1);
        lags[0] = newest;
    }
}

/// Says whether the zeros of `1 + d_1 q^-1 + ... + d_n q^-n` lie inside the unit circle.
#[derive(Clone, Debug)]
pub(super) struct StabilityTest {
    reversed: Vec<f64>,
    scratch: Vec<f64>,
}

impl StabilityTest {
    /// Makes buffers for polynomials of up to this order.
    pub(super) fn new(order: usize) -> Self {
        Self {
            reversed: vec![0.0; order],
            scratch: vec![0.0; order],
        }
    }

    /// `d` holds d_1 ... d_n.
    pub(super) fn passes(&mut self, d: &[f64]) -> bool {
        let n = d.len();
        let (reversed, scratch) = (&mut self.reversed[..n], &mut self.scratch[..n]);
        reverse_negated(d, reversed);
        with_fma!(|| is_stable(reversed, scratch))
    }
}
