//! Recursive instrumental variables.

use super::elimination::Elimination;
use super::first_equations::FirstEquations;
use super::lags::{StabilityTest, push};
use super::options::{RecursiveOptions, recursive_options};
use super::recursion::{Recursion, RecursiveMethod, Shared};
use super::weights::Weights;
use super::{RecursiveSettings, SquareRoot, dot};
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
            /// The signals that replace the outputs: delayed (inputs, the default), auxiliary (the output of the
            /// present model).
            pub instruments: RecursiveInstruments,
        }
        with start
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

    fn beginning(&self) -> (usize, f64) {
        match self.instruments {
            RecursiveInstruments::Delayed => (0, 1.0),
            RecursiveInstruments::Auxiliary => super::options::INSTRUMENTS,
        }
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
/// `delayed`: `z(k) = (g u(k-nk-nb) ... g u(k-nk-nb-na+1), u(k-nk) ... u(k-nk-nb+1))`, zeros before the record. g is 1
/// with p0; without, it is the size of y over that of u in the equations of the start, whose instruments are phi: sums
/// of both would otherwise depend on what u and y are measured in.
/// `auxiliary`: `z(k) = (-x(k-1) ... -x(k-na), u(k-nk) ...)`, where `x(k) = z(k)' theta(k)` is the output of the
/// present model from rest. A model of too few samples may have an output far larger than y, which then rules Z'Phi for
/// long: a longer start, or early forgetting, prevents that. While A-hat has a zero on or outside the unit circle, x is
/// that of the last stable one.
///
/// P is not symmetric, so it has no square root. Its inverse is carried: with lambda = 1, `P^-1 = P(0)^-1 + Z'Phi`. The
/// covariance is `s^2 P Z'Z P'`; after early forgetting `s^2 P Z'W^2 Z P'`, W being the weights that are left. A sample
/// takes about `d^3/3 + 4 d^2` multiplications and additions, d = na + nb, and na^2 for stability.
///
/// Source: L. Ljung and T. Soderstrom, *Theory and Practice of Recursive Identification*, 1983, section 2.2.2.
pub type RecursiveIv = Recursion<Instrumental>;

/// The equations of [`RecursiveIv`] and their instruments.
#[derive(Clone, Debug)]
pub struct Instrumental {
    instruments: RecursiveInstruments,
    update: InstrumentalUpdate,
    /// -x(k-1), -x(k-2), ...
    auxiliary: Vec<f64>,
    /// The last theta with a stable A.
    stable: Vec<f64>,
    /// The unit of delayed inputs that stand for outputs.
    unit: f64,
    test: StabilityTest,
    phi: Vec<f64>,
    z: Vec<f64>,
}

/// The equations of recursive instrumental variables, and what the covariance and the variance of the residuals are
/// made of.
///
/// Not P is carried but its inverse, `R = lambda R + z phi'` with `R(0) = inverse(P(0))`, and `r = lambda r + z y` with
/// `r(0) = R(0) theta(0)`; theta solves `R theta = r`. That is the same theta, and nothing is ever subtracted from
/// P(0): what a P far larger than the records' units loses in its first updates would be lost for good.
///
/// Until Z'Phi has full rank theta follows from [`FirstEquations`].
#[derive(Clone, Debug)]
pub(super) struct InstrumentalUpdate {
    information: Vec<f64>,
    sums: Vec<f64>,
    elimination: Elimination,
    first: FirstEquations,
    /// Z'W^2 Z, and Phi'W Phi, Phi'W y, y'W y, with the weights that forgetting leaves.
    squares: Vec<f64>,
    moments: Vec<f64>,
    products: Vec<f64>,
    power: f64,
    /// P Z'W^2 Z, transposed.
    product: Vec<f64>,
    weights: Weights,
}

impl InstrumentalUpdate {
    pub(super) fn new(d: usize) -> Self {
        let (vector, matrix) = (|| vec![0.0; d], || vec![0.0; d * d]);
        Self {
            information: matrix(),
            sums: vector(),
            elimination: Elimination::new(d),
            first: FirstEquations::new(d),
            squares: matrix(),
            moments: matrix(),
            products: vector(),
            power: 0.0,
            product: matrix(),
            weights: Weights::default(),
        }
    }

    /// Takes the equations over from least squares, whose instruments were phi.
    pub(super) fn begin(&mut self, from: &SquareRoot) {
        self.power = from.moments(&mut self.squares, &mut self.products);
        self.moments.copy_from_slice(&self.squares);
        self.information.copy_from_slice(&self.squares);
        self.sums.copy_from_slice(&self.products);
        self.weights = from.weights();
    }

    /// The size of the first `na` regressors over that of the others, in the equations of the start; 1 without others.
    fn ratio(&self, na: usize) -> f64 {
        let d = self.sums.len();
        let power = |of: std::ops::Range<usize>| {
            let count = of.len() as f64;
            of.map(|i| self.squares[i * d + i]).sum::<f64>() / count
        };
        let ratio = (power(0..na) / power(na..d)).sqrt();
        if ratio.is_normal() { ratio } else { 1.0 }
    }

    /// Before the first equation theta is theta0 and P is p0 times the identity. Without p0 the start has d equations
    /// at least.
    pub(super) fn restart(&mut self, settings: &RecursiveSettings) {
        self.first.restart(&settings.theta0, settings.p0);
    }

    /// Keeps an equation of the start.
    pub(super) fn keep(&mut self, phi: &[f64], y: f64, lambda: f64) {
        self.first.take(phi, phi, y, lambda);
    }

    /// One equation; theta changes.
    pub(super) fn take(&mut self, z: &[f64], phi: &[f64], y: f64, lambda: f64, theta: &mut [f64]) {
        self.add(z, phi, y, lambda);
        if self.first.is_needed() {
            self.first.solve(theta);
        } else {
            theta.copy_from_slice(&self.sums);
            self.elimination.solve(z.len(), &self.information, theta);
        }
    }

    /// One equation without solving.
    fn add(&mut self, z: &[f64], phi: &[f64], y: f64, lambda: f64) {
        let d = z.len();
        with_fma!(|| {
            for i in 0..d {
                let rows = i * d..(i + 1) * d;
                add(&mut self.information[rows.clone()], lambda, z[i], phi);
                add(&mut self.squares[rows.clone()], lambda * lambda, z[i], z);
                add(&mut self.moments[rows], lambda, phi[i], phi);
            }
            add(&mut self.sums, lambda, y, z);
            add(&mut self.products, lambda, y, phi);
        });
        self.power = lambda * self.power + y * y;
        self.weights.add(lambda);
        self.first.take(z, phi, y, lambda);
    }

    /// The variance of the residuals of theta in all equations. Theta was far off when the first were taken, so their
    /// residuals at that time say nothing.
    pub(super) fn variance(&self, theta: &[f64]) -> f64 {
        let d = self.sums.len();
        let rows = self.moments.chunks_exact(d).zip(theta);
        let quadratic: f64 = rows.map(|(row, theta_i)| theta_i * dot(row, theta)).sum();
        let sum = self.power - 2.0 * dot(&self.products, theta) + quadratic;
        // Rounding may make a sum of 0 negative.
        self.weights.variance(sum.max(0.0), d)
    }

    /// Fills `to` with `variance P Z'W^2 Z P'`.
    pub(super) fn covariance(&mut self, variance: f64, to: &mut [f64]) {
        let d = self.sums.len();
        to.copy_from_slice(&self.squares);
        self.elimination.solve(d, &self.information, to);
        for i in 0..d {
            for j in 0..d {
                self.product[i * d + j] = variance * to[j * d + i];
            }
        }
        to.copy_from_slice(&self.product);
        self.elimination.solve(d, &self.information, to);
    }
}

/// `to = lambda to + factor of`.
#[inline(always)]
fn add(to: &mut [f64], lambda: f64, factor: f64, of: &[f64]) {
    for (to, of) in to.iter_mut().zip(of) {
        *to = lambda * *to + factor * of;
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
        let method = Instrumental {
            instruments,
            update: InstrumentalUpdate::new(d),
            auxiliary: vec![0.0; na],
            stable: vec![0.0; d],
            unit: 1.0,
            test: StabilityTest::new(na),
            phi: vec![0.0; d],
            z: vec![0.0; d],
        };
        Self::begin(settings, [na, nk + nb + na], (0..d).collect(), method)
    }
}

impl RecursiveMethod for Instrumental {
    fn take(&mut self, shared: &mut Shared, _: f64, y: f64, wanted: bool) {
        if !shared.has_equation() {
            return;
        }
        let Orders { na, nb, nk, .. } = shared.settings.orders;
        let own_output = self.instruments == RecursiveInstruments::Auxiliary;
        let (phi, z) = (&mut self.phi, &mut self.z);
        phi[..na].copy_from_slice(&shared.outputs);
        phi[na..].copy_from_slice(&shared.inputs[nk..nk + nb]);
        z.copy_from_slice(phi);
        z[..na].copy_from_slice(match self.instruments {
            RecursiveInstruments::Delayed => &shared.inputs[nk + nb..],
            RecursiveInstruments::Auxiliary => &self.auxiliary,
        });
        if shared.begins() {
            self.update.begin(shared.start.root());
            if shared.settings.p0.is_none() && !own_output {
                self.unit = self.update.ratio(na);
            }
        }
        if shared.started {
            z[..na].iter_mut().for_each(|z| *z *= self.unit);
            let lambda = shared.forgetting.next();
            if wanted || own_output {
                self.update.take(z, phi, y, lambda, &mut shared.theta);
            } else {
                self.update.add(z, phi, y, lambda);
            }
        } else {
            shared.take(phi, y);
            self.update.keep(phi, y, shared.settings.forgetting);
        }
        if own_output {
            if self.test.passes(&shared.theta[..na]) {
                self.stable.copy_from_slice(&shared.theta);
            }
            let x = dot(z, &self.stable);
            push(&mut self.auxiliary, -x);
        }
    }

    fn variance(&self, theta: &[f64]) -> f64 {
        self.update.variance(theta)
    }

    fn covariance(&mut self, variance: f64, to: &mut [f64]) {
        self.update.covariance(variance, to);
    }

    fn restart(&mut self, shared: &mut Shared) {
        self.update.restart(&shared.settings);
        self.unit = 1.0;
        self.auxiliary.fill(0.0);
        self.stable.fill(0.0);
    }
}
