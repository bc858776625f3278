//! Four lanes.

use asobench_identification::real::{Mask, Real, Word};
use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

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

operators!(
    Avx2: Add add _mm256_add_pd,
    Sub sub _mm256_sub_pd,
    Mul mul _mm256_mul_pd,
    Div div _mm256_div_pd
);
operators!(
    Avx2Word: BitXor bitxor _mm256_xor_si256,
    BitAnd bitand _mm256_and_si256,
    BitOr bitor _mm256_or_si256
);
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
    const REGISTERS: usize = 16;
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
        // SAFETY: as the module says. 0 > x if the highest bit is set.
        Avx2Mask(unsafe { _mm256_castsi256_pd(_mm256_cmpgt_epi64(_mm256_setzero_si256(), bits.0)) })
    }
    #[inline(always)]
    fn run<T>(kernel: impl FnOnce() -> T) -> T {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn with_instructions<T>(kernel: impl FnOnce() -> T) -> T {
            kernel()
        }
        // SAFETY: only `Isa::dispatch` chooses this type, and only if `Isa::is_here` holds.
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
        // SAFETY: as the module says. The product is made of products of halves; those of unlike halves count 2^32.
        Self(unsafe {
            let (high, other_high) = (_mm256_srli_epi64::<32>(self.0), _mm256_srli_epi64::<32>(other.0));
            let crossed = _mm256_add_epi64(_mm256_mul_epu32(high, other.0), _mm256_mul_epu32(self.0, other_high));
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
