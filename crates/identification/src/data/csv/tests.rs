//! Whole files: as people reported them, and in every dialect.

mod dialects;
mod reported;
