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
//! Both equations are solved in units of states, y, time and variances in which their numbers are of like sizes
//! ([`balance`](fn@crate::plant::balance)), so that P and the gain are as exact in any units.
//!
//! Sources: Chu, Fan, Lin, Wang, "Structure-preserving algorithms for periodic discrete-time
//! algebraic Riccati equations", Int. J. Control 77 (2004) 767; Chu, Fan, Lin, "A
//! structure-preserving doubling algorithm for continuous-time algebraic Riccati equations", Linear
//! Algebra Appl. 396 (2005) 55.

pub(super) mod check;
mod continuous_equation;
mod discrete_equation;
pub(super) mod equation;
mod scaling;
#[cfg(test)]
pub(super) mod tests;

pub(super) use check::{check_column, check_covariance};
pub(super) use discrete_equation::Discrete;
pub use equation::RiccatiError;
pub(super) use equation::{Equation, MARGIN};

use crate::plant::own_rate;
use continuous_equation::Continuous;
use faer::{Mat, MatRef};
use scaling::Scaling;

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

/// The largest relative residual that is returned.
const ACCEPTED: f64 = 1e-9;
/// The number of Newton steps. If a pole tends to the stability boundary, each step at least halves its distance to it.
const NEWTON_STEPS: usize = 40;
/// So many steps in a row that do not lower the residual are the last.
const TRIED: usize = 3;

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
    Err(RiccatiError::NotStabilising(margin))
}

/// Improves a P whose gain stabilises by Newton's iteration, until the residual falls no more.
///
/// Each step adds a correction to P, so its own rounding is only of the size of that correction. The rounding of the
/// defect limits the result; it is another one in each step, so that a few more are tried, and the best P is taken.
fn refine(equation: &impl Equation, p: Mat<f64>, steps: usize) -> Result<Solution, RiccatiError> {
    let (mut defect, residual) = relative(equation, &p);
    let (mut last, mut without_gain) = (p.clone(), 0);
    let mut best = (p, residual, steps);
    for step in 1..=NEWTON_STEPS {
        if best.1 == 0.0 || without_gain == TRIED {
            break;
        }
        let gain = equation.gain(&last);
        let Some(correction) = equation.correction(&gain, defect) else {
            break;
        };
        last += correction;
        let (next, residual) = relative(equation, &last);
        defect = next;
        // From a distant start the first step may raise the residual; the next ones then lower it slowly.
        if residual < best.1 || best.1 > ACCEPTED {
            best = (last.clone(), residual, steps + step);
            without_gain = 0;
        } else {
            without_gain += 1;
        }
    }
    let margin = equation.margin(&equation.gain(&best.0));
    if !(margin > MARGIN) {
        Err(RiccatiError::NotStabilising(margin))
    } else if !(best.1 <= ACCEPTED) {
        Err(RiccatiError::NoConvergence(best.1))
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
pub fn dare(f: MatRef<'_, f64>, h: &[f64], q: MatRef<'_, f64>, s: &[f64], r: f64) -> Result<Riccati, RiccatiError> {
    // Mistakes and the residual are in the units of the caller.
    let given = Discrete::new(f, h, q, s, r)?;
    let units = Scaling::new(f, h, q, r, 1.0);
    let (own_f, own_q) = (units.a(f), units.q(q));
    let (h, s) = (units.c(h), units.s(s));
    let equation = Discrete::new(own_f.as_ref(), &h, own_q.as_ref(), &s, units.r(r))?;
    let (own, _, iterations) = solve(&equation)?;
    let p = units.covariance(&own);
    Ok(Riccati {
        gain: units.gain(equation.predictor_gain(&equation.gain(&own))),
        innovation: units.of_output(equation.innovation(&own)),
        residual: relative(&given, &p).1,
        p,
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
pub fn care(a: MatRef<'_, f64>, c: &[f64], q: MatRef<'_, f64>, r: f64) -> Result<Riccati, RiccatiError> {
    let given = Continuous::new(a, c, q, r)?;
    let units = Scaling::new(a, c, q, r, own_rate(a));
    let (own_a, own_q) = (units.a(a), units.q(q));
    let equation = Continuous::new(own_a.as_ref(), &units.c(c), own_q.as_ref(), units.r(r))?;
    let (own, _, iterations) = solve(&equation)?;
    let p = units.covariance(&own);
    Ok(Riccati {
        gain: units.gain(equation.gain(&own).iter().copied()),
        innovation: r,
        residual: relative(&given, &p).1,
        p,
        iterations,
    })
}

/// Solves the same for correlated noises, `E[w(t) v(t')] = s delta(t - t')`, s n numbers: `A P + P A' + Q - (P c + s)
/// r^-1 (P c + s)' = 0` with the gain `L = (P c + s) / r`. It is [`care`] of `A - s c' / r` and `Q - s s' / r`, whose
/// gain is `L - s / r`.
///
/// # Errors
/// As for [`care`], and [`RiccatiError::Indefinite`] for `Q - s s' / r`.
pub fn care_correlated(
    a: MatRef<'_, f64>,
    c: &[f64],
    q: MatRef<'_, f64>,
    s: &[f64],
    r: f64,
) -> Result<Riccati, RiccatiError> {
    let n = a.nrows();
    check::check("A", a, n, n)?;
    check_column("c", c, n)?;
    check_column("s", s, n)?;
    if !(r > 0.0) {
        return Err(RiccatiError::Variance(r));
    }
    let q = check_covariance("Q", q, n)?;
    let rest = Mat::from_fn(n, n, |i, j| q[(i, j)] - s[i] * s[j] / r);
    check::check_definite("Q - s s' / r", &rest, 1e-12 * q.norm_l2())?;
    let reduced = Mat::from_fn(n, n, |i, j| a[(i, j)] - s[i] * c[j] / r);
    let mut found = care(reduced.as_ref(), c, rest.as_ref(), r)?;
    found.gain.iter_mut().zip(s).for_each(|(gain, s)| *gain += s / r);
    Ok(found)
}
