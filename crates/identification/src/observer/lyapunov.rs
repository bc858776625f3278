//! The stationary covariance of a stable system: the discrete Lyapunov equation.

use super::riccati::check::check;
use super::riccati::equation::{RiccatiError, symmetric};
use crate::plant::eigenvalues;
use faer::{Mat, MatRef};

/// Returns the solution P (n x n) of `P = F P F' + Q`. For Q >= 0 it is the stationary covariance of
/// `x(k+1) = F x(k) + w(k)` with white w of covariance Q.
///
/// Computed by doubling (Smith 1968): `P = sum_i F^i Q F'^i`, 2^j terms after j steps.
///
/// # Errors
/// [`RiccatiError::Shape`], [`RiccatiError::NotFinite`]; [`RiccatiError::NotSymmetric`] for Q;
/// [`RiccatiError::Unstable`] if F has an eigenvalue on or outside the unit circle;
/// [`RiccatiError::NoConvergence`] if the sum overflows.
pub fn lyapunov(f: MatRef<'_, f64>, q: MatRef<'_, f64>) -> Result<Mat<f64>, RiccatiError> {
    let n = f.nrows();
    check("F", f, n, n)?;
    check("Q", q, n, n)?;
    if (q - q.transpose()).norm_max() > 1e-12 * q.norm_l2() {
        return Err(RiccatiError::NotSymmetric("Q"));
    }
    let radius = spectral_radius(f);
    if !(radius < 1.0) {
        return Err(RiccatiError::Unstable(radius));
    }
    sum_of_powers(f.to_owned(), symmetric(&q.to_owned())).ok_or(RiccatiError::NoConvergence(f64::INFINITY))
}

/// Returns the largest modulus of the eigenvalues: 0 for an empty matrix, NaN if the eigenvalues cannot be computed.
pub(super) fn spectral_radius(f: MatRef<'_, f64>) -> f64 {
    eigenvalues(f).map_or(f64::NAN, |found| found.iter().map(|z| z.norm()).fold(0.0, f64::max))
}

/// Returns `sum_i F^i Q F'^i` of a stable F and a symmetric Q. `None` if it overflows or does not settle.
pub(super) fn sum_of_powers(mut f: Mat<f64>, mut p: Mat<f64>) -> Option<Mat<f64>> {
    for _ in 0..64 {
        let more = symmetric(&(&f * &p * f.transpose()));
        p += &more;
        f = &f * &f;
        let (norm, change) = (p.norm_l2(), more.norm_l2());
        if !(norm.is_finite() && f.is_all_finite()) {
            return None;
        }
        // The remainder is F^(2^j) P F'^(2^j), which vanishes once both factors are lost in P's rounding.
        if change <= 0.1 * f64::EPSILON * norm {
            return Some(p);
        }
    }
    None
}
