//! Judges a model by the record that it was estimated from: whether its residuals are white and free of the input,
//! and how uncertain its poles, zeros, responses and static gain are.

mod added_columns;
mod continuous_pole;
mod feedback;
mod outliers;
mod past_input;
mod response;
mod root_errors;
#[cfg(test)]
mod tests;
mod verdict;
mod whiteness;

pub use continuous_pole::Mode;
pub use feedback::{FeedbackTest, LoopVerdict};
pub use outliers::Outlier;
pub use response::{FrequencyPoint, StepPoint, frequency_response, step_response};
pub use root_errors::{Cancellation, Precision, Root, RootError};
pub use verdict::Whiteness;
pub use whiteness::Residuals;

/// Level of the tests of residuals: the false-alarm probability of each.
pub const LEVEL: f64 = 0.01;

/// The standard normal quantile for 95 % intervals.
pub const Z_95: f64 = 1.959_963_984_540_054;

/// The standard normal quantile for 99 % intervals.
pub const Z_99: f64 = 2.575_829_303_548_900_4;

/// The 95 % point of chi-square with 2 degrees of freedom, `-2 ln 0.05`: it bounds the 95 % ellipse of a normal pair.
pub const CHI_SQUARE_2_95: f64 = 5.991_464_547_107_979;
