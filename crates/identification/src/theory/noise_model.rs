//! The innovations form of the measurement noise: lowest terms, zeros inside the unit circle.

use super::joint_state::is_stable;
use super::missing::Missing;
use super::population::{NOISE, Population};
use super::signal::Signal;
use super::spectrum::turn;
use crate::estimator::recursive::SquareRoot;
use crate::model::polynomial::multiply;
use crate::plant::polynomial_from_poles;
use faer::c64;

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
        let equation = |i: isize| -> (Vec<f64>, f64) {
            let by_d = (0..of_d as isize).map(|j| at(c, i - 1 - j));
            let by_c = (0..of_c as isize).map(|j| -at(d, i - 1 - j));
            (by_d.chain(by_c).collect(), at(d, i) - at(c, i))
        };
        let equations: Vec<_> = (1..=rows as isize).map(equation).collect();
        let mut solution = vec![0.0; of_d + of_c];
        let mut root = SquareRoot::new(solution.len());
        for (left, right) in &equations {
            root.update(left, *right, 1.0);
        }
        root.solve(&mut solution);
        let rest = |(left, right): &(Vec<f64>, f64)| {
            let products = left.iter().zip(&solution).map(|(x, y)| x * y);
            (right - products.sum::<f64>()).abs()
        };
        let rest = equations.iter().map(rest).fold(0.0, f64::max);
        let size = 1.0 + c.iter().chain(d).fold(0.0_f64, |m, x| m.max(x.abs()));
        if rest <= COMMON * size && solution.iter().all(|x| x.is_finite()) {
            let quotient = |from: usize, count: usize| {
                let rest = (0..count).map(|i| solution[from + i]);
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
    let zeros = zeros(c)?;
    let (mut inside, mut gain) = (Vec::new(), 1.0);
    for zero in zeros {
        let size = zero.norm_sqr().sqrt();
        if (size - 1.0).abs() < 1e-9 {
            return None;
        }
        if size > 1.0 {
            gain *= size;
            inside.push(zero / (size * size));
        } else {
            inside.push(zero);
        }
    }
    let phi = polynomial_from_poles(&inside);
    let real: Vec<f64> = std::iter::once(1.0).chain(phi.iter().map(|c| c.re)).collect();
    is_stable(&real).then_some((real, gain))
}

/// Returns the zeros of a monic polynomial in q^-1, in q; `None` if the iteration does not end.
///
/// All are moved together by Newton steps that leave out the others (Aberth, Math. Comp. 27, 1973; the starts are on a
/// circle that is not symmetric to the real axis).
fn zeros(c: &[f64]) -> Option<Vec<c64>> {
    const MOST: usize = 200;
    let n = c.len() - 1;
    let radius = c[1..].iter().fold(0.5, |most: f64, c| c.abs().max(most));
    let start = |i: usize| turn(4 * i + 1, 4 * n) * radius.min(2.0);
    let mut zeros: Vec<c64> = (0..n).map(start).collect();
    for _ in 0..MOST {
        let mut largest = 0.0_f64;
        for i in 0..n {
            let z = zeros[i];
            let (mut value, mut slope) = (c64::new(1.0, 0.0), c64::new(0.0, 0.0));
            for c in &c[1..] {
                slope = slope * z + value;
                value = value * z + c;
            }
            if value == c64::new(0.0, 0.0) {
                continue;
            }
            let others = zeros.iter().enumerate().filter(|(j, _)| *j != i);
            let repelled: c64 = others.map(|(_, other)| (z - other).inv()).sum();
            let step = (slope / value - repelled).inv();
            zeros[i] = z - step;
            largest = largest.max(step.norm_sqr() / zeros[i].norm_sqr().max(1e-300));
        }
        if !largest.is_finite() {
            return None;
        }
        if largest <= 1e-30 {
            return Some(zeros);
        }
    }
    Some(zeros)
}
