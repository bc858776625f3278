//! The filters of an adaptive observer: a state that is linear in the parameters.

use crate::estimator::FailureKind;
use crate::estimator::recursive::Diverged;
use crate::plant::canonical::{reverse_negated, solve_toeplitz};

/// `M(k+1) = F M(k) + (I y(k), I u(k))`, n x 2n, from M(0) = 0, where `F = A0 - f c'` has the characteristic polynomial
/// `z^n + f_1 z^(n-1) + ... + f_n`. For the plant `(alpha, h)` and any k,
///
/// ```text
///     x_o(k) = M(k) p + F^k x_o(0),  p = (f - alpha, h)
/// ```
///
/// so one set of filters serves every estimate of the plant, and x_o(0) is forgotten as F^k; with f = 0 (dead beat)
/// after n samples. A sample takes about 4 n^2 multiplications and additions.
///
/// Source: G. Kreisselmeier, Adaptive observers with exponential rate of convergence, IEEE Trans. Automatic Control 22,
/// 1977, with differences for derivatives.
#[derive(Clone, Debug)]
pub struct StateFilters {
    f: Vec<f64>,
    /// The 2n columns of M, n numbers each.
    columns: Vec<f64>,
    /// The plant (a, b) and the state, in the papers' form.
    plant: Vec<f64>,
    state: Vec<f64>,
    samples: usize,
}

impl StateFilters {
    /// Makes filters with the coefficients f_1 ... f_n; zeros are dead beat.
    ///
    /// # Panics
    /// If there are none.
    pub fn new(f: &[f64]) -> Self {
        let n = f.len();
        assert!(n > 0);
        Self {
            f: f.to_vec(),
            columns: vec![0.0; 2 * n * n],
            plant: vec![0.0; 2 * n],
            state: vec![0.0; n],
            samples: 0,
        }
    }

    /// Forgets all samples.
    pub fn restart(&mut self) {
        self.columns.fill(0.0);
        self.samples = 0;
    }

    /// Returns the order n.
    pub fn order(&self) -> usize {
        self.f.len()
    }

    /// Computes `F v` in place.
    fn advance(f: &[f64], v: &mut [f64]) {
        let first = v[0];
        v.rotate_left(1);
        if let Some(last) = v.last_mut() {
            *last = 0.0;
        }
        for (v, f) in v.iter_mut().zip(f) {
            *v -= f * first;
        }
    }

    /// Takes u(k) and y(k).
    pub fn update(&mut self, u: f64, y: f64) {
        let n = self.order();
        for (i, column) in self.columns.chunks_exact_mut(n).enumerate() {
            Self::advance(&self.f, column);
            column[i % n] += if i < n { y } else { u };
        }
        self.samples += 1;
    }

    /// Fills `to` with the first row of M: `y = z' p`, but for `c'F^k x_o(0)`.
    ///
    /// # Panics
    /// If `to` is shorter than 2n.
    pub fn regressors(&self, to: &mut [f64]) {
        let columns = self.columns.chunks_exact(self.order());
        to[..2 * self.order()]
            .iter_mut()
            .zip(columns)
            .for_each(|(to, column)| *to = column[0]);
    }

    /// Adds `M q` to a vector in observer form.
    pub(super) fn add_product(&self, q: &[f64], to: &mut [f64]) {
        for (column, q) in self.columns.chunks_exact(self.order()).zip(q) {
            for (to, m) in to.iter_mut().zip(column) {
                *to += m * q;
            }
        }
    }

    /// Returns f_1 ... f_n.
    pub(super) fn coefficients(&self) -> &[f64] {
        &self.f
    }

    /// Takes over the plant `p + (alpha, h)`, and its state x_o.
    ///
    /// # Errors
    /// [`Diverged`] if a number is not finite.
    pub(super) fn set(&mut self, alpha: &[f64], h: &[f64], state: &[f64]) -> Result<(), Diverged> {
        let n = self.order();
        let (a, b) = self.plant.split_at_mut(n);
        reverse_negated(alpha, a);
        b.copy_from_slice(h);
        solve_toeplitz(a, b);
        self.state.copy_from_slice(state);
        solve_toeplitz(a, &mut self.state);
        finite(&self.state, self.samples)?;
        finite(&self.plant, self.samples)
    }

    /// Returns the state in the papers' form.
    pub(super) fn state(&self) -> &[f64] {
        &self.state
    }

    /// Returns (a, b).
    pub(super) fn plant(&self) -> &[f64] {
        &self.plant
    }
}

/// Checks numbers after so many samples.
pub(super) fn finite(numbers: &[f64], samples: usize) -> Result<(), Diverged> {
    if numbers.iter().all(|number| number.is_finite()) {
        return Ok(());
    }
    Err(Diverged {
        k: samples.saturating_sub(1),
        kind: FailureKind::NonFinite,
    })
}
