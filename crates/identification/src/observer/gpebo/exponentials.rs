//! The exponential in lock step, with the same bits on every machine.
//!
//! Both functions are those of glibc on a machine with fused multiply-add, operation by operation, so that one number
//! and many, this machine and another have the same bits.

use crate::real::{MOST_LANES, Mask, Real, Word};

/// 1.5 times 2^52: the sum with it has the nearest integer in its lowest bits.
const SHIFT: f64 = 6755399441055744.0;

/// Below this size `e^x - 1` is x, 2^-54.
const TINY: u64 = 0x3c90_0000;
/// From this size on x is reduced, about ln 2 / 2.
const REDUCED: u64 = 0x3fd6_2e43;
/// From this size on more than one ln 2 is taken away, about 1.5 ln 2.
const FAR: u64 = 0x3ff0_a2b2;
/// From this size on `e^x - 1` is -1, about 56 ln 2.
const GONE: u64 = 0x4043_687a;

/// ln 2, in units of 2^-127.
const LN_2: u128 = 0x58b9_0bfb_e8e7_bcd5_e4f1_d9cc_01f9_7b57;

/// For each i from 0 to 127 the bits of t and those of s less `i 2^45`, where `2^(i/128) = s (1 + t)` with s rounded:
/// the table of [`exp`]'s source.
const POWERS: [[u64; 2]; 128] = {
    let (mut powers, mut i) = ([[0; 2]; 128], 0);
    while i < powers.len() {
        powers[i] = power(i as u64);
        i += 1;
    }
    powers
};

/// Computes an entry by the series of `e^(i ln 2 / 128)`, in units of 2^-127.
const fn power(i: u64) -> [u64; 2] {
    let exponent = LN_2 / 128 * i as u128;
    let (mut term, mut sum, mut n) = (1 << 127, 1 << 127, 1);
    while term > 0 {
        term = product(term, exponent) / n;
        sum += term;
        n += 1;
    }
    let s = sum as f64;
    let rest = sum.wrapping_sub(s as u128) as i128;
    // Over the 53 bits of s, so that the quotient is rounded once.
    let t = ((rest << 50) / (s as u128 >> 75) as i128) as f64 / (1_u128 << 125) as f64;
    [t.to_bits(), s.to_bits() - (127 << 52) - (i << 45)]
}

/// Returns the product of two numbers in units of 2^-127, the second below 1.
const fn product(a: u128, b: u128) -> u128 {
    const LOW: u128 = u64::MAX as u128;
    let middle = (a >> 64) * (b & LOW) + (a & LOW) * (b >> 64) + (((a & LOW) * (b & LOW)) >> 64);
    (((a >> 64) * (b >> 64)) << 1) + (middle >> 63)
}

/// Returns the number that a word of the source stands for: its upper half, the lower half being zero.
#[inline(always)]
fn limit<R: Real>(word: u64) -> R {
    R::splat(f64::from_bits(word << 32))
}

/// Returns `e^x - 1` for x <= 0; NaN for NaN. Within 1 ulp.
///
/// Source: FreeBSD's `s_expm1.c` (Sun Microsystems 1993), its polynomial as glibc groups it: `x = k ln 2 + r`, then
/// `e^r - 1` by a rational function of r^2, then `2^k (e^r - 1) + (2^k - 1)`.
#[inline(always)]
pub fn exp_m1<R: Real>(x: R) -> R {
    const LN2_HIGH: f64 = f64::from_bits(0x3fe6_2e42_fee0_0000);
    const LN2_LOW: f64 = f64::from_bits(0x3dea_39ef_3579_3c76);
    let (one, half) = (R::splat(1.0), R::splat(0.5));
    let size = x.abs();
    let reduced = limit::<R>(REDUCED).at_most(size);
    let far = limit::<R>(FAR).at_most(size);
    // k = the quotient towards zero, and 1 below it: of negative numbers the ceiling.
    let quotient = R::splat(std::f64::consts::LOG2_E) * x - half;
    let nearest = (quotient + R::splat(SHIFT)) - R::splat(SHIFT);
    let ceiling = R::select(nearest.less(quotient), nearest + one, nearest);
    let near = R::select(reduced, -one, R::zero());
    let k = R::select(far, ceiling, near);
    // For k = 0, r = x and its correction is 0.
    let high = k.neg_mul_add(R::splat(LN2_HIGH), x);
    let low = k * R::splat(LN2_LOW);
    let r = high - low;
    let correction = (high - r) - low;
    let (e, z) = rational(r);
    let whole = r - e.mul_add(r, -z);
    let e = (e - correction).mul_add(r, -correction) - z;
    let once = (r - e).mul_add(half, -half);
    // The exponent of `1 + (r - e)` plus k.
    let power = (k + R::splat(SHIFT)).to_bits().left::<52>();
    let scaled = R::from_bits((one - (e - r)).to_bits().plus(power)) - one;
    let below = k.less(R::splat(-1.5));
    let found = R::select(reduced, R::select(below, scaled, once), whole);
    let found = R::select(limit::<R>(GONE).at_most(size), -one, found);
    R::select(size.less(limit(TINY)), x, found)
}

