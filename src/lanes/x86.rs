//! Packs of x86-64: 8 lanes by AVX-512, 4 by AVX2 and FMA.
//!
//! The values of a type exist only where [`Isa::is_here`] said that its instructions do: [`super::Isa::dispatch`] is
//! the one place that chooses a type. That is the reason of every `unsafe` here: an intrinsic of that instruction set
//! on values in registers. Loads and stores go through references to arrays of the register's size.

#![allow(unsafe_code)]
#![allow(
    clippy::wildcard_imports,
    reason = "the names of intrinsics say where they are from"
)]

use crate::real::{Mask, Real, Word};
use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

/// The operators of a pack, each one intrinsic of two registers.
macro_rules! operators {
    ($pack:ident: $($trait:ident $method:ident $intrinsic:ident),*) => {$(
        impl $trait for $pack {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: a value of this type exists, so its instructions do.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    )*};
}

/// Eight doubles.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Avx512(__m512d);

/// Eight words.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Avx512Word(__m512i);

/// A choice of eight lanes.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Avx512Mask(__mmask8);

operators!(Avx512: Add add _mm512_add_pd, Sub sub _mm512_sub_pd, Mul mul _mm512_mul_pd, Div div _mm512_div_pd);
operators!(Avx512Word: BitXor bitxor _mm512_xor_si512, BitAnd bitand _mm512_and_si512, BitOr bitor _mm512_or_si512);

impl Neg for Avx512 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::splat(-0.0) - self
    }
}

impl Real for Avx512 {
    const LANES: usize = 8;
    type Mask = Avx512Mask;
    type Word = Avx512Word;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm512_set1_pd(x) })
    }
    #[inline(always)]
    fn load(x: &[f64]) -> Self {
        let x: &[f64; 8] = x[..8].try_into().expect("eight numbers");
        // SAFETY: as the module says; the array has the register's size, and the load asks for no alignment.
        Self(unsafe { _mm512_loadu_pd(x.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, x: &mut [f64]) {
        let x: &mut [f64; 8] = (&mut x[..8]).try_into().expect("eight numbers");
        // SAFETY: as for `load`.
        unsafe { _mm512_storeu_pd(x.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm512_fmadd_pd(self.0, factor.0, addend.0) })
    }
    #[inline(always)]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm512_fnmadd_pd(self.0, factor.0, addend.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm512_sqrt_pd(self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm512_abs_pd(self.0) })
    }
    #[inline(always)]
    fn less(self, other: Self) -> Avx512Mask {
        // SAFETY: as the module says.
        Avx512Mask(unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> Avx512Mask {
        // SAFETY: as the module says.
        Avx512Mask(unsafe { _mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn select(mask: Avx512Mask, yes: Self, no: Self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm512_mask_blend_pd(mask.0, no.0, yes.0) })
    }
    #[inline(always)]
    fn to_bits(self) -> Avx512Word {
        // SAFETY: as the module says.
        Avx512Word(unsafe { _mm512_castpd_si512(self.0) })
    }
    #[inline(always)]
    fn from_bits(bits: Avx512Word) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm512_castsi512_pd(bits.0) })
    }
    #[inline(always)]
    fn where_negative(bits: Avx512Word) -> Avx512Mask {
        // SAFETY: as the module says.
        Avx512Mask(unsafe { _mm512_movepi64_mask(bits.0) })
    }
    #[inline(always)]
    fn run<T>(kernel: impl FnOnce() -> T) -> T {
        #[target_feature(
            enable = "avx512f,avx512dq,avx512vl,avx512bw,avx512cd,avx2,fma,bmi1,bmi2,lzcnt,popcnt"
        )]
        fn with_instructions<T>(kernel: impl FnOnce() -> T) -> T {
            kernel()
        }
        // SAFETY: only `Isa::dispatch` chooses this type, where `Isa::is_here` holds.
        unsafe { with_instructions(kernel) }
    }
}

impl BitAnd for Avx512Mask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for Avx512Mask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for Avx512Mask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl Mask for Avx512Mask {
    #[inline(always)]
    fn bits(self) -> u8 {
        self.0
    }
    #[inline(always)]
    fn from_bits(bits: u8) -> Self {
        Self(bits)
    }
}

