//! How many parameters an input can tell apart.

use super::FailureKind;
use super::hankel::{Delays, Hankel};
use crate::data::rounding_of;

/// Singular values below this share of the largest are rounding, whatever the digits of u.
const SMALLEST: f64 = 1e-11;

/// Returns the numerical order of persistent excitation of u, at most `most`: the rank of the matrix with the rows
/// `u(k), u(k-1) ... u(k-most+1)`, k = most-1 ... N-1. A model whose transfer function from u has more parameters is
/// not determined by u, signals before the record being free (Ljung, *System Identification*, 2nd ed., section 13.2).
///
/// Singular values count above 1e-11 of the largest, and above those of the rounding of u: `r sqrt(rows)`, r being the
/// unit of its last digit (those of rounding errors are at most about `r sqrt(rows/12)`, twice that of few rows). A
/// signal with fewer than six digits is taken as exact.
pub fn excitation_order(u: &[f64], most: usize) -> usize {
    let most = most.min(u.len().div_ceil(2)).max(1);
    let rows = u.len() + 1 - most;
    let Ok(triangle) = Hankel::new(&[Delays::new(u, 0, most, 0)], rows) else {
        return 0;
    };
    let rounding = rounding_of(u) * (rows as f64).sqrt();
    // Well-conditioned, so far above the smallest share of the largest.
    if triangle.least_singular_value().is_some_and(|least| least > rounding) {
        return most;
    }
    let values = triangle.r().singular_values().unwrap_or_default();
    let largest = values.iter().copied().fold(0.0, f64::max);
    let limit = (SMALLEST * largest).max(rounding);
    values.iter().filter(|value| **value > limit).count()
}

/// Returns the number of block rows s of a subspace method, `wanted` if u excites it: the inputs of the past and of the
/// future are 2 s rows, which have to be independent (Van Overschee and De Moor, *Subspace Identification for Linear
/// Systems*, 1996, theorem 2). Fewer rows are taken if u excites these alone.
///
/// # Errors
/// [`FailureKind::RankDeficient`] if u does not excite `least` rows either.
pub(super) fn excited_rows(u: &[f64], wanted: usize, least: usize) -> Result<usize, FailureKind> {
    if u.iter().any(|u| !u.is_finite()) {
        return Err(FailureKind::NonFinite);
    }
    let rows = excitation_order(u, 2 * wanted) / 2;
    if rows < least {
        return Err(FailureKind::RankDeficient);
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A constant has order 1, a sine 2, with an offset 3, two sines 4 (Ljung, section 13.2); the same with six digits
    /// and with twelve; a staircase and a binary signal any.
    #[test]
    fn orders_of_known_signals() {
        let sine = |omega: f64, k: u32| (omega * f64::from(k) + 0.3).sin();
        let of = |signal: &dyn Fn(u32) -> f64, digits: i32| {
            let unit = 10_f64.powi(digits);
            let u: Vec<f64> = (0..300).map(|k| (signal(k) * unit).round() / unit).collect();
            excitation_order(&u, 12)
        };
        for digits in [6, 8, 12, 15] {
            assert_eq!(of(&|_| 4.0, digits), 1, "{digits}");
            assert_eq!(of(&|k| sine(0.7, k), digits), 2, "{digits}");
            assert_eq!(of(&|k| 5.0 + sine(0.7, k), digits), 3, "{digits}");
            assert_eq!(of(&|k| sine(0.4, k) + sine(1.9, k), digits), 4, "{digits}");
            assert_eq!(of(&|k| f64::from(k / 30 % 3), digits), 12, "{digits}");
            assert_eq!(
                of(&|k| f64::from((k.wrapping_mul(2_654_435_761) >> 13) & 1), digits),
                12,
                "{digits}"
            );
        }
        assert_eq!(excitation_order(&[0.0; 40], 5), 0);
    }

    #[test]
    fn block_rows_are_those_that_the_input_excites() {
        let u: Vec<f64> = (0..200)
            .map(|k| (0.5 * f64::from(k)).sin() + (1.3 * f64::from(k)).sin())
            .collect();
        assert_eq!(excited_rows(&u, 8, 2), Ok(2));
        assert_eq!(excited_rows(&u, 8, 3), Err(FailureKind::RankDeficient));
        let white: Vec<f64> = (0..200_u32).map(|k| f64::from((k * k * 7 + k) % 13)).collect();
        assert_eq!(excited_rows(&white, 6, 3), Ok(6));
    }
}
