//! A realisation of the general linear model in state space.

use super::LinearModel;
use super::polynomial::multiply;
use crate::plant::canonical::{reverse_negated, solve_toeplitz};

/// The innovations form in observability coordinates,
/// `x(k+1) = A x(k) + b u(k) + K e(k)`, `y(k) = x_1(k) + d u(k) + e(k)`, `A = [0 | I; a']`.
///
/// The order is that of the common denominator `A F D` (of `A F` if D = 1), or of B if that is longer. With `nk > 0`
/// and no noise model, a and b are those of the paper's form, and `K` makes the observer the predictor of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Realisation {
    /// The last row of A.
    pub a: Vec<f64>,
    /// The input vector.
    pub b: Vec<f64>,
    /// The direct term; 0 if nk > 0.
    pub d: f64,
    /// The gain of the innovations.
    pub k: Vec<f64>,
    /// The initial state.
    pub x0: Vec<f64>,
}

impl Realisation {
    /// Makes the realisation of a model, with x(0) = 0.
    pub fn new(model: &LinearModel) -> Self {
        let both = multiply(&multiply(&model.a, &model.f), &model.d);
        let input = multiply(&model.b, &model.d);
        let noise = multiply(&model.c, &model.f);
        let longest = both.len().max(input.len()).max(noise.len()).max(2);
        let padded = |mut polynomial: Vec<f64>| {
            polynomial.resize(longest, 0.0);
            polynomial
        };
        let (both, input, noise) = (padded(both), padded(input), padded(noise));
        let mut a = vec![0.0; longest - 1];
        reverse_negated(&both[1..], &mut a);
        // G = g_0 + (sum (g_i - g_0 alpha_i) q^-i) / (1 + sum alpha_i q^-i), and T x = the numerator.
        let vector = |numerator: &[f64]| {
            let terms = numerator[1..].iter().zip(&both[1..]);
            let mut x: Vec<f64> = terms.map(|(g, alpha)| g - numerator[0] * alpha).collect();
            solve_toeplitz(&a, &mut x);
            x
        };
        Self {
            b: vector(&input),
            d: input[0],
            k: vector(&noise),
            x0: vec![0.0; longest - 1],
            a,
        }
    }

    /// Computes the output for an input and innovations.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn simulate(&self, u: &[f64], e: &[f64], y: &mut [f64]) {
        assert!(u.len() == e.len() && u.len() == y.len());
        let n = self.a.len();
        let mut x = self.x0.clone();
        for (k, y) in y.iter_mut().enumerate() {
            *y = x[0] + self.d * u[k] + e[k];
            let last: f64 = self.a.iter().zip(&x).map(|(a, x)| a * x).sum();
            x.rotate_left(1);
            x[n - 1] = last;
            for ((x, b), gain) in x.iter_mut().zip(&self.b).zip(&self.k) {
                *x += b * u[k] + gain * e[k];
            }
        }
    }
}
