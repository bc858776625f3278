//! Tests of the whole library: a page of everything, and forged results.

mod demo;
mod mutations;
pub(crate) mod xml;
