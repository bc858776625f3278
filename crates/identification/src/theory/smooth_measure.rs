//! Measures that are smooth in p, to first order about a limit: `e - e_limit = |L z|`, with z standard normal over
//! sqrt(N).

use super::canonical::{Asymptotic, input_vector};
use super::matrix::Matrix;
use super::population::Population;
use super::quadratic_form::quantile;
use crate::metric::relative_error;
use crate::model::polynomial::divide;
use crate::names::named_enum;

/// Number of Markov parameters in e_g.
const RESPONSE: usize = 200;

named_enum! {
    /// A measure that the theory covers.
    SmoothMeasure, "measure of theory" {
        /// Relative error of a.
        Ea = "e_a",
        /// Relative error of b.
        Eb = "e_b",
        /// Relative error of h.
        Eh = "e_h",
        /// Relative error of the impulse response.
        ImpulseResponse = "e_g",
    }
}

/// The theory of a measure.
#[derive(Clone, Debug)]
pub struct Figure {
    /// The measure at the limit.
    pub limit: f64,
    /// sqrt(N) times the root mean square of `|v_hat - v_limit| / |v|`, v the true vector.
    pub sqrt_n_rms: f64,
    /// The weights w: `sum_i w_i z_i^2`, z independent standard normal, is N times the square of that ratio.
    weights: Vec<f64>,
}

impl Figure {
    /// sqrt(N) times the quantile of `|v_hat - v_limit| / |v|`, 0 < p < 1.
    pub fn quantile(&self, p: f64) -> f64 {
        quantile(&self.weights, p)
    }
}

/// Computes a measure of an estimate; `None` if it needs the plant's order and the estimate has another.
pub fn figure(population: &Population, estimate: &Asymptotic, measure: SmoothMeasure) -> Option<Figure> {
    let n = population.plant.order();
    let truth = [&population.alpha[1..], &population.beta[1..]].concat();
    let (p, covariance) = match (&estimate.of_b, measure) {
        (Some((p, covariance)), SmoothMeasure::Eb) => (p, covariance),
        _ => (&estimate.p, &estimate.covariance),
    };
    let m = p.len() / 2;
    if m != n && measure != SmoothMeasure::ImpulseResponse {
        return None;
    }
    let part = |first: usize| Matrix::from_fn(m, 2 * m, |i, j| f64::from(u8::from(first + i == j)));
    let (v, limit, slopes) = match measure {
        SmoothMeasure::Ea => (truth[..n].to_vec(), p[..m].to_vec(), part(0)),
        SmoothMeasure::Eh => (truth[n..].to_vec(), p[m..].to_vec(), part(m)),
        SmoothMeasure::Eb => {
            let (b, slopes) = input_vector(p);
            (population.plant.b().to_vec(), b, slopes)
        }
        SmoothMeasure::ImpulseResponse => {
            let (g, slopes) = impulse_response(p);
            (impulse_response(&truth).0, g, slopes)
        }
    };
    let size = v.iter().map(|v| v * v).sum::<f64>();
    let weights = squares_of_root(covariance, &slopes)?;
    let weights: Vec<f64> = weights.iter().map(|w| w / size).collect();
    Some(Figure {
        limit: relative_error(&v, &limit),
        sqrt_n_rms: weights.iter().sum::<f64>().sqrt(),
        weights,
    })
}

/// The eigenvalues of `J P J'`, P symmetric and not negative, but for zeros: those of `(J R)'(J R)` with `P = R R'`.
fn squares_of_root(p: &Matrix, slopes: &Matrix) -> Option<Vec<f64>> {
    let n = p.nrows();
    let symmetric = Matrix::from_fn(n, n, |i, j| 0.5 * (p[(i, j)] + p[(j, i)]));
    let moved = slopes * &symmetric.root();
    let values = (&moved.transpose() * &moved).symmetric_eigenvalues()?;
    Some(values.into_iter().map(|w| w.max(0.0)).collect())
}

/// g(1) ... of B/A, and its derivative with respect to p: `dg / dalpha_i = -g(k-i) / A`,
/// `dg / dbeta_i = delta(k-i) / A`.
fn impulse_response(p: &[f64]) -> (Vec<f64>, Matrix) {
    let m = p.len() / 2;
    let a = [&[1.0], &p[..m]].concat();
    let mut g = vec![0.0; RESPONSE + 1];
    let length = (m + 1).min(g.len());
    g[1..length].copy_from_slice(&p[m..m + length - 1]);
    divide(&a, &mut g);
    let (mut of_alpha, mut of_beta) = (g.clone(), vec![0.0; RESPONSE + 1]);
    of_beta[0] = 1.0;
    divide(&a, &mut of_alpha);
    divide(&a, &mut of_beta);
    let slopes = Matrix::from_fn(RESPONSE, 2 * m, |k, j| {
        let (from, lag, sign) = if j < m {
            (&of_alpha, j + 1, -1.0)
        } else {
            (&of_beta, j + 1 - m, 1.0)
        };
        (k + 1).checked_sub(lag).map_or(0.0, |k| sign * from[k])
    });
    (g[1..].to_vec(), slopes)
}
