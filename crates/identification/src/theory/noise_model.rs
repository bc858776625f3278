//! The innovations form of the measurement noise: lowest terms, zeros inside the unit circle.

use super::joint_state::is_stable;
use super::missing::Missing;
use super::population::{NOISE, Population};
use super::signal::Signal;
use crate::model::polynomial::multiply;
use faer::linalg::solvers::SolveLstsq;
use faer::{Mat, c64};

/// Two polynomials have a common factor if the relative residual is below this.
const COMMON: f64 = 1e-10;

/// `f = C/D e`, C and D monic without a common factor, both stable.
#[derive(Clone, Debug)]
pub struct NoiseModel {
    /// `1, c_1, ...`.
    pub c: Vec<f64>,
    /// `1, d_1, ...`.
    pub d: Vec<f64>,
    /// The innovations e.
    pub innovation: Signal,
    /// The variance of e.
    pub variance: f64,
}

impl NoiseModel {
    /// Builds the model of the noise f of a population.
    ///
    /// # Errors
    /// [`Missing::NoNoiseModel`] if a zero of C is on the unit circle.
    pub fn new(population: &Population) -> Result<Self, Missing> {
        let (numerator, denominator) = &population.noise;
        let first = numerator.iter().position(|c| *c != 0.0);
        let last = numerator.iter().rposition(|c| *c != 0.0);
        let (Some(first), Some(last)) = (first, last) else {
            return Err(Missing::NoNoiseModel);
        };
        let lead = numerator[first];
        let c: Vec<f64> = numerator[first..=last].iter().map(|c| c / lead).collect();
        let (c, d) = lowest_terms(&c, denominator);
        let variance = population.sources[NOISE].variance * lead * lead;
        if is_stable(&c) {
            let innovation = Signal::new(NOISE, &[lead], &[1.0]);
            return Ok(Self {
                c,
                d,
                innovation,
                variance,
            });
        }
        let (reflected, gain) = reflected(&c).ok_or(Missing::NoNoiseModel)?;
        // e = D / C_reflected f is white like w, because the filter between them is all-pass.
        let all_pass: Vec<f64> = c.iter().map(|c| c * lead).collect();
        Ok(Self {
            innovation: Signal::new(NOISE, &all_pass, &reflected),
            c: reflected,
            d,
            variance: variance * gain * gain,
        })
    }

    /// Returns C and D of `A(q) f = C/D e` in lowest terms.
    pub fn equation_error(&self, alpha: &[f64]) -> (Vec<f64>, Vec<f64>) {
        lowest_terms(&multiply(alpha, &self.c), &self.d)
    }
}

/// Divides two monic polynomials by their common factor. It tries the degrees of the factor, largest first: the two
/// quotients solve `C d' = D c'` by least squares, with zero residual if the factor exists.
pub fn lowest_terms(c: &[f64], d: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let degree = |p: &[f64]| p.iter().rposition(|c| *c != 0.0).unwrap_or(0);
    let (nc, nd) = (degree(c), degree(d));
    let (c, d) = (&c[..=nc], &d[..=nd]);
    let at = |p: &[f64], i: isize| {
        let index = usize::try_from(i).ok();
        index.and_then(|i| p.get(i)).copied().unwrap_or(0.0)
    };
    for common in (1..=nc.min(nd)).rev() {
        let (of_d, of_c) = (nd - common, nc - common);
        let rows = nc + nd - common;
        // C (1 + d'_1 q^-1 ...) - D (1 + c'_1 q^-1 ...) = 0 at q^-1 ... q^-rows.
        let right = Mat::from_fn(rows, 1, |i, _| {
            let i = i as isize + 1;
            at(d, i) - at(c, i)
        });
        let matrix = Mat::from_fn(rows, of_d + of_c, |i, j| {
            let i = i as isize + 1;
            match j.checked_sub(of_d) {
                None => at(c, i - 1 - j as isize),
                Some(j) => -at(d, i - 1 - j as isize),
            }
        });
        let solution = if matrix.ncols() == 0 {
            Mat::zeros(0, 1)
        } else {
            matrix.qr().solve_lstsq(&right)
        };
        let rest = &right - &matrix * &solution;
        let size = 1.0 + c.iter().chain(d).fold(0.0_f64, |m, x| m.max(x.abs()));
        if rest.norm_max() <= COMMON * size && solution.is_all_finite() {
            let quotient = |from: usize, count: usize| {
                let rest = (0..count).map(|i| solution[(from + i, 0)]);
                std::iter::once(1.0).chain(rest).collect()
            };
            return (quotient(of_d, of_c), quotient(0, of_d));
        }
    }
    (c.to_vec(), d.to_vec())
}

/// Reflects the zeros of a polynomial that are outside the unit circle into it. Returns the new polynomial and the
/// product of their moduli, or `None` if a zero is on the circle.
fn reflected(c: &[f64]) -> Option<(Vec<f64>, f64)> {
    let n = c.len() - 1;
    let companion = Mat::from_fn(n, n, |i, j| match (i, j) {
        (0, j) => -c[j + 1],
        (i, j) if i == j + 1 => 1.0,
        _ => 0.0,
    });
    let zeros = companion.eigenvalues().ok()?;
    let mut product = vec![c64::new(1.0, 0.0)];
    let mut gain = 1.0;
    for zero in zeros {
        let size = zero.norm();
        if (size - 1.0).abs() < 1e-9 {
            return None;
        }
        let zero = if size > 1.0 {
            gain *= size;
            zero / (size * size)
        } else {
            zero
        };
        product.push(c64::new(0.0, 0.0));
        for i in (1..product.len()).rev() {
            let before = product[i - 1];
            product[i] -= zero * before;
        }
    }
    let real: Vec<f64> = product.iter().map(|c| c.re).collect();
    is_stable(&real).then_some((real, gain))
}
