//! An observer whose parameters come from a recursive estimator.

use super::AdaptiveObserver;
use super::filters::StateFilters;
use crate::estimator::recursive::{Diverged, RecursiveEstimator};
use crate::model::Orders;

/// The adaptive observer fed sample by sample: with the filters of [`StateFilters`] and theta(k) of any recursive
/// estimator, `xhat_o(k+1) = M(k+1) (f - alpha(k), h(k))`, `T(k) xhat(k+1) = xhat_o(k+1)`.
///
/// It is the state that an observer with the present model would have had it run from the beginning from `x_o(0) = 0`,
/// so no error of an earlier model is left in it. With f = 0 it is the papers' dead-beat observer.
#[derive(Clone, Debug)]
pub struct FedObserver<R> {
    estimator: R,
    filters: StateFilters,
    orders: Orders,
    alpha: Vec<f64>,
    h: Vec<f64>,
    /// f - alpha and h.
    p: Vec<f64>,
    state: Vec<f64>,
}

impl<R: RecursiveEstimator> FedObserver<R> {
    /// Joins an estimator with filters of its model's order.
    ///
    /// # Panics
    /// If the model has both an A and an F, or no delay, or another order than the filters.
    pub fn new(estimator: R, filters: StateFilters) -> Self {
        let (orders, n) = (estimator.orders(), filters.order());
        assert!(orders.nk > 0 && (orders.na == 0 || orders.nf == 0));
        assert_eq!(orders.order(), n);
        Self {
            estimator,
            filters,
            orders,
            alpha: vec![0.0; n],
            h: vec![0.0; n],
            p: vec![0.0; 2 * n],
            state: vec![0.0; n],
        }
    }

    /// Returns the estimator.
    pub fn estimator(&self) -> &R {
        &self.estimator
    }
}

impl<R: RecursiveEstimator> AdaptiveObserver for FedObserver<R> {
    fn restart(&mut self) {
        self.estimator.restart();
        self.filters.restart();
    }

    /// # Errors
    /// The error of the estimator, after which the state is that of its last model.
    fn update(&mut self, u: f64, y: f64) -> Result<(), Diverged> {
        let estimated = self.estimator.update(u, y);
        self.filters.update(u, y);
        let Orders { na, nb, nf, nk, .. } = self.orders;
        let theta = self.estimator.theta();
        let (poles, b) = if na > 0 {
            (&theta[..na], &theta[na..na + nb])
        } else {
            (&theta[theta.len() - nf..], &theta[..nb])
        };
        self.alpha[..poles.len()].copy_from_slice(poles);
        self.h[nk - 1..nk - 1 + nb].copy_from_slice(b);
        let (first, second) = self.p.split_at_mut(self.alpha.len());
        let f = self.filters.coefficients();
        for ((p, alpha), f) in first.iter_mut().zip(&self.alpha).zip(f) {
            *p = f - alpha;
        }
        second.copy_from_slice(&self.h);
        self.state.fill(0.0);
        self.filters.add_product(&self.p, &mut self.state);
        let set = self.filters.set(&self.alpha, &self.h, &self.state);
        estimated.and(set)
    }

    fn state(&self) -> &[f64] {
        self.filters.state()
    }

    fn plant(&self) -> &[f64] {
        self.filters.plant()
    }
}
