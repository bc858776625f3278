//! Verdicts of tests at 1 %, and lags that they share.

use super::LEVEL;
use super::added_columns::Added;
use serde::Serialize;

/// A test at 1 %.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Whiteness {
    /// Degrees of freedom, or the number of added lags.
    pub degrees: usize,
    /// The probability of this result or a worse one if the residuals satisfy the hypothesis; by Sidak's inequality if
    /// two tests share it.
    pub p_value: f64,
    /// Whether the p-value is at least 1 %.
    pub passed: bool,
}

impl Whiteness {
    pub(super) fn new(degrees: usize, p_value: f64) -> Self {
        Self {
            degrees,
            p_value,
            passed: p_value >= LEVEL,
        }
    }
}

/// Largest lag of the tests.
pub(super) const LAGS: usize = 25;

/// Lags of u that are tested in a record of n samples: 25, or n/8.
pub(super) fn lags_of(n: usize) -> usize {
    LAGS.min(n / 8)
}

/// Returns the test that takes the smaller p-value of two; `None` if neither could be made.
pub(super) fn of_two(one: Option<Added>, other: Option<Added>, degrees: usize) -> Option<Whiteness> {
    let p_values = [one, other].into_iter().flatten().map(|test| test.p_value);
    let least = p_values.reduce(f64::min)?;
    Some(Whiteness::new(degrees, any_of(least, 2)))
}

/// Returns the largest probability that one of `count` tests is as unlikely as `single`, whatever their correlations:
/// `1 - (1 - single)^count` (Sidak, J. Amer. Statist. Assoc. 62 (1967), 626-633).
fn any_of(single: f64, count: usize) -> f64 {
    -(count as f64 * (-single).ln_1p()).exp_m1()
}
