//! FIT: how much of a record's output a model explains.

use super::errors_ahead;
use crate::model::LinearModel;
use std::ops::Range;

/// `100 (1 - || y - yhat || / || y - mean(y) ||)` per cent over a range of samples; NaN if y is constant there.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Fit {
    /// FIT with yhat simulated from x0, using u only.
    pub simulated: f64,
    /// FIT with yhat predicted one step ahead, using y up to k - 1, from the start of [`super::prediction_errors`], or
    /// from rest where x0 is 0; NaN if there is no start.
    pub one_step: f64,
    /// FIT with yhat predicted some steps ahead, using y up to k less [`Ahead::steps`]; `None` for one step.
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

/// The mean of some samples.
pub(crate) fn mean(y: &[f64]) -> f64 {
    y.iter().sum::<f64>() / y.len() as f64
}

/// FIT of a sum of squared errors in y.
pub(crate) fn percent(squares: f64, y: &[f64], mean: f64) -> f64 {
    let spread: f64 = y.iter().map(|y| (y - mean) * (y - mean)).sum();
    if spread > 0.0 {
        100.0 * (1.0 - (squares / spread).sqrt())
    } else {
        f64::NAN
    }
}