impl Word for Avx512Word {
    #[inline(always)]
    fn splat(x: u64) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm512_set1_epi64(x.cast_signed()) })
    }
    #[inline(always)]
    fn load(x: &[u64]) -> Self {
        let x: &[u64; 8] = x[..8].try_into().expect("eight words");
        // SAFETY: as for `Avx512::load`.
        Self(unsafe { _mm512_loadu_epi64(x.as_ptr().cast()) })
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm512_add_epi64(self.0, other.0) })
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm512_sub_epi64(self.0, other.0) })
    }
    #[inline(always)]
    fn times(self, other: Self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm512_mullo_epi64(self.0, other.0) })
    }
    #[inline(always)]
    fn left<const BITS: u32>(self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm512_slli_epi64::<BITS>(self.0) })
    }
    #[inline(always)]
    fn right<const BITS: u32>(self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm512_srli_epi64::<BITS>(self.0) })
    }
}

/// Four doubles.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Avx2(__m256d);

/// Four words.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Avx2Word(__m256i);

/// A choice of four lanes: all bits of a lane, or none.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Avx2Mask(__m256d);

operators!(Avx2: Add add _mm256_add_pd, Sub sub _mm256_sub_pd, Mul mul _mm256_mul_pd, Div div _mm256_div_pd);
operators!(Avx2Word: BitXor bitxor _mm256_xor_si256, BitAnd bitand _mm256_and_si256, BitOr bitor _mm256_or_si256);
operators!(Avx2Mask: BitAnd bitand _mm256_and_pd, BitOr bitor _mm256_or_pd);

impl Neg for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::splat(-0.0) - self
    }
}

impl Real for Avx2 {
    const LANES: usize = 4;
    type Mask = Avx2Mask;
    type Word = Avx2Word;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm256_set1_pd(x) })
    }
    #[inline(always)]
    fn load(x: &[f64]) -> Self {
        let x: &[f64; 4] = x[..4].try_into().expect("four numbers");
        // SAFETY: as for `Avx512::load`.
        Self(unsafe { _mm256_loadu_pd(x.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, x: &mut [f64]) {
        let x: &mut [f64; 4] = (&mut x[..4]).try_into().expect("four numbers");
        // SAFETY: as for `Avx512::load`.
        unsafe { _mm256_storeu_pd(x.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm256_fmadd_pd(self.0, factor.0, addend.0) })
    }
    #[inline(always)]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm256_fnmadd_pd(self.0, factor.0, addend.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm256_sqrt_pd(self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0) })
    }
    #[inline(always)]
    fn less(self, other: Self) -> Avx2Mask {
        // SAFETY: as the module says.
        Avx2Mask(unsafe { _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> Avx2Mask {
        // SAFETY: as the module says.
        Avx2Mask(unsafe { _mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn select(mask: Avx2Mask, yes: Self, no: Self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm256_blendv_pd(no.0, yes.0, mask.0) })
    }
    #[inline(always)]
    fn to_bits(self) -> Avx2Word {
        // SAFETY: as the module says.
        Avx2Word(unsafe { _mm256_castpd_si256(self.0) })
    }
    #[inline(always)]
    fn from_bits(bits: Avx2Word) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm256_castsi256_pd(bits.0) })
    }
    #[inline(always)]
    fn where_negative(bits: Avx2Word) -> Avx2Mask {
        // SAFETY: as the module says. 0 > x where the highest bit is set.
        Avx2Mask(unsafe { _mm256_castsi256_pd(_mm256_cmpgt_epi64(_mm256_setzero_si256(), bits.0)) })
    }
    #[inline(always)]
    fn run<T>(kernel: impl FnOnce() -> T) -> T {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn with_instructions<T>(kernel: impl FnOnce() -> T) -> T {
            kernel()
        }
        // SAFETY: only `Isa::dispatch` chooses this type, where `Isa::is_here` holds.
        unsafe { with_instructions(kernel) }
    }
}

impl Not for Avx2Mask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm256_xor_pd(self.0, _mm256_castsi256_pd(_mm256_set1_epi64x(-1))) })
    }
}

impl Mask for Avx2Mask {
    #[inline(always)]
    fn bits(self) -> u8 {
        // SAFETY: as the module says. Four bits.
        unsafe { _mm256_movemask_pd(self.0) as u8 }
    }
    #[inline(always)]
    fn from_bits(bits: u8) -> Self {
        let lane = |i: u8| -i64::from(bits >> i & 1);
        // SAFETY: as the module says.
        Self(unsafe { _mm256_castsi256_pd(_mm256_setr_epi64x(lane(0), lane(1), lane(2), lane(3))) })
    }
}

