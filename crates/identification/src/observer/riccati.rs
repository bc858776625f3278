//! Algebraic Riccati equations of the Kalman filter for one output.
//!
//! Each solution takes three steps, the same in discrete and continuous time. First comes the structure-preserving
//! doubling algorithm (SDA), which converges quadratically. Then a check confirms that the gain stabilises the filter.
//! Last, Newton's iteration (Kleinman 1968, Hewer 1971) squares the remaining error.
//!
//! Doubling starts at Q and finds the smallest solution P >= 0. That is not the stabilising one if Q does not drive all
//! modes on or outside the unit circle. Such an equation is first solved with Q + eps I, whose gain stabilises.
//! Newton's iteration then leads from that gain to the stabilising solution, if there is one.
//!
//! Sources: Chu, Fan, Lin, Wang, "Structure-preserving algorithms for periodic discrete-time
//! algebraic Riccati equations", Int. J. Control 77 (2004) 767; Chu, Fan, Lin, "A
//! structure-preserving doubling algorithm for continuous-time algebraic Riccati equations", Linear
//! Algebra Appl. 396 (2005) 55.

mod check;
mod continuous_equation;
mod discrete_equation;
#[cfg(test)]
pub(super) mod tests;

pub(super) use check::{check, check_column, check_covariance};
pub(super) use discrete_equation::Discrete;

use continuous_equation::Continuous;
use faer::{Col, Mat, MatRef};

/// The stabilising solution of a filter's Riccati equation.
#[derive(Clone, Debug)]
pub struct Riccati {
    /// The covariance P of the prediction error, n x n, symmetric, >= 0 up to rounding.
    pub p: Mat<f64>,
    /// The predictor gain, n numbers: K (discrete) or L (continuous).
    pub gain: Vec<f64>,
    /// The innovation variance `h'P h + r` (discrete), or its intensity r (continuous).
    pub innovation: f64,
    /// The relative residual of the equation at P. Discrete: `||P - Ric(P)||_F / max(||P||_F, ||Q||_F)`; continuous:
    /// `||A P + P A' + Q - P c c'P / r||_F / max(||A P||_F, ||Q||_F, ||P c c'P / r||_F)`.
    pub residual: f64,
    /// Steps of doubling and of Newton's iteration together.
    pub iterations: usize,
}

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
    /// A covariance has a negative eigenvalue.
    #[error("{name} is not positive semidefinite: it has the eigenvalue {eigenvalue:e}")]
    Indefinite {
        /// Name of the covariance.
        name: &'static str,
        /// Its smallest eigenvalue.
        eigenvalue: f64,
    },
    /// No gain was found that makes the filter strictly stable.
    #[error(
        "no stabilising solution: the filter's slowest pole is {margin:e} inside the stability \
         boundary, but more than {MARGIN:e} is required; a mode of the plant on or outside the \
         boundary is not observable in y, or one on it is not driven by the process noise"
    )]
    NotStabilising {
        /// Discrete: 1 minus the largest modulus of a pole. Continuous: minus the largest real part, divided by the
        /// largest modulus.
        margin: f64,
    },
    /// The iteration overflowed or stopped short of the required accuracy.
    #[error("no convergence: the relative residual is {residual:e}")]
    NoConvergence {
        /// The best relative residual; infinite on overflow.
        residual: f64,
    },
    /// F of a Lyapunov equation has an eigenvalue on or outside the unit circle.
    #[error("no stationary covariance: the system's spectral radius is {0}")]
    Unstable(f64),
}

/// The smallest accepted distance of the filter's poles from the stability boundary. A double pole on the boundary is
/// computed to about 1e-8, a simple one to about 1e-15.
const MARGIN: f64 = 1e-9;
/// The largest relative residual that is returned.
const ACCEPTED: f64 = 1e-9;
/// The number of Newton steps. If a pole tends to the stability boundary, each step at least halves its distance to it.
const NEWTON_STEPS: usize = 40;

