//! What a record says of a model that was estimated from it: whether its residuals are white and free of the input, and
//! how far its poles and its static gain may be from the truth.

mod precision;
mod residuals;

pub use precision::{PoleError, Precision};
pub use residuals::{Residuals, Whiteness};

/// The quantile of the standard normal law that 95 % intervals have at both ends.
pub const Z_95: f64 = 1.959_963_984_540_054;

/// The same of 99 % intervals.
pub const Z_99: f64 = 2.575_829_303_548_900_4;
