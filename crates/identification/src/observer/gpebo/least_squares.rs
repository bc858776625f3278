//! Least squares on Eq. (9): the Kalman-Bucy filter in the coordinates theta, and the extension of LS+DREM.

use super::mixing::Mixer;
use super::operators::{Nodes, half_simpson, no_signal, simpson};
use super::scalar::At;
use crate::real::Real;

/// The integrals `S = int phi phi' dt` and `s = int phi z dt`.
#[derive(Clone, Debug)]
pub struct LeastSquaresIntegrals<R> {
    n: usize,
    /// S, of which the lower triangle counts, row-major.
    matrix: Vec<R>,
    /// s.
    vector: Vec<R>,
}

impl<R: Real> LeastSquaresIntegrals<R> {
    /// Makes the integrals of order n, all zero.
    pub fn new(n: usize) -> Self {
        Self {
            n,
            matrix: vec![R::zero(); n * n],
            vector: vec![R::zero(); n],
        }
    }

    /// Adds a step of length h, or the first half of it, given the nodes of each phi_i and of z.
    #[inline(always)]
    pub fn add(&mut self, part: At, h: R, phi: &[Nodes<R>], z: &Nodes<R>) {
        let n = self.n;
        for i in 0..n {
            for j in 0..=i {
                let added = integral(part, h, &phi[i], &phi[j]);
                self.matrix[i * n + j] = self.matrix[i * n + j] + added;
            }
            self.vector[i] = self.vector[i] + integral(part, h, &phi[i], z);
        }
    }

    /// Takes over the integrals of another of the same order.
    pub fn copy_from(&mut self, other: &Self) {
        self.matrix.copy_from_slice(&other.matrix);
        self.vector.copy_from_slice(&other.vector);
    }

    /// Returns the smallest eigenvalue of S in a lane, a measure of the excitation of Eq. (9) over the run. `None`
    /// if S is not finite.
    pub fn smallest_eigenvalue(&self, lane: usize) -> Option<f64> {
        let n = self.n;
        let entry = |i: usize, j: usize| self.matrix[i.max(j) * n + i.min(j)].lane(lane);
        let s = faer::Mat::from_fn(n, n, entry);
        if !s.is_all_finite() {
            return None;
        }
        // The eigenvalues are in ascending order.
        s.self_adjoint_eigenvalues(faer::Side::Lower).ok()?.first().copied()
    }
}

/// Returns `int a b dt` up to the middle or the end of a step of length h.
#[inline(always)]
fn integral<R: Real>(up_to: At, h: R, a: &Nodes<R>, b: &Nodes<R>) -> R {
    match up_to {
        At::Middle => half_simpson(h, a, b),
        At::End => simpson(h, a, b),
    }
}

/// The estimate `theta_hat = (I / p0 + S / r)^-1 s / r`: the mean of theta given z up to now, for
/// `theta ~ N(0, p0 I)` and white delta of intensity r. With it, `xhat = xi + Phi theta_hat` is the state of the
/// filter `xhat' = A xhat + B u + P C (y - C'xhat) / r`, `P' = A P + P A' - P C C'P / r`, `P(0) = p0 I`,
/// `xhat(0) = xi(0)`. No Riccati equation is solved.
#[derive(Clone, Debug)]
pub struct LeastSquares<R> {
    p0: f64,
    r: f64,
    factor: Vec<R>,
}

impl<R: Real> LeastSquares<R> {
    /// Makes the estimator with prior variance p0 and intensity r, for order n.
    pub fn new(p0: f64, r: f64, n: usize) -> Self {
        Self {
            p0,
            r,
            factor: vec![R::zero(); n * n],
        }
    }

    /// Computes `theta` by Cholesky of `I r / p0 + S`; NaN if that matrix is not numerically positive definite.
    #[inline(always)]
    pub fn solve(&mut self, information: &LeastSquaresIntegrals<R>, theta: &mut [R]) {
        let n = theta.len();
        let l = &mut self.factor;
        for i in 0..n {
            for j in 0..=i {
                let prior = R::splat(if i == j { self.r / self.p0 } else { 0.0 });
                // The sum of nothing is -0.
                let mut sum = R::splat(-0.0);
                for k in 0..j {
                    sum = sum + l[i * n + k] * l[j * n + k];
                }
                let rest = information.matrix[i * n + j] + prior - sum;
                // The root of a negative number is NaN, as documented.
                l[i * n + j] = if i == j { rest.sqrt() } else { rest / l[j * n + j] };
            }
        }
        theta.copy_from_slice(&information.vector);
        self.substitute(theta);
    }

