//! Error measures, and their summaries over trials, each with its Monte-Carlo standard error (MCSE).
//!
//! [`Sample`] gathers one figure over trials, [`Paired`] two methods on the same trials, [`slope`] a rate
//! over cells. They hold exact sums ([`ExactSum`]) and counts in fixed bins ([`Sketch`]), so that merging
//! in any order or grouping gives the same bits.

mod dd;
mod error;
mod estimate;
mod exact_sum;
mod fit;
mod moments;
mod paired;
mod quantile;
mod response;
mod share;
mod sketch;
mod slope;

pub use error::{StateError, relative_error, relative_error_as_printed};
pub use estimate::{Estimate, Z};
pub use exact_sum::ExactSum;
pub use fit::{Fit, FitModel, fit};
pub use moments::{DOMINANT_SHARE, Sample, Statistics, TRIM};
pub use paired::{Paired, PairedStatistics};
pub use quantile::{Quantile, quantile};
pub use response::{Response, System};
pub use share::{Share, Verdict, verdict};
pub use sketch::{SKETCH_ERROR, Sketch, expected_bins};
pub use slope::{JACKKNIFE_GROUPS, Jackknife, NoSlope, Slope, SlopeOf, slope, slope_of_statistics};
