//! Algebraic Riccati equations of the Kalman filter for one output.
//!
//! A solution is found in three steps, the same in discrete and continuous time: the
//! structure-preserving doubling algorithm (SDA), which converges quadratically; a check that its
//! gain stabilises the filter; and Newton's iteration (Kleinman 1968, Hewer 1971), which squares
//! what error is left. Doubling begins at Q and finds the smallest solution P >= 0, which is not
//! the stabilising one where modes on or outside the unit circle are not driven by Q. Such an
//! equation is solved with Q + eps I first, whose gain stabilises, and Newton's iteration leads
//! from that gain to the stabilising solution, where there is one.
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
    /// The covariance P of the prediction's error, n x n, symmetric, >= 0 to rounding.
    pub p: Mat<f64>,
    /// The predictor's gain, n numbers: K (discrete) or L (continuous).
    pub gain: Vec<f64>,
    /// The innovation's variance `h'P h + r` (discrete), or its intensity r (continuous).
    pub innovation: f64,
    /// What P leaves of the equation, relative: discrete
    /// `||P - Ric(P)||_F / max(||P||_F, ||Q||_F)`, continuous
    /// `||A P + P A' + Q - P c c'P / r||_F / max(||A P||_F, ||Q||_F, ||P c c'P / r||_F)`.
    pub residual: f64,
    /// Steps of doubling and of Newton's iteration.
    pub iterations: usize,
}

/// Why a Riccati or Lyapunov equation was refused or not solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RiccatiError {
    /// A matrix or vector of another size than the order asks for.
    #[error("{name} must be {rows} x {columns}, not {actual_rows} x {actual_columns}")]
    Shape {
        /// Which one.
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
    /// The noise's D does not begin with 1.
    #[error("the noise's denominator must begin with 1, not {0}")]
    NotMonic(f64),
    /// A covariance is not symmetric.
    #[error("{0} is not symmetric")]
    NotSymmetric(&'static str),
    /// A covariance has a negative eigenvalue.
    #[error("{name} is not non-negative definite: it has the eigenvalue {eigenvalue:e}")]
    Indefinite {
        /// Which one.
        name: &'static str,
        /// Its smallest eigenvalue.
        eigenvalue: f64,
    },
    /// No gain found makes the filter strictly stable.
    #[error(
        "no stabilising solution: the filter's slowest pole is {margin:e} inside the stability \
         boundary, where more than {MARGIN:e} is asked for; a mode of the plant on or outside the \
         boundary is not seen in y, or one on it is not driven by the process noise"
    )]
    NotStabilising {
        /// Discrete: 1 - the largest modulus of a pole; continuous: minus the largest real part
        /// over the largest modulus.
        margin: f64,
    },
    /// The iteration overflowed, or stopped short of the accuracy asked for.
    #[error("no convergence: the relative residual is {residual:e}")]
    NoConvergence {
        /// The best relative residual; infinite on overflow.
        residual: f64,
    },
    /// F of a Lyapunov equation has an eigenvalue on or outside the unit circle.
    #[error("no stationary covariance: the system's spectral radius is {0}")]
    Unstable(f64),
}

/// The least distance of the filter's poles to the stability boundary. A double pole on the
/// boundary is found to about 1e-8, a simple one to about 1e-15.
const MARGIN: f64 = 1e-9;
/// The largest relative residual that is returned.
const ACCEPTED: f64 = 1e-9;
/// Newton's steps, each of which halves at least the distance to the boundary of a pole that tends
/// to it.
const NEWTON_STEPS: usize = 40;

/// What the two equations have in common.
pub(super) trait Equation {
    /// The solution by doubling with Q + eps I, and the steps it took. `None` where that does not
    /// converge.
    fn double(&self, eps: f64) -> Option<(Mat<f64>, usize)>;
    /// The gain for the covariance P.
    fn gain(&self, p: &Mat<f64>) -> Col<f64>;
    /// How far inside the stability boundary the filter's poles are. NaN where they cannot be
    /// found.
    fn margin(&self, gain: &Col<f64>) -> f64;
    /// What P leaves of the equation, symmetric, and the size it is relative to.
    fn defect(&self, p: &Mat<f64>) -> (Mat<f64>, f64);
    /// Newton's step: what to add to P for a defect, by the stable filter with the gain of P.
    /// `None` where it overflows.
    fn correction(&self, gain: &Col<f64>, defect: Mat<f64>) -> Option<Mat<f64>>;
    /// An eps of the equation's own scale.
    fn scale(&self) -> f64;
}

/// P, its residual and the number of steps.
type Solution = (Mat<f64>, f64, usize);

/// The stabilising solution of an equation.
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

/// Newton's iteration from a P whose gain stabilises, to where the residual falls no more.
///
/// Each step adds to P: its own rounding is of the size of the correction, and what limits the
/// result is the rounding of the defect.
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
        // From a distant start the first step may raise it, and the next ones lower it slowly.
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

/// The defect of P and its relative size.
fn relative(equation: &impl Equation, p: &Mat<f64>) -> (Mat<f64>, f64) {
    let (defect, size) = equation.defect(p);
    let norm = defect.norm_l2();
    (defect, if norm == 0.0 { 0.0 } else { norm / size })
}

/// The stabilising solution P (n x n) of the predictor's equation
/// `P = F P F' + Q - (F P h + s) (h'P h + r)^-1 (F P h + s)'` for `x(k+1) = F x + w`,
/// `y = h'x + v`, `Q = E[w w']`, `s = E[w v]`, `r = E[v v]`, with the gain
/// `K = (F P h + s) / (h'P h + r)` for which `F - K h'` is strictly stable.
///
/// F and Q are n x n, h and s have n numbers. The cross covariance is removed first: with
/// `F~ = F - s r^-1 h'` and `Q~ = Q - s r^-1 s'` the equation has s = 0 and the gain `K - s / r`.
/// The rounding of the gain limits the relative residual to about `2e-16 (1 + |F K| |h|)`: below
/// 1e-12 on plants of order 10 and less with poles of modulus up to 1.5, 1e-11 where ten poles of
/// modulus about 3 must be stabilised from one output. One above 1e-9 is an error.
///
/// # Errors
/// [`RiccatiError::Shape`], [`RiccatiError::NotFinite`], [`RiccatiError::Variance`];
/// [`RiccatiError::NotSymmetric`] and [`RiccatiError::Indefinite`] for Q, and the latter for Q~,
/// the covariance of what v does not tell of w; [`RiccatiError::NotStabilising`] where (F, h) is
/// not detectable or F~ has a pole on the unit circle that Q~ does not drive;
/// [`RiccatiError::NoConvergence`].
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

/// The stabilising solution P (n x n) of `A P + P A' + Q - P c r^-1 c'P = 0` for `dx/dt = A x + w`,
/// `y = c'x + v` with white w and v of intensities Q and r, not correlated, and the gain
/// `L = P c / r` for which `A - L c'` is strictly stable.
///
/// A and Q are n x n, c has n numbers. Doubling works on the equation's Cayley transform.
///
/// # Errors
/// As for [`dare`], with the imaginary axis in place of the unit circle.
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

/// SDA: the limit of `H+ = H + A'H W^-1 A`, `G+ = G + A W^-1 G A'`, `A+ = A W^-1 A`, `W = I + G H`,
/// which is the smallest solution of `X = A'X (I + G X)^-1 A + H`, and the steps it took.
/// `None` where it overflows or does not settle.
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

/// `(M + M') / 2`.
pub(super) fn symmetric(m: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(m.nrows(), m.ncols(), |i, j| 0.5 * (m[(i, j)] + m[(j, i)]))
}
