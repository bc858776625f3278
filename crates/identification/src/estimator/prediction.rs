//! One-step predictions of a record from the best initial state.

use crate::estimator::Window;
use crate::estimator::initial_state::InitialState;
use crate::model::LinearModel;
use crate::model::polynomial::{divide, multiply};
use crate::plant::canonical::reverse_negated;

/// Returns the errors of a model's one-step predictions over a record, and the first sample that counts. `None` if no
/// start is found: the predictor is unstable and overflows, or the window is shorter than its memory.
///
/// A window of no samples tells no start: the signals before the record are zero, and every sample counts.
///
/// A predictor without C, D, F has no memory but the record. Its first `max(na, nb + nk - 1)` samples look back beyond
/// the record and do not count. Any other predictor starts from the state that minimises the sum of squared errors over
/// the first `window` samples, as MATLAB's `compare` and `predict` do. A start adds `P(q)/(C F)` to the errors, with a
/// free polynomial P of degree below `n = max(na + nf + nd, nb + nk - 1 + nd, nc + nf)`. In state space this is
/// `c'A^k x0` with the A of C F, so stage 6 finds x0.
///
/// # Panics
/// If u and y differ in length, or the window is longer than they are.
pub fn prediction_errors(model: &LinearModel, u: &[f64], y: &[f64], window: usize) -> Option<(usize, Vec<f64>)> {
    let orders = model.orders();
    let (mut e, mut scratch) = (vec![0.0; u.len()], vec![0.0; u.len()]);
    model.residuals(u, y, &mut e, &mut scratch);
    if window == 0 {
        return Some((0, e));
    }
    if orders.nc + orders.nd + orders.nf == 0 {
        return Some((orders.reach().min(u.len()), e));
    }
    let input = (orders.nb + orders.nk).saturating_sub(1);
    let n = ((orders.na + orders.nf).max(input) + orders.nd).max(orders.nc + orders.nf);
    let mut denominator = multiply(&model.c, &model.f);
    denominator.resize(n + 1, 0.0);
    let (mut a, b) = (vec![0.0; n], vec![0.0; n]);
    reverse_negated(&denominator[1..], &mut a);
    let (mut x, mut state) = (vec![0.0; n], InitialState::new(n));
    state.estimate(&a, &b, Window::new(u, &e, window), &mut x).ok()?;
    crate::plant::simulate(&a, &b, &mut x, u, |k, x| e[k] -= x[0]);
    Some((0, e))
}

