//! Stability without eigenvalues, by Levinson's step-down recursion, also known as the Schur-Cohn or Jury test. The
//! same numbers yield predictors and energies.

use crate::real::{Mask, Real};

/// Steps down once, in place: from the predictor of order m to that of order m - 1.
///
/// `d^(m-1)_i = (d^(m)_i - kappa d^(m)_(m-i)) / (1 - kappa^2)`, `kappa = d^(m)_m`; `d` holds `d_1 ... d_m`. Returns
/// kappa. If
/// kappa| >= 1 or kappa is NaN, the new `d` is meaningless.
#[inline(always)]
fn step_down<R: Real>(d: &mut [R]) -> R {
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

/// Returns whether all zeros of `z^n - a_n z^(n-1) - ... - a_1` lie inside the unit circle, in O(n^2).
///
/// `scratch` has room for n numbers.
///
/// # Panics
/// In debug builds, if the lengths differ.
#[inline(always)]
pub fn is_stable<R: Real>(a: &[R], scratch: &mut [R]) -> R::Mask {
    super::canonical::reverse_negated(a, scratch);
    let inside = |kappa: R| kappa.abs().less(R::splat(1.0));
    let mut stable = R::Mask::from_bits(u8::MAX);
    for m in (1..=scratch.len()).rev() {
        stable = stable & inside(step_down(&mut scratch[..m]));
    }
    stable
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
        Some(Self {
            predictors,
            deviations,
        })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_quadratic() {
        // z^2 - 1.5 z + 0.7: poles 0.75 +- 0.37i, modulus 0.837.
        assert!(is_stable(&[-0.7, 1.5], &mut [0.0; 2]));
        assert!(!is_stable(&[-1.0, 1.5], &mut [0.0; 2]));
        assert!(!is_stable(&[-0.7, 1.75], &mut [0.0; 2]));
        assert!(!is_stable(&[f64::NAN, 1.0], &mut [0.0; 2]));
        assert!(is_stable::<f64>(&[], &mut []));
    }

    #[test]
    fn energy_is_the_sum_of_the_squared_impulse_response() {
        for (c, d) in [
            (vec![1.0], vec![-0.9]),
            (vec![0.5, -1.0, 2.0], vec![-1.2, 0.5]),
            (vec![1.0, 0.3, 0.0, -0.4, 2.0], vec![0.4, -0.3]),
            (vec![2.0, 1.0], vec![]),
            (vec![0.0, 1.0], vec![-1.4, 0.7875, -0.2275, 0.035525]),
        ] {
            let mut g: Vec<f64> = Vec::new();
            for k in 0..2000 {
                let mut sum = c.get(k).copied().unwrap_or(0.0);
                for (i, d) in d.iter().enumerate().take(k) {
                    sum -= d * g[k - 1 - i];
                }
                g.push(sum);
            }
            let direct: f64 = g.iter().map(|g| g * g).sum();
            let energy = StepDown::new(&d).unwrap().energy(&c);
            assert!((energy / direct - 1.0).abs() < 1e-13, "{energy} {direct}");
        }
    }
}
