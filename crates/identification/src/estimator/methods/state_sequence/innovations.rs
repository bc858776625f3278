//! The innovations form of a sequence of states, as polynomials.

use crate::estimator::initial_state_choice::StateEstimate;
use crate::estimator::numerator::fit_numerator;
use crate::estimator::prediction_error::kernels::Triangle;
use crate::estimator::reflection::{Stabilise, reflect_zeros, stable};
use crate::estimator::solver::rank::{check_rank_of_columns, condition_of_triangle};
use crate::estimator::{FailureKind, InitialCondition, Pass, Window, prediction_errors};
use crate::failure::all_finite;
use crate::model::LinearModel;
use crate::plant::polynomial_from_poles;
use faer::{Mat, MatRef};

/// Fits `x(t+1) = (A - K C) x + (B - K D) u + K y` and `y = C x + D u` by least squares, with `x(t) = J z(t)`, and
/// sets the polynomials. Returns the condition of the states.
pub(super) fn fit(
    u: &[f64],
    y: &[f64],
    j: &MatRef<'_, f64>,
    s: usize,
    model: &mut LinearModel,
) -> Result<f64, FailureKind> {
    let (n, direct) = (j.nrows(), model.delay == 0);
    let count = y.len() - s;
    let mut x = Mat::zeros(n, count);
    for t in 0..count {
        for i in 0..n {
            let of_y = (0..s).map(|lag| j[(i, lag)] * y[s + t - 1 - lag]);
            let of_u = (0..s).map(|lag| j[(i, s + lag)] * u[s + t - 1 - lag]);
            x[(i, t)] = of_y.sum::<f64>() + of_u.sum::<f64>();
        }
    }
    // Columns x, then u and y, then the next x; with a delay y does not see u.
    let (of_u, of_y) = if direct { (n, n + 1) } else { (n + 1, n) };
    let mut triangle = Triangle::new(2 * n + 2);
    triangle.run(count - 1, |column, first, to| {
        for (to, t) in to.iter_mut().zip(first..) {
            *to = match column {
                column if column < n => x[(column, t)],
                column if column == of_u => u[s + t],
                column if column == of_y => y[s + t],
                column if column < 2 * n + 2 => x[(column - n - 2, t + 1)],
                _ => 0.0,
            };
        }
    })?;
    let r = triangle.r();
    let of_states = r.get(..n, ..n);
    let condition = condition_of_triangle(of_states)?;
    check_rank_of_columns(condition, n)?;
    let is_combination = |of: usize| {
        let length = (0..=of).map(|i| r[(i, of)].powi(2)).sum::<f64>().sqrt();
        r[(of, of)].abs() <= length * (n + 2) as f64 * f64::EPSILON * 64.0
    };
    // An input that is silent, or known from the states, determines no B.
    if is_combination(of_u) {
        return Err(FailureKind::RankDeficient);
    }
    // The output is a combination of states (and u) only where there is no noise: then K is 0.
    let noise = !is_combination(of_y);
    let solve = |column: usize, unknowns: usize| {
        let mut solution = vec![0.0; unknowns];
        for i in (0..unknowns).rev() {
            if i == of_y && !noise {
                continue;
            }
            let sum: f64 = (i + 1..unknowns).map(|l| r[(i, l)] * solution[l]).sum();
            solution[i] = (r[(i, column)] - sum) / r[(i, i)];
        }
        solution
    };
    let output = solve(of_y, of_y);
    let next: Vec<Vec<f64>> = (0..n).map(|i| solve(n + 2 + i, n + 2)).collect();
    let closed = Mat::from_fn(n, n, |i, l| next[i][l]);
    let a = Mat::from_fn(n, n, |i, l| next[i][l] + next[i][of_y] * output[l]);
    let d = if direct { output[of_u] } else { 0.0 };
    let b: Vec<f64> = next.iter().map(|next| next[of_u] + next[of_y] * d).collect();
    characteristic(a.as_ref(), &mut model.a)?;
    characteristic(closed.as_ref(), &mut model.c)?;
    numerator(&a, &b, &output[..n], d, model);
    Ok(condition)
}

/// Takes a model for the pass, with its loss, from rest or from the start that is best for each: the predictor's
/// for the loss, and x0, as stage 6 finds it, for the output.
///
/// # Errors
/// [`FailureKind::NonFinite`]; as for [`fit_numerator`].
pub(in crate::estimator) fn conclude(
    window: Window<'_>,
    (stabilise, initial): (Stabilise, InitialCondition),
    (mut model, condition): (LinearModel, f64),
    pass: &mut Pass,
) -> Result<(), FailureKind> {
    let Window { u, y, .. } = window;
    make_stable(u, y, stabilise, &mut model)?;
    let orders = model.orders();
    let mut e = vec![0.0; y.len()];
    if initial == InitialCondition::Zero {
        model.residuals(u, y, &mut e, &mut vec![0.0; y.len()]);
    } else {
        let found = prediction_errors(&model, u, y, y.len());
        e = found.ok_or(FailureKind::NonFinite)?.1;
        pass.start_numbers = orders.order();
    }
    let sum: f64 = e.iter().map(|e| e * e).sum();
    let fitted = orders.parameters() + pass.start_numbers;
    model.noise_variance = sum / y.len().saturating_sub(fitted) as f64;
    pass.loss = sum / y.len() as f64;
    pass.set_model(&model, condition)?;
    StateEstimate::new(orders.order(), initial.into()).estimate(window, 0, pass);
    Ok(())
}

/// Reflects zeros of C, and those of A if that is wanted; then B is fitted again, by the prediction errors.
fn make_stable(u: &[f64], y: &[f64], stabilise: Stabilise, model: &mut LinearModel) -> Result<(), FailureKind> {
    let scratch = &mut Vec::new();
    let reflected = |finite: bool| finite.then_some(()).ok_or(FailureKind::NonFinite);
    if !stable(&model.c, scratch) {
        reflected(reflect_zeros(&mut model.c))?;
    }
    if stabilise == Stabilise::None || stable(&model.a, scratch) {
        return Ok(());
    }
    reflected(reflect_zeros(&mut model.a))?;
    fit_numerator(model, u, y)
}

/// Computes `det(I - A q^-1)`.
pub(in crate::estimator) fn characteristic(a: MatRef<'_, f64>, to: &mut [f64]) -> Result<(), FailureKind> {
    let poles = a.eigenvalues().map_err(|_| FailureKind::NonFinite)?;
    for (to, coefficient) in to[1..].iter_mut().zip(polynomial_from_poles(&poles)) {
        *to = coefficient.re;
    }
    all_finite(&*to)
}

/// Sets B, the product of A and of the impulse response `d, c b, c A b ...`, whose powers beyond n vanish.
fn numerator(a: &Mat<f64>, b: &[f64], c: &[f64], d: f64, model: &mut LinearModel) {
    let n = c.len();
    let mut response = vec![d];
    let mut state = Mat::from_fn(n, 1, |i, _| b[i]);
    for _ in 0..n {
        response.push(c.iter().enumerate().map(|(i, c)| c * state[(i, 0)]).sum());
        state = a * &state;
    }
    for i in model.delay..=n {
        model.b[i] = (0..=i).map(|j| model.a[j] * response[i - j]).sum();
    }
}
