//! Standard normal numbers by the Box-Muller transform, without tables, branches or libm.
//!
//! Two words of a stream give `z1 = r cos t` and `z2 = r sin t` with `r = sqrt(-2 ln v)`. The uniform v in (0, 1] has
//! 52 bits (so |z| <= 8.49); the angle t is uniform on the circle with 2 + 52 bits. A SIMD lane can do every step, so
//! many trials in lock step can have the bits of this code. Normal numbers come in pairs: two words are always two
//! numbers.

use super::arithmetic::with_fma;
use super::random_stream::Stream;
use crate::real::{Real, Word};
use rand::Rng;
use std::f64::consts::FRAC_PI_2;

const MANTISSA: u64 = (1 << 52) - 1;
const ONE: u64 = 1023 << 52;
const SIGN: u64 = 1 << 63;

/// Fills `z` with independent standard normal numbers.
///
/// Numbers 2i and 2i+1 come from words 2i and 2i+1 of the stream. For an odd length the second number of the last pair
/// is dropped. Hence a longer slice extends a shorter one.
pub fn fill_standard_normal(stream: &mut Stream, z: &mut [f64]) {
    const PAIRS: usize = 8;
    let mut words = [[0; 2]; PAIRS];
    for block in z.chunks_mut(2 * PAIRS) {
        for pair in words.iter_mut().take(block.len().div_ceil(2)) {
            *pair = [stream.next_u64(), stream.next_u64()];
        }
        let mut normals = [[0.0_f64; 2]; PAIRS];
        with_fma(
            #[inline(always)]
            || {
                for (normal, word) in normals.iter_mut().zip(&words) {
                    *normal = box_muller(*word);
                }
            },
        );
        block.copy_from_slice(&normals.as_flattened()[..block.len()]);
    }
}

/// Computes one pair of normal numbers from two words.
#[inline(always)]
fn box_muller([radius_word, angle_word]: [u64; 2]) -> [f64; 2] {
    turn(radius_square(radius_word), angle_word)
}

/// Returns the number in [1, 2) with the mantissa bits of a word.
#[inline(always)]
fn fraction<R: Real>(word: R::Word) -> R {
    R::from_bits((word & R::Word::splat(MANTISSA)) | R::Word::splat(ONE))
}

/// Returns r^2.
#[inline(always)]
pub fn radius_square<R: Real>(word: R::Word) -> R {
    R::splat(-2.0) * ln(R::splat(2.0) - fraction::<R>(word))
}

/// Returns `(r cos t, r sin t)`, given r^2 and the word of t.
#[inline(always)]
pub fn turn<R: Real>(radius_square: R, angle_word: R::Word) -> [R; 2] {
    let r = radius_square.sqrt();
    let (sin, cos) = sin_cos_quarter(fraction::<R>(angle_word) - R::splat(1.5));
    // Turn by the quadrant, which is the highest two bits: (c, s), (-s, c), (-c, -s), (s, -c).
    let second_bit = angle_word.left::<1>();
    let odd = R::where_negative(second_bit);
    let (x, y) = (R::select(odd, sin, cos), R::select(odd, cos, sin));
    let sign = R::Word::splat(SIGN);
    let x_sign = (angle_word ^ second_bit) & sign;
    let y_sign = angle_word & sign;
    [
        r * R::from_bits(x.to_bits() ^ x_sign),
        r * R::from_bits(y.to_bits() ^ y_sign),
    ]
}

/// Returns the natural logarithm of a normal v in (0, 1], with an error below one unit in the last place.
///
/// `v = 2^e m` with m in [sqrt(1/2), sqrt(2)), `f = m - 1`, `s = f / (2 + f)`, and
/// `ln m = f - f^2/2 + s (f^2/2 + R(s^2))`, with R's minimax coefficients from FreeBSD's e_log.c
/// (Sun Microsystems 1993; error of R below 2^-58.45).
#[inline(always)]
fn ln<R: Real>(v: R) -> R {
    const COEFFICIENTS: [f64; 7] = [
        6.666666666666735130e-1,
        3.999999999940941908e-1,
        2.857142874366239149e-1,
        2.222219843214978396e-1,
        1.818357216161805012e-1,
        1.531383769920937332e-1,
        1.479819860511658591e-1,
    ];
    // ln 2 in two parts; e times the first is exact.
    const LN2_HIGH: f64 = 6.93147180369123816490e-1;
    const LN2_LOW: f64 = 1.90821492927058770002e-10;
    // The bits of sqrt(1/2).
    const SPLIT: u64 = 0x3fe6_a09e_667f_3bcd;
    // 2^52, whose lowest bits take an integer, and the amount added to the exponent.
    const SHIFTER: f64 = 4_503_599_627_370_496.0;
    const BIAS: u64 = 0x800;

    let offset = v.to_bits().minus(R::Word::splat(SPLIT));
    let biased = offset.right::<52>() ^ R::Word::splat(BIAS);
    let exponent = R::from_bits(biased | R::Word::splat(SHIFTER.to_bits())) - R::splat(SHIFTER + BIAS as f64);
    let m = R::from_bits(v.to_bits().minus(offset & R::Word::splat(!MANTISSA)));
    let f = m - R::splat(1.0);
    let s = f / (R::splat(2.0) + f);
    let w = s * s;
    let remainder = w * horner(&COEFFICIENTS, w);
    let half_square = R::splat(0.5) * f * f;
    let low = s.mul_add(half_square + remainder, exponent * R::splat(LN2_LOW));
    exponent.mul_add(R::splat(LN2_HIGH), f - (half_square - low))
}

