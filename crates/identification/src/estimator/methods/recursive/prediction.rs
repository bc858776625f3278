//! The recursive prediction error method.

use super::lags::StabilityTest;
use super::options::{RecursiveOptions, recursive_options};
use super::predictor::{Predictor, polynomials};
use super::recursion::{Recursion, RecursiveMethod, Shared};
use super::{RecursiveSettings, SquareRoot, dot};
use crate::estimator::OptionError;
use crate::estimator::methods::output_error_iteration::output_error;
use crate::model::Orders;

recursive_options! {
    /// The options of `rpem`.
    RpemOptions {
        /// Orders of any of na, nb, nc, nd, nf and the delay nk, such as nb=2,nf=2,nk=1; by default nb = nf = the
        /// setting `order`, nk = 1.
        orders,
        with start
    }
}

impl RecursiveOptions for RpemOptions {
    type Recursion = RecursivePrediction;

    fn orders(&self, order: usize) -> Orders {
        output_error(self.orders, order)
    }

    fn check_own(&self) -> Result<(), OptionError> {
        if self.orders.is_some_and(|orders| orders.parameters() == 0) {
            let message = "expected at least one of na, nb, nc, nd, nf";
            return Err(OptionError::new("orders", message));
        }
        Ok(())
    }

    fn beginning(&self) -> (usize, f64) {
        (0, 0.97)
    }

    fn recursion(&self, settings: RecursiveSettings) -> RecursivePrediction {
        RecursivePrediction::new(settings)
    }
}

/// `A(q) y = B(q)/F(q) u + C(q)/D(q) e` by the recursive prediction error method of Ljung: output-error, ARMAX,
/// Box-Jenkins models and all others of this form. With phi and psi of the predictor, made with the theta of their own
/// times,
///
/// ```text
///     eps(k) = y(k) - phi(k)' theta(k-1),  P^-1(k) = lambda P^-1(k-1) + psi psi',  theta(k) = theta(k-1) + P(k) psi
///     eps(k)
/// ```
///
/// P is kept as a [`SquareRoot`]. theta(k) is projected into the region where C and F are stable: the step is halved
/// until it ends there, 20 times at most, else left out. The start is least squares of `A y = B u + e`, or of `F y = B
/// u + e` if there is no A; an unstable F of it is not taken over. Without A, y stands for `B/F u` meanwhile. The
/// covariance is `s^2 P`, as efficient as that of the prediction error method (after early forgetting `s^2 P sum w^2 /
/// sum w`, w being the weights that are left).
///
/// A sample takes about 5 d^2 multiplications and additions, d being the number of parameters, and nc^2 + nf^2 for
/// stability.
///
/// Source: L. Ljung, *System Identification*, 2nd ed., 1999, sections 10.3 (psi) and 11.4; L. Ljung and T. Soderstrom,
/// *Theory and Practice of Recursive Identification*, 1983, sections 3.7 to 3.8.
pub type RecursivePrediction = Recursion<Prediction>;

/// The steps of [`RecursivePrediction`].
#[derive(Clone, Debug)]
pub struct Prediction {
    root: SquareRoot,
    predictor: Predictor,
    test: StabilityTest,
    phi: Vec<f64>,
    psi: Vec<f64>,
    /// The step's end, which may lie outside the region; during the start, the solution of least squares.
    next: Vec<f64>,
    residual_sum: f64,
}

/// How often a step is halved.
const HALVINGS: usize = 20;

impl RecursivePrediction {
    /// Makes the buffers.
    ///
    /// # Panics
    /// If theta0 does not fit the orders.
    pub fn new(settings: RecursiveSettings) -> Self {
        let orders @ Orders { na, nb, nc, nf, .. } = settings.orders;
        let d = orders.parameters();
        let common = if na > 0 { 0..na } else { d - nf..d };
        let mut places: Vec<usize> = common.chain(na..na + nb).collect();
        places.sort_unstable();
        let method = Prediction {
            root: SquareRoot::new(d),
            predictor: Predictor::new(orders),
            test: StabilityTest::new(nc.max(nf)),
            phi: vec![0.0; d],
            psi: vec![0.0; d],
            next: vec![0.0; d],
            residual_sum: 0.0,
        };
        Self::begin(settings, [0; 2], places, method)
    }
}

impl Prediction {
    /// Whether the predictor of `next` is stable.
    fn is_inside(&mut self, orders: Orders) -> bool {
        let [_, _, c, _, f] = polynomials(orders, &self.next);
        self.test.passes(c) && self.test.passes(f)
    }

    /// One equation of least squares.
    fn begin(&mut self, shared: &mut Shared, y: f64) {
        self.predictor.linear_regressors(&mut self.phi);
        let lambda = shared.settings.forgetting;
        shared.start.update(&self.phi, y, lambda, &mut self.next);
        if self.is_inside(shared.settings.orders) {
            shared.theta.copy_from_slice(&self.next);
        }
    }

    /// One step of the method. Returns the prediction error.
    fn step(&mut self, shared: &mut Shared, y: f64) -> f64 {
        self.predictor.regressors(&mut self.phi, &mut self.psi);
        let error = y - dot(&self.phi, &shared.theta);
        let lambda = shared.forgetting.next();
        self.root.update(&self.psi, 0.0, lambda);
        self.residual_sum *= lambda;
        self.root.gain(&mut self.psi);
        let mut share = error;
        for _ in 0..=HALVINGS {
            for ((next, theta), gain) in self.next.iter_mut().zip(&shared.theta).zip(&self.psi) {
                *next = theta + share * gain;
            }
            if self.is_inside(shared.settings.orders) {
                shared.theta.copy_from_slice(&self.next);
                break;
            }
            share /= 2.0;
        }
        error
    }
}

impl RecursiveMethod for Prediction {
    fn take(&mut self, shared: &mut Shared, u: f64, y: f64, _: bool) {
        self.predictor.input(u, &shared.theta);
        let mut error = 0.0;
        if shared.has_equation() {
            if shared.begins() {
                shared.hand_over(&mut self.root);
                self.residual_sum = self.root.residual_sum();
            }
            if shared.started {
                error = self.step(shared, y);
            } else {
                self.begin(shared, y);
            }
        }
        let residual = if shared.started || shared.settings.orders.na > 0 {
            self.predictor.output(y, &shared.theta)
        } else {
            self.predictor.output_without_noise(y, &shared.theta)
        };
        if shared.started {
            self.residual_sum += error * residual;
        }
    }

    /// theta never becomes infinite: it would be outside the region. The gain may.
    fn numbers<'a>(&'a self, shared: &'a Shared) -> (&'a [f64], f64) {
        (&self.psi, shared.start.size())
    }

    fn variance(&self, theta: &[f64]) -> f64 {
        let weights = self.root.weights();
        weights.variance(self.residual_sum, theta.len())
    }

    fn covariance(&mut self, variance: f64, to: &mut [f64]) {
        let variance = variance * self.root.weights().ratio();
        self.root.covariance(variance, to);
    }

    fn restart(&mut self, shared: &mut Shared) {
        self.predictor.restart();
        self.psi.fill(0.0);
        self.next.copy_from_slice(&shared.settings.theta0);
        self.residual_sum = 0.0;
    }
}
