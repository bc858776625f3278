//! The spectral radius, i.e. the largest modulus of the poles, by the Ehrlich-Aberth iteration for all poles
//! simultaneously, over [`Real`].
//!
//! The iteration ends when every approximate root is one of two kinds. Either the polynomial's value there is rounding.
//! Or the disc of radius `n |p(z_i) / prod_(j != i) (z_i - z_j)|` around it stays within the largest modulus. All these
//! discs together contain all zeros, so no zero beyond the radius is missed. The error of the radius is a few times
//! that of rounding each coefficient once.

use super::canonical::reverse_negated;
use crate::real::{Mask, Real, Word};

/// The largest order that uses the iteration. At orders of some hundreds, powers of moduli would overflow or underflow.
pub const LARGEST_ORDER: usize = 24;

/// The largest number of steps from one circle. Six are usual; double zeros take about 20, 24-fold ones 60.
const MOST_STEPS: usize = 100;

/// Cosine and sine of the golden angle. Points turned by it surround a circle, however many there are.
const TURN: [f64; 2] = [-0.737_368_878_078_319_7, 0.675_490_294_261_523_8];

/// Circles on which the iteration starts, in units of `max |alpha_k|^(1/k)`; no zero exceeds twice that unit. Started
/// from within the zeros, all points may converge to a multiple zero and miss a larger one. Then the next circle is
/// tried.
const CIRCLES: [f64; 3] = [1.5, 2.0, 3.0];

/// Returns the largest modulus of the zeros of `z^n - a_n z^(n-1) - ... - a_1`, n at most `N`. NaN if a coefficient is
/// not finite or the iteration does not converge.
///
/// `stable` is the result of [`super::stability::is_stable`] for `a`.
#[inline(always)]
pub fn spectral_radius<R: Real, const N: usize>(a: &[R], stable: R::Mask) -> R {
    let mut alpha = [R::zero(); N];
    let alpha = &mut alpha[..a.len()];
    reverse_negated(a, alpha);
    let (scale, start) = normalise(alpha);
    on_its_side(iterate::<R, N>(alpha, start) * scale, stable)
}

/// Makes the radius agree with the stability test: it is 1 or more exactly if the polynomial is not stable. A radius
/// that rounding has put on the wrong side of 1 becomes the nearest number on the right side.
#[inline(always)]
pub(crate) fn on_its_side<R: Real>(radius: R, stable: R::Mask) -> R {
    let one = R::splat(1.0);
    let below = R::splat(1.0 - f64::EPSILON / 2.0);
    let inside = R::select(one.at_most(radius), below, radius);
    let outside = R::select(radius.less(one), one, radius);
    R::select(stable, inside, outside)
}

/// Divides the zeros exactly by a power of two such that `max |alpha_k|^(1/k)` is about 1. Returns that power, and the
/// maximum to within 10 %: zero if all zeros are, NaN if a coefficient is not finite.
#[inline(always)]
fn normalise<R: Real>(alpha: &mut [R]) -> (R, R) {
    let zero = R::zero();
    let limit = R::splat(LARGEST_EXPONENT);
    let (mut exponent, mut sum) = (-limit, zero);
    for (k, alpha) in alpha.iter().enumerate() {
        sum = sum + alpha.abs() * R::splat(f64::EPSILON);
        let of_root = rough_logarithm(*alpha) * R::splat(1.0 / (k + 1) as f64);
        let nonzero = zero.less(alpha.abs());
        exponent = exponent.maximum(R::select(nonzero, of_root, exponent));
    }
    let exponent = R::select(exponent.less(limit), exponent, limit);
    let integers = R::splat(INTEGERS);
    let whole = (exponent + integers) - integers;
    let inverse = rough_power(-whole);
    let mut some = R::Mask::from_bits(0);
    for k in 0..alpha.len() {
        for alpha in &mut alpha[k..] {
            *alpha = *alpha * inverse;
        }
        some = some | zero.less(alpha[k].abs());
    }
    let largest = R::select(some, rough_power(exponent - whole), zero);
    let largest = R::select(sum.is_finite(), largest, R::splat(f64::NAN));
    (rough_power(whole), largest)
}

/// The inverse of powers of two up to this exponent is a normal number.
const LARGEST_EXPONENT: f64 = 1022.0;

/// A number of this size has no fractional bits: 2^52, and half as much again to allow negative integers.
const INTEGERS: f64 = 6_755_399_441_055_744.0;

/// Units per 1 of the logarithm.
const UNITS: f64 = 1_048_576.0;

/// Returns `log2 |x|`, too low by at most 0.09, from the exponent and the first 20 bits of the mantissa.
#[inline(always)]
fn rough_logarithm<R: Real>(x: R) -> R {
    let integers = R::splat(INTEGERS);
    let bits = x.abs().to_bits().right::<32>() | integers.to_bits();
    (R::from_bits(bits) - integers) * R::splat(1.0 / UNITS) - R::splat(1023.0)
}