    /// Replaces `b` by the solution of `(I r / p0 + S) x = b`, with the matrix of the last [`Self::solve`].
    #[inline(always)]
    fn substitute(&self, b: &mut [R]) {
        let (n, l) = (b.len(), &self.factor);
        for i in 0..n {
            let mut sum = R::splat(-0.0);
            for k in 0..i {
                sum = sum + l[i * n + k] * b[k];
            }
            b[i] = (b[i] - sum) / l[i * n + i];
        }
        for i in (0..n).rev() {
            let mut sum = R::splat(-0.0);
            for k in i + 1..n {
                sum = sum + l[k * n + i] * b[k];
            }
            b[i] = (b[i] - sum) / l[i * n + i];
        }
    }
}

/// The scalar regressions `adj(H) theta_g = det(H) theta` at the nodes of a step, with `H = (w I + S)^-1 S` (n x n)
/// and `theta_g = (w I + S)^-1 s` (n), S and s the integrals of least squares.
#[derive(Clone, Debug)]
pub struct MixedSquares<R> {
    n: usize,
    squares: LeastSquares<R>,
    mixer: Mixer<R>,
    /// det(H).
    pub delta: Nodes<R>,
    /// The components of adj(H) theta_g.
    pub mixed: Vec<Nodes<R>>,
    h: Vec<R>,
    theta: Vec<R>,
    column: Vec<R>,
    out: Vec<R>,
}

impl<R: Real> MixedSquares<R> {
    /// Makes the mixing for the weight w = r / p0 and order n.
    pub fn new(weight: f64, n: usize) -> Self {
        Self {
            n,
            squares: LeastSquares::new(1.0, weight, n),
            mixer: Mixer::new(n),
            delta: no_signal(),
            mixed: vec![no_signal(); n],
            h: vec![R::zero(); n * n],
            theta: vec![R::zero(); n],
            column: vec![R::zero(); n],
            out: vec![R::zero(); n],
        }
    }

    /// Computes the nodes of the next step from the integrals in its middle and at its end.
    #[inline(always)]
    pub fn step(&mut self, information: [&LeastSquaresIntegrals<R>; 2]) {
        let n = self.n;
        self.delta[0] = self.delta[2];
        for i in 0..n {
            self.mixed[i][0] = self.mixed[i][2];
        }
        for node in 1..3 {
            let information = information[node - 1];
            let matrix = &information.matrix;
            self.squares.solve(information, &mut self.theta);
            for j in 0..n {
                for i in 0..n {
                    self.column[i] = matrix[i.max(j) * n + i.min(j)];
                }
                self.squares.substitute(&mut self.column);
                for i in 0..n {
                    self.h[i * n + j] = self.column[i];
                }
            }
            self.delta[node] = self.mixer.mix(&self.h, &self.theta, &mut self.out);
            for i in 0..n {
                self.mixed[i][node] = self.out[i];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// phi = (1, t), z = 2 + 3 t over [0, 1], by hand: S = [1 1/2; 1/2 1/3], s = S (2, 3).
    #[test]
    fn a_line_is_fitted() {
        let mut information = LeastSquaresIntegrals::<f64>::new(2);
        let phi = [[1.0; 3], [0.0, 0.5, 1.0]];
        information.add(At::End, 1.0, &phi, &[2.0, 3.5, 5.0]);
        let mut theta = [0.0; 2];
        LeastSquares::new(1e12, 1.0, 2).solve(&information, &mut theta);
        assert!((theta[0] - 2.0).abs() < 1e-9 && (theta[1] - 3.0).abs() < 1e-9);
        // (4/3 - sqrt(16/9 - 1/3)) / 2
        let exact = (4.0 / 3.0 - (16.0_f64 / 9.0 - 1.0 / 3.0).sqrt()) / 2.0;
        assert!((information.smallest_eigenvalue(0).unwrap() - exact).abs() < 1e-15);
        // With p0 = r: (I + S)^-1 s
        LeastSquares::new(3.0, 3.0, 2).solve(&information, &mut theta);
        let (a, b, d) = (2.0, 0.5, 4.0 / 3.0);
        let s = [3.5, 2.0];
        let det = a * d - b * b;
        assert!((theta[0] - (d * s[0] - b * s[1]) / det).abs() < 1e-14);
        assert!((theta[1] - (a * s[1] - b * s[0]) / det).abs() < 1e-14);
        // Over [0, 1/2]: S = [1/2 1/8; 1/8 1/24].
        let mut half = LeastSquaresIntegrals::<f64>::new(2);
        half.add(At::Middle, 1.0, &phi, &[2.0, 3.5, 5.0]);
        for (i, exact) in [(0, 0.5), (2, 0.125), (3, 1.0 / 24.0)] {
            assert!((half.matrix[i] - exact).abs() < 1e-16);
        }
    }
}
