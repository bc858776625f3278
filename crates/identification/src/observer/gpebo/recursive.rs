//! The Kalman-Bucy filter in the coordinates theta: recursive least squares on Eq. (9).

use super::filter::Nodes;

/// The integrals `S = int phi phi' dt` and `s = int phi z dt`.
#[derive(Clone, Debug)]
pub struct LeastSquaresIntegrals {
    n: usize,
    matrix: Vec<f64>,
    vector: Vec<f64>,
}

impl LeastSquaresIntegrals {
    /// Makes the integrals of order n, all zero.
    pub fn new(n: usize) -> Self {
        Self {
            n,
            matrix: vec![0.0; n * n],
            vector: vec![0.0; n],
        }
    }

    /// Adds a step of length h, or a part of it, by the rule `int a b dt`, given the nodes of each phi_i and of z.
    #[inline]
    pub fn add(
        &mut self,
        rule: impl Fn(f64, &Nodes, &Nodes) -> f64,
        h: f64,
        phi: &[Nodes],
        z: &Nodes,
    ) {
        for i in 0..self.n {
            for j in 0..=i {
                self.matrix[i * self.n + j] += rule(h, &phi[i], &phi[j]);
            }
            self.vector[i] += rule(h, &phi[i], z);
        }
    }

    /// Returns S, of which the lower triangle counts, row-major, and s.
    pub(super) fn parts(&self) -> (&[f64], &[f64]) {
        (&self.matrix, &self.vector)
    }

    /// Takes over the integrals of another of the same order.
    pub fn copy_from(&mut self, other: &Self) {
        self.matrix.copy_from_slice(&other.matrix);
        self.vector.copy_from_slice(&other.vector);
    }

    /// Returns the smallest eigenvalue of S, a measure of the excitation of Eq. (9) over the run. `None` if S is not
    /// finite.
    pub fn smallest_eigenvalue(&self) -> Option<f64> {
        let n = self.n;
        let s = faer::Mat::from_fn(n, n, |i, j| self.matrix[i.max(j) * n + i.min(j)]);
        if !s.is_all_finite() {
            return None;
        }
        // The eigenvalues are in ascending order.
        s.self_adjoint_eigenvalues(faer::Side::Lower)
            .ok()?
            .first()
            .copied()
    }
}

/// The estimate `theta_hat = (I / p0 + S / r)^-1 s / r`: the mean of theta given z up to now, for `theta ~ N(0, p0 I)`
/// and white delta of intensity r. With it, `xhat = xi + Phi theta_hat` is the state of the filter
/// `xhat' = A xhat + B u + P C (y - C'xhat) / r`, `P' = A P + P A' - P C C'P / r`, `P(0) = p0 I`, `xhat(0) = xi(0)`. No
/// Riccati equation is solved.
#[derive(Clone, Debug)]
pub struct LeastSquares {
    p0: f64,
    r: f64,
    factor: Vec<f64>,
}

impl LeastSquares {
    /// Makes the estimator with prior variance p0 and intensity r, for order n.
    pub fn new(p0: f64, r: f64, n: usize) -> Self {
        Self {
            p0,
            r,
            factor: vec![0.0; n * n],
        }
    }

    /// Computes `theta` by Cholesky of `I r / p0 + S`; NaN if that matrix is not numerically positive definite.
    pub fn solve(&mut self, information: &LeastSquaresIntegrals, theta: &mut [f64]) {
        let n = theta.len();
        let l = &mut self.factor;
        for i in 0..n {
            for j in 0..=i {
                let prior = if i == j { self.r / self.p0 } else { 0.0 };
                let sum: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
                let rest = information.matrix[i * n + j] + prior - sum;
                // The root of a negative number is NaN, as documented.
                l[i * n + j] = if i == j {
                    rest.sqrt()
                } else {
                    rest / l[j * n + j]
                };
            }
        }
        theta.copy_from_slice(&information.vector);
        self.substitute(theta);
    }

    /// Replaces `b` by the solution of `(I r / p0 + S) x = b`, with the matrix of the last [`Self::solve`].
    pub(super) fn substitute(&self, b: &mut [f64]) {
        let (n, l) = (b.len(), &self.factor);
        for i in 0..n {
            let sum: f64 = (0..i).map(|k| l[i * n + k] * b[k]).sum();
            b[i] = (b[i] - sum) / l[i * n + i];
        }
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|k| l[k * n + i] * b[k]).sum();
            b[i] = (b[i] - sum) / l[i * n + i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::filter::{half_simpson, simpson};
    use super::*;

    /// phi = (1, t), z = 2 + 3 t over [0, 1], by hand: S = [1 1/2; 1/2 1/3], s = S (2, 3).
    #[test]
    fn a_line_is_fitted() {
        let mut information = LeastSquaresIntegrals::new(2);
        let phi = [[1.0; 3], [0.0, 0.5, 1.0]];
        information.add(simpson, 1.0, &phi, &[2.0, 3.5, 5.0]);
        let mut theta = [0.0; 2];
        LeastSquares::new(1e12, 1.0, 2).solve(&information, &mut theta);
        assert!((theta[0] - 2.0).abs() < 1e-9 && (theta[1] - 3.0).abs() < 1e-9);
        // (4/3 - sqrt(16/9 - 1/3)) / 2
        let exact = (4.0 / 3.0 - (16.0_f64 / 9.0 - 1.0 / 3.0).sqrt()) / 2.0;
        assert!((information.smallest_eigenvalue().unwrap() - exact).abs() < 1e-15);
        // With p0 = r: (I + S)^-1 s
        LeastSquares::new(3.0, 3.0, 2).solve(&information, &mut theta);
        let (a, b, d) = (2.0, 0.5, 4.0 / 3.0);
        let s = [3.5, 2.0];
        let det = a * d - b * b;
        assert!((theta[0] - (d * s[0] - b * s[1]) / det).abs() < 1e-14);
        assert!((theta[1] - (a * s[1] - b * s[0]) / det).abs() < 1e-14);
        // Over [0, 1/2]: S = [1/2 1/8; 1/8 1/24].
        let mut half = LeastSquaresIntegrals::new(2);
        half.add(half_simpson, 1.0, &phi, &[2.0, 3.5, 5.0]);
        for (i, exact) in [(0, 0.5), (2, 0.125), (3, 1.0 / 24.0)] {
            assert!((half.matrix[i] - exact).abs() < 1e-16);
        }
    }
}
