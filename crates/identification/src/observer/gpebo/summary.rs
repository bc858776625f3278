//! The results of a run.

use super::score::Accuracy;

/// An observer's estimate at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObserverEstimate<R = f64> {
    /// xhat, of length n.
    pub x: Vec<R>,
    /// theta_hat, of length n; empty for the full-order observer.
    pub theta: Vec<R>,
}

/// The state of a run at one time.
#[derive(Clone, Copy, Debug)]
pub struct Sample<'a> {
    /// t in seconds.
    pub t: f64,
    /// x, of length n.
    pub x: &'a [f64],
    /// One for each observer, in their order.
    pub estimates: &'a [ObserverEstimate],
    /// mbar of Eq. (10), of length n.
    pub mbar: &'a [f64],
    /// Delta of Eq. (10).
    pub delta: f64,
    /// `dbar = mbar - Delta theta` with the true theta, of length n.
    pub dbar: &'a [f64],
}

/// Whether numbers stayed finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// All numbers were finite at all times.
    Finite,
    /// Numbers were finite until the given time, in seconds. Numbers of that time and later must not be used.
    NotFinite(f64),
}

impl Outcome {
    /// Records the time of the first failure.
    pub(super) fn note(&mut self, finite: bool, t: f64) {
        if !finite && *self == Self::Finite {
            *self = Self::NotFinite(t);
        }
    }
}

/// The excitation of an observer's scalar estimators, one entry for each component; empty for observers without scalar
/// estimators.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Excitation {
    /// `int Delta^2 dt` over the run, with the Delta of the observer's own scalar regression.
    pub integral: Vec<f64>,
    /// The first t from which `gamma int_t^T Delta^2 dt < 0.01`: from then on, the error of the estimate can shrink by
    /// at most 1 %. 0 if there was never anything to learn; `None` if the estimator was still learning in the last
    /// hundredth of the run.
    pub frozen_at: Vec<Option<f64>>,
}

/// The results of one observer over the whole run.
#[derive(Clone, Debug, PartialEq)]
pub struct ObserverSummary {
    /// Whether its estimates stayed finite.
    pub outcome: Outcome,
    /// How much its scalar estimators could learn from.
    pub excitation: Excitation,
    /// The size of its errors.
    pub accuracy: Accuracy,
}

/// The results of the whole run.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Whether the plant stayed finite; the run ends if it did not.
    pub outcome: Outcome,
    /// One for each observer, in their order.
    pub observers: Vec<ObserverSummary>,
    /// Largest `|dbar_i|` over all nodes, n numbers.
    pub largest_dbar: Vec<f64>,
    /// Smallest eigenvalue of `int phi phi' dt`; `None` if that is not finite.
    pub smallest_eigenvalue: Option<f64>,
    /// Steps taken, refinement included.
    pub steps: usize,
}
