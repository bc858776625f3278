//! Tests whether the standard errors that a method prints can be trusted.
//!
//! Measures and Monte-Carlo standard errors follow Morris, White and Crowther, *Statistics in Medicine* 38 (2019),
//! table 6. The spread of moments is taken from fourth moments instead of the normal law.

use super::{Estimate, Sample, Share, Sketch};
use serde::{Deserialize, Serialize};

/// Coverage of the 95 % intervals `estimate -+ 1.96 se` of one number over trials.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Share of the intervals that hold the truth, among the trials with an interval.
    pub covered: Share,
    /// Share of the intervals that hold the mean of the estimates: the coverage without the effect of bias.
    pub bias_eliminated: Share,
    /// The mean error.
    pub bias: Estimate,
    /// The standard deviation of the estimates.
    pub empirical_se: Estimate,
    /// Root mean square of the standard errors that the method printed.
    pub model_se: Estimate,
    /// `model_se / empirical_se - 1`.
    pub relative_error: Estimate,
}

impl Coverage {
    /// Computes the coverage from errors, standard errors, and both ends of the intervals of the error. Trials without
    /// an interval are missing in `low` and `high`.
    pub fn new(error: &Sample, se: &Sample, low: &Sketch, high: &Sketch) -> Self {
        let (empirical, model) = (error.sd(), se.rmse());
        let ratio = model.value / empirical.value;
        let relative = (model.mcse / model.value).hypot(empirical.mcse / empirical.value);
        let bias = error.mean();
        Self {
            covered: holding(0.0, low, high),
            bias_eliminated: holding(bias.value, low, high),
            bias,
            empirical_se: empirical,
            model_se: model,
            relative_error: Estimate::new(ratio - 1.0, ratio * relative),
        }
    }
}

/// The share of the intervals that hold x: those with `low < x` and not `high < x`. Exact for x = 0.
fn holding(x: f64, low: &Sketch, high: &Sketch) -> Share {
    let count = low.count();
    if x.is_nan() {
        return Share::new(0, 0);
    }
    let [begun, ended] = [low, high].map(|ends| ends.share_below(x).count);
    Share::new(begun.saturating_sub(ended), count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metric::Z;

    fn coverage(errors: &[f64], ses: &[f64]) -> Coverage {
        let ends = |sign: f64| {
            let ends = errors.iter().zip(ses).map(|(e, se)| e + sign * Z * se);
            Sketch::from_values(ends)
        };
        let sample = |values: &[f64]| Sample::from_values(values.iter().copied());
        Coverage::new(&sample(errors), &sample(ses), &ends(-1.0), &ends(1.0))
    }

    /// By hand: errors 0, 1, 2 ... 39 with standard errors 5. Intervals hold the truth if |e| < 9.8, the mean if |e -
    /// 19.5| < 9.8.
    #[test]
    fn counts_by_hand() {
        let errors: Vec<f64> = (0..40).map(f64::from).collect();
        let found = coverage(&errors, &[5.0; 40]);
        assert_eq!((found.covered.count, found.covered.total), (10, 40));
        // 10, 11, ... 29
        assert_eq!(found.bias_eliminated.count, 20);
        assert!((found.bias.value - 19.5).abs() < 1e-14);
        let variance = (40.0 * 40.0 - 1.0) / 12.0 * 40.0 / 39.0;
        assert!((found.empirical_se.value - f64::sqrt(variance)).abs() < 1e-12);
        assert_eq!((found.model_se.value, found.model_se.mcse), (5.0, 0.0));
        let relative = 5.0 / f64::sqrt(variance) - 1.0;
        assert!((found.relative_error.value - relative).abs() < 1e-12);
    }

    /// Standard errors 3 and 4 in turn: the root of the mean square is sqrt(12.5), and its error by table 6 is
    /// sqrt(Var(se^2) / (4 M 12.5)), Var(se^2) = 3.5^2 M / (M - 1).
    #[test]
    fn errors_of_standard_errors_by_hand() {
        let m = 100.0;
        let ses: Vec<f64> = (0..100).map(|i| if i % 2 == 0 { 3.0 } else { 4.0 }).collect();
        let errors: Vec<f64> = (0..100).map(|i| f64::from(i) - 49.5).collect();
        let found = coverage(&errors, &ses);
        assert!((found.model_se.value - 12.5_f64.sqrt()).abs() < 1e-12);
        let expected = (3.5_f64.powi(2) * m / (m - 1.0) / (4.0 * m * 12.5)).sqrt();
        assert!((found.model_se.mcse - expected).abs() < 1e-12);
    }
}
