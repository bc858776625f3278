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
    /// Seconds in each round, in which all methods of the cell had their turns. Older versions did not store them.
    #[serde(default)]
    pub rounds: Vec<f64>,
}

impl MethodTime {
    /// Whether it can be a time from a study of so many cells.
    pub fn is_of(&self, cells: usize) -> bool {
        let times = [self.q25_seconds, self.median_seconds, self.q75_seconds];
        self.rounds.iter().all(|time| *time > 0.0)
            && self.cell < cells
            && times[0] >= 0.0
            && times.is_sorted_by(|a, b| a <= b)
    }
}
