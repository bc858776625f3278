//! The settings that all recursive estimators share.

use crate::model::Orders;

/// From which theta and P a recursion starts, and what it forgets.
#[derive(Clone, Debug, PartialEq)]
pub struct RecursiveSettings {
    /// The orders of the model.
    pub orders: Orders,
    /// theta before the first equation, in the order A, B, C, D, F.
    pub theta0: Vec<f64>,
    /// P before the first equation is `p0 I`; `None`: exact, the limit of p0 to infinity.
    pub p0: Option<f64>,
    /// lambda, above 0 and at most 1: an equation that is i samples old has the weight `lambda^i`.
    pub forgetting: f64,
    /// `lambda(i) = lambda - (lambda - early) 0.99^i` at equation i after the start; lambda itself: no such rise.
    ///
    /// Source: L. Ljung and T. Soderstrom, *Theory and Practice of Recursive Identification*, 1983, section 5.6.
    pub early_forgetting: f64,
    /// The number of equations that least squares solves before instruments, filters and residuals are used; not used
    /// by recursive least squares.
    pub start: usize,
}

/// The factor by which early forgetting approaches the final one.
const RISE: f64 = 0.99;

impl RecursiveSettings {
    /// Makes settings without forgetting, theta0 = 0 and an exact start of two equations for each parameter.
    pub fn new(orders: Orders) -> Self {
        let d = orders.parameters();
        Self {
            orders,
            theta0: vec![0.0; d],
            p0: None,
            forgetting: 1.0,
            early_forgetting: 1.0,
            start: 2 * d,
        }
    }

    /// Returns the sample of the first equation.
    pub fn first(&self) -> usize {
        let Orders { na, nb, nf, nk, .. } = self.orders;
        (na + nf).max((nb + nk).saturating_sub(1))
    }

    /// Whether there is no forgetting, so that P is a covariance but for a factor.
    pub(super) fn remembers(&self) -> bool {
        self.forgetting == 1.0
    }
}

/// The factor lambda of one equation after the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Forgetting {
    last: f64,
    missing: f64,
}

impl Forgetting {
    pub(super) fn new(settings: &RecursiveSettings) -> Self {
        Self {
            last: settings.forgetting,
            missing: settings.forgetting - settings.early_forgetting,
        }
    }

    pub(super) fn next(&mut self) -> f64 {
        let lambda = self.last - self.missing;
        self.missing *= RISE;
        lambda
    }
}
