//! Recursive instrumental variables.

use super::lags::{StabilityTest, push};
use super::options::{RecursiveOptions, recursive_options};
use super::settings::Forgetting;
use super::start::Start;
use super::weights::Weights;
use super::{Clock, Diverged, RecursiveEstimator, RecursiveSettings, SquareRoot, dot};
use crate::estimator::{ArxOptions, OptionError};
use crate::model::Orders;
use crate::names::named_enum;

named_enum! {
    /// The instruments of recursive instrumental variables.
    RecursiveInstruments, "choice of instruments" {
        /// Inputs from before those in phi, instead of the outputs (the default).
        Delayed = "delayed",
        /// The output of the present model, run along sample by sample: the papers' auxiliary model.
        Auxiliary = "auxiliary",
    }
}

recursive_options! {
    /// The options of `recursive-iv`.
    RecursiveIvOptions {
        /// Orders na, nb and the delay nk, such as na=2,nb=2,nk=1; by default na = nb = the setting `order`, nk = 1.
        orders,
        first {
            /// What replaces the outputs: delayed (inputs, the default), auxiliary (the output of the present model).
            instruments: RecursiveInstruments,
        }
        start
    }
}

impl RecursiveOptions for RecursiveIvOptions {
    type Recursion = RecursiveIv;

    fn orders(&self, order: usize) -> Orders {
        self.orders.unwrap_or(Orders::arx(order, order, 1))
    }

    fn check_own(&self) -> Result<(), OptionError> {
        ArxOptions::check_orders(self.orders)
    }

    fn recursion(&self, settings: RecursiveSettings) -> RecursiveIv {
        RecursiveIv::new(settings, self.instruments)
    }
}

/// `A(q) y = B(q) u + v` by recursive instrumental variables: with the phi of least squares and instruments z,
///
/// ```text
///     K = P z / (lambda + phi' P z),  theta += K (y - phi' theta),  P = (P - K phi' P) / lambda
/// ```
///
/// `delayed`: `z(k) = (u(k-nk-nb) ... u(k-nk-nb-na+1), u(k-nk) ... u(k-nk-nb+1))`, zeros before the record.
/// `auxiliary`: `z(k) = (-x(k-1) ... -x(k-na), u(k-nk) ...)`, where `x(k) = z(k)' theta(k)` is the output of the present
/// model from rest. A model of too few samples may have an output far larger than y, which then rules Z'Phi for long:
/// a longer start, or early forgetting, prevents that. While A-hat has a zero on or outside the unit circle, x is that of the last stable one.
///
/// P is not symmetric, so it has no square root: with lambda = 1, `P^-1 = P(0)^-1 + Z'Phi`, and the covariance is `s^2 P
/// Z'Z P'`; after early forgetting `s^2 P Z'W^2 Z P'`, W being the weights that are left. A sample takes about 7 d^2 multiplications and additions, d = na + nb, and na^2 for stability.
///
/// Source: L. Ljung and T. Soderstrom, *Theory and Practice of Recursive Identification*, 1983, section 2.2.2.
#[derive(Clone, Debug)]
pub struct RecursiveIv {
    settings: RecursiveSettings,
    forgetting: Forgetting,
    instruments: RecursiveInstruments,
    start: Start,
    started: bool,
    update: InstrumentalUpdate,
    outputs: Vec<f64>,
    inputs: Vec<f64>,
    /// -x(k-1), -x(k-2), ...
    auxiliary: Vec<f64>,
    /// The last theta with a stable A.
    stable: Vec<f64>,
    test: StabilityTest,
    phi: Vec<f64>,
    z: Vec<f64>,
    theta: Vec<f64>,
    clock: Clock,
}

/// P of recursive instrumental variables, and what its covariance and the variance of the residuals are made of.
#[derive(Clone, Debug)]
pub(super) struct InstrumentalUpdate {
    p: Vec<f64>,
    /// Z'W^2 Z, and Phi'W Phi, Phi'W y, y'W y, with the weights that forgetting leaves.
    squares: Vec<f64>,
    moments: Vec<f64>,
    products: Vec<f64>,
    power: f64,
    /// P z, and phi'P.
    gain: Vec<f64>,
    left: Vec<f64>,
    /// P Z'W^2 Z.
    product: Vec<f64>,
    weights: Weights,
}

impl InstrumentalUpdate {
    pub(super) fn new(d: usize) -> Self {
        let (vector, matrix) = (|| vec![0.0; d], || vec![0.0; d * d]);
        Self {
            p: matrix(),
            squares: matrix(),
            moments: matrix(),
            products: vector(),
            power: 0.0,
            gain: vector(),
            left: vector(),
            product: matrix(),
            weights: Weights::default(),
        }
    }

    /// Takes P over from least squares, whose instruments were phi.
    pub(super) fn begin(&mut self, from: &SquareRoot) {
        from.covariance(1.0, &mut self.p);
        self.power = from.moments(&mut self.squares, &mut self.products);
        self.moments.copy_from_slice(&self.squares);
        self.weights = from.weights();
    }

