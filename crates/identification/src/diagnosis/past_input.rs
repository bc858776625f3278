//! Whether past input explains residuals: a score test of added lags of u.

use super::added_columns::AddedColumns;
use super::verdict::{Whiteness, lags_of, of_two};
use crate::estimator::{Autoregression, InitialCondition, PredictionGradient};
use crate::model::LinearModel;
use crate::model::polynomial::filter;

/// Lags that are tested by themselves beside all of them.
const NEAR: usize = 5;

/// Samples that are tested, of a longer record the first.
const MOST: usize = 100_000;

/// Singular values of psi that count, of the largest.
const TOLERANCE: f64 = 1e-9;

/// Returns the test of the residuals' freedom from past input; `None` where nothing is left to test with this input, or
/// the predictor is not stable.
///
/// u is taken as given. The residuals e are regressed on psi, the gradient of the prediction (which holds the
/// parameters of A, B, F, and those of the start where it was fitted), on 1, and on u(k-1) ... u(k-L), with u(k) if
/// nk = 0 and L of [`lags_of`], after all of them were filtered by an autoregression of e: its order, at most 10 and
/// M/20 of M rows, is that by AIC. The F test of the added lags is made for the first five of them and for all; the
/// result is that of the smaller p-value of two. So nothing is assumed of u, whose spectrum may have any form, fitted
/// parameters cost their degrees of freedom, and e may be coloured.
///
/// Of more than 100,000 samples the first are tested.
///
/// A model of records that begin at rest is tested in all rows, with zeros before the record; others where all lags
/// lie in it.
pub(super) fn past_input(model: &LinearModel, u: &[f64], y: &[f64], start: InitialCondition) -> Option<Whiteness> {
    let tested = u.len().min(MOST);
    let (u, y) = (&u[..tested], &y[..tested]);
    let mut of = PredictionGradient::new(model, u, y, start)?;
    let lags = lags_of(u.len());
    let first = match start {
        InitialCondition::Zero => 0,
        InitialCondition::Estimate => of.first.max(lags),
    };
    let rows = u.len().checked_sub(first).filter(|_| lags > 0)?;
    let of_rows = &mut of.errors[first..];
    let mean = of_rows.iter().sum::<f64>() / rows as f64;
    for e in of_rows.iter_mut() {
        *e -= mean;
    }
    let mut noise = Autoregression::default();
    noise.fit_within(of_rows, 10.min(rows / 20));
    let whitened = |signal: &[f64]| {
        let mut to = vec![0.0; signal.len()];
        filter(noise.denominator(), signal, &mut to);
        to
    };
    let first = first + noise.denominator().len() - 1;
    let (e, u_whitened) = (whitened(&of.errors), whitened(u));
    let signals: Vec<Vec<f64>> = of.signals.iter().map(|(signal, _)| whitened(signal)).collect();
    // Each column is a delayed signal; 1 has none.
    let mut columns: Vec<Option<(&[f64], usize)>> = Vec::new();
    for (signal, (_, delays)) in signals.iter().zip(&of.signals) {
        columns.extend(delays.clone().map(|delay| Some((signal.as_slice(), delay))));
    }
    columns.push(None);
    let known = columns.len();
    let least = usize::from(model.delay > 0);
    columns.extend((least..=lags).map(|lag| Some((u_whitened.as_slice(), lag))));
    let added = columns.len() - known;
    columns.push(Some((&e, 0)));
    let regression = AddedColumns::new(
        u.len() - first,
        columns.len(),
        TOLERANCE,
        |column, row, to| match columns[column] {
            None => to.fill(1.0),
            Some((signal, delay)) => {
                for (to, k) in to.iter_mut().zip(first + row..) {
                    *to = k.checked_sub(delay).map_or(0.0, |k| signal[k]);
                }
            }
        },
    )?;
    let near = (NEAR + 1 - least).min(added);
    of_two(regression.test(known, near), regression.test(known, added), added)
}
