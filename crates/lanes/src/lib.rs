//! The fast engine: the stages with one trial in each SIMD lane.
//!
//! A pack of trials runs in lock step: 8 with AVX-512, 4 with AVX2 and FMA, one otherwise. Each lane computes as in
//! f64, independently of its neighbours. Hence a trial has the same bits in any lane of any pack on any machine.
//! Records have the bits of [`asobench_identification::data`]; estimates agree with those of
//! [`asobench_identification::estimator`] up to rounding.
//!
//! A study decides when this engine is used; everything else runs on [`asobench_identification::estimator`].

pub mod information;
pub mod initial_state;
mod inverses;
pub mod one_record;
// The tests of the program run whole packs; to compile them for unit tests too would take a minute.
#[cfg(not(test))]
pub mod pack;
pub mod partitioned;
pub mod passes;
mod peak;
pub mod record;
pub mod response;
pub mod score;
mod sorted_qr;
#[cfg(test)]
mod tests;
#[cfg(target_arch = "x86_64")]
mod x86;

use asobench_identification::names::named_enum;
use asobench_identification::real::{Real, use_portable_instructions};
use std::sync::OnceLock;

/// The largest order of a pack. It is the capacity of the general code, for orders without specialised code.
pub const LARGEST_ORDER: usize = asobench_identification::plant::radius::LARGEST_ORDER;

/// An n x n matrix, row by row, stored in the first n rows and columns.
type Square<R, const N: usize> = [[R; N]; N];

/// Returns the order; it is a constant in code specialised for one order.
#[inline(always)]
pub fn order<const N: usize>(n: usize) -> usize {
    if N == LARGEST_ORDER { n } else { N }
}

/// Calls `visit(0) ... visit(n - 1)`. The calls are unrolled if the order is a constant, so that indexed values stay in
/// registers.
#[inline(always)]
fn unrolled<const N: usize>(n: usize, mut visit: impl FnMut(usize)) {
    if N == LARGEST_ORDER {
        for i in 0..n {
            visit(i);
        }
        return;
    }
    if 0 < n {
        visit(0);
    }
    if 1 < n {
        visit(1);
    }
    if 2 < n {
        visit(2);
    }
    if 3 < n {
        visit(3);
    }
    if 4 < n {
        visit(4);
    }
    if 5 < n {
        visit(5);
    }
    const { assert!(N <= 6 || N == LARGEST_ORDER) };
}

/// Returns the numbers, the same in every lane, followed by zeros.
fn splat<R: Real, const N: usize>(numbers: &[f64]) -> [R; N] {
    let mut to = [R::zero(); N];
    for (to, number) in to.iter_mut().zip(numbers) {
        *to = R::splat(*number);
    }
    to
}

/// Returns the numbers of one lane.
pub(crate) fn lane<R: Real, const N: usize>(packed: &[R; N], lane: usize) -> [f64; N] {
    std::array::from_fn(|i| packed[i].lane(lane))
}

named_enum! {
    /// The instruction set of a pack.
    Isa, "instruction set" {
        /// Eight lanes.
        Avx512 = "avx512",
        /// Four lanes, with fused multiply-add.
        Avx2 = "avx2",
        /// One lane, on any machine.
        Portable = "portable",
    }
}

/// The instruction set that a process was told to use.
static CHOSEN: OnceLock<Isa> = OnceLock::new();

/// This machine does not have the instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("this machine has no {0}")]
pub struct NotHere(pub Isa);

impl Isa {
    /// Returns whether this machine has the instructions.
    pub fn is_here(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_here()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512cd")
            }
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => {
                is_x86_feature_detected!("avx2")
                    && is_x86_feature_detected!("fma")
                    && is_x86_feature_detected!("bmi1")
                    && is_x86_feature_detected!("bmi2")
                    && is_x86_feature_detected!("lzcnt")
                    && is_x86_feature_detected!("popcnt")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// Returns the widest instruction set of this machine, or the one that was chosen instead.
    pub fn best() -> Self {
        if let Some(chosen) = CHOSEN.get() {
            return *chosen;
        }
        let all = [Self::Avx512, Self::Avx2, Self::Portable];
        all.into_iter().find(|isa| isa.is_here()).unwrap_or_default()
    }

    /// Makes this the instruction set of all that chooses one by the machine, for the whole process: packs, and with
    /// [`Self::Portable`] kernels of one record too. Not faer, which chooses for itself. The first choice stays.
    ///
    /// # Errors
    /// [`NotHere`].
    pub fn choose(self) -> Result<(), NotHere> {
        if !self.is_here() {
            return Err(NotHere(self));
        }
        if *CHOSEN.get_or_init(|| self) == Self::Portable {
            use_portable_instructions();
        }
        Ok(())
    }

    /// Calls `call` with the pack of this width and the capacity for an order.
    ///
    /// # Panics
    /// If this machine does not have the instructions, or the order is 0 or above
    /// [`LARGEST_ORDER`].
    pub fn dispatch<C: Call>(self, order: usize, call: C) -> C::Output {
        assert!(self.is_here(), "{self} is not on this machine");
        assert!((1..=LARGEST_ORDER).contains(&order));
        // A combination without specialised code gives the same bits by the general code.
        match (self, order) {
            #[cfg(target_arch = "x86_64")]
            (Self::Avx512, 2) => call.with::<x86::Avx512, 2>(),
            #[cfg(target_arch = "x86_64")]
            (Self::Avx512, 4) => call.with::<x86::Avx512, 4>(),
            #[cfg(target_arch = "x86_64")]
            (Self::Avx512, 6) => call.with::<x86::Avx512, 6>(),
            #[cfg(target_arch = "x86_64")]
            (Self::Avx512, _) => call.with::<x86::Avx512, LARGEST_ORDER>(),
            #[cfg(target_arch = "x86_64")]
            (Self::Avx2, 6) => call.with::<x86::Avx2, 6>(),
            #[cfg(target_arch = "x86_64")]
            (Self::Avx2, _) => call.with::<x86::Avx2, LARGEST_ORDER>(),
            _ => call.with::<f64, LARGEST_ORDER>(),
        }
    }
}

/// A computation on packs of any width.
pub trait Call {
    /// The result.
    type Output;

    /// Runs it with packs `R` and matrices of capacity `N`.
    fn with<R: Real, const N: usize>(self) -> Self::Output;
}
