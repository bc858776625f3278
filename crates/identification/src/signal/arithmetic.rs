//! The rules of arithmetic that give the same bits on every machine.
//!
//! 1. A product that is added to something is fused by [`f64::mul_add`], with one rounding. The compiler never fuses
//!    or reorders on its own, so nothing is left to it.
//! 2. A long sum consists of eight partial sums. The term with index k goes to partial sum k mod 8, and [`fold`] adds
//!    the partial sums. One accumulator per SIMD lane or eight per trial give the same bits.
//! 3. Short sums (over the order of a system) run in the order of the formula.
//! 4. Elementary functions are polynomials of this crate ([`super::normal`]), never the platform's libm. IEEE 754
//!    ensures that division and square root are correctly rounded everywhere.
//!
//! A machine without fused multiply-add instructions computes the same bits through the software `fma`, slowly.
//! [`with_fma`] detects these instructions at run time.
//!
//! Code written over [`Real`] serves both one trial and trials in lock step.

pub use crate::real::with_fma;

use crate::real::Real;

/// Adds eight partial sums: halves are added, then quarters, then the last two.
#[inline(always)]
pub fn fold<R: Real>(partial: [R; 8]) -> R {
    let [a, b, c, d, e, f, g, h] = partial;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// Returns the inner product `sum_k x(k) y(k)` over eight fused partial sums.
///
/// # Panics
/// In debug builds, if the lengths differ.
#[inline(always)]
pub fn dot(x: &[f64], y: &[f64]) -> f64 {
    debug_assert_eq!(x.len(), y.len());
    let mut partial = [0.0; 8];
    let (x_whole, x_rest) = x.as_chunks::<8>();
    let (y_whole, y_rest) = y.as_chunks::<8>();
    for (x, y) in x_whole.iter().zip(y_whole) {
        for i in 0..8 {
            partial[i] = x[i].mul_add(y[i], partial[i]);
        }
    }
    for (i, (x, y)) in x_rest.iter().zip(y_rest).enumerate() {
        partial[i] = x.mul_add(*y, partial[i]);
    }
    fold(partial)
}

/// Computes `sum_k term(x(k))` over eight partial sums; each step is `step(partial, x(k))`.
#[inline(always)]
fn reduce<R: Real>(x: &[R], step: impl Fn(R, R) -> R) -> R {
    let mut partial = [R::zero(); 8];
    let (whole, rest) = x.as_chunks::<8>();
    for x in whole {
        for i in 0..8 {
            partial[i] = step(partial[i], x[i]);
        }
    }
    for (i, &x) in rest.iter().enumerate() {
        partial[i] = step(partial[i], x);
    }
    fold(partial)
}

/// Returns the arithmetic mean; NaN for an empty slice.
pub fn mean<R: Real>(x: &[R]) -> R {
    R::run(
        #[inline(always)]
        || reduce(x, |s, x| s + x) / R::splat(x.len() as f64),
    )
}

/// Returns the mean square about the mean, divisor N: `sum_k (x(k) - mean)^2 / N`, in two passes.
pub fn variance<R: Real>(x: &[R]) -> R {
    R::run(
        #[inline(always)]
        || {
            let count = R::splat(x.len() as f64);
            let mean = reduce(x, |s, x| s + x) / count;
            reduce(x, |s, x| (x - mean).mul_add(x - mean, s)) / count
        },
    )
}

/// Returns the covariance about the means, divisor N: `sum_k (x(k) - mean_x)(y(k) - mean_y) / N`.
///
/// # Panics
/// If the lengths differ.
pub fn covariance<R: Real>(x: &[R], y: &[R]) -> R {
    assert_eq!(x.len(), y.len());
    let (mean_x, mean_y) = (mean(x), mean(y));
    R::run(
        #[inline(always)]
        || {
            let mut partial = [R::zero(); 8];
            for (k, (x, y)) in x.iter().zip(y).enumerate() {
                partial[k % 8] = (*x - mean_x).mul_add(*y - mean_y, partial[k % 8]);
            }
            fold(partial) / R::splat(x.len() as f64)
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_follow_the_stated_order() {
        let x: Vec<f64> = (0..27).map(|k| 1.0 / f64::from(k + 1)).collect();
        let y: Vec<f64> = (0..27).map(|k| 0.1 * f64::from(k * k)).collect();
        let mut partial = [0.0; 8];
        for k in 0..27 {
            partial[k % 8] = x[k].mul_add(y[k], partial[k % 8]);
        }
        let expected = fold(partial);
        assert_eq!(dot(&x, &y).to_bits(), expected.to_bits());
        let dispatched = with_fma(
            #[inline(always)]
            || dot(&x, &y),
        );
        assert_eq!(dispatched.to_bits(), expected.to_bits());
    }

    #[test]
    fn moments_of_a_known_sequence() {
        let x: Vec<f64> = (0..10).map(f64::from).collect();
        assert_eq!(mean(&x), 4.5);
        assert_eq!(variance(&x), 8.25);
        let y: Vec<f64> = x.iter().map(|x| 3.0 - 2.0 * x).collect();
        assert_eq!(covariance(&x, &y), -16.5);
    }
}
