//! The four-step instrumental variables of Ljung and Soderstrom, approximately optimal where the noise is
//! `1/(A L)` of white noise.

use super::arx::ArxOptions;
use super::instruments::{InstrumentalRegression, Instruments, Signals};
use super::least_squares::{StartState, StateEstimate};
use super::method::{MethodKind, OptionError, Problem};
use super::regression::{Regression, Rows};
use super::{Estimator, Failure, FailureKind, Pass, SetupError, Stage, Window};
use crate::model::polynomial::filter;
use crate::model::{LinearModel, Orders};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The options of `iv4`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Iv4Options {
    /// Orders na, nb and the delay nk, such as na=2,nb=2,nk=1; by default na = nb = the setting `order`, nk = 1.
    pub orders: Option<Orders>,
    /// The equations that are used: complete, prewindow (zeros before the record), padded (and after it).
    pub rows: Rows,
    /// The initial state: estimate (stage 6 for the model found), or zero.
    pub initial_state: StartState,
}

impl Iv4Options {
    fn orders(&self, order: usize) -> Orders {
        self.orders.unwrap_or(Orders::arx(order, order, 1))
    }
}

impl MethodKind for Iv4Options {
    fn check(&self) -> Result<(), OptionError> {
        ArxOptions::check_orders(self.orders)
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        Some(self.orders(setting))
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let (orders, rows) = (self.orders(problem.shape.order), self.rows);
        let window = problem.shape.window;
        let signal = || vec![0.0; window];
        let regression = Regression::new(orders, rows, window)?;
        // The residuals of the rows are a record of their own.
        let residuals = regression.rows().min(window);
        let whitening = Orders::arx(orders.na + orders.nb, 0, 1);
        Ok(Box::new(Iv4 {
            instruments: InstrumentalRegression::new(orders, Instruments::Signal, rows, window)?,
            whitening: Regression::new(whitening, rows, residuals).map_err(|_| {
                // The residuals' autoregression looks back as far as it has coefficients.
                SetupError::ShortRecord {
                    orders,
                    window,
                    rows: residuals,
                    needed: 2 * whitening.na,
                }
            })?,
            regression,
            first: window - residuals,
            prefilter: vec![1.0; orders.na + orders.nb + 1],
            model: LinearModel::zero(orders),
            state: StateEstimate::new(orders.order(), self.initial_state),
            x: signal(),
            w: signal(),
            filtered: [signal(), signal(), signal()],
        }))
    }
}

/// (1) Least squares; (2) instruments from its simulated output; (3) `L(q)`, an AR(na + nb) of the residuals
/// `A y - B u`; (4) instruments from the output of (2), everything filtered by L. The covariance is
/// `s^2 (Z'Phi)^-1 Z'Z (Phi'Z)^-1` of (4), `s^2` its filtered residuals' sum over rows less parameters.
pub struct Iv4 {
    regression: Regression,
    instruments: InstrumentalRegression,
    whitening: Regression,
    /// The first row.
    first: usize,
    prefilter: Vec<f64>,
    model: LinearModel,
    state: StateEstimate,
    x: Vec<f64>,
    w: Vec<f64>,
    /// u, y, x filtered by L.
    filtered: [Vec<f64>; 3],
}

impl Iv4 {
    /// The model; on failure its kind and the stage.
    fn find(
        &mut self,
        Window { u, y, .. }: Window<'_>,
        condition: &mut f64,
    ) -> Result<(), (FailureKind, Stage)> {
        let at = |stage: Stage| move |kind: FailureKind| (kind, stage);
        let (ls, iv) = (Stage::LeastSquares, Stage::Instruments);
        self.regression.solve(u, y, condition).map_err(at(ls))?;
        self.model.set_parameters(self.regression.theta());
        self.model.simulate(u, &mut self.x);
        let signals = Signals { u, y, x: &self.x };
        self.instruments.solve(signals, condition).map_err(at(iv))?;
        self.model.set_parameters(self.instruments.theta());
        let (w, x) = (&mut self.w, &mut self.x);
        self.model.residuals(u, y, w, x);
        let w = &w[self.first..];
        // No input.
        x[..w.len()].fill(0.0);
        let mut unused = f64::NAN;
        let whitened = self.whitening.solve(&x[..w.len()], w, &mut unused);
        whitened.map_err(at(iv))?;
        self.prefilter[1..].copy_from_slice(self.whitening.theta());
        self.model.simulate(u, x);
        for (to, from) in self.filtered.iter_mut().zip([u, y, x]) {
            filter(&self.prefilter, from, to);
        }
        let [u, y, x] = &self.filtered;
        let signals = Signals { u, y, x };
        self.instruments.solve(signals, condition).map_err(at(iv))?;
        let theta = self.instruments.theta();
        self.model.set_parameters(theta);
        let freedom = self.instruments.rows() - theta.len();
        let variance = self.instruments.residual_sum() / freedom as f64;
        self.model.noise_variance = variance;
        self.instruments
            .covariance(variance, &mut self.model.covariance);
        Ok(())
    }
}

impl Estimator for Iv4 {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        let Some(pass) = passes.first_mut() else {
            return;
        };
        let mut condition = f64::NAN;
        let found = self.find(window, &mut condition);
        let at_iv = |kind| (kind, Stage::Instruments);
        let set = found.and_then(|()| pass.set_model(&self.model, condition).map_err(at_iv));
        match set {
            Ok(()) => self.state.estimate(window, 0, pass),
            Err((kind, stage)) => pass.fail(Failure {
                kind,
                stage,
                pass: 0,
            }),
        }
    }
}
