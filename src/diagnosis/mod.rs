//! What a record says of a model that was estimated from it: whether its residuals are white and free of the input, and
//! how far its poles, zeros, responses and static gain may be from the truth.

mod precision;
mod residuals;
mod response;
mod roots;
#[cfg(test)]
mod tests;

pub use precision::Precision;
pub use residuals::{Residuals, Whiteness};
pub use response::{FrequencyPoint, StepPoint, frequency_response, step_response};
pub use roots::{Cancellation, Root, RootError};

/// The quantile of the standard normal law that 95 % intervals have at both ends.
pub const Z_95: f64 = 1.959_963_984_540_054;

/// The same of 99 % intervals.
pub const Z_99: f64 = 2.575_829_303_548_900_4;

/// The 95 % point of chi-square with 2 degrees of freedom, `-2 ln 0.05`: a normal pair lies within its ellipse.
pub const CHI_SQUARE_2_95: f64 = 5.991_464_547_107_979;
