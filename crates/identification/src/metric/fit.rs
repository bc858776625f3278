//! FIT: how much of a record's output a model explains.

use super::errors_ahead;
use crate::model::LinearModel;
use crate::plant::simulate;
use std::ops::Range;

/// `100 (1 - || y - yhat || / || y - mean(y) ||)` per cent over a range of samples; NaN if y is constant there.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Fit {
    /// FIT with yhat simulated from x0, using u only.
    pub simulated: f64,
    /// FIT with yhat predicted one step ahead, using y up to k - 1, from the start of [`super::prediction_errors`], or
    /// from rest where x0 is 0; NaN if there is no start.
    pub one_step: f64,
    /// FIT with yhat predicted [`FitModel::horizon`] steps ahead, using y up to k - horizon; `None` for one step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ahead: Option<Ahead>,
}

/// FIT of predictions some steps ahead.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Ahead {
    /// The steps, at least 2.
    pub steps: usize,
    /// FIT.
    pub fit: f64,
}

/// A model in the form that [`fit`] needs.
#[derive(Clone, Copy, Debug)]
pub struct FitModel<'a> {
    /// The model, used for prediction.
    pub model: &'a LinearModel,
    /// Last row of A, n numbers.
    pub a: &'a [f64],
    /// Input vector.
    pub b: &'a [f64],
    /// Direct term.
    pub d: f64,
    /// Initial state at k = 0.
    pub x0: &'a [f64],
    /// Steps of the predictions ahead.
    pub horizon: usize,
}

/// Computes the FIT of a model on the samples k in `range` of a record that begins at k = 0. The first `window` samples
/// determine the start of the predictor, unless x0 is 0: then both begin at rest.
///
/// # Panics
/// If u and y differ in length, or the window or the range reaches beyond them.
pub fn fit(model: FitModel<'_>, u: &[f64], y: &[f64], window: usize, range: Range<usize>) -> Fit {
    assert!(u.len() == y.len() && range.end <= y.len());
    let FitModel {
        model,
        a,
        b,
        d,
        x0,
        horizon,
    } = model;
    let mean = mean(&y[range.clone()]);
    let mut simulated = 0.0;
    let mut x = x0.to_vec();
    simulate(
        a,
        b,
        &mut x,
        &u[..range.end],
        #[inline(always)]
        |k, x| {
            if k >= range.start {
                let error = y[k] - x[0] - d * u[k];
                simulated += error * error;
            }
        },
    );
    let window = if x0.iter().all(|x| *x == 0.0) { 0 } else { window };
    let predicted = |horizon| fit_ahead(model, u, y, window, range.clone(), horizon);
    Fit {
        simulated: percent(simulated, &y[range.clone()], mean),
        one_step: predicted(1),
        ahead: (horizon > 1).then(|| Ahead {
            steps: horizon,
            fit: predicted(horizon),
        }),
    }
}

/// Returns the FIT over a range of samples with y predicted `horizon` samples ahead; NaN if there is no start. The
/// first `window` samples determine the start of the predictor.
///
/// # Panics
/// If u and y differ in length, or the window or the range reaches beyond them.
pub fn fit_ahead(model: &LinearModel, u: &[f64], y: &[f64], window: usize, range: Range<usize>, horizon: usize) -> f64 {
    let mean = mean(&y[range.clone()]);
    let Some((first, e)) = errors_ahead(model, u, y, window, horizon) else {
        return f64::NAN;
    };
    let range = first.clamp(range.start, range.end)..range.end;
    let squares = e[range.clone()].iter().map(|e| e * e);
    percent(squares.sum(), &y[range], mean)
}

fn mean(y: &[f64]) -> f64 {
    y.iter().sum::<f64>() / y.len() as f64
}

/// FIT of a sum of squared errors in y.
fn percent(squares: f64, y: &[f64], mean: f64) -> f64 {
    let spread: f64 = y.iter().map(|y| (y - mean) * (y - mean)).sum();
    if spread > 0.0 {
        100.0 * (1.0 - (squares / spread).sqrt())
    } else {
        f64::NAN
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
        let linear = LinearModel::from_canonical(&a, &b, 1);
        let model = FitModel {
            model: &linear,
            a: &a,
            b: &b,
            d: 0.0,
            x0: &[3.0],
            horizon: 2,
        };
        let perfect = fit(model, &u, &y, 50, 10..50);
        assert!((perfect.simulated - 100.0).abs() < 1e-10 && (perfect.one_step - 100.0).abs() < 1e-10);
        assert!((perfect.ahead.unwrap().fit - 100.0).abs() < 1e-10);
        let mean = y[10..].iter().sum::<f64>() / 40.0;
        let linear = LinearModel::from_canonical(&[1.0], &[0.0], 1);
        let constant = FitModel {
            model: &linear,
            a: &[1.0],
            b: &[0.0],
            d: 0.0,
            x0: &[mean],
            horizon: 1,
        };
        assert!(fit(constant, &u, &y, 50, 10..50).simulated.abs() < 1e-10);
        assert!(fit(model, &u, &[1.0; 50], 50, 0..50).simulated.is_nan());
    }
}
