//! Packs of x86-64: 8 lanes by AVX-512, 4 by AVX2 and FMA.
//!
//! The values of a type exist only where [`Isa::is_here`] said that its instructions do:
//! [`super::Isa::dispatch`] is the one place that chooses a type. That is the reason of every
//! `unsafe` here: an intrinsic of that instruction set on values in registers. Loads and stores go
//! through references to arrays of the register's size.

#![allow(unsafe_code)]
#![allow(
    clippy::wildcard_imports,
    reason = "the names of intrinsics say where they are from"
)]

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

mod avx2;
mod avx512;
#[cfg(test)]
mod tests;

pub use avx2::Avx2;
pub use avx512::Avx512;
