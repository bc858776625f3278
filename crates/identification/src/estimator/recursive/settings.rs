//! The settings that all recursive estimators share.

use super::Coefficients;
use crate::estimator::OptionError;
use crate::estimator::{SetupError, Shape};
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

    /// Makes the settings of options.
    pub(super) fn of(
        orders: Orders,
        given: &Given<'_>,
        early: Option<f64>,
        shape: Shape,
    ) -> Result<Self, SetupError> {
        let d = orders.parameters();
        let mut settings = Self::new(orders);
        if let Some(theta0) = given.theta0 {
            if theta0.numbers().len() != d {
                return Err(SetupError::ParameterCount {
                    orders,
                    given: theta0.numbers().len(),
                });
            }
            settings.theta0.copy_from_slice(theta0.numbers());
        }
        settings.p0 = given.p0;
        settings.forgetting = given.forgetting.unwrap_or(1.0);
        settings.early_forgetting = early.unwrap_or(settings.forgetting);
        let start = given.p0.map_or(2 * d, |_| 0);
        settings.start = given.start.unwrap_or(start);
        let rows = shape.window.saturating_sub(settings.first());
        if rows < d {
            return Err(SetupError::ShortRecord {
                orders,
                window: shape.window,
                rows,
                needed: d,
            });
        }
        Ok(settings)
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

/// The options that all recursive estimators have.
pub(super) struct Given<'a> {
    pub(super) theta0: Option<&'a Coefficients>,
    pub(super) p0: Option<f64>,
    pub(super) forgetting: Option<f64>,
    pub(super) start: Option<usize>,
}

impl Given<'_> {
    /// Checks the numbers.
    pub(super) fn check(&self, early: Option<f64>) -> Result<(), OptionError> {
        let wrong = |key: &str, text: String| Err(OptionError::new(key, text));
        if let Some(p0) = self.p0.filter(|p0| !(*p0 > 0.0 && p0.is_finite())) {
            return wrong("p0", format!("{p0}; expected a number above 0"));
        }
        let rates = [("forgetting", self.forgetting), ("early_forgetting", early)];
        for (key, rate) in rates {
            if let Some(rate) = rate.filter(|rate| !(*rate > 0.0 && *rate <= 1.0)) {
                return wrong(key, format!("{rate}; expected a number above 0, at most 1"));
            }
        }
        Ok(())
    }

    /// Checks that theta0 has as many numbers as there are parameters, if the orders are given.
    pub(super) fn check_count(&self, orders: Option<Orders>) -> Result<(), OptionError> {
        let (Some(orders), Some(theta0)) = (orders, self.theta0) else {
            return Ok(());
        };
        let (given, needed) = (theta0.numbers().len(), orders.parameters());
        if given == needed {
            return Ok(());
        }
        let text = format!("{given} numbers; orders {orders} have {needed} parameters");
        Err(OptionError::new("theta0", text))
    }
}
