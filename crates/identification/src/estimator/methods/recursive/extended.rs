//! Recursive extended least squares.

use super::lags::push;
use super::options::{RecursiveOptions, recursive_options};
use super::settings::Forgetting;
use super::start::Start;
use super::{Clock, Diverged, RecursiveEstimator, RecursiveSettings, SquareRoot, dot};
use crate::estimator::OptionError;
use crate::model::Orders;

recursive_options! {
    /// The options of `rels`.
    RelsOptions {
        /// Orders na, nb, nc and the delay nk, such as na=2,nb=2,nc=1,nk=1; by default na = nb = nc = the setting
        /// `order`, nk = 1.
        orders,
        start
    }
}

impl RecursiveOptions for RelsOptions {
    type Recursion = ExtendedLeastSquares;

    fn orders(&self, order: usize) -> Orders {
        self.orders.unwrap_or(Orders {
            nc: order,
            ..Orders::arx(order, order, 1)
        })
    }

    fn check_own(&self) -> Result<(), OptionError> {
        let message = match self.orders {
            Some(Orders { nd, nf, .. }) if nd + nf > 0 => {
                "expected na, nb, nc, nk; the model has no D, F"
            }
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
#[derive(Clone, Debug)]
pub struct ExtendedLeastSquares {
    settings: RecursiveSettings,
    forgetting: Forgetting,
    start: Start,
    started: bool,
    root: SquareRoot,
    outputs: Vec<f64>,
    inputs: Vec<f64>,
    residuals: Vec<f64>,
    phi: Vec<f64>,
    theta: Vec<f64>,
    clock: Clock,
}

impl ExtendedLeastSquares {
    /// Makes the buffers; orders nd and nf must be 0.
    ///
    /// # Panics
    /// If theta0 does not fit the orders.
    pub fn new(settings: RecursiveSettings) -> Self {
        let Orders { na, nb, nc, nk, .. } = settings.orders;
        let d = na + nb + nc;
        assert_eq!(settings.theta0.len(), d);
        let mut made = Self {
            forgetting: Forgetting::new(&settings),
            start: Start::new((0..na + nb).collect()),
            started: false,
            root: SquareRoot::new(d),
            outputs: vec![0.0; na],
            inputs: vec![0.0; nb + nk],
            residuals: vec![0.0; nc],
            phi: vec![0.0; d],
            theta: vec![0.0; d],
            clock: Clock::default(),
            settings,
        };
        made.restart();
        made
    }

    fn step(&mut self, y: f64) {
        let Orders { na, nb, nk, .. } = self.settings.orders;
        let phi = &mut self.phi;
        phi[..na].copy_from_slice(&self.outputs);
        phi[na..na + nb].copy_from_slice(&self.inputs[nk..]);
        phi[na + nb..].copy_from_slice(&self.residuals);
        if !self.started && self.start.is_over(&self.settings) {
            self.started = true;
            self.start
                .hand_over(&self.settings, &self.theta, &mut self.root);
        }
        let residual = if self.started {
            self.root.update(phi, y, self.forgetting.next());
            self.root.solve(&mut self.theta);
            y - dot(phi, &self.theta)
        } else {
            let lambda = self.settings.forgetting;
            self.start.update(phi, y, lambda, &mut self.theta)
        };
        push(&mut self.residuals, residual);
    }
}

impl RecursiveEstimator for ExtendedLeastSquares {
    fn orders(&self) -> Orders {
        self.settings.orders
    }

    fn advance(&mut self, u: f64, y: f64, _: bool) -> Result<(), Diverged> {
        self.clock.begin(u, y)?;
        push(&mut self.inputs, u);
        if self.clock.samples >= self.settings.first() {
            self.step(y);
        }
        push(&mut self.outputs, -y);
        self.clock.end(&self.theta, self.start.size())
    }

    fn theta(&self) -> &[f64] {
        &self.theta
    }

    fn is_determined(&self) -> bool {
        self.start.is_determined()
    }

    fn noise_variance(&self) -> f64 {
        if self.started && self.settings.remembers() {
            let (root, d) = (&self.root, self.theta.len());
            root.weights().variance(root.residual_sum(), d)
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
        for signal in [&mut self.outputs, &mut self.inputs, &mut self.residuals] {
            signal.fill(0.0);
        }
        self.theta.copy_from_slice(&self.settings.theta0);
        self.clock = Clock::default();
    }
}
