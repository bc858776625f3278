//! The errors and the trait that both equations share.

use faer::{Col, Mat};

/// The smallest accepted distance of the filter's poles from the stability boundary. A double pole on the boundary is
/// computed to about 1e-8, a simple one to about 1e-15.
pub(in crate::observer) const MARGIN: f64 = 1e-9;
/// Why a Riccati or Lyapunov equation was refused or not solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RiccatiError {
    /// A matrix or vector does not have the size that the order requires.
    #[error("{name} must be {rows} x {columns}, not {actual_rows} x {actual_columns}")]
    Shape {
        /// Name of the matrix or vector.
        name: &'static str,
        /// Rows expected.
        rows: usize,
        /// Columns expected.
        columns: usize,
        /// Rows found.
        actual_rows: usize,
        /// Columns found.
        actual_columns: usize,
    },
    /// An entry is not a finite number.
    #[error("{0} has an entry that is not a finite number")]
    NotFinite(&'static str),
    /// The variance of the measurement noise, or of its white source, is not positive.
    #[error("the measurement noise's variance must be positive, not {0}")]
    Variance(f64),
    /// The noise's denominator D does not begin with 1.
    #[error("the noise's denominator must begin with 1, not {0}")]
    NotMonic(f64),
    /// A covariance is not symmetric.
    #[error("{0} is not symmetric")]
    NotSymmetric(&'static str),
    /// A covariance has a negative eigenvalue: its name, its smallest eigenvalue.
    #[error("{0} is not positive semidefinite: it has the eigenvalue {1:e}")]
    Indefinite(&'static str, f64),
    /// No gain was found that makes the filter strictly stable. Of a discrete one it holds 1 minus the largest modulus
    /// of a pole, of a continuous one minus the largest real part, divided by the largest modulus.
    #[error(
        "no stabilising solution: the filter's slowest pole is {0:e} inside the stability \
         boundary, but more than {MARGIN:e} is required; a mode of the plant on or outside the \
         boundary is not observable in y, or one on it is not driven by the process noise"
    )]
    NotStabilising(f64),
    /// The iteration overflowed or stopped short of the required accuracy. Holds the best relative residual; infinite
    /// on overflow.
    #[error("no convergence: the relative residual is {0:e}")]
    NoConvergence(f64),
    /// F of a Lyapunov equation has an eigenvalue on or outside the unit circle.
    #[error("no stationary covariance: the system's spectral radius is {0}")]
    Unstable(f64),
}

/// The operations that both equations have.
pub(in crate::observer) trait Equation {
    /// Solves the equation by doubling with Q + eps I; returns the solution and the number of steps. `None` if doubling
    /// does not converge.
    fn double(&self, eps: f64) -> Option<(Mat<f64>, usize)>;
    /// Returns the gain for the covariance P.
    fn gain(&self, p: &Mat<f64>) -> Col<f64>;
    /// Returns how far inside the stability boundary the filter's poles are; NaN if they cannot be computed.
    fn margin(&self, gain: &Col<f64>) -> f64;
    /// Returns the equation's residual at P, a symmetric matrix, and the size it is relative to.
    fn defect(&self, p: &Mat<f64>) -> (Mat<f64>, f64);
    /// Computes Newton's step for a defect: what to add to P, given a gain of P that makes the filter stable. `None` if
    /// it overflows.
    fn correction(&self, gain: &Col<f64>, defect: Mat<f64>) -> Option<Mat<f64>>;
    /// Returns an eps on the scale of the equation.
    fn scale(&self) -> f64;
}

/// Returns `(M + M') / 2`.
pub(in crate::observer) fn symmetric(m: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(m.nrows(), m.ncols(), |i, j| 0.5 * (m[(i, j)] + m[(j, i)]))
}

/// Runs the SDA: `H+ = H + A'H W^-1 A`, `G+ = G + A W^-1 G A'`, `A+ = A W^-1 A` with `W = I + G H`. Returns the limit
/// of H, which is the smallest solution of `X = A'X (I + G X)^-1 A + H`, and the number of steps. `None` if the
/// iteration overflows or does not settle.
pub(in crate::observer) fn double(mut a: Mat<f64>, mut g: Mat<f64>, mut h: Mat<f64>) -> Option<(Mat<f64>, usize)> {
    use faer::linalg::solvers::Solve;
    let n = a.nrows();
    for step in 1..=60 {
        let w = Mat::<f64>::identity(n, n) + &g * &h;
        let lu = w.partial_piv_lu();
        let wa = lu.solve(&a);
        let more = symmetric(&(a.transpose() * (&h * &wa)));
        g += symmetric(&(&a * lu.solve(&g) * a.transpose()));
        h += &more;
        a = &a * wa;
        let (norm, change) = (h.norm_l2(), more.norm_l2());
        if !(norm.is_finite() && g.is_all_finite() && a.is_all_finite()) {
            return None;
        }
        if change <= f64::EPSILON * norm {
            return Some((h, step));
        }
    }
    None
}
