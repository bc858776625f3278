//! Recursive extended least squares.

use super::batch::Batch;
use super::lags::push;
use super::settings::{Forgetting, Given};
use super::start::Start;
use super::{
    Clock, Coefficients, Diverged, RecursiveEstimator, RecursiveSettings, SquareRoot, dot,
};
use crate::estimator::start_state::StartState;
use crate::estimator::{Estimator, SetupError};
use crate::estimator::{MethodKind, OptionError, Problem};
use crate::model::Orders;

/// The options of `rels`.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "json",
    derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema),
    serde(deny_unknown_fields, default)
)]
pub struct RelsOptions {
    /// Orders na, nb, nc and the delay nk, such as na=2,nb=2,nc=1,nk=1; by default na = nb = nc = the setting `order`, nk = 1.
    pub orders: Option<Orders>,
    /// The parameters before the first equation, in the order A, B, C, D, F, such as -1.5,0.7,1,0.5; by default zeros.
    pub theta0: Option<Coefficients>,
    /// P before the first equation is p0 times the identity; by default exact, the limit of p0 to infinity.
    pub p0: Option<f64>,
    /// Forgetting factor: the weight of an equation that is i samples old is its i-th power; 1 (the default): none.
    pub forgetting: Option<f64>,
    /// Forgetting factor after the start, which approaches `forgetting` by 1 % of the difference a sample; by default there is no such rise.
    pub early_forgetting: Option<f64>,
    /// Equations that least squares solves before residuals, instruments or filters are used; by default 0 with p0, else two for each parameter.
    pub start: Option<usize>,
    /// The initial state: estimate (stage 6 for the model found), or zero.
    pub initial_state: StartState,
}

impl RelsOptions {
    fn given(&self) -> Given<'_> {
        Given {
            theta0: self.theta0.as_ref(),
            p0: self.p0,
            forgetting: self.forgetting,
            start: self.start,
        }
    }

    fn orders(&self, order: usize) -> Orders {
        self.orders.unwrap_or(Orders {
            nc: order,
            ..Orders::arx(order, order, 1)
        })
    }
}

impl MethodKind for RelsOptions {
    fn check(&self) -> Result<(), OptionError> {
        match self.orders {
            Some(Orders { nd, nf, .. }) if nd + nf > 0 => {
                let message = "expected na, nb, nc, nk; the model has no D, F";
                return Err(OptionError::new("orders", message));
            }
            Some(Orders { na: 0, nb: 0, .. }) => {
                let message = "expected an na or nb of at least 1";
                return Err(OptionError::new("orders", message));
            }
            _ => {}
        }
        self.given().check(self.early_forgetting)?;
        self.given().check_count(self.orders)
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        Some(self.orders(setting))
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let (orders, early) = (self.orders(problem.shape.order), self.early_forgetting);
        let settings = RecursiveSettings::of(orders, &self.given(), early, problem.shape)?;
        let covariance = settings.remembers();
        let recursion = ExtendedLeastSquares::new(settings);
        Ok(Box::new(Batch::new(
            recursion,
            self.initial_state,
            covariance,
        )))
    }
}

/// `A(q) y = B(q) u + C(q) e` by recursive extended least squares: recursive least squares with the residuals `eps(k) =
/// y(k) - phi(k)' theta(k)` for e, `phi(k) = (-y(k-1) ... , u(k-nk) ... , eps(k-1) ... eps(k-nc))`. eps is 0 before the
/// first equation. It converges where `1/C - 1/2` is positive real; its covariance is `s^2 P`, right for C = 1 only.
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

    fn update(&mut self, u: f64, y: f64) -> Result<(), Diverged> {
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
        let (rows, d) = (self.root.rows(), self.theta.len());
        if self.started && self.settings.remembers() && rows > d {
            self.root.residual_sum() / (rows - d) as f64
        } else {
            f64::NAN
        }
    }

    fn covariance(&mut self, to: &mut [f64]) {
        self.root.covariance(self.noise_variance(), to);
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
