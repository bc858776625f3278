//! The errors of a model's one-step predictions of a record, with their gradient, for any polynomial model.

use super::InitialCondition;
use super::predictor::{OfRecord, Predictor, initial_numbers};
use crate::estimator::Runs;
use crate::model::LinearModel;
use std::ops::Range;

/// `e(k)` and `psi(k) = de(k)/dtheta`, theta being the parameters and, where the start is fitted, its numbers.
pub(crate) struct PredictionGradient {
    /// e.
    pub(crate) errors: Vec<f64>,
    /// The first sample whose prediction does not look back beyond the record, or from the start that is taken.
    pub(crate) first: usize,
    /// The columns of psi: these delays of each signal, which is zero before the record.
    pub(crate) signals: Vec<(Vec<f64>, Range<usize>)>,
}

impl PredictionGradient {
    /// `None` if the predictor is not stable, a number overflows, or the record is shorter than the predictor's memory.
    pub(crate) fn new(model: &LinearModel, u: &[f64], y: &[f64], start: InitialCondition) -> Option<Self> {
        let orders = model.orders();
        let has_memory = orders.nc + orders.nd + orders.nf > 0;
        let fitted = start == InitialCondition::Estimate;
        let initial = if fitted && has_memory {
            initial_numbers(orders)
        } else {
            0
        };
        if initial >= u.len() {
            return None;
        }
        let of_record = OfRecord { offset: false, initial };
        let mut predictor = Predictor::new(orders, of_record, Runs::new(&[u.len()]));
        let mut theta: Vec<f64> = model.parameters().collect();
        theta.resize(theta.len() + initial, 0.0);
        predictor.sum(u, y, &theta)?;
        if initial > 0 {
            theta.truncate(orders.parameters());
            theta.extend(predictor.best_start()?);
            predictor.sum(u, y, &theta)?;
        }
        let signals = predictor.signals();
        Some(Self {
            errors: std::mem::take(&mut predictor.e),
            first: if fitted && !has_memory {
                orders.reach().min(u.len())
            } else {
                0
            },
            signals,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns of psi are differences of e in one parameter, or one number of the start, at a time; the numbers of the
    /// start are linear, so that with the fitted ones e is orthogonal to their columns.
    #[test]
    fn the_gradient_is_that_of_the_errors() {
        let u: Vec<f64> = (0..60_u32).map(|k| f64::from((k * k * 7) % 11) - 5.0).collect();
        let y: Vec<f64> = (0..60_u32).map(|k| f64::from((k * 13) % 17) - 8.0).collect();
        for orders in ["na=2,nb=2,nk=1", "nb=2,nf=2,nk=2", "na=1,nb=1,nc=1,nd=1,nf=1,nk=0"] {
            let mut model = LinearModel::zero(orders.parse().unwrap());
            let count = model.orders().parameters();
            let theta: Vec<f64> = [0.4, 0.3, -0.2, 0.25, 0.1][..count].to_vec();
            model.set_parameters(&theta);
            for start in [InitialCondition::Zero, InitialCondition::Estimate] {
                let found = PredictionGradient::new(&model, &u, &y, start).unwrap();
                let columns: Vec<Vec<f64>> = found
                    .signals
                    .iter()
                    .flat_map(|(signal, delays)| {
                        delays.clone().map(move |delay| {
                            let mut column = vec![0.0; delay];
                            column.extend(&signal[..signal.len() - delay]);
                            column
                        })
                    })
                    .collect();
                if start == InitialCondition::Estimate {
                    for column in &columns[count..] {
                        let product: f64 = column.iter().zip(&found.errors).map(|(a, b)| a * b).sum();
                        assert!(product.abs() < 1e-9, "{orders}: {product}");
                    }
                    continue;
                }
                assert_eq!(columns.len(), count);
                let h = 1e-6;
                for (i, column) in columns.iter().enumerate() {
                    let at = |by: f64| {
                        let mut moved = theta.clone();
                        moved[i] += by;
                        let mut model = model.clone();
                        model.set_parameters(&moved);
                        let mut e = vec![0.0; u.len()];
                        model.residuals(&u, &y, &mut e, &mut vec![0.0; u.len()]);
                        e
                    };
                    for ((more, less), psi) in at(h).iter().zip(at(-h)).zip(column) {
                        let slope = (more - less) / (2.0 * h);
                        let error = (slope - psi).abs();
                        assert!(error < 1e-6 * (1.0 + psi.abs()), "{orders} {i}: {slope} {psi}");
                    }
                }
            }
        }
    }
}
