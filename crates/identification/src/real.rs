//! The number type of the stages' arithmetic: one number, or a pack of numbers in lock step.
//!
//! [`Real`] is f64 itself or one SIMD register of f64 (the package asobench-lanes). The results of a lane are those of
//! f64: every operation is that of IEEE 754, lane by lane, and products are fused only where the code says so
//! ([`Real::mul_add`]).

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};
use std::sync::atomic::{AtomicBool, Ordering};

/// The largest number of lanes.
pub const MOST_LANES: usize = 8;

/// A double, or several in lock step.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Send
    + 'static
{
    /// The number of lanes of a pack.
    const LANES: usize;
    /// How many packs the registers hold, which determines how much a loop should do at once.
    const REGISTERS: usize;
    /// The result of a comparison.
    type Mask: Mask;
    /// The same bits as integers.
    type Word: Word;

    /// Returns the same number in every lane.
    fn splat(x: f64) -> Self;
    /// Loads lane i from `x[i]`.
    ///
    /// # Panics
    /// If `x` is shorter than the pack.
    fn load(x: &[f64]) -> Self;
    /// Stores lane i to `x[i]`.
    ///
    /// # Panics
    /// If `x` is shorter than the pack.
    fn store(self, x: &mut [f64]);
    /// Returns `self * factor + addend` with one rounding.
    #[must_use]
    fn mul_add(self, factor: Self, addend: Self) -> Self;
    /// Returns `addend - self * factor` with one rounding.
    #[must_use]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self;
    /// Returns the square root.
    #[must_use]
    fn sqrt(self) -> Self;
    /// Returns the absolute value.
    #[must_use]
    fn abs(self) -> Self;
    /// Returns whether `self < other`; false for NaN.
    fn less(self, other: Self) -> Self::Mask;
    /// Returns whether `self <= other`; false for NaN.
    fn at_most(self, other: Self) -> Self::Mask;
    /// Returns `yes` in the lanes that the mask selects, `no` elsewhere.
    #[must_use]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Returns the bits.
    fn to_bits(self) -> Self::Word;
    /// Returns the number with these bits.
    fn from_bits(bits: Self::Word) -> Self;
    /// Returns the lanes in which the highest bit is set.
    fn where_negative(bits: Self::Word) -> Self::Mask;
    /// Runs a kernel with the instructions that the lanes need. The kernel must be inlined.
    fn run<T>(kernel: impl FnOnce() -> T) -> T;

    /// Returns zero.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }

    /// Returns the number of one lane.
    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        let mut lanes = [0.0; MOST_LANES];
        self.store(&mut lanes);
        lanes[lane]
    }

    /// Returns the pack with the number of one lane replaced.
    #[inline(always)]
    #[must_use]
    fn with_lane(self, lane: usize, x: f64) -> Self {
        let mut lanes = [0.0; MOST_LANES];
        self.store(&mut lanes);
        lanes[lane] = x;
        Self::load(&lanes)
    }

    /// Returns the larger number, NaN if either is.
    #[inline(always)]
    #[must_use]
    fn maximum(self, other: Self) -> Self {
        // `other <= self` is false if either is NaN. The first selection then returns other, and the second self if it
        // is the NaN.
        let larger = Self::select(other.at_most(self), self, other);
        Self::select(self.at_most(self), larger, self)
    }

    /// Returns the lanes in which the number is neither infinite nor NaN.
    #[inline(always)]
    fn is_finite(self) -> Self::Mask {
        self.abs().less(Self::splat(f64::INFINITY))
    }
}

/// A selection of lanes.
pub trait Mask: Copy + Send + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// Returns the mask as bits; bit i is lane i.
    fn bits(self) -> u8;
    /// Returns the mask with these bits, the inverse of [`Self::bits`]. Bits beyond the lanes are ignored.
    fn from_bits(bits: u8) -> Self;

    /// Returns whether a lane is selected.
    #[inline(always)]
    fn lane(self, lane: usize) -> bool {
        self.bits() >> lane & 1 == 1
    }

    /// Returns whether any lane is selected.
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }

    /// Returns the selected lanes.
    fn lanes(self) -> impl Iterator<Item = usize> {
        let bits = self.bits();
        (0..MOST_LANES).filter(move |lane| bits >> lane & 1 == 1)
    }
}

