//! Times of the methods, measured apart from the results.

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
    /// Seconds in each round, in which the methods of the cell had their turns; none where this one passed, since its
    /// estimates are long. Older versions did not store them.
    #[serde(default)]
    pub rounds: Vec<Option<f64>>,
}
