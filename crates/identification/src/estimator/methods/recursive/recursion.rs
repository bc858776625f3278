//! The common parts of recursive methods: settings, the start, theta, and when a recursion ends.

use super::lags::push;
use super::settings::Forgetting;
use super::start::Start;
use super::{Clock, Diverged, RecursiveEstimator, RecursiveSettings, SquareRoot};
use crate::model::Orders;

/// The state that all methods have.
#[derive(Clone, Debug)]
pub struct Shared {
    pub(super) settings: RecursiveSettings,
    pub(super) forgetting: Forgetting,
    pub(super) start: Start,
    /// Whether the method has taken over from the start.
    pub(super) started: bool,
    pub(super) theta: Vec<f64>,
    /// -y(k-1), -y(k-2), ...
    pub(super) outputs: Vec<f64>,
    /// u(k), u(k-1), ...
    pub(super) inputs: Vec<f64>,
    clock: Clock,
}

impl Shared {
    /// Whether the sample at hand has an equation.
    pub(super) fn has_equation(&self) -> bool {
        self.clock.samples >= self.settings.first()
    }

    /// Whether the method takes over from the start at this equation.
    pub(super) fn begins(&mut self) -> bool {
        let begins = !self.started && self.start.is_over(&self.settings);
        self.started |= begins;
        begins
    }

    /// Takes an equation of the start, and returns its residual.
    pub(super) fn take(&mut self, phi: &[f64], y: f64) -> f64 {
        let lambda = self.settings.forgetting;
        self.start.update(phi, y, lambda, &mut self.theta)
    }

    /// Hands the information of the start to the recursion that goes on.
    pub(super) fn hand_over(&self, to: &mut SquareRoot) {
        self.start.hand_over(&self.settings, &self.theta, to);
    }

    fn restart(&mut self) {
        self.start.restart(&self.settings);
        self.started = false;
        self.forgetting = Forgetting::new(&self.settings);
        self.theta.copy_from_slice(&self.settings.theta0);
        self.outputs.fill(0.0);
        self.inputs.fill(0.0);
        self.clock = Clock::default();
    }
}

/// A method of one equation after the other.
pub trait RecursiveMethod: Clone + std::fmt::Debug + Send {
    /// Takes u(k), which is among the inputs, and y(k), which is not yet among the outputs.
    fn take(&mut self, shared: &mut Shared, u: f64, y: f64, wanted: bool);

    /// Returns numbers that must be finite, and one that is not finite once the information was not.
    fn numbers<'a>(&'a self, shared: &'a Shared) -> (&'a [f64], f64) {
        (&shared.theta, shared.start.size())
    }

    /// Whether the equations so far determine theta.
    fn is_determined(&self, shared: &Shared) -> bool {
        shared.start.is_determined()
    }

    /// Returns the variance of the residuals so far.
    fn variance(&self, theta: &[f64]) -> f64;

    /// Fills `to` with the covariance of theta for this variance.
    fn covariance(&mut self, variance: f64, to: &mut [f64]);

    /// Forgets all samples.
    fn restart(&mut self, shared: &mut Shared);
}

/// A recursion by a method.
#[derive(Clone, Debug)]
pub struct Recursion<M> {
    shared: Shared,
    method: M,
}

impl<M: RecursiveMethod> Recursion<M> {
    /// Begins a recursion that remembers so many outputs and inputs, and of whose parameters the start estimates those
    /// at these places.
    ///
    /// # Panics
    /// If theta0 does not fit the orders.
    pub(super) fn begin(
        settings: RecursiveSettings,
        [outputs, inputs]: [usize; 2],
        places: Vec<usize>,
        method: M,
    ) -> Self {
        let d = settings.orders.parameters();
        assert_eq!(settings.theta0.len(), d);
        let shared = Shared {
            forgetting: Forgetting::new(&settings),
            start: Start::new(places),
            started: false,
            theta: vec![0.0; d],
            outputs: vec![0.0; outputs],
            inputs: vec![0.0; inputs],
            clock: Clock::default(),
            settings,
        };
        let mut made = Self { shared, method };
        made.restart();
        made
    }
}

impl<M: RecursiveMethod> RecursiveEstimator for Recursion<M> {
    fn orders(&self) -> Orders {
        self.shared.settings.orders
    }

    fn advance(&mut self, u: f64, y: f64, wanted: bool) -> Result<(), Diverged> {
        self.shared.clock.begin(u, y)?;
        push(&mut self.shared.inputs, u);
        self.method.take(&mut self.shared, u, y, wanted);
        push(&mut self.shared.outputs, -y);
        let (numbers, size) = self.method.numbers(&self.shared);
        let mut clock = self.shared.clock;
        let ended = clock.end(numbers, size);
        self.shared.clock = clock;
        ended
    }

    fn theta(&self) -> &[f64] {
        &self.shared.theta
    }

    fn is_determined(&self) -> bool {
        self.method.is_determined(&self.shared)
    }

    fn noise_variance(&self) -> f64 {
        if self.shared.started && self.shared.settings.remembers() {
            self.method.variance(&self.shared.theta)
        } else {
            f64::NAN
        }
    }

    fn covariance(&mut self, to: &mut [f64]) {
        let variance = self.noise_variance();
        self.method.covariance(variance, to);
    }

    fn samples(&self) -> usize {
        self.shared.clock.samples
    }

    fn restart(&mut self) {
        self.shared.restart();
        self.method.restart(&mut self.shared);
    }
}