/// What the two equations have in common.
pub(super) trait Equation {
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

/// P, its residual and the number of steps.
type Solution = (Mat<f64>, f64, usize);

/// Returns the stabilising solution of an equation.
fn solve(equation: &impl Equation) -> Result<Solution, RiccatiError> {
    let mut margin = f64::NEG_INFINITY;
    for eps in [0.0, equation.scale()] {
        let Some((p, steps)) = equation.double(eps) else {
            continue;
        };
        let found = equation.margin(&equation.gain(&p));
        margin = margin.max(found);
        if found > MARGIN {
            return refine(equation, p, steps);
        }
    }
    Err(RiccatiError::NotStabilising { margin })
}

/// Improves a P whose gain stabilises by Newton's iteration, until the residual stops falling.
///
/// Each step adds a correction to P, so its own rounding is only of the size of that correction. The rounding of the
/// defect limits the result.
fn refine(equation: &impl Equation, p: Mat<f64>, steps: usize) -> Result<Solution, RiccatiError> {
    let (mut defect, mut residual) = relative(equation, &p);
    let mut best = (p, residual, steps);
    for step in 1..=NEWTON_STEPS {
        if residual == 0.0 {
            break;
        }
        let gain = equation.gain(&best.0);
        let Some(correction) = equation.correction(&gain, defect) else {
            break;
        };
        let p = &best.0 + correction;
        (defect, residual) = relative(equation, &p);
        // From a distant start the first step may raise the residual; the next ones then lower it slowly.
        if !(residual < best.1) && best.1 <= ACCEPTED {
            break;
        }
        best = (p, residual, steps + step);
    }
    let margin = equation.margin(&equation.gain(&best.0));
    if !(margin > MARGIN) {
        Err(RiccatiError::NotStabilising { margin })
    } else if !(best.1 <= ACCEPTED) {
        Err(RiccatiError::NoConvergence { residual: best.1 })
    } else {
        Ok(best)
    }
}

/// Returns the defect of P and its relative size.
fn relative(equation: &impl Equation, p: &Mat<f64>) -> (Mat<f64>, f64) {
    let (defect, size) = equation.defect(p);
    let norm = defect.norm_l2();
    (defect, if norm == 0.0 { 0.0 } else { norm / size })
}

/// Solves the predictor's Riccati equation `P = F P F' + Q - (F P h + s) (h'P h + r)^-1 (F P h + s)'` for the model
/// `x(k+1) = F x + w`, `y = h'x + v`, `Q = E[w w']`, `s = E[w v]`, `r = E[v v]`. Returns the stabilising P (n x n) and
/// the gain `K = (F P h + s) / (h'P h + r)`, for which `F - K h'` is strictly stable.
///
/// F and Q are n x n, h and s have n numbers. The cross covariance is removed first: with `F~ = F - s r^-1 h'` and
/// `Q~ = Q - s r^-1 s'` the equation has s = 0 and the gain `K - s / r`.
///
/// The rounding of the gain limits the relative residual to about `2e-16 (1 + |F K| |h|)`. It is below 1e-12 for plants
/// of order 10 or less with poles of modulus up to 1.5, and below 1e-11 if ten poles of modulus about 3 must be
/// stabilised from one output. A residual above 1e-9 is an error.
///
/// # Errors
/// [`RiccatiError::Shape`], [`RiccatiError::NotFinite`], [`RiccatiError::Variance`]. [`RiccatiError::NotSymmetric`] for
/// Q; [`RiccatiError::Indefinite`] for Q or for Q~, the covariance of the part of w that v does not determine.
/// [`RiccatiError::NotStabilising`] if (F, h) is not detectable or F~ has a pole on the unit circle that Q~ does not
/// drive. [`RiccatiError::NoConvergence`].
pub fn dare(
    f: MatRef<'_, f64>,
    h: &[f64],
    q: MatRef<'_, f64>,
    s: &[f64],
    r: f64,
) -> Result<Riccati, RiccatiError> {
    let equation = Discrete::new(f, h, q, s, r)?;
    let (p, residual, iterations) = solve(&equation)?;
    Ok(Riccati {
        gain: equation.predictor_gain(&equation.gain(&p)),
        innovation: equation.innovation(&p),
        p,
        residual,
        iterations,
    })
}

/// Solves `A P + P A' + Q - P c r^-1 c'P = 0` for the model `dx/dt = A x + w`, `y = c'x + v` with uncorrelated white w
/// and v of intensities Q and r. Returns the stabilising P (n x n) and the gain `L = P c / r`, for which `A - L c'` is
/// strictly stable.
///
/// A and Q are n x n, c has n numbers. Doubling works on the equation's Cayley transform.
///
/// # Errors
/// As for [`dare`], with the imaginary axis instead of the unit circle.
pub fn care(
    a: MatRef<'_, f64>,
    c: &[f64],
    q: MatRef<'_, f64>,
    r: f64,
) -> Result<Riccati, RiccatiError> {
    let equation = Continuous::new(a, c, q, r)?;
    let (p, residual, iterations) = solve(&equation)?;
    Ok(Riccati {
        gain: equation.gain(&p).iter().copied().collect(),
        innovation: r,
        p,
        residual,
        iterations,
    })
}

/// Runs the SDA: `H+ = H + A'H W^-1 A`, `G+ = G + A W^-1 G A'`, `A+ = A W^-1 A` with `W = I + G H`. Returns the limit
/// of H, which is the smallest solution of `X = A'X (I + G X)^-1 A + H`, and the number of steps. `None` if the
/// iteration overflows or does not settle.
fn double(mut a: Mat<f64>, mut g: Mat<f64>, mut h: Mat<f64>) -> Option<(Mat<f64>, usize)> {
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

/// Returns `(M + M') / 2`.
pub(super) fn symmetric(m: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(m.nrows(), m.ncols(), |i, j| 0.5 * (m[(i, j)] + m[(j, i)]))
}