/// Returns `(sin, cos)` of `pi/2 * x` for |x| <= 1/2 by Taylor series, with truncation errors below 2^-54 and 2^-58.
#[inline(always)]
fn sin_cos_quarter<R: Real>(x: R) -> (R, R) {
    // (-1)^k (pi/2)^(2k+1) / (2k+1)! and (-1)^k (pi/2)^(2k) / (2k)!
    const SIN: [f64; 8] = [
        FRAC_PI_2,
        -0.6459640975062463,
        0.07969262624616705,
        -0.004681754135318688,
        0.00016044118478735983,
        -3.598843235212085e-06,
        5.692172921967927e-08,
        -6.688035109811468e-10,
    ];
    const COS: [f64; 9] = [
        1.0,
        -1.2337005501361697,
        0.25366950790104803,
        -0.02086348076335296,
        0.0009192602748394266,
        -2.5202042373060607e-05,
        4.710874778818172e-07,
        -6.386603083791852e-09,
        6.565963114979473e-11,
    ];
    let w = x * x;
    (x * horner(&SIN, w), horner(&COS, w))
}

/// Returns `c_0 + c_1 x + c_2 x^2 + ...` by Horner's rule, fused.
#[inline(always)]
fn horner<const M: usize, R: Real>(c: &[f64; M], x: R) -> R {
    let mut sum = R::splat(c[M - 1]);
    for i in (0..M - 1).rev() {
        sum = sum.mul_add(x, R::splat(c[i]));
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Purpose, stream};

    fn normals(trial: u64, count: usize) -> Vec<f64> {
        let mut z = vec![0.0; count];
        fill_standard_normal(&mut stream(1, trial, Purpose::NoiseDrive), &mut z);
        z
    }

    fn ulps(a: f64, b: f64) -> f64 {
        (a - b).abs() / (b.abs() * f64::EPSILON).max(f64::MIN_POSITIVE)
    }

    #[test]
    fn logarithm_agrees_with_libm_to_an_ulp() {
        let mut v = 1.0_f64;
        for i in 0..200_000 {
            let x = (v * (1.0 - 1e-5 * f64::from(i % 7))).max(f64::MIN_POSITIVE);
            assert!(ulps(ln(x), libm::log(x)) <= 1.0, "{x:e}");
            v *= 0.999_82;
        }
        assert_eq!(ln(1.0), 0.0);
    }

    #[test]
    fn sine_and_cosine_agree_with_libm() {
        for i in -500..=500 {
            let x = f64::from(i) / 1000.0;
            let angle = std::f64::consts::FRAC_PI_2 * x;
            let (sin, cos) = sin_cos_quarter(x);
            assert!((sin - libm::sin(angle)).abs() <= 2e-16, "{x}");
            assert!((cos - libm::cos(angle)).abs() <= 2e-16, "{x}");
        }
    }

    #[test]
    fn a_longer_record_extends_a_shorter_one() {
        let long = normals(3, 1001);
        for count in [0, 1, 2, 15, 16, 17, 400] {
            assert_eq!(normals(3, count), long[..count]);
        }
    }

    /// The moments of 4 million numbers are within 4.5 standard errors of those of the normal law.
    #[test]
    fn moments_are_the_normal_laws() {
        const COUNT: usize = 4_000_000;
        let z = normals(0, COUNT);
        let moment = |p: i32| z.iter().map(|z| z.powi(p)).sum::<f64>() / COUNT as f64;
        // E z^p and the variance of z^p: E z^2p - (E z^p)^2.
        for (p, expected, variance) in [
            (1, 0.0, 1.0),
            (2, 1.0, 2.0),
            (3, 0.0, 15.0),
            (4, 3.0, 96.0),
            (6, 15.0, 10_170.0),
        ] {
            let error = (moment(p) - expected) / (variance / COUNT as f64).sqrt();
            assert!(error.abs() < 4.5, "moment {p}: {error} standard errors");
        }
        let lag_one = z.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / (COUNT as f64).sqrt();
        assert!(lag_one.abs() < 4.5, "lag one: {lag_one}");
        let squares = z.windows(2).map(|w| (w[0] * w[0] - 1.0) * (w[1] * w[1] - 1.0));
        let squares = squares.sum::<f64>() / (4.0 * COUNT as f64).sqrt();
        assert!(squares.abs() < 4.5, "lag one of squares: {squares}");
    }

    /// The shares beyond t are within 4.5 standard errors of erfc(t / sqrt 2).
    #[test]
    fn tail_shares_are_the_normal_laws() {
        const COUNT: usize = 4_000_000;
        let z = normals(1, COUNT);
        for t in [0.5, 1.0, 2.0, 3.0, 4.0, 4.5] {
            let share = libm::erfc(t / std::f64::consts::SQRT_2);
            let found = z.iter().filter(|z| z.abs() > t).count() as f64;
            let deviation = (COUNT as f64 * share * (1.0 - share)).sqrt();
            let error = (found - COUNT as f64 * share) / deviation;
            assert!(error.abs() < 4.5, "beyond {t}: {error} standard errors");
        }
    }

    /// The Kolmogorov-Smirnov statistic of a million numbers is below its 0.01 % critical value.
    #[test]
    fn the_distribution_is_normal() {
        const COUNT: usize = 1_000_000;
        let mut z = normals(2, COUNT);
        z.sort_by(f64::total_cmp);
        let distance = z.iter().enumerate().fold(0.0_f64, |distance, (i, z)| {
            let law = 0.5 * libm::erfc(-z / std::f64::consts::SQRT_2);
            let (below, above) = (i as f64 / COUNT as f64, (i + 1) as f64 / COUNT as f64);
            distance.max(law - below).max(above - law)
        });
        let scaled = distance * (COUNT as f64).sqrt();
        assert!(scaled < 2.23, "sqrt(N) D = {scaled}");
    }
}
