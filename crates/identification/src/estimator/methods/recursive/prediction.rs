//! The recursive prediction error method.

use super::lags::StabilityTest;
use super::options::{RecursiveOptions, recursive_options};
use super::predictor::{Predictor, polynomials};
use super::settings::Forgetting;
use super::start::Start;
use super::{Clock, Diverged, RecursiveEstimator, RecursiveSettings, SquareRoot, dot};
use crate::estimator::OptionError;
use crate::estimator::methods::output_error_iteration::output_error;
use crate::model::Orders;

recursive_options! {
    /// The options of `rpem`.
    RpemOptions {
        /// Orders of any of na, nb, nc, nd, nf and the delay nk, such as nb=2,nf=2,nk=1; by default nb = nf = the
        /// setting `order`, nk = 1.
        orders,
        start
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
#[derive(Clone, Debug)]
pub struct RecursivePrediction {
    settings: RecursiveSettings,
    forgetting: Forgetting,
    start: Start,
    started: bool,
    root: SquareRoot,
    predictor: Predictor,
    test: StabilityTest,
    phi: Vec<f64>,
    psi: Vec<f64>,
    theta: Vec<f64>,
    /// The step's end, which may lie outside the region; during the start, the solution of least squares.
    next: Vec<f64>,
    residual_sum: f64,
    clock: Clock,
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
        assert_eq!(settings.theta0.len(), d);
        let common = if na > 0 { 0..na } else { d - nf..d };
        let mut places: Vec<usize> = common.chain(na..na + nb).collect();
        places.sort_unstable();
        let mut made = Self {
            forgetting: Forgetting::new(&settings),
            start: Start::new(places),
            started: false,
            root: SquareRoot::new(d),
            predictor: Predictor::new(orders),
            test: StabilityTest::new(nc.max(nf)),
            phi: vec![0.0; d],
            psi: vec![0.0; d],
            theta: vec![0.0; d],
            next: vec![0.0; d],
            residual_sum: 0.0,
            clock: Clock::default(),
            settings,
        };
        made.restart();
        made
    }

    /// Whether the predictor of `next` is stable.
    fn is_inside(&mut self) -> bool {
        let [_, _, c, _, f] = polynomials(self.settings.orders, &self.next);
        self.test.passes(c) && self.test.passes(f)
    }

    /// One equation of least squares.
    fn begin(&mut self, y: f64) {
        self.predictor.linear_regressors(&mut self.phi);
        let lambda = self.settings.forgetting;
        self.start.update(&self.phi, y, lambda, &mut self.next);
        if self.is_inside() {
            self.theta.copy_from_slice(&self.next);
        }
    }

    /// One step of the method. Returns the prediction error.
    fn step(&mut self, y: f64) -> f64 {
        self.predictor.regressors(&mut self.phi, &mut self.psi);
        let error = y - dot(&self.phi, &self.theta);
        let lambda = self.forgetting.next();
        self.root.update(&self.psi, 0.0, lambda);
        self.residual_sum *= lambda;
        self.root.gain(&mut self.psi);
        let mut share = error;
        for _ in 0..=HALVINGS {
            for ((next, theta), gain) in self.next.iter_mut().zip(&self.theta).zip(&self.psi) {
                *next = theta + share * gain;
            }
            if self.is_inside() {
                self.theta.copy_from_slice(&self.next);
                break;
            }
            share /= 2.0;
        }
        error
    }
}

impl RecursiveEstimator for RecursivePrediction {
    fn orders(&self) -> Orders {
        self.settings.orders
    }

    fn advance(&mut self, u: f64, y: f64, _: bool) -> Result<(), Diverged> {
        self.clock.begin(u, y)?;
        self.predictor.input(u, &self.theta);
        let (mut error, has_equation) = (0.0, self.clock.samples >= self.settings.first());
        if has_equation {
            if !self.started && self.start.is_over(&self.settings) {
                self.started = true;
                self.start
                    .hand_over(&self.settings, &self.theta, &mut self.root);
                self.residual_sum = self.root.residual_sum();
            }
            if self.started {
                error = self.step(y);
            } else {
                self.begin(y);
            }
        }
        let residual = if self.started || self.settings.orders.na > 0 {
            self.predictor.output(y, &self.theta)
        } else {
            self.predictor.output_without_noise(y, &self.theta)
        };
        if self.started {
            self.residual_sum += error * residual;
        }
        // theta never becomes infinite: it would be outside the region. The gain may.
        self.clock.end(&self.psi, self.start.size())
    }

    fn theta(&self) -> &[f64] {
        &self.theta
    }

    fn is_determined(&self) -> bool {
        self.start.is_determined()
    }

    fn noise_variance(&self) -> f64 {
        if self.started && self.settings.remembers() {
            let weights = self.root.weights();
            weights.variance(self.residual_sum, self.theta.len())
        } else {
            f64::NAN
        }
    }

    fn covariance(&mut self, to: &mut [f64]) {
        let variance = self.noise_variance() * self.root.weights().ratio();
        self.root.covariance(variance, to);
    }

    fn samples(&self) -> usize {
        self.clock.samples
    }

    fn restart(&mut self) {
        self.start.restart(&self.settings);
        self.started = false;
        self.forgetting = Forgetting::new(&self.settings);
        self.predictor.restart();
        self.psi.fill(0.0);
        self.theta.copy_from_slice(&self.settings.theta0);
        self.next.copy_from_slice(&self.settings.theta0);
        self.residual_sum = 0.0;
        self.clock = Clock::default();
    }
}
