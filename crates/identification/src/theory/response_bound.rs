//! The Cramer-Rao value of the error of an impulse response: a distance for models of any order.

use super::fisher_information::FisherInformation;
use super::matrix::Matrix;
use super::missing::Missing;
use crate::model::polynomial::divide;
use crate::plant::{PoleFinder, StateSpace};

/// Lags until the plant's response has decayed to this part of itself, within these bounds.
const DECAYED: f64 = 1e-8;
const LAGS: [usize; 2] = [200, 20_000];

/// The squared error of an impulse response over what it is on average at the Cramer-Rao bound,
///
/// ```text
/// d = sum_k (ghat(k) - g(k))^2 / tr(M F^-1),   M = sum_k g'(k) g'(k)',   k = 0 ... L,
/// ```
///
/// g' the gradient by the p free coefficients of the plant, F their [`FisherInformation`]. By Parseval both are the
/// squared error of the frequency response, integrated over all frequencies. For an estimate that reaches the bound, d
/// tends to
/// `sum_i w_i z_i^2`, z standard normal, w the eigenvalues of `M F^-1` over their sum: its mean is 1.
///
/// Source: Ljung, System Identification, 2nd ed., sections 9.4 and 9.5.
#[derive(Clone, Debug)]
pub struct ResponseBound {
    /// g(1) ... g(L) of the plant; g(0) is 0.
    markov: Vec<f64>,
    /// `tr(M F^-1)`.
    expected: f64,
    /// The weights w of the law of d, of sum 1.
    pub weights: Vec<f64>,
}

impl ResponseBound {
    /// Computes the bound for a stable plant from the information of a record.
    ///
    /// # Errors
    /// [`Missing::Singular`] if the information is singular, or if the plant is not stable.
    pub fn new(information: &FisherInformation, plant: &StateSpace) -> Result<Self, Missing> {
        let n = plant.order();
        let radius = PoleFinder::new(n).spectral_radius(plant.a(), true);
        if !plant.is_stable() || radius >= 1.0 {
            return Err(Missing::Singular);
        }
        let lags = (libm::log(DECAYED) / libm::log(radius.max(1e-3))).ceil() as usize;
        let lags = lags.clamp(LAGS[0], LAGS[1]);
        let denominator: Vec<f64> = [1.0].into_iter().chain(plant.a().iter().rev().map(|a| -a)).collect();
        // 1/A, and B/A from it, g(k) at place k; then -B/A^2.
        let mut by_beta = vec![0.0; lags + 1];
        by_beta[0] = 1.0;
        divide(&denominator, &mut by_beta);
        let delayed = |x: &[f64], k: usize, by: usize| k.checked_sub(by).map_or(0.0, |k| x[k]);
        let h = plant.h();
        let response = |k: usize| (1..=n).map(|i| h[i - 1] * delayed(&by_beta, k, i)).sum();
        let markov: Vec<f64> = (0..=lags).map(response).collect();
        let mut by_alpha: Vec<f64> = markov.iter().map(|g| -g).collect();
        divide(&denominator, &mut by_alpha);
        let (free, of_free) = information.of_free();
        let slope = |place: usize, k: usize| match place.checked_sub(n) {
            None => delayed(&by_alpha, k, place + 1),
            Some(i) => delayed(&by_beta, k, i + 1),
        };
        let gram = Matrix::from_fn(free.len(), free.len(), |i, j| -> f64 {
            (0..=lags).map(|k| slope(free[i], k) * slope(free[j], k)).sum()
        });
        let eigenvalues = relative_eigenvalues(&gram, &of_free).ok_or(Missing::Singular)?;
        let expected: f64 = eigenvalues.iter().sum();
        if !(expected > 0.0 && expected.is_finite()) {
            return Err(Missing::Singular);
        }
        Ok(Self {
            markov: markov[1..].to_vec(),
            expected,
            weights: eigenvalues.iter().map(|of| of / expected).collect(),
        })
    }

    /// Returns d of a model from its last row of A, its input vector and its direct term; infinite if its response
    /// overflows.
    pub fn distance(&self, a: &[f64], b: &[f64], direct: f64) -> f64 {
        let (mut x, mut square) = (b.to_vec(), direct * direct);
        for g in &self.markov {
            square += (g - x[0]).powi(2);
            let next = a.iter().zip(&x).map(|(a, x)| a * x).sum();
            x.rotate_left(1);
            x[a.len() - 1] = next;
        }
        if square.is_finite() {
            square / self.expected
        } else {
            f64::INFINITY
        }
    }
}

/// Returns the weights of the law of d, measured with one information, of an estimate that reaches the bound of another
/// about the same coefficients: the eigenvalues of `F G^-1` over p. `None` if one is singular.
pub fn weights_between(measured: &FisherInformation, reached: &FisherInformation) -> Option<Vec<f64>> {
    let [(_, f), (_, g)] = [measured, reached].map(FisherInformation::of_free);
    let each = relative_eigenvalues(&f, &g)?.into_iter();
    Some(each.map(|of| of / measured.free() as f64).collect())
}

/// The eigenvalues of `M F^-1`: those of `R' F^-1 R` with `M = R R'`, both scaled so that F has ones on its diagonal.
fn relative_eigenvalues(m: &Matrix, f: &Matrix) -> Option<Vec<f64>> {
    let size = f.nrows();
    let scale: Vec<f64> = (0..size).map(|i| f[(i, i)].sqrt().recip()).collect();
    let scaled = |of: &Matrix| Matrix::from_fn(size, size, |i, j| of[(i, j)] * scale[i] * scale[j]);
    let (root, information) = (scaled(m).root(), scaled(f));
    let whole = &root.transpose() * &information.solve(&root);
    let symmetric = Matrix::from_fn(size, size, |i, j| 0.5 * (whole[(i, j)] + whole[(j, i)]));
    let eigenvalues = symmetric.symmetric_eigenvalues()?;
    let is_positive = information.symmetric_eigenvalues()?.iter().all(|of| *of > 0.0);
    (is_positive && symmetric.is_all_finite()).then(|| eigenvalues.into_iter().map(|of| of.max(0.0)).collect())
}
