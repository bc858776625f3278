//! The four-step instrumental variables of Ljung and Soderstrom. They are approximately optimal if the noise is white
//! noise through `1/(A L)`.

use super::arx::ArxOptions;
use crate::estimator::autoregression::durbin_step;
use crate::estimator::covariance::Covariance;
use crate::estimator::initial_state_choice::{StartState, StateEstimate};
use crate::estimator::instruments::{InstrumentalRegression, Instruments, Signals};
use crate::estimator::method_kind::{MethodKind, Needs, Problem, options};
use crate::estimator::option_error::OptionError;
use crate::estimator::other_tools::{R_SYSID_RIDGE, Reading};
use crate::estimator::reflection::stable;
use crate::estimator::reflection::{Stabilise, reflect_zeros};
use crate::estimator::regression::{Regression, Rows};
use crate::estimator::{Estimator, FailureKind, InstrumentSource, Pass, SetupError, SinglePass, Window};
use crate::model::polynomial::filter;
use crate::model::{LinearModel, Orders};
use crate::signal::arithmetic::mean;
use std::ops::Range;

options! {
    /// The options of `iv4`.
    pub struct Iv4Options {
        /// Orders na, nb and the delay nk, such as na=2,nb=2,nk=1; by default na = nb = the setting `order`, nk = 1.
        pub orders: Option<Orders>,
        /// The equations that are used: complete, prewindow (zeros before the record), padded (zeros before and after).
        pub rows: Rows,
        /// The initial state: estimate (stage 6 for the model found), or zero.
        pub initial_state: StartState,
        /// The conventions of another tool: r-sysid.
        pub reading: Option<Reading>,
        /// The signal from which the instruments are formed: u (the default) or r, the reference of a closed loop.
        pub instruments: Option<InstrumentSource>,
        /// The treatment of an unstable model whose output makes the instruments: reflect (its poles into the unit
        /// circle, the default), none (also with a reading).
        pub stabilise: Option<Stabilise>,
    }
}

impl Iv4Options {
    fn orders(&self, order: usize) -> Orders {
        self.orders.unwrap_or(Orders::arx(order, order, 1))
    }
}

impl MethodKind for Iv4Options {
    fn check(&self) -> Result<(), OptionError> {
        if self.reading.is_some() {
            let rows = (self.rows != Rows::default()).then_some(self.rows);
            Reading::refuse(rows, None)?;
        }
        ArxOptions::check_orders(self.orders)
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        Some(self.orders(setting))
    }

    fn needs(&self) -> Needs {
        Needs {
            reference: (self.instruments == Some(InstrumentSource::Reference)).then_some(("instruments", "r")),
            ..Needs::default()
        }
    }

    fn begins_at_rest(&self) -> bool {
        self.rows != Rows::Complete
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let (orders, window) = (self.orders(problem.shape.order), problem.shape.window);
        // R's sysid also has zeros after the record, and its filters continue into them.
        let r_sysid = self.reading == Some(Reading::RSysid);
        let (rows, ridge, length) = if r_sysid {
            (Rows::Prewindow, R_SYSID_RIDGE, window + orders.reach())
        } else {
            (self.rows, 0.0, window)
        };
        let signal = || vec![0.0; length];
        let regression = Regression::with_ridge(orders, rows, ridge, length)?;
        // The residuals of the rows form a record of their own.
        let residuals = regression.rows().min(window);
        let lags = orders.na + orders.nb;
        let whitening = if r_sysid {
            Whitening::YuleWalker
        } else {
            let equations = Regression::new(Orders::arx(lags, 0, 1), rows, residuals);
            let equations = equations.map_err(|_| {
                // The residuals' autoregression looks back as many samples as it has coefficients.
                SetupError::ShortRecord {
                    orders,
                    window,
                    rows: residuals,
                    needed: 2 * lags,
                }
            })?;
            Whitening::LeastSquares(Box::new(equations))
        };
        // The other tool does not reflect.
        let stabilise = self
            .stabilise
            .unwrap_or(if r_sysid { Stabilise::None } else { Stabilise::Reflect });
        Ok(Box::new(Iv4 {
            stabilise,
            exploding: false,
            scratch: Vec::new(),
            instruments: InstrumentalRegression::new(orders, Instruments::Signal, rows, length)?,
            whitening,
            regression,
            residuals: window - residuals..window,
            prefilter: vec![1.0; lags + 1],
            model: LinearModel::zero(orders),
            state: StateEstimate::new(orders.order(), self.initial_state),
            u: signal(),
            y: signal(),
            x: signal(),
            w: signal(),
            filtered: [signal(), signal(), signal(), signal()],
            v: signal(),
            from_reference: self.instruments == Some(InstrumentSource::Reference),
        }))
    }
}

/// How the autoregression of the residuals is found.
enum Whitening {
    LeastSquares(Box<Regression>),
    /// From the covariances of the residuals about their mean; each sum is divided by the number of residuals.
    YuleWalker,
}