/// Returns the source's e, of which `e^r - 1 = r - (r e - z)`, and its z, `r^2 / 2`.
#[inline(always)]
fn rational<R: Real>(r: R) -> (R, R) {
    let halved = r * R::splat(0.5);
    let z = r * halved;
    let r1 = z.mul_add(R::splat(f64::from_bits(0xbfa1_1111_1111_10f4)), R::splat(1.0));
    let r2 =
        R::splat(f64::from_bits(0xbf14_ce19_9eaa_dbb7)).mul_add(z, R::splat(f64::from_bits(0x3f5a_01a0_19fe_5585)));
    let r3 =
        R::splat(f64::from_bits(0xbe8a_fdb7_6e09_c32d)).mul_add(z, R::splat(f64::from_bits(0x3ed0_cfca_86e6_5239)));
    let z2 = z * z;
    let sum = (z2 * z2).mul_add(r3, z2.mul_add(r2, r1));
    let t = sum.neg_mul_add(halved, R::splat(3.0));
    ((sum - t) / t.neg_mul_add(r, R::splat(6.0)) * z, z)
}

/// For rates of decay, none negative, computes `e^-rate - 1`, and `(1 - e^-rate) / rate`, which is 1 where the rate
/// is 0.
///
/// Where all rates are tiny, or all so large that nothing is left, nothing needs to be computed; and less, where
/// none is reduced. The bits are those of [`exp_m1`].
#[inline(always)]
pub fn decays<R: Real, const N: usize>(rates: &[R; N]) -> ([R; N], [R; N]) {
    let (one, mut decay, mut phi) = (R::splat(1.0), [R::zero(); N], [R::splat(1.0); N]);
    let mut tiny = rates[0].less(limit(TINY));
    let mut small = rates[0].less(limit(REDUCED));
    let mut gone = limit::<R>(GONE).at_most(rates[0]);
    for i in 1..N {
        tiny = tiny & rates[i].less(limit(TINY));
        small = small & rates[i].less(limit(REDUCED));
        gone = gone & limit::<R>(GONE).at_most(rates[i]);
    }
    if !(!tiny).any() {
        for i in 0..N {
            decay[i] = -rates[i];
        }
        return (decay, phi);
    }
    if !(!gone).any() {
        for i in 0..N {
            decay[i] = -one;
            phi[i] = one / rates[i];
        }
        return (decay, phi);
    }
    if (!small).any() {
        for i in 0..N {
            decay[i] = exp_m1(-rates[i]);
        }
    } else {
        for i in 0..N {
            let r = -rates[i];
            let (e, z) = rational(r);
            decay[i] = R::select(rates[i].less(limit(TINY)), r, r - e.mul_add(r, -z));
        }
    }
    for i in 0..N {
        let none = rates[i].at_most(R::zero());
        phi[i] = R::select(none, one, -decay[i] / rates[i]);
    }
    (decay, phi)
}

