//! Eight lanes.

use asobench_identification::real::{Mask, Real, Word};
use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

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

operators!(
    Avx512: Add add _mm512_add_pd,
    Sub sub _mm512_sub_pd,
    Mul mul _mm512_mul_pd,
    Div div _mm512_div_pd
);
operators!(
    Avx512Word: BitXor bitxor _mm512_xor_si512,
    BitAnd bitand _mm512_and_si512,
    BitOr bitor _mm512_or_si512
);

impl Neg for Avx512 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::splat(-0.0) - self
    }
}

impl Real for Avx512 {
    const LANES: usize = 8;
    const REGISTERS: usize = 32;
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
        // SAFETY: as the module says; the array has the register's size, and the load needs no alignment.
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
        #[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw,avx512cd,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn with_instructions<T>(kernel: impl FnOnce() -> T) -> T {
            kernel()
        }
        // SAFETY: only `Isa::dispatch` chooses this type, and only if `Isa::is_here` holds.
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
