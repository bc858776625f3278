//! GPEBO in discrete time: an observer that estimates the constant `theta = x(0) - xi(0)`.

use super::gpebo::Mixer;
use super::luenberger::ObservedModel;
use crate::failure::{FailureKind, all_finite};

/// How theta is estimated from `z(k) = c'Phi(k) theta + f(k)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ThetaEstimator {
    /// DREM: the regression and its delays by 1 ... n - 1 samples, mixed to `mbar = Delta theta`, and for each
    /// component `theta_i += gamma Delta (mbar_i - Delta theta_i) / (1 + gamma Delta^2)`. Holds gamma.
    Drem(f64),
    /// Recursive least squares from `P(0) = I / rho`. Holds rho, the variance of f over that of each theta_i.
    Squares(f64),
}

/// `xi(k+1) = A xi(k) + b u(k)`, `Phi(k+1) = A Phi(k)`, `Phi(0) = I`, `z(k) = y(k) - c'xi(k)`, `xhat(k) = xi(k) +
/// Phi(k) theta_hat(k)` with `xi(0) = x0`, `theta_hat(0) = 0`; theta_hat(k) is made of z up to k - 1. The observer of
/// Bobtsov et al. 2023, Eqs. (5) to (10), with differences for derivatives.
#[derive(Clone, Debug)]
pub struct DiscreteGpebo {
    by: ThetaEstimator,
    n: usize,
    xi: Vec<f64>,
    theta: Vec<f64>,
    /// c'A^j, j = k - n + 1 ... k + n - 1, each n numbers, 0 for j < 0; the last n rows are Phi(k), since c'A^j =
    /// e_(j+1)' for j < n.
    rows: Vec<f64>,
    /// z(k), z(k - 1), ..., z(k - n + 1).
    z: Vec<f64>,
    /// P (n x n) of least squares, or M of the mixing.
    matrix: Vec<f64>,
    /// P phi, mbar, or the next row.
    vector: Vec<f64>,
    mixer: Mixer,
    xhat: Vec<f64>,
}

impl DiscreteGpebo {
    /// Makes the buffers for order n.
    pub fn new(by: ThetaEstimator, n: usize) -> Self {
        Self {
            by,
            n,
            xi: vec![0.0; n],
            theta: vec![0.0; n],
            rows: vec![0.0; (2 * n - 1) * n],
            z: vec![0.0; n],
            matrix: vec![0.0; n * n],
            vector: vec![0.0; n],
            mixer: Mixer::new(n),
            xhat: vec![0.0; n],
        }
    }

    /// Returns the estimator of theta.
    pub fn estimator(&self) -> ThetaEstimator {
        self.by
    }

    /// Returns theta_hat after the last sample.
    pub fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Calls `visit(k, xhat(k))` for k = 0 ... K-1.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if xi or theta_hat overflows; the visited values must then not be used.
    ///
    /// # Panics
    /// If the model is of another order.
    pub fn run(
        &mut self,
        model: ObservedModel<'_>,
        u: &[f64],
        y: &[f64],
        mut visit: impl FnMut(usize, &[f64]),
    ) -> Result<(), FailureKind> {
        let n = self.n;
        self.xi.copy_from_slice(model.x0);
        self.theta.fill(0.0);
        self.z.fill(0.0);
        self.rows.fill(0.0);
        for i in 0..n {
            self.rows[(n - 1 + i) * n + i] = 1.0;
            if let ThetaEstimator::Squares(rho) = self.by {
                self.matrix[i * n..(i + 1) * n].fill(0.0);
                self.matrix[i * n + i] = 1.0 / rho;
            }
        }
        for (k, (u, y)) in u.iter().zip(y).enumerate() {
            let phi = self.rows[(n - 1) * n..].chunks_exact(n);
            for ((xhat, xi), row) in self.xhat.iter_mut().zip(&self.xi).zip(phi) {
                *xhat = xi + dot(row, &self.theta);
            }
            visit(k, &self.xhat);
            self.z.rotate_right(1);
            self.z[0] = y - self.xi[0];
            match self.by {
                ThetaEstimator::Drem(gamma) => self.mix(gamma),
                ThetaEstimator::Squares(_) => self.fit(),
            }
            let last = dot(model.a, &self.xi);
            self.xi.rotate_left(1);
            self.xi[n - 1] = last;
            for (xi, b) in self.xi.iter_mut().zip(model.b) {
                *xi += b * u;
            }
            self.shift(model.a);
        }
        all_finite(self.xi.iter().chain(&self.theta))
    }

    /// One step of the gradient on the mixed regression.
    fn mix(&mut self, gamma: f64) {
        let n = self.n;
        // Row i is c'Phi(k - i).
        for i in 0..n {
            let from = (n - 1 - i) * n;
            self.matrix[i * n..(i + 1) * n].copy_from_slice(&self.rows[from..from + n]);
        }
        let delta = self.mixer.mix(&self.matrix, &self.z, &mut self.vector);
        let rate = gamma * delta / (1.0 + gamma * delta * delta);
        for (theta, mbar) in self.theta.iter_mut().zip(&self.vector) {
            *theta += rate * (mbar - delta * *theta);
        }
    }

    /// One step of recursive least squares.
    fn fit(&mut self) {
        let n = self.n;
        let phi = &self.rows[(n - 1) * n..n * n];
        for (p, row) in self.vector.iter_mut().zip(self.matrix.chunks_exact(n)) {
            *p = dot(row, phi);
        }
        let variance = 1.0 + dot(phi, &self.vector);
        let error = (self.z[0] - dot(phi, &self.theta)) / variance;
        for i in 0..n {
            self.theta[i] += self.vector[i] * error;
            for j in 0..n {
                self.matrix[i * n + j] -= self.vector[i] * self.vector[j] / variance;
            }
        }
    }

    /// Advances the rows by a sample: `c'A^(k+n) = sum_i a_i c'A^(k+i-1)`.
    fn shift(&mut self, a: &[f64]) {
        let n = self.n;
        self.vector.fill(0.0);
        for (a, row) in a.iter().zip(self.rows[(n - 1) * n..].chunks_exact(n)) {
            for (next, row) in self.vector.iter_mut().zip(row) {
                *next += a * row;
            }
        }
        self.rows.rotate_left(n);
        self.rows[(2 * n - 2) * n..].copy_from_slice(&self.vector);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
