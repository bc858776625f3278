//! Packs of x86-64: 8 lanes with AVX-512, 4 with AVX2 and FMA.
//!
//! A value of such a type exists only if [`Isa::is_here`] has confirmed its instructions, because
//! [`super::Isa::dispatch`] is the only place that chooses a type. This justifies every `unsafe` here: each is an
//! intrinsic of that instruction set on values in registers. Loads and stores go through references to arrays of the
//! register's size.

#![allow(unsafe_code)]
#![allow(clippy::wildcard_imports, reason = "the names of intrinsics say where they are from")]

/// The operators of a pack; each is one intrinsic of two registers.
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

mod avx2;
mod avx512;
#[cfg(test)]
mod tests;

pub use avx2::Avx2;
pub use avx512::Avx512;