/// Returns [`prediction_errors`] of predictions `horizon` steps ahead, which know u up to k and y up to k - horizon,
/// and the first sample that counts.
///
/// With `C/(A D) = sum g_i q^-i` they are `sum_(i < horizon) g_i e(k - i)`. Where the predictor has a start, the first
/// samples are predicted from it, over fewer steps.
///
/// # Panics
/// As [`prediction_errors`].
pub fn errors_ahead(
    model: &LinearModel,
    u: &[f64],
    y: &[f64],
    window: usize,
    horizon: usize,
) -> Option<(usize, Vec<f64>)> {
    let (first, mut errors) = prediction_errors(model, u, y, window)?;
    if horizon <= 1 {
        return Some((first, errors));
    }
    let e = errors.split_off(first);
    let mut g = vec![0.0; horizon.min(e.len())];
    let count = g.len().min(model.c.len());
    g[..count].copy_from_slice(&model.c[..count]);
    divide(&model.a, &mut g);
    divide(&model.d, &mut g);
    errors.extend((0..e.len()).map(|k| {
        let past = g.iter().take(k + 1).enumerate();
        past.map(|(i, g)| g * e[k - i]).sum::<f64>()
    }));
    let later = if first > 0 { horizon - 1 } else { 0 };
    Some(((first + later).min(errors.len()), errors))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `y = B/F u + C/D e` with signals that began long before the record: the errors equal the innovations. The first
    /// samples show neither an offset from the past nor its noise.
    #[test]
    fn a_record_that_began_before_is_predicted_from_its_first_sample() {
        for orders in ["nb=2,nf=2", "na=1,nb=2,nc=1", "nb=2,nc=1,nd=1,nf=2,nk=2", "nb=4,nf=1"] {
            let mut model = LinearModel::zero(orders.parse().unwrap());
            let n = model.orders().parameters();
            let theta = [0.5, 1.0, 0.3, -0.4, 0.2, 0.1, 0.3];
            model.set_parameters(&theta[..n]);
            if model.orders().nf == 2 {
                model.f = vec![1.0, -1.5, 0.7];
            }
            // The record is the end of a longer one; its innovations are 0 except at one sample.
            let (long, start) = (400, 300);
            let u: Vec<f64> = (0..long).map(|k| 10.0 + f64::from((k * 7) % 5)).collect();
            let mut e = vec![0.0; long as usize];
            e[start + 40] = 1.0;
            let (mut driven, mut noise) = (vec![0.0; e.len()], vec![0.0; e.len()]);
            model.simulate(&u, &mut driven);
            crate::model::polynomial::filter(&model.c, &e, &mut noise);
            crate::model::polynomial::divide(&model.d, &mut noise);
            crate::model::polynomial::divide(&model.a, &mut noise);
            let y: Vec<f64> = driven.iter().zip(&noise).map(|(y, v)| y + v).collect();
            // The start is fitted to samples before the innovation, so it does not depend on it.
            let (first, found) = prediction_errors(&model, &u[start..], &y[start..], 40).unwrap();
            assert_eq!((first, found.len()), (0, 100));
            for (found, e) in found.iter().zip(&e[start..]) {
                assert!((found - e).abs() < 1e-9, "{orders}: {found} instead of {e}");
            }
        }
    }

    /// A prediction h steps ahead is the output of the model whose innovations end h samples before.
    #[test]
    fn predictions_ahead_forget_the_last_innovations() {
        for orders in ["na=2,nb=2", "na=1,nb=2,nc=2", "nb=2,nc=1,nd=2,nf=1,nk=2"] {
            let mut model = LinearModel::zero(orders.parse().unwrap());
            let n = model.orders().parameters();
            let theta = [0.5, -0.3, 0.2, -0.4, 0.25, 0.1, 0.3];
            model.set_parameters(&theta[..n]);
            let u: Vec<f64> = (0..60).map(|k| f64::from((k * 7) % 5) - 2.0).collect();
            let y: Vec<f64> = (0..60).map(|k| f64::from((k * k * 7) % 11)).collect();
            let (first, e) = prediction_errors(&model, &u, &y, 60).unwrap();
            let noise = |e: &[f64]| {
                let mut v = vec![0.0; e.len()];
                crate::model::polynomial::filter(&model.c, e, &mut v);
                divide(&model.d, &mut v);
                divide(&model.a, &mut v);
                v
            };
            let e = &e[first..];
            let full = noise(e);
            for horizon in [1, 2, 5, 80] {
                let (counts, found) = errors_ahead(&model, &u, &y, 60, horizon).unwrap();
                assert_eq!(counts, if first > 0 { (first + horizon - 1).min(60) } else { 0 });
                for k in 0..e.len() {
                    let mut known = e.to_vec();
                    known[(k + 1).saturating_sub(horizon)..].fill(0.0);
                    let (found, expected) = (found[first + k], full[k] - noise(&known)[k]);
                    assert!((found - expected).abs() < 1e-12, "{orders}, {horizon}, {k}");
                }
            }
        }
    }

    #[test]
    fn a_window_shorter_than_the_memory_has_no_start() {
        let model = LinearModel::zero("nb=9,nf=1".parse().unwrap());
        assert!(prediction_errors(&model, &[1.0; 6], &[1.0; 6], 6).is_none());
    }
}
