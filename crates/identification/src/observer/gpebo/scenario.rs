//! The settings of a run.

use super::delay::Operator;
use crate::signal::Signal;

/// Input, disturbance, initial state and time.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// The input u(t).
    pub u: Signal,
    /// The disturbance delta(t) of the output.
    pub delta: Signal,
    /// x(0), of length n.
    pub x0: Vec<f64>,
    /// T in seconds.
    pub horizon: f64,
    /// The mean squares of errors start at this time, in seconds; no step crosses it.
    pub scored_from: f64,
    /// The longest step in seconds.
    pub step: f64,
}

/// The options that the estimators share.
#[derive(Clone, Debug, PartialEq)]
pub struct GpeboOptions {
    /// xi(0), of length n, Eq. (5).
    pub xi0: Vec<f64>,
    /// The n - 1 distinct operators H_i of the first extension.
    pub filters: Vec<Operator>,
}
