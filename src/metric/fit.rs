//! FIT: how much of a record's output a model explains.

use crate::plant::simulate;
use std::ops::Range;

/// `100 (1 - || y - yhat || / || y - mean(y) ||)` per cent on some samples; NaN where y is
/// constant.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Fit {
    /// With yhat simulated from x0: only u is used.
    pub simulated: f64,
    /// With yhat predicted one step ahead, `yhat(k) = phi(k)' theta`: y up to k - 1 is used.
    /// Samples before k = n have no prediction and are left out.
    pub one_step: f64,
}

/// A model as [`fit`] needs it: a, h and b of length n, and x0.
#[derive(Clone, Copy, Debug)]
pub struct FitModel<'a> {
    /// Last row of A.
    pub a: &'a [f64],
    /// Input vector.
    pub b: &'a [f64],
    /// Numerator.
    pub h: &'a [f64],
    /// Initial state at k = 0.
    pub x0: &'a [f64],
}

/// FIT of a model on the samples k in `range` of a record that begins at k = 0.
///
/// # Panics
/// If u and y differ in length or the range reaches beyond them.
pub fn fit(model: FitModel<'_>, u: &[f64], y: &[f64], range: Range<usize>) -> Fit {
    assert!(u.len() == y.len() && range.end <= y.len());
    let n = model.a.len();
    let mean = range.clone().map(|k| y[k]).sum::<f64>() / range.len() as f64;
    let mut simulated = 0.0;
    let mut x = model.x0.to_vec();
    simulate(
        model.a,
        model.b,
        &mut x,
        &u[..range.end],
        #[inline(always)]
        |k, x| {
            if k >= range.start {
                simulated += (y[k] - x[0]) * (y[k] - x[0]);
            }
        },
    );
    let predict = |k: usize| -> f64 {
        let lags = 1..=n;
        lags.map(|i| model.a[n - i] * y[k - i] + model.h[i - 1] * u[k - i])
            .sum()
    };
    let predicted: f64 = (range.start.max(n)..range.end)
        .map(|k| (y[k] - predict(k)) * (y[k] - predict(k)))
        .sum();
    let spread = |from: usize| -> f64 {
        (from..range.end)
            .map(|k| (y[k] - mean) * (y[k] - mean))
            .sum()
    };
    let percent = |error: f64, spread: f64| {
        if spread > 0.0 {
            100.0 * (1.0 - (error / spread).sqrt())
        } else {
            f64::NAN
        }
    };
    Fit {
        simulated: percent(simulated, spread(range.start)),
        one_step: percent(predicted, spread(range.start.max(n))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_perfect_model_has_100_and_the_mean_has_0() {
        let u: Vec<f64> = (0..50).map(|k| f64::from((k * 7) % 5) - 2.0).collect();
        let (a, b) = ([0.5], [2.0]);
        let mut y = Vec::new();
        simulate(&a, &b, &mut [3.0], &u, |_, x| y.push(x[0]));
        let model = FitModel {
            a: &a,
            b: &b,
            h: &b,
            x0: &[3.0],
        };
        let perfect = fit(model, &u, &y, 10..50);
        assert!(
            (perfect.simulated - 100.0).abs() < 1e-10 && (perfect.one_step - 100.0).abs() < 1e-10
        );
        let mean = y[10..].iter().sum::<f64>() / 40.0;
        let constant = FitModel {
            a: &[1.0],
            b: &[0.0],
            h: &[0.0],
            x0: &[mean],
        };
        assert!(fit(constant, &u, &y, 10..50).simulated.abs() < 1e-10);
        assert!(fit(model, &u, &[1.0; 50], 0..50).simulated.is_nan());
    }
}