    /// One equation; theta changes.
    pub(super) fn take(&mut self, z: &[f64], phi: &[f64], y: f64, lambda: f64, theta: &mut [f64]) {
        let d = z.len();
        self.left.fill(0.0);
        for i in 0..d {
            let row = &self.p[i * d..][..d];
            self.gain[i] = dot(row, z);
            for (left, p) in self.left.iter_mut().zip(row) {
                *left += phi[i] * p;
            }
        }
        let scale = lambda + dot(phi, &self.gain);
        let error = y - dot(phi, theta);
        self.gain.iter_mut().for_each(|gain| *gain /= scale);
        for i in 0..d {
            theta[i] += self.gain[i] * error;
            let rows = i * d..(i + 1) * d;
            for (p, left) in self.p[rows.clone()].iter_mut().zip(&self.left) {
                *p = (*p - self.gain[i] * left) / lambda;
            }
            for (square, z_j) in self.squares[rows.clone()].iter_mut().zip(z) {
                *square = lambda * lambda * *square + z[i] * z_j;
            }
            for (moment, phi_j) in self.moments[rows].iter_mut().zip(phi) {
                *moment = lambda * *moment + phi[i] * phi_j;
            }
            self.products[i] = lambda * self.products[i] + phi[i] * y;
        }
        self.power = lambda * self.power + y * y;
        self.weights.add(lambda);
    }

    /// The variance of the residuals of theta in all equations. Theta was far off when the first were taken, so their
    /// residuals at that time say nothing.
    pub(super) fn variance(&self, theta: &[f64]) -> f64 {
        let d = self.gain.len();
        let rows = self.moments.chunks_exact(d).zip(theta);
        let quadratic: f64 = rows.map(|(row, theta_i)| theta_i * dot(row, theta)).sum();
        let sum = self.power - 2.0 * dot(&self.products, theta) + quadratic;
        // Rounding may make a sum of 0 negative.
        self.weights.variance(sum.max(0.0), d)
    }

    /// Fills `to` with `variance P Z'W^2 Z P'`.
    pub(super) fn covariance(&mut self, variance: f64, to: &mut [f64]) {
        let d = self.gain.len();
        for i in 0..d {
            for j in 0..d {
                // Z'W^2 Z is symmetric.
                self.product[i * d + j] = dot(&self.p[i * d..][..d], &self.squares[j * d..][..d]);
            }
        }
        for i in 0..d {
            for j in 0..d {
                to[i * d + j] = variance * dot(&self.product[i * d..][..d], &self.p[j * d..][..d]);
            }
        }
    }
}

impl RecursiveIv {
    /// Makes the buffers; orders nc, nd and nf must be 0.
    ///
    /// # Panics
    /// If theta0 does not fit the orders.
    pub fn new(settings: RecursiveSettings, instruments: RecursiveInstruments) -> Self {
        let Orders { na, nb, nk, .. } = settings.orders;
        let d = na + nb;
        assert_eq!(settings.theta0.len(), d);
        let mut made = Self {
            forgetting: Forgetting::new(&settings),
            instruments,
            start: Start::new((0..d).collect()),
            started: false,
            update: InstrumentalUpdate::new(d),
            outputs: vec![0.0; na],
            inputs: vec![0.0; nk + nb + na],
            auxiliary: vec![0.0; na],
            stable: vec![0.0; d],
            test: StabilityTest::new(na),
            phi: vec![0.0; d],
            z: vec![0.0; d],
            theta: vec![0.0; d],
            clock: Clock::default(),
            settings,
        };
        made.restart();
        made
    }

    fn step(&mut self, y: f64) {
        let Orders { na, nb, nk, .. } = self.settings.orders;
        let (phi, z) = (&mut self.phi, &mut self.z);
        phi[..na].copy_from_slice(&self.outputs);
        phi[na..].copy_from_slice(&self.inputs[nk..nk + nb]);
        z.copy_from_slice(phi);
        z[..na].copy_from_slice(match self.instruments {
            RecursiveInstruments::Delayed => &self.inputs[nk + nb..],
            RecursiveInstruments::Auxiliary => &self.auxiliary,
        });
        if !self.started && self.start.is_over(&self.settings) {
            self.started = true;
            self.update.begin(self.start.root());
        }
        if self.started {
            let lambda = self.forgetting.next();
            self.update.take(z, phi, y, lambda, &mut self.theta);
        } else {
            let lambda = self.settings.forgetting;
            self.start.update(phi, y, lambda, &mut self.theta);
        }
        if self.test.passes(&self.theta[..na]) {
            self.stable.copy_from_slice(&self.theta);
        }
        if self.instruments == RecursiveInstruments::Auxiliary {
            let x = dot(z, &self.stable);
            push(&mut self.auxiliary, -x);
        }
    }
}

impl RecursiveEstimator for RecursiveIv {
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
        if self.started && self.settings.remembers() {
            self.update.variance(&self.theta)
        } else {
            f64::NAN
        }
    }

    fn covariance(&mut self, to: &mut [f64]) {
        self.update.covariance(self.noise_variance(), to);
    }

    fn samples(&self) -> usize {
        self.clock.samples
    }

    fn restart(&mut self) {
        self.start.restart(&self.settings);
        self.started = false;
        self.forgetting = Forgetting::new(&self.settings);
        for signal in [&mut self.outputs, &mut self.inputs, &mut self.auxiliary] {
            signal.fill(0.0);
        }
        self.stable.fill(0.0);
        self.theta.copy_from_slice(&self.settings.theta0);
        self.clock = Clock::default();
    }
}
