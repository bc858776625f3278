//! Recursive extended least squares.

use super::lags::push;
use super::options::{RecursiveOptions, recursive_options};
use super::recursion::{Recursion, RecursiveMethod, Shared};
use super::{RecursiveSettings, SquareRoot, dot};
use crate::estimator::OptionError;
use crate::model::Orders;

recursive_options! {
    /// The options of `rels`.
    RelsOptions {
        /// Orders na, nb, nc and the delay nk, such as na=2,nb=2,nc=1,nk=1; by default na = nb = nc = the setting
        /// `order`, nk = 1.
        orders,
        with start
    }
}

impl RecursiveOptions for RelsOptions {
    type Recursion = ExtendedLeastSquares;

    fn orders(&self, order: usize) -> Orders {
        self.orders.unwrap_or(Orders::armax(order, order, order, 1))
    }

    fn check_own(&self) -> Result<(), OptionError> {
        let message = match self.orders {
            Some(Orders { nd, nf, .. }) if nd + nf > 0 => "expected na, nb, nc, nk; the model has no D, F",
            Some(Orders { na: 0, nb: 0, .. }) => "expected an na or nb of at least 1",
            _ => return Ok(()),
        };
        Err(OptionError::new("orders", message))
    }

    fn recursion(&self, settings: RecursiveSettings) -> ExtendedLeastSquares {
        ExtendedLeastSquares::new(settings)
    }
}

/// `A(q) y = B(q) u + C(q) e` by recursive extended least squares: recursive least squares with the residuals `eps(k) =
/// y(k) - phi(k)' theta(k)` for e, `phi(k) = (-y(k-1) ... , u(k-nk) ... , eps(k-1) ... eps(k-nc))`. eps is 0 before the
/// first equation. It converges where `1/C - 1/2` is positive real; its covariance is `s^2 P`, right for C = 1 only
/// (after early forgetting `s^2 P sum w^2 / sum w`, w being the weights that are left).
///
/// A sample takes about 4 d^2 multiplications and additions, d = na + nb + nc.
///
/// Source: L. Ljung and T. Soderstrom, *Theory and Practice of Recursive Identification*, 1983, sections 2.3 and 4.4.
pub type ExtendedLeastSquares = Recursion<Extended>;

/// The equations of [`ExtendedLeastSquares`].
#[derive(Clone, Debug)]
pub struct Extended {
    root: SquareRoot,
    residuals: Vec<f64>,
    phi: Vec<f64>,
}

impl ExtendedLeastSquares {
    /// Makes the buffers; orders nd and nf must be 0.
    ///
    /// # Panics
    /// If theta0 does not fit the orders.
    pub fn new(settings: RecursiveSettings) -> Self {
        let Orders { na, nb, nc, nk, .. } = settings.orders;
        let d = na + nb + nc;
        let method = Extended {
            root: SquareRoot::new(d),
            residuals: vec![0.0; nc],
            phi: vec![0.0; d],
        };
        Self::begin(settings, [na, nb + nk], (0..na + nb).collect(), method)
    }
}

impl RecursiveMethod for Extended {
    fn take(&mut self, shared: &mut Shared, _: f64, y: f64, _: bool) {
        if !shared.has_equation() {
            return;
        }
        let Orders { na, nb, nk, .. } = shared.settings.orders;
        let phi = &mut self.phi;
        phi[..na].copy_from_slice(&shared.outputs);
        phi[na..na + nb].copy_from_slice(&shared.inputs[nk..]);
        phi[na + nb..].copy_from_slice(&self.residuals);
        if shared.begins() {
            shared.hand_over(&mut self.root);
        }
        let residual = if shared.started {
            self.root.update(phi, y, shared.forgetting.next());
            self.root.solve(&mut shared.theta);
            y - dot(phi, &shared.theta)
        } else {
            shared.take(phi, y)
        };
        push(&mut self.residuals, residual);
    }

    fn variance(&self, theta: &[f64]) -> f64 {
        let root = &self.root;
        root.weights().variance(root.residual_sum(), theta.len())
    }

    fn covariance(&mut self, variance: f64, to: &mut [f64]) {
        let variance = variance * self.root.weights().ratio();
        self.root.covariance(variance, to);
    }

    fn restart(&mut self, _: &mut Shared) {
        self.residuals.fill(0.0);
    }
}
