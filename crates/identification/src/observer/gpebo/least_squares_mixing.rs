//! Least squares as the extension of DREM, LS+DREM.

use super::filter::{Nodes, no_signal};
use super::mixing::Mixer;
use super::recursive::{LeastSquares, LeastSquaresIntegrals};
use crate::real::Real;

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
            let (matrix, _) = information.parts();
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
