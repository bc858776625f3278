//! Parameters of a model in the paper's forms, with derivatives.

use super::matrix::Matrix;
use super::population::Population;
use crate::model::Orders;
use crate::plant::canonical::{multiply_toeplitz, reverse_negated, solve_toeplitz};

/// A limit, and the covariance P of `sqrt(N) (p_hat - p)`, with `p = (alpha, beta)` of order m.
#[derive(Clone, Debug)]
pub struct Asymptotic {
    /// The limit, 2m numbers.
    pub p: Vec<f64>,
    /// Whether the limit is the truth.
    pub is_consistent: bool,
    /// P, 2m x 2m.
    pub covariance: Matrix,
    /// Limit and covariance of the p that the reported b comes from, if it is another one.
    pub of_b: Option<(Vec<f64>, Matrix)>,
}

/// The orders of a model whose parameters are the coefficients `d_1 ...` of one denominator, then those of B.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Free coefficients of the denominator, A or F.
    pub denominator: usize,
    /// Coefficients of B.
    pub nb: usize,
    /// The delay.
    pub nk: usize,
}

impl Shape {
    /// The shape of a model that has A or F, not both.
    pub fn new(orders: Orders) -> Self {
        Self {
            denominator: orders.na + orders.nf,
            nb: orders.nb,
            nk: orders.nk,
        }
    }

    /// The true parameters, if the model can have them.
    pub fn truth(self, population: &Population) -> Option<Vec<f64>> {
        let Population { alpha, beta, .. } = population;
        let size = beta.iter().fold(0.0_f64, |m, b| m.max(b.abs()));
        let coefficients = self.nk..self.nk + self.nb;
        let is_free = |(i, b): (usize, &f64)| coefficients.contains(&i) || b.abs() <= 1e-13 * size;
        let fits = alpha.iter().skip(self.denominator + 1).all(|a| *a == 0.0) && beta.iter().enumerate().all(is_free);
        let at = |c: &[f64], i: usize| c.get(i).copied().unwrap_or(0.0);
        let denominator = (1..=self.denominator).map(|i| at(alpha, i));
        let numerator = coefficients.clone().map(|i| at(beta, i));
        fits.then(|| denominator.chain(numerator).collect())
    }

    /// Converts parameters to `p = (alpha, beta)` and returns the derivative too: `beta_i = b_i - b_0 alpha_i`.
    pub fn canonical(self, theta: &[f64]) -> (Vec<f64>, Matrix) {
        let Self { denominator, nb, nk } = self;
        let m = denominator.max((nb + nk).saturating_sub(1)).max(1);
        let (alpha, b) = theta.split_at(denominator);
        let direct = if nk == 0 { b.first().copied() } else { None };
        let mut p = vec![0.0; 2 * m];
        let mut slopes = Matrix::zeros(2 * m, theta.len());
        for (i, alpha) in alpha.iter().enumerate() {
            p[i] = *alpha;
            slopes[(i, i)] = 1.0;
        }
        for (j, b) in b.iter().enumerate() {
            if nk + j > 0 {
                p[m + nk + j - 1] = *b;
                slopes[(m + nk + j - 1, denominator + j)] = 1.0;
            }
        }
        if let Some(direct) = direct {
            for (i, alpha) in alpha.iter().enumerate() {
                p[m + i] -= direct * alpha;
                slopes[(m + i, i)] -= direct;
                slopes[(m + i, denominator)] -= alpha;
            }
        }
        (p, slopes)
    }

    /// Converts an estimate of parameters and its covariance to p.
    pub fn asymptotic(self, theta: &[f64], is_consistent: bool, of: &Matrix) -> Asymptotic {
        let (p, slopes) = self.canonical(theta);
        Asymptotic {
            p,
            is_consistent,
            covariance: &(&slopes * of) * &slopes.transpose(),
            of_b: None,
        }
    }
}

/// b as a function of p, from `T b = h`, Eq. (5), and its derivative: `T db = dbeta - dT b`, `T_ij = alpha_(i-j)`.
pub fn input_vector(p: &[f64]) -> (Vec<f64>, Matrix) {
    let n = p.len() / 2;
    let (alpha, h) = p.split_at(n);
    let mut a = vec![0.0; n];
    reverse_negated(alpha, &mut a);
    let mut b = h.to_vec();
    solve_toeplitz(&a, &mut b);
    let mut slopes = Matrix::zeros(n, 2 * n);
    for j in 0..2 * n {
        let mut column = vec![0.0; n];
        if j < n {
            // alpha_(j+1) is on the diagonal of T that lies j + 1 below the main one.
            for i in j + 1..n {
                column[i] = -b[i - j - 1];
            }
        } else {
            column[j - n] = 1.0;
        }
        solve_toeplitz(&a, &mut column);
        for (i, value) in column.iter().enumerate() {
            slopes[(i, j)] = *value;
        }
    }
    (b, slopes)
}

/// `h = T b` as a function of (alpha, b), and its derivatives with respect to alpha and b.
pub fn numerator(alpha: &[f64], b: &[f64]) -> (Vec<f64>, Matrix, Matrix) {
    let n = alpha.len();
    let mut a = vec![0.0; n];
    reverse_negated(alpha, &mut a);
    let mut h = b.to_vec();
    multiply_toeplitz(&a, &mut h);
    let of_alpha = Matrix::from_fn(n, n, |i, j| if i > j { b[i - j - 1] } else { 0.0 });
    let of_b = Matrix::from_fn(n, n, |i, j| match i.checked_sub(j) {
        None => 0.0,
        Some(0) => 1.0,
        Some(lag) => alpha[lag - 1],
    });
    (h, of_alpha, of_b)
}
