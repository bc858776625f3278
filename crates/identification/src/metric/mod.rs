//! Error measures and their summaries over trials, each with its Monte-Carlo standard error (MCSE).
//!
//! A statistic of M trials has a standard error only if M is large enough for its formula to be meaningful; for fewer
//! trials the error is NaN (in files null). For moments the limit is where `value -+ 1.96 MCSE` covers 90 % for normal
//! numbers, instead of the nominal 95 %. With more trials the coverage tends to 95 % (`tests/coverage.rs` has the
//! intervals at these M). The limits and their reasons:
//!
//! - mean, mean difference: [`FEWEST_FOR_MEANS`] = 7. By Student's law, 1.96 covers 89.3 % with 5 degrees of freedom,
//!   90.2 % with 6.
//! - trimmed mean: 7, by the same rule for the M - 2 g values kept
//! - sd, MSE, RMSE, RMSE ratio: [`FEWEST_FOR_SQUARES`] = 40. The error is one of fourth powers: the interval of an sd
//!   covers 57 % at M = 2, 79 % at 10, 90 % at 40.
//! - q-quantile: 6 (median), 16 (quartiles), 92 (5 and 95 %): the order statistics of its 95 % interval exist; see
//!   [`Quantile::mcse`]
//! - share p: 3.84 max((1-p)/p, p/(1-p)): its 95 % interval lies within 0 to 1. Wilson's interval always exists.
//! - slope of RMSEs: [`JACKKNIFE_GROUPS`] = 20, one trial in every group; Student's interval covers 94 %
//! - slope of medians: 40, two trials in every group: with one, the interval covers 84 %, with two 91 %
//!
//! [`Sample`] summarises one measure over trials, [`Paired`] two methods on the same trials, [`slope`] a rate over
//! cells. They hold exact sums ([`ExactSum`]) and counts in fixed bins ([`Sketch`]), so merging in any order or
//! grouping gives the same bits.

mod coverage;
mod double_double;
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
mod statistic_names;
mod statistics;
pub mod tails;

pub use crate::estimator::{errors_ahead, prediction_errors};
pub use coverage::Coverage;
pub use error::{Gathered, StateError, relative_error, relative_error_as_printed};
pub use estimate::{Estimate, FEWEST_FOR_MEANS, FEWEST_FOR_SQUARES, Z};
pub use exact_sum::ExactSum;
pub use fit::{Ahead, Fit, fit_ahead};
pub(crate) use fit::{mean, percent};
pub use moments::Sample;
pub use paired::{Paired, PairedStatistics};
pub use quantile::{Quantile, Worse, correlation_of_medians, quantile};
pub use response::{Response, System};
pub use share::{BoundVerdict, Share, verdict};
pub use sketch::{SKETCH_ERROR, Sketch, expected_bins};
pub use slope::slope_weights;
pub use slope::{JACKKNIFE_GROUPS, Jackknife, NoSlope, Slope, SlopeOf, slope, slope_of_statistics};
pub use statistic_names::Statistic;
pub use statistics::{DOMINANT_SHARE, Quantiles, Statistics, TRIM};