/// Returns `e^x`, within 1 ulp.
///
/// Source: `exp.c` of the "Optimized Routines" of Arm (MIT licence): `x = (128 k + i) ln 2 / 128 + r`, a polynomial
/// of r and a table of `2^(i/128)`.
#[inline(always)]
pub fn exp<R: Real>(x: R) -> R {
    const STEPS: f64 = f64::from_bits(0x4067_1547_652b_82fe);
    const STEP_HIGH: f64 = f64::from_bits(0xbf76_2e42_fefa_0000);
    const STEP_LOW: f64 = f64::from_bits(0xbd0c_f79a_bc9e_3b3a);
    let number = |bits: u64| R::splat(f64::from_bits(bits));
    let shifted = x.mul_add(R::splat(STEPS), R::splat(SHIFT));
    let k = shifted - R::splat(SHIFT);
    let r = k.mul_add(R::splat(STEP_HIGH), x);
    let r = k.mul_add(R::splat(STEP_LOW), r);
    let mut steps = [0.0; MOST_LANES];
    shifted.store(&mut steps);
    let (mut tails, mut powers) = ([0.0; MOST_LANES], [0; MOST_LANES]);
    for lane in 0..R::LANES {
        let bits = steps[lane].to_bits();
        let [tail, power] = POWERS[(bits % 128) as usize];
        tails[lane] = f64::from_bits(tail);
        powers[lane] = power.wrapping_add(bits << 45);
    }
    let scale = R::from_bits(R::Word::load(&powers));
    let low = number(0x3fc5_5555_5555_543c).mul_add(r, number(0x3fdf_ffff_ffff_fdbd));
    let high = number(0x3f81_1111_67a4_d017).mul_add(r, number(0x3fa5_5555_cf17_2b91));
    let r2 = r * r;
    let sum = (r2 * r2).mul_add(high, low.mul_add(r2, R::load(&tails) + r));
    let found = scale.mul_add(sum, scale);
    // 2^-54 and 512; a NaN is beyond.
    let size = x.abs();
    let found = R::select(size.less(number(0x3c90_0000_0000_0000)), x + R::splat(1.0), found);
    let beyond = !size.less(R::splat(512.0));
    if beyond.any() { extreme(x, found, beyond) } else { found }
}

/// Replaces what may be infinite, subnormal or NaN.
#[cold]
#[inline(never)]
fn extreme<R: Real>(x: R, mut found: R, beyond: R::Mask) -> R {
    let mut numbers = [0.0; MOST_LANES];
    x.store(&mut numbers);
    for lane in beyond.lanes() {
        found = found.with_lane(lane, numbers[lane].exp());
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From 2^-60 to beyond the ends, and both sides of every case of the source.
    fn arguments() -> impl Iterator<Item = f64> {
        let ends = [0x3c90_0000, 0x3fd6_2e43, 0x3ff0_a2b2, 0x4043_687a].map(|word: u64| word << 32);
        let ends = ends.into_iter().flat_map(|bits| [bits - 1, bits, bits + 1]);
        let ends = ends.map(f64::from_bits).chain([0.0, 1e300, f64::INFINITY]);
        ends.chain((-6000..=1000).map(|i| (f64::from(i) / 100.0).exp2() * 1.01))
    }

    /// In units of the last place of the expected number.
    fn error(found: f64, expected: f64) -> f64 {
        if found == expected {
            return 0.0;
        }
        let next = f64::from_bits(expected.to_bits() + 1);
        ((found - expected) / (next - expected)).abs()
    }

    #[test]
    fn the_powers_are_those_of_the_source() {
        assert_eq!(POWERS, super::super::exp_table::POWERS);
    }

    #[test]
    fn both_are_within_an_ulp_of_another_library() {
        for x in arguments() {
            // That library is within 1 ulp too.
            assert!(error(exp_m1(-x), libm::expm1(-x)) <= 2.0, "{x:e}");
            for x in [x, -x] {
                assert!(error(exp(x), libm::exp(x)) <= 2.0, "{x:e}");
            }
        }
        assert!(exp_m1(f64::NAN).is_nan() && exp(f64::NAN).is_nan());
        assert!(exp_m1(-0.0).is_sign_negative());
    }

    #[test]
    fn short_cuts_have_the_same_bits() {
        for rate in arguments() {
            let (decay, phi) = decays(&[rate]);
            let long = exp_m1(-rate);
            assert_eq!(decay[0].to_bits(), long.to_bits(), "{rate:e}");
            let expected = if rate == 0.0 { 1.0 } else { -long / rate };
            assert_eq!(phi[0].to_bits(), expected.to_bits(), "{rate:e}");
            // Beside one that needs the long way.
            assert_eq!(decays(&[rate, 1.3]).0[0].to_bits(), long.to_bits());
            assert_eq!(decays(&[rate, 1.3]).1[0].to_bits(), phi[0].to_bits());
        }
        let (decay, phi) = decays(&[f64::NAN]);
        assert!(decay[0].is_nan() && phi[0].is_nan());
    }
}
