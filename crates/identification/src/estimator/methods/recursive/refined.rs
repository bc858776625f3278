//! Recursive simplified refined instrumental variables.

use super::instrumental::InstrumentalUpdate;
use super::lags::{StabilityTest, push};
use super::options::{RecursiveOptions, recursive_options};
use super::recursion::{Recursion, RecursiveMethod, Shared};
use super::{RecursiveSettings, dot};
use crate::estimator::OptionError;
use crate::estimator::methods::output_error_iteration::{check_output_error, output_error};
use crate::model::Orders;

recursive_options! {
    /// The options of `recursive-sriv`.
    RecursiveSrivOptions {
        /// Orders nb, nf and the delay nk, such as nb=2,nf=2,nk=1; by default nb = nf = the setting `order`, nk = 1.
        orders,
        with start
    }
}

impl RecursiveOptions for RecursiveSrivOptions {
    type Recursion = RecursiveSriv;

    fn orders(&self, order: usize) -> Orders {
        output_error(self.orders, order)
    }

    fn check_own(&self) -> Result<(), OptionError> {
        check_output_error(self.orders)
    }

    fn beginning(&self) -> (usize, f64) {
        super::options::INSTRUMENTS
    }

    fn recursion(&self, settings: RecursiveSettings) -> RecursiveSriv {
        RecursiveSriv::new(settings)
    }
}

/// `y = B/F u + e` by Young's simplified refined instrumental variables, sample by sample. With `uf = u/F`, `yf = y/F`
/// and `xf = x/F`, F being the last stable one,
///
/// ```text
///     phi = (uf(k-nk) ... uf(k-nk-nb+1), -yf(k-1) ... -yf(k-nf)),  z = the same with xf for yf
///     K = P z / (lambda + phi' P z),  theta += K (yf - phi' theta),  P = (P - K phi' P) / lambda
/// ```
///
/// where theta = (b, f) and `x(k) = b_0 u(k-nk) + ... - f_1 x(k-1) - ...` is the output of the new model, from rest.
/// During the start, least squares of `F y = B u + e`, filters and x run along. In white output noise it is
/// asymptotically efficient; its covariance is `s^2 P Z'Z P'`.
///
/// A sample takes about `d^3/3 + 4 d^2` multiplications and additions, d = nb + nf, and nf^2 for stability.
///
/// Source: P. C. Young, *Recursive Estimation and Time-Series Analysis*, 2nd ed., 2011, chapter 7; P. C. Young and A.
/// J. Jakeman, Refined instrumental variable methods of recursive time-series analysis, part I, Int. J. Control 29,
/// 1979.
pub type RecursiveSriv = Recursion<Refined>;

/// The equations of [`RecursiveSriv`].
#[derive(Clone, Debug)]
pub struct Refined {
    update: InstrumentalUpdate,
    /// uf(k), uf(k-1), ...
    filtered_inputs: Vec<f64>,
    /// -yf(k-1), -yf(k-2), ...
    filtered_outputs: Vec<f64>,
    /// -x(k-1), ..., and -xf(k-1), ...
    auxiliary: Vec<f64>,
    filtered_auxiliary: Vec<f64>,
    /// The last theta with a stable F.
    stable: Vec<f64>,
    test: StabilityTest,
    phi: Vec<f64>,
    z: Vec<f64>,
}

impl RecursiveSriv {
    /// Makes the buffers; orders na, nc and nd must be 0.
    ///
    /// # Panics
    /// If theta0 does not fit the orders.
    pub fn new(settings: RecursiveSettings) -> Self {
        let Orders { nb, nf, nk, .. } = settings.orders;
        let d = nb + nf;
        let (of_outputs, of_parameters) = (|| vec![0.0; nf], || vec![0.0; d]);
        let method = Refined {
            update: InstrumentalUpdate::new(d),
            filtered_inputs: vec![0.0; (nk + nb).max(nf + 1)],
            filtered_outputs: of_outputs(),
            auxiliary: of_outputs(),
            filtered_auxiliary: of_outputs(),
            stable: of_parameters(),
            test: StabilityTest::new(nf),
            phi: of_parameters(),
            z: of_parameters(),
        };
        Self::begin(settings, [nf, nk + nb], (0..d).collect(), method)
    }
}

impl Refined {
    /// The equation of y(k), with the filtered signals of this sample.
    fn step(&mut self, shared: &mut Shared, y: f64, filtered: f64) {
        let Orders { nb, nk, .. } = shared.settings.orders;
        let phi = &mut self.phi;
        if shared.begins() {
            self.update.begin(shared.start.root());
        }
        if shared.started {
            phi[..nb].copy_from_slice(&self.filtered_inputs[nk..nk + nb]);
            self.z.copy_from_slice(phi);
            phi[nb..].copy_from_slice(&self.filtered_outputs);
            self.z[nb..].copy_from_slice(&self.filtered_auxiliary);
            let lambda = shared.forgetting.next();
            self.update.take(&self.z, phi, filtered, lambda, &mut shared.theta);
        } else {
            phi[..nb].copy_from_slice(&shared.inputs[nk..]);
            phi[nb..].copy_from_slice(&shared.outputs);
            shared.take(phi, y);
            self.update.keep(phi, y, shared.settings.forgetting);
        }
    }
}

impl RecursiveMethod for Refined {
    fn take(&mut self, shared: &mut Shared, u: f64, y: f64, _: bool) {
        let Orders { nb, nf, nk, .. } = shared.settings.orders;
        // The outputs' lags have a minus, so a filter 1/F adds f_i times a lag.
        let f = &self.stable[nb..];
        let uf = u - dot(f, &self.filtered_inputs[..nf]);
        let yf = y + dot(f, &self.filtered_outputs);
        push(&mut self.filtered_inputs, uf);
        if shared.has_equation() {
            self.step(shared, y, yf);
            if self.test.passes(&shared.theta[nb..]) {
                self.stable.copy_from_slice(&shared.theta);
            }
        }
        let (b, f) = self.stable.split_at(nb);
        let x = dot(b, &shared.inputs[nk..]) + dot(f, &self.auxiliary);
        let xf = x + dot(f, &self.filtered_auxiliary);
        push(&mut self.filtered_outputs, -yf);
        push(&mut self.auxiliary, -x);
        push(&mut self.filtered_auxiliary, -xf);
    }

    fn variance(&self, theta: &[f64]) -> f64 {
        self.update.variance(theta)
    }

    fn covariance(&mut self, variance: f64, to: &mut [f64]) {
        self.update.covariance(variance, to);
    }

    fn restart(&mut self, shared: &mut Shared) {
        self.update.restart(&shared.settings);
        for signal in [
            &mut self.filtered_inputs,
            &mut self.filtered_outputs,
            &mut self.auxiliary,
            &mut self.filtered_auxiliary,
            &mut self.stable,
        ] {
            signal.fill(0.0);
        }
    }
}
