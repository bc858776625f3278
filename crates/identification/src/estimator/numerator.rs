//! B of a model whose other polynomials are known.

use super::FailureKind;
use super::prediction_error::kernels::{Triangle, copy_delayed, divide, filter};
use crate::model::{LinearModel, Orders};

/// Fits B such that the sum of squared prediction errors `D/C (A y - B/F u)` is least. C and F are stable.
///
/// # Errors
/// [`FailureKind::Singular`] if the filtered input has no such B; [`FailureKind::NonFinite`].
pub(super) fn fit_numerator(model: &mut LinearModel, u: &[f64], y: &[f64]) -> Result<(), FailureKind> {
    let Orders { nb, nk, .. } = model.orders();
    let (mut of_u, mut of_y) = (vec![0.0; u.len()], vec![0.0; y.len()]);
    let mut scratch = of_y.clone();
    filter(&model.d, u, &mut of_u);
    divide(&model.c, &mut of_u);
    divide(&model.f, &mut of_u);
    filter(&model.a, y, &mut scratch);
    filter(&model.d, &scratch, &mut of_y);
    divide(&model.c, &mut of_y);
    let mut triangle = Triangle::new(nb);
    triangle.run(y.len(), |i, first, to| {
        let (signal, lag) = if i < nb { (&of_u, nk + i) } else { (&of_y, 0) };
        copy_delayed(signal, lag, first, to);
    })?;
    let b = &mut model.b[nk..];
    b.copy_from_slice(triangle.top());
    triangle.solve(b).then_some(()).ok_or(FailureKind::Singular)
}
