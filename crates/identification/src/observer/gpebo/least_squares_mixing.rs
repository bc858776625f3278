//! Least squares as the extension of DREM, LS+DREM.

use super::filter::Nodes;
use super::mixing::Mixer;
use super::recursive::{LeastSquares, LeastSquaresIntegrals};

/// The scalar regressions `adj(H) theta_g = det(H) theta` at the nodes of a step, with `H = (w I + S)^-1 S` (n x n) and
/// `theta_g = (w I + S)^-1 s` (n), S and s the integrals of least squares.
#[derive(Clone, Debug)]
pub struct MixedSquares {
    n: usize,
    squares: LeastSquares,
    mixer: Mixer,
    /// det(H).
    pub delta: Nodes,
    /// The components of adj(H) theta_g.
    pub mixed: Vec<Nodes>,
    h: Vec<f64>,
    theta: Vec<f64>,
    column: Vec<f64>,
    out: Vec<f64>,
}

impl MixedSquares {
    /// Makes the mixing for the weight w = r / p0 and order n.
    pub fn new(weight: f64, n: usize) -> Self {
        Self {
            n,
            squares: LeastSquares::new(1.0, weight, n),
            mixer: Mixer::new(n),
            delta: [0.0; 3],
            mixed: vec![[0.0; 3]; n],
            h: vec![0.0; n * n],
            theta: vec![0.0; n],
            column: vec![0.0; n],
            out: vec![0.0; n],
        }
    }

    /// Computes the nodes of the next step from the integrals in its middle and at its end.
    pub fn step(&mut self, information: [&LeastSquaresIntegrals; 2]) {
        let n = self.n;
        self.delta[0] = self.delta[2];
        for mixed in &mut self.mixed {
            mixed[0] = mixed[2];
        }
        for (node, information) in (1..).zip(information) {
            let (matrix, _) = information.parts();
            self.squares.solve(information, &mut self.theta);
            for j in 0..n {
                for (i, column) in self.column.iter_mut().enumerate() {
                    *column = matrix[i.max(j) * n + i.min(j)];
                }
                self.squares.substitute(&mut self.column);
                for (i, column) in self.column.iter().enumerate() {
                    self.h[i * n + j] = *column;
                }
            }
            self.delta[node] = self.mixer.mix(&self.h, &self.theta, &mut self.out);
            for (mixed, out) in self.mixed.iter_mut().zip(&self.out) {
                mixed[node] = *out;
            }
        }
    }
}