impl Whitening {
    /// Computes `L = 1 + l_1 q^-1 + ...` of residuals w; `zeros` is a signal of zeros of the same length.
    fn find(&mut self, w: &[f64], zeros: &[f64], prefilter: &mut [f64]) -> Result<(), FailureKind> {
        match self {
            Self::LeastSquares(regression) => {
                regression.solve(zeros, w)?;
                prefilter[1..].copy_from_slice(regression.theta());
                Ok(())
            }
            Self::YuleWalker => yule_walker(w, prefilter),
        }
    }
}

/// Computes the autoregression `L w = e` of a signal by the Levinson-Durbin recursion.
fn yule_walker(w: &[f64], l: &mut [f64]) -> Result<(), FailureKind> {
    let level = mean(w);
    let covariance = |lag: usize| -> f64 {
        let pairs = w.get(lag..).unwrap_or_default().iter().zip(w);
        pairs.map(|(late, early)| (late - level) * (early - level)).sum()
    };
    let mut variance = covariance(0);
    l.fill(0.0);
    l[0] = 1.0;
    for lag in 1..l.len() {
        durbin_step(l, lag, &mut variance, covariance)?;
    }
    Ok(())
}

/// The four steps: (1) least squares; (2) instruments from the simulated output of (1); (3) `L(q)`, an AR(na + nb) of
/// the residual `A y - B u` of (2); (4) instruments from the output of (2), everything filtered by L. The covariance is
/// `s^2 (Z'Phi)^-1 Z'Z (Phi'Z)^-1` of (4), `s^2` being the sum of its squared filtered residuals over rows less
/// parameters.
///
/// A model that is simulated for instruments has its poles outside the unit circle reflected into it.
pub struct Iv4 {
    stabilise: Stabilise,
    /// Whether the model of the present instruments is unstable.
    exploding: bool,
    scratch: Vec<f64>,
    regression: Regression,
    instruments: InstrumentalRegression,
    whitening: Whitening,
    /// The range of samples whose residuals are whitened.
    residuals: Range<usize>,
    prefilter: Vec<f64>,
    model: LinearModel,
    state: StateEstimate,
    /// The record, followed by zeros in the reading that has them.
    u: Vec<f64>,
    y: Vec<f64>,
    x: Vec<f64>,
    w: Vec<f64>,
    /// The input of the instruments: u, or r of a closed loop.
    v: Vec<f64>,
    from_reference: bool,
    /// u, y, x and v filtered by L.
    filtered: [Vec<f64>; 4],
}

impl Iv4 {
    /// Simulates the model, stabilised, for the instruments of the record's samples.
    fn make_instruments(&mut self, record: usize) -> Result<(), FailureKind> {
        self.exploding = !stable(&self.model.a, &mut self.scratch);
        if self.exploding && self.stabilise == Stabilise::Reflect {
            self.exploding = false;
            if !reflect_zeros(&mut self.model.a) {
                return Err(FailureKind::NonFinite);
            }
        }
        self.model.simulate(&self.v[..record], &mut self.x[..record]);
        self.x[record..].fill(0.0);
        Ok(())
    }

    /// Solves with instruments; their model's instability is the cause of a failure.
    fn solve(&mut self, filtered: bool) -> Result<f64, FailureKind> {
        let signals = match &self.filtered {
            [u, y, x, v] if filtered => Signals {
                v: Some(v),
                ..Signals::new(u, y, x)
            },
            _ => Signals {
                v: Some(&self.v),
                ..Signals::new(&self.u, &self.y, &self.x)
            },
        };
        let solved = self.instruments.solve(signals);
        solved.map_err(|kind| {
            if self.exploding {
                FailureKind::UnstableInstruments
            } else {
                kind
            }
        })
    }
}

impl SinglePass for Iv4 {
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        let Window { u, y, r } = window;
        let record = y.len();
        self.u[..record].copy_from_slice(u);
        self.y[..record].copy_from_slice(y);
        self.v[..record].copy_from_slice(if self.from_reference { r } else { u });
        let (u, y) = (&self.u, &self.y);
        self.regression.solve(u, y)?;
        self.model.set_parameters(self.regression.theta());
        self.make_instruments(record)?;
        self.solve(false)?;
        let (u, y, w, x) = (&self.u, &self.y, &mut self.w, &mut self.x);
        self.model.set_parameters(self.instruments.theta());
        self.model.residuals(u, y, w, x);
        let w = &w[self.residuals.clone()];
        // The residuals have no input.
        x[..w.len()].fill(0.0);
        self.whitening.find(w, &x[..w.len()], &mut self.prefilter)?;
        self.make_instruments(record)?;
        let (u, y, x, v) = (&self.u, &self.y, &self.x, &self.v);
        for (to, from) in self.filtered.iter_mut().zip([u, y, x, v]) {
            filter(&self.prefilter, from, to);
        }
        let condition = self.solve(true)?;
        let theta = self.instruments.theta();
        self.model.set_parameters(theta);
        let freedom = self.instruments.rows() - theta.len();
        let variance = self.instruments.residual_sum() / freedom as f64;
        self.model.noise_variance = variance;
        self.instruments
            .covariance(Covariance::White, variance, &mut self.model.covariance);
        pass.set_model(&self.model, condition)?;
        self.state.estimate(window, 0, pass);
        Ok(())
    }
}