/// 64 bits, or several times 64.
pub trait Word: Copy + BitXor<Output = Self> + BitAnd<Output = Self> + BitOr<Output = Self> {
    /// Returns the same bits in every lane.
    fn splat(x: u64) -> Self;
    /// Loads lane i from `x[i]`.
    ///
    /// # Panics
    /// If `x` is shorter than the pack.
    fn load(x: &[u64]) -> Self;
    /// Returns the sum modulo 2^64.
    #[must_use]
    fn plus(self, other: Self) -> Self;
    /// Returns the difference modulo 2^64.
    #[must_use]
    fn minus(self, other: Self) -> Self;
    /// Returns the product modulo 2^64.
    #[must_use]
    fn times(self, other: Self) -> Self;
    /// Shifts to the left.
    #[must_use]
    fn left<const BITS: u32>(self) -> Self;
    /// Shifts to the right, filling with zeros.
    #[must_use]
    fn right<const BITS: u32>(self) -> Self;
}

/// Whether kernels run as compiled for any machine of the architecture.
static PORTABLE: AtomicBool = AtomicBool::new(false);

/// Makes [`with_fma`] use no instructions but those that every machine of the architecture has.
pub fn use_portable_instructions() {
    PORTABLE.store(true, Ordering::Relaxed);
}

/// Runs `kernel` compiled for the machine's fused multiply-add and vector instructions.
///
/// The result does not depend on the instructions found: `kernel` must follow the rules of
/// [`crate::signal::arithmetic`].
#[inline(always)]
pub fn with_fma<T>(kernel: impl FnOnce() -> T) -> T {
    let arch = if PORTABLE.load(Ordering::Relaxed) {
        pulp::Arch::Scalar
    } else {
        pulp::Arch::new()
    };
    arch.dispatch(kernel)
}

impl Real for f64 {
    const LANES: usize = 1;
    const REGISTERS: usize = 16;
    type Mask = bool;
    type Word = u64;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn load(x: &[f64]) -> Self {
        x[0]
    }
    #[inline(always)]
    fn store(self, x: &mut [f64]) {
        x[0] = self;
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self::mul_add(self, factor, addend)
    }
    #[inline(always)]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        Self::mul_add(-self, factor, addend)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self::abs(self)
    }
    #[inline(always)]
    fn less(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn to_bits(self) -> u64 {
        Self::to_bits(self)
    }
    #[inline(always)]
    fn from_bits(bits: u64) -> Self {
        Self::from_bits(bits)
    }
    #[inline(always)]
    fn where_negative(bits: u64) -> bool {
        bits >> 63 == 1
    }
    #[inline(always)]
    fn run<T>(kernel: impl FnOnce() -> T) -> T {
        with_fma(kernel)
    }
}

impl Mask for bool {
    #[inline(always)]
    fn bits(self) -> u8 {
        u8::from(self)
    }
    #[inline(always)]
    fn from_bits(bits: u8) -> Self {
        bits & 1 == 1
    }
}

impl Word for u64 {
    #[inline(always)]
    fn splat(x: u64) -> Self {
        x
    }
    #[inline(always)]
    fn load(x: &[u64]) -> Self {
        x[0]
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self.wrapping_add(other)
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.wrapping_sub(other)
    }
    #[inline(always)]
    fn times(self, other: Self) -> Self {
        self.wrapping_mul(other)
    }
    #[inline(always)]
    fn left<const BITS: u32>(self) -> Self {
        self << BITS
    }
    #[inline(always)]
    fn right<const BITS: u32>(self) -> Self {
        self >> BITS
    }
}