/// Returns the inverse of [`rough_logarithm`], which is exact for integers.
#[inline(always)]
fn rough_power<R: Real>(exponent: R) -> R {
    let integer = exponent.mul_add(R::splat(UNITS), R::splat(1023.0 * UNITS + INTEGERS));
    R::from_bits(integer.to_bits().left::<32>())
}

/// Returns the largest modulus of the zeros by the iteration.
#[inline(always)]
fn iterate<R: Real, const N: usize>(alpha: &[R], start: R) -> R {
    let n = alpha.len();
    let mut going = R::zero().less(start);
    let mut radius = R::select(going, R::splat(f64::NAN), start);
    let mut roots = [Complex::real(R::zero()); N];
    for step in 0..CIRCLES.len() * MOST_STEPS {
        if step % MOST_STEPS == 0 {
            surround(&mut roots[..n], start * R::splat(CIRCLES[step / MOST_STEPS]));
        }
        let (mut moduli, mut largest) = ([R::zero(); N], R::zero());
        for i in 0..n {
            moduli[i] = roots[i].square().sqrt();
            largest = largest.maximum(moduli[i]);
        }
        let (mut next, mut done, mut square) = (roots, going, R::zero());
        for i in 0..n {
            let settled;
            (next[i], settled) = improve(alpha, &roots[..n], i, moduli[i], largest);
            done = done & settled;
            square = square.maximum(next[i].square());
        }
        roots = next;
        radius = R::select(done, square.sqrt(), radius);
        going = going & !done;
        if !going.any() {
            break;
        }
    }
    radius
}

/// Fills `roots` with points around a circle.
#[inline(always)]
fn surround<R: Real>(roots: &mut [Complex<R>], radius: R) {
    let mut next = Complex {
        re: radius * R::splat(0.8),
        im: radius * R::splat(0.6),
    };
    for root in roots {
        *root = next;
        next = next.times(Complex::splat(TURN));
    }
}

/// Does the Ehrlich-Aberth step of one root. Also returns whether the root can no longer change the radius.
#[inline(always)]
fn improve<R: Real>(alpha: &[R], roots: &[Complex<R>], i: usize, modulus: R, largest: R) -> (Complex<R>, R::Mask) {
    let n = roots.len() as f64;
    let (zero, one) = (Complex::real(R::zero()), Complex::real(R::splat(1.0)));
    let z = roots[i];
    // p(z), p'(z), and the sum of the moduli of the terms of p.
    let (mut p, mut dp, mut terms) = (one, zero, one.re);
    for alpha in alpha {
        dp = dp.times_plus(z, p);
        p = p.times_plus(z, Complex::real(*alpha));
        terms = terms.mul_add(modulus, alpha.abs());
    }
    // The product of the distances from the other roots, and its derivative.
    let (mut q, mut dq) = (one, zero);
    for (j, other) in roots.iter().enumerate() {
        if j != i {
            let distance = z.minus(*other);
            dq = dq.times_plus(distance, q);
            q = q.times(distance);
        }
    }
    let rounding = terms * R::splat(n * f64::EPSILON);
    let room = (largest - modulus) * R::splat(1.0 / n);
    let is_zero = p.square().at_most(rounding * rounding);
    let is_within = p.square().at_most(room * room * q.square());
    let step = p.times(q).over(dp.times(q).minus(p.times(dq)));
    let better = z.minus(step);
    // A step that has no value, or that goes beyond the modulus of any possible zero, is not taken. z then moves along
    // the circle instead.
    let possible = better.square().at_most(R::splat(64.0));
    let turned = z.times(Complex::splat(TURN));
    let better = Complex {
        re: R::select(possible, better.re, turned.re),
        im: R::select(possible, better.im, turned.im),
    };
    (better, is_zero | is_within)
}

/// re + i im.
#[derive(Clone, Copy)]
struct Complex<R> {
    re: R,
    im: R,
}

impl<R: Real> Complex<R> {
    #[inline(always)]
    fn real(re: R) -> Self {
        let im = R::zero();
        Self { re, im }
    }

    #[inline(always)]
    fn splat([re, im]: [f64; 2]) -> Self {
        let (re, im) = (R::splat(re), R::splat(im));
        Self { re, im }
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        Self {
            re: self.re - other.re,
            im: self.im - other.im,
        }
    }

    /// Returns `self * factor + addend`.
    #[inline(always)]
    fn times_plus(self, factor: Self, addend: Self) -> Self {
        let re = self.re.mul_add(factor.re, addend.re);
        let im = self.re.mul_add(factor.im, addend.im);
        Self {
            re: self.im.neg_mul_add(factor.im, re),
            im: self.im.mul_add(factor.re, im),
        }
    }

    #[inline(always)]
    fn times(self, factor: Self) -> Self {
        self.times_plus(factor, Self::real(R::zero()))
    }

    #[inline(always)]
    fn over(self, divisor: Self) -> Self {
        let inverse = R::splat(1.0) / divisor.square();
        let conjugate = Self {
            re: divisor.re * inverse,
            im: -divisor.im * inverse,
        };
        self.times(conjugate)
    }

    /// Returns the modulus squared.
    #[inline(always)]
    fn square(self) -> R {
        self.re.mul_add(self.re, self.im * self.im)
    }
}
