//! Kreisselmeier's adaptive observer.

use super::AdaptiveObserver;
use super::filters::StateFilters;
use crate::estimator::recursive::Diverged;

/// The tuning of [`Kreisselmeier`].
#[derive(Clone, Debug, PartialEq)]
pub struct KreisselmeierSettings {
    /// Coefficients f_1 ... f_n of the filters' characteristic polynomial.
    pub filter: Vec<f64>,
    /// The share q of the memory that is left after a sample, from 0 to 1.
    pub memory: f64,
    /// The gain gamma, above 0 and below 2: the step is `gamma / tr R` times the gradient.
    pub gain: f64,
}

/// Filters as [`StateFilters`], and the gradient of the exponentially weighted sum of squares of `y - z' p`:
///
/// ```text
///     R = q R + z z',  r = q r + z y,  p = p + gamma / tr(R) (r - R p),  xhat_o = M p
/// ```
///
/// It converges exponentially where u excites; at gamma below 2 it cannot leave, since no eigenvalue of R exceeds tr R.
/// The source has derivatives for differences and a constant gain; the normalised gain makes the rate independent of
/// the signals' size. A sample takes about 12 n^2 multiplications and additions.
///
/// Source: G. Kreisselmeier, Adaptive observers with exponential rate of convergence, IEEE Trans. Automatic Control 22,
/// 1977, section IV.
#[derive(Clone, Debug)]
pub struct Kreisselmeier {
    settings: KreisselmeierSettings,
    filters: StateFilters,
    /// R (2n x 2n) and r.
    weights: Vec<f64>,
    products: Vec<f64>,
    z: Vec<f64>,
    p: Vec<f64>,
    gradient: Vec<f64>,
    alpha: Vec<f64>,
    state: Vec<f64>,
}

impl Kreisselmeier {
    /// Makes the observer of a plant of the filters' order, from `alpha = f`, `h = 0` and `x_o(0) = 0`.
    ///
    /// # Panics
    /// If there are no filter coefficients.
    pub fn new(settings: KreisselmeierSettings) -> Self {
        let n = settings.filter.len();
        Self {
            filters: StateFilters::new(&settings.filter),
            weights: vec![0.0; 4 * n * n],
            products: vec![0.0; 2 * n],
            z: vec![0.0; 2 * n],
            p: vec![0.0; 2 * n],
            gradient: vec![0.0; 2 * n],
            alpha: settings.filter.clone(),
            state: vec![0.0; n],
            settings,
        }
    }
}

impl AdaptiveObserver for Kreisselmeier {
    fn restart(&mut self) {
        self.filters.restart();
        for memory in [&mut self.weights, &mut self.products, &mut self.p] {
            memory.fill(0.0);
        }
    }

    fn update(&mut self, u: f64, y: f64) -> Result<(), Diverged> {
        let (q, n) = (self.settings.memory, self.filters.order());
        self.filters.regressors(&mut self.z);
        let (mut trace, rows) = (0.0, self.weights.chunks_exact_mut(2 * n));
        for (i, row) in rows.enumerate() {
            let mut product = 0.0;
            for ((weight, z), p) in row.iter_mut().zip(&self.z).zip(&self.p) {
                *weight = q * *weight + self.z[i] * z;
                product += *weight * p;
            }
            trace += row[i];
            self.products[i] = q * self.products[i] + self.z[i] * y;
            self.gradient[i] = self.products[i] - product;
        }
        if trace > 0.0 {
            let step = self.settings.gain / trace;
            for (p, gradient) in self.p.iter_mut().zip(&self.gradient) {
                *p += step * gradient;
            }
        }
        self.filters.update(u, y);
        for ((alpha, f), p) in self.alpha.iter_mut().zip(&self.settings.filter).zip(&self.p) {
            *alpha = f - p;
        }
        self.state.fill(0.0);
        self.filters.add_product(&self.p, &mut self.state);
        self.filters.set(&self.alpha, &self.p[n..], &self.state)
    }

    fn state(&self) -> &[f64] {
        self.filters.state()
    }

    fn plant(&self) -> &[f64] {
        self.filters.plant()
    }
}
