//! Checks of shapes, finite entries and covariances.

use super::equation::{RiccatiError, symmetric};
use faer::{Mat, MatRef, Side};

/// Checks the size of a matrix, and that its entries are finite.
pub(in crate::observer) fn check(
    name: &'static str,
    m: MatRef<'_, f64>,
    rows: usize,
    columns: usize,
) -> Result<(), RiccatiError> {
    if m.shape() != (rows, columns) {
        return Err(RiccatiError::Shape {
            name,
            rows,
            columns,
            actual_rows: m.nrows(),
            actual_columns: m.ncols(),
        });
    }
    if m.is_all_finite() {
        Ok(())
    } else {
        Err(RiccatiError::NotFinite(name))
    }
}

/// Checks a column of `n` numbers.
pub(in crate::observer) fn check_column(name: &'static str, v: &[f64], n: usize) -> Result<(), RiccatiError> {
    check(name, MatRef::from_column_major_slice(v, v.len(), 1), n, 1)
}

/// Checks a covariance, n x n, and returns it exactly symmetric. Deviations up to 1e-12 of its norm count as rounding.
pub(in crate::observer) fn check_covariance(
    name: &'static str,
    q: MatRef<'_, f64>,
    n: usize,
) -> Result<Mat<f64>, RiccatiError> {
    check(name, q, n, n)?;
    let tolerance = 1e-12 * q.norm_l2();
    if (q - q.transpose()).norm_max() > tolerance {
        return Err(RiccatiError::NotSymmetric(name));
    }
    let q = symmetric(&q.to_owned());
    check_definite(name, &q, tolerance)?;
    Ok(q)
}

/// Refuses an eigenvalue below `-tolerance`.
pub(super) fn check_definite(name: &'static str, q: &Mat<f64>, tolerance: f64) -> Result<(), RiccatiError> {
    let eigenvalues = q
        .self_adjoint_eigenvalues(Side::Lower)
        .map_err(|_| RiccatiError::NotFinite(name))?;
    match eigenvalues.iter().copied().reduce(f64::min) {
        Some(eigenvalue) if !(eigenvalue >= -tolerance) => Err(RiccatiError::Indefinite(name, eigenvalue)),
        _ => Ok(()),
    }
}