impl Word for Avx2Word {
    #[inline(always)]
    fn splat(x: u64) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm256_set1_epi64x(x.cast_signed()) })
    }
    #[inline(always)]
    fn load(x: &[u64]) -> Self {
        let x: &[u64; 4] = x[..4].try_into().expect("four words");
        // SAFETY: as for `Avx512::load`.
        Self(unsafe { _mm256_loadu_si256(x.as_ptr().cast()) })
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm256_add_epi64(self.0, other.0) })
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm256_sub_epi64(self.0, other.0) })
    }
    #[inline(always)]
    fn times(self, other: Self) -> Self {
        // SAFETY: as the module says. The halves' products, of which those of unlike halves count 2^32.
        Self(unsafe {
            let (high, other_high) = (
                _mm256_srli_epi64::<32>(self.0),
                _mm256_srli_epi64::<32>(other.0),
            );
            let crossed = _mm256_add_epi64(
                _mm256_mul_epu32(high, other.0),
                _mm256_mul_epu32(self.0, other_high),
            );
            let low = _mm256_mul_epu32(self.0, other.0);
            _mm256_add_epi64(low, _mm256_slli_epi64::<32>(crossed))
        })
    }
    #[inline(always)]
    fn left<const BITS: u32>(self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm256_sll_epi64(self.0, _mm_cvtsi32_si128(BITS.cast_signed())) })
    }
    #[inline(always)]
    fn right<const BITS: u32>(self) -> Self {
        // SAFETY: as the module says.
        Self(unsafe { _mm256_srl_epi64(self.0, _mm_cvtsi32_si128(BITS.cast_signed())) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Isa;
    use crate::lanes::tests::tested;
    use crate::real::MOST_LANES;
    use std::array::from_fn;
    use std::panic::{AssertUnwindSafe, catch_unwind};

    /// Zeros, the ends of the normal and subnormal ranges, infinities, NaN of both signs, and numbers whose
    /// operations round, overflow or cancel. Their number is prime, so that any stride visits all.
    const NUMBERS: [f64; 31] = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        5e-324,
        -5e-324,
        2.225_073_858_507_200_9e-308,
        2.225_073_858_507_201_4e-308,
        -2.225_073_858_507_201_4e-308,
        f64::MAX,
        f64::MIN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
        -f64::NAN,
        f64::EPSILON,
        1.0 + f64::EPSILON,
        1.0 - f64::EPSILON / 2.0,
        std::f64::consts::PI,
        -std::f64::consts::E,
        1.0 / 3.0,
        1e-200,
        -1e200,
        1e-160,
        1e154,
        123_456_789.123,
        9_007_199_254_740_993.0,
        -4_503_599_627_370_495.5,
        0.1,
        -7.0,
        1e308,
    ];

    const WORDS: [u64; 7] = [
        0,
        1,
        u64::MAX,
        1 << 63,
        0x0123_4567_89ab_cdef,
        0xfedc_ba98_7654_3210,
        0x5555_aaaa_0f0f_3c3c,
    ];

    /// Other numbers in every lane.
    fn numbers(from: usize) -> [f64; MOST_LANES] {
        from_fn(|lane| NUMBERS[(from + 5 * lane) % NUMBERS.len()])
    }

    fn words(from: usize) -> [u64; MOST_LANES] {
        from_fn(|lane| WORDS[(from + 3 * lane) % WORDS.len()])
    }

    /// The same bits; of a NaN, whose sign and payload IEEE 754 leaves open, only that it is one.
    fn same(found: f64, expected: f64) -> bool {
        found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan()
    }

    fn check<R: Real>(what: &str, found: R, expected: impl Fn(usize) -> f64) {
        let mut lanes = [f64::NAN; MOST_LANES];
        found.store(&mut lanes);
        for lane in 0..R::LANES {
            let (found, expected) = (lanes[lane], expected(lane));
            assert!(
                same(found, expected),
                "{what}, lane {lane}: {found:e} for {expected:e}"
            );
        }
    }

    fn check_mask<M: Mask>(what: &str, lanes: usize, found: M, expected: impl Fn(usize) -> bool) {
        let bits = (0..lanes).fold(0, |bits, lane| bits | u8::from(expected(lane)) << lane);
        assert_eq!(found.bits(), bits, "{what}");
        assert_eq!(found.any(), bits != 0, "{what}");
        for lane in 0..lanes {
            assert_eq!(found.lane(lane), expected(lane), "{what}, lane {lane}");
        }
        let chosen: Vec<usize> = found.lanes().collect();
        let expected: Vec<usize> = (0..lanes).filter(|lane| expected(*lane)).collect();
        assert_eq!(chosen, expected, "{what}");
    }

    fn arithmetic<R: Real>() {
        for i in 0..NUMBERS.len() {
            let x = numbers(i);
            let a = R::load(&x);
            check("load", a, |l| x[l]);
            check("splat", R::splat(x[0]), |_| x[0]);
            check("neg", -a, |l| -x[l]);
            check("sqrt", a.sqrt(), |l| x[l].sqrt());
            check("abs", a.abs(), |l| x[l].abs());
            check("bits", R::from_bits(a.to_bits()), |l| x[l]);
            check_mask("finite", R::LANES, a.is_finite(), |l| x[l].is_finite());
            for lane in 0..R::LANES {
                assert!(same(a.lane(lane), x[lane]));
                let with = |l: usize| if l == lane { 42.0 } else { x[l] };
                check("with_lane", a.with_lane(lane, 42.0), with);
            }
            for j in 0..NUMBERS.len() {
                let y = numbers(j);
                let b = R::load(&y);
                check("add", a + b, |l| x[l] + y[l]);
                check("sub", a - b, |l| x[l] - y[l]);
                check("mul", a * b, |l| x[l] * y[l]);
                check("div", a / b, |l| x[l] / y[l]);
                check_mask("less", R::LANES, a.less(b), |l| x[l] < y[l]);
                check_mask("at_most", R::LANES, a.at_most(b), |l| x[l] <= y[l]);
                let maximum = a.maximum(b);
                for l in 0..R::LANES {
                    let found = maximum.lane(l);
                    if x[l].is_nan() || y[l].is_nan() {
                        assert!(found.is_nan(), "maximum of {} and {}", x[l], y[l]);
                    } else {
                        // Of two zeros either one.
                        assert_eq!(found, x[l].max(y[l]));
                    }
                }
                for k in 0..NUMBERS.len() {
                    let z = numbers(k);
                    let c = R::load(&z);
                    check("mul_add", a.mul_add(b, c), |l| x[l].mul_add(y[l], z[l]));
                    check("neg_mul_add", a.neg_mul_add(b, c), |l| {
                        (-x[l]).mul_add(y[l], z[l])
                    });
                }
            }
        }
    }

    fn masks<R: Real>() {
        let (x, y) = (numbers(15), numbers(18));
        let (a, b) = (R::load(&x), R::load(&y));
        for left in 0..=u8::MAX {
            let chosen = |l: usize| left >> l & 1 == 1;
            let mask = R::Mask::from_bits(left);
            check_mask("from_bits", R::LANES, mask, chosen);
            check_mask("not", R::LANES, !mask, |l| !chosen(l));
            let select = R::select(mask, a, b);
            check("select", select, |l| if chosen(l) { x[l] } else { y[l] });
            for right in [0, 1, 0b1010_0101, 0b0110_1100, u8::MAX, left] {
                let other = R::Mask::from_bits(right);
                let also = |l: usize| right >> l & 1 == 1;
                check_mask("and", R::LANES, mask & other, |l| chosen(l) && also(l));
                check_mask("or", R::LANES, mask | other, |l| chosen(l) || also(l));
            }
        }
    }

    fn check_words<R: Real>(what: &str, found: R::Word, expected: impl Fn(usize) -> u64) {
        let mut lanes = [f64::NAN; MOST_LANES];
        R::from_bits(found).store(&mut lanes);
        for lane in 0..R::LANES {
            let (found, expected) = (lanes[lane].to_bits(), expected(lane));
            assert_eq!(found, expected, "{what}, lane {lane}");
        }
        check_mask(what, R::LANES, R::where_negative(found), |l| {
            expected(l) >> 63 == 1
        });
    }

    fn shifts<R: Real, const BITS: u32>(x: &[u64; MOST_LANES]) {
        let a = R::Word::load(x);
        check_words::<R>("left", a.left::<BITS>(), |l| x[l] << BITS);
        check_words::<R>("right", a.right::<BITS>(), |l| x[l] >> BITS);
    }

    fn integers<R: Real>() {
        for i in 0..WORDS.len() {
            let x = words(i);
            let a = R::Word::load(&x);
            check_words::<R>("load", a, |l| x[l]);
            check_words::<R>("splat", R::Word::splat(x[0]), |_| x[0]);
            // Every shift that the streams, the signs and the normal numbers take, and the ends.
            shifts::<R, 0>(&x);
            shifts::<R, 1>(&x);
            shifts::<R, 11>(&x);
            shifts::<R, 12>(&x);
            shifts::<R, 17>(&x);
            shifts::<R, 19>(&x);
            shifts::<R, 23>(&x);
            shifts::<R, 41>(&x);
            shifts::<R, 45>(&x);
            shifts::<R, 52>(&x);
            shifts::<R, 63>(&x);
            for j in 0..WORDS.len() {
                let y = words(j);
                let b = R::Word::load(&y);
                check_words::<R>("plus", a.plus(b), |l| x[l].wrapping_add(y[l]));
                check_words::<R>("minus", a.minus(b), |l| x[l].wrapping_sub(y[l]));
                check_words::<R>("times", a.times(b), |l| x[l].wrapping_mul(y[l]));
                check_words::<R>("xor", a ^ b, |l| x[l] ^ y[l]);
                check_words::<R>("and", a & b, |l| x[l] & y[l]);
                check_words::<R>("or", a | b, |l| x[l] | y[l]);
            }
        }
    }

    /// Whatever the address, a load and a store touch the pack's numbers and no other.
    fn memory<R: Real>() {
        let all: Vec<f64> = (0..40).map(f64::from).collect();
        let words: Vec<u64> = (0..40).map(|i| i << 52 | i).collect();
        for offset in 0..=all.len() - R::LANES {
            let mut to = vec![-1.0; all.len()];
            R::load(&all[offset..]).store(&mut to[offset..]);
            for (i, to) in to.iter().enumerate() {
                let within = (offset..offset + R::LANES).contains(&i);
                assert_eq!(*to, if within { all[i] } else { -1.0 }, "{offset}, {i}");
            }
            let loaded = R::Word::load(&words[offset..]);
            check_words::<R>("load", loaded, |l| words[offset + l]);
        }
        let panics = |run: &mut dyn FnMut()| catch_unwind(AssertUnwindSafe(run)).is_err();
        for length in 0..R::LANES {
            let short = vec![1.0; length];
            let mut load = || assert!(R::load(&short).lane(0) == 1.0);
            assert!(panics(&mut load), "{length}");
            let mut to = vec![1.0; length];
            assert!(panics(&mut || R::splat(0.0).store(&mut to)), "{length}");
            let short = vec![1_u64; length];
            let mut load = || check_words::<R>("load", R::Word::load(&short), |_| 1);
            assert!(panics(&mut load), "{length}");
        }
        let exact = vec![1.0; R::LANES];
        check("exact", R::load(&exact), |_| 1.0);
    }

    /// As it stands, and some of it compiled for the instructions.
    fn every_operation<R: Real>() {
        arithmetic::<R>();
        masks::<R>();
        integers::<R>();
        assert_eq!(R::run(|| R::splat(3.0).lane(R::LANES - 1)), 3.0);
        R::run(
            #[inline(always)]
            || {
                let (x, y, z) = (numbers(2), numbers(18), numbers(28));
                let (a, b, c) = (R::load(&x), R::load(&y), R::load(&z));
                check("mul_add", a.mul_add(b, c), |l| x[l].mul_add(y[l], z[l]));
                check("div", a / b, |l| x[l] / y[l]);
                check("sqrt", b.abs().sqrt(), |l| y[l].abs().sqrt());
            },
        );
    }

    /// Not for valgrind 3.19, whose fused products have zeros of the wrong sign.
    #[test]
    fn every_operation_is_that_of_f64_in_every_lane() {
        for isa in tested() {
            match isa {
                Isa::Avx512 => every_operation::<Avx512>(),
                Isa::Avx2 => every_operation::<Avx2>(),
                Isa::Portable => every_operation::<f64>(),
            }
        }
    }

    #[test]
    fn loads_and_stores_touch_the_packs_numbers_only() {
        for isa in tested() {
            match isa {
                Isa::Avx512 => memory::<Avx512>(),
                Isa::Avx2 => memory::<Avx2>(),
                Isa::Portable => memory::<f64>(),
            }
        }
    }
}
