//! Levinson's step-down recursion: the predictors of a stationary process, and with them energies.

use crate::real::Real;

/// Steps down once, in place: from the predictor of order m to that of order m - 1.
///
/// `d^(m-1)_i = (d^(m)_i - kappa d^(m)_(m-i)) / (1 - kappa^2)`, `kappa = d^(m)_m`; `d` holds `d_1 ... d_m`. Returns
/// kappa. If |kappa| >= 1 or kappa is NaN, the new `d` is meaningless.
#[inline(always)]
pub(crate) fn step_down<R: Real>(d: &mut [R]) -> R {
    let m = d.len();
    let kappa = d[m - 1];
    let one = R::splat(1.0);
    let inverse = one / ((one - kappa) * (one + kappa));
    for i in 0..(m - 1).div_ceil(2) {
        let j = m - 2 - i;
        let (low, high) = (d[i], d[j]);
        d[i] = kappa.neg_mul_add(high, low) * inverse;
        d[j] = kappa.neg_mul_add(low, high) * inverse;
    }
    kappa
}

/// The predictors of orders 0 ... p of the stationary process `D(q) v = w`, with white w of unit variance.
#[derive(Clone, Debug, PartialEq)]
pub struct StepDown {
    /// `predictors[m]` holds d^(m)_1 ... d^(m)_m.
    predictors: Vec<Vec<f64>>,
    /// Standard deviations of the prediction errors; the last is 1.
    deviations: Vec<f64>,
}

impl StepDown {
    /// Makes the recursion for `D = 1 + d_1 q^-1 + ... + d_p q^-p`; `None` if D is not stable.
    pub fn new(d: &[f64]) -> Option<Self> {
        let p = d.len();
        let mut predictors = vec![d.to_vec()];
        let mut variances = vec![1.0];
        let mut current = d.to_vec();
        for m in (1..=p).rev() {
            let kappa = step_down(&mut current[..m]);
            // `!(... < 1.0)` also refuses NaN.
            if !(kappa.abs() < 1.0) {
                return None;
            }
            variances.push(variances[p - m] / ((1.0 - kappa) * (1.0 + kappa)));
            predictors.push(current[..m - 1].to_vec());
        }
        predictors.reverse();
        variances.reverse();
        let deviations = variances.iter().map(|v: &f64| v.sqrt()).collect();
        Some(Self { predictors, deviations })
    }

    /// Returns the predictor polynomial of an order and the standard deviation of its error.
    pub fn predictor(&self, order: usize) -> (&[f64], f64) {
        (&self.predictors[order], self.deviations[order])
    }

    /// Returns `sum_k g(k)^2` of the impulse response g of `C(q) / D(q)`, with C given by `c_0 ... c_q`.
    ///
    /// Computed by the recursion of Astrom, Jury and Agniel: with `c^(m-1)_i = c^(m)_i - c^(m)_m d^(m)_(m-i)` the sum
    /// is `sum_m (c^(m)_m sigma_m)^2`.
    pub fn energy(&self, numerator: &[f64]) -> f64 {
        let p = self.predictors.len() - 1;
        let mut c = numerator.to_vec();
        c.resize(c.len().max(p + 1), 0.0);
        let mut energy = 0.0;
        for m in (0..c.len()).rev() {
            let last = c[m];
            let (predictor, deviation) = self.predictor(m.min(p));
            energy += (last * deviation) * (last * deviation);
            // d^(m)_(m-i) is zero beyond order p.
            for i in 0..m {
                if let Some(d) = predictor.get(m - i - 1) {
                    c[i] = (-last).mul_add(*d, c[i]);
                }
            }
        }
        energy
    }
}
