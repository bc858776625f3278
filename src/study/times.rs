//! Times of the methods, which are measured apart from results.

use serde::Deserialize;

/// The time of one method in one cell.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct MethodTime {
    /// The cell's index.
    pub cell: usize,
    /// The method's name.
    pub method: String,
    /// Median, seconds.
    pub median_seconds: f64,
    /// Lower quartile.
    pub q25_seconds: f64,
    /// Upper quartile.
    pub q75_seconds: f64,
}
