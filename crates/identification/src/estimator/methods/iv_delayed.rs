//! Delayed inputs as instruments: two-stage least squares.

use super::arx::ArxOptions;
use crate::estimator::covariance::Covariance;
use crate::estimator::initial_state_choice::{StartState, StateEstimate};
use crate::estimator::instruments::{InstrumentalRegression, Instruments, Signals};
use crate::estimator::method_kind::{MethodKind, Problem};
use crate::estimator::option_error::OptionError;
use crate::estimator::regression::Rows;
use crate::estimator::{Estimator, Pass, SetupError, Window};
use crate::model::{LinearModel, Orders};

/// The options of `iv-delayed`.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "json",
    derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema),
    serde(deny_unknown_fields, default)
)]
pub struct IvDelayedOptions {
    /// Orders na, nb and the delay nk, such as na=2,nb=2,nk=1; by default na = nb = the setting `order`, nk = 1.
    pub orders: Option<Orders>,
    /// How many more instruments than parameters.
    pub extra: usize,
    /// The equations that are used: complete, prewindow (zeros before the record), padded (zeros before and after).
    pub rows: Rows,
    /// The initial state: estimate (stage 6 for the model found), or zero.
    pub initial_state: StartState,
    /// What standard errors assume of the equation errors: white (the default), coloured (and independent of the
    /// instruments), robust.
    pub covariance: Option<Covariance>,
}

impl Default for IvDelayedOptions {
    fn default() -> Self {
        Self {
            orders: None,
            extra: 5,
            rows: Rows::default(),
            initial_state: StartState::default(),
            covariance: None,
        }
    }
}

/// The largest number of instruments beyond the parameters.
const MOST_EXTRA: usize = 1000;

impl IvDelayedOptions {
    fn orders(&self, order: usize) -> Orders {
        self.orders.unwrap_or(Orders::arx(order, order, 1))
    }
}

impl MethodKind for IvDelayedOptions {
    fn check(&self) -> Result<(), OptionError> {
        if self.extra > MOST_EXTRA {
            let message = format!("{}; expected at most {MOST_EXTRA}", self.extra);
            return Err(OptionError::new("extra", message));
        }
        ArxOptions::check_orders(self.orders)
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        Some(self.orders(setting))
    }

    fn begins_at_rest(&self) -> bool {
        self.rows != Rows::Complete
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let orders = self.orders(problem.shape.order);
        let instruments = Instruments::DelayedInputs { extra: self.extra };
        let window = problem.shape.window;
        Ok(Box::new(IvDelayed {
            regression: InstrumentalRegression::new(orders, instruments, self.rows, window)?,
            covariance: self.covariance.unwrap_or_default(),
            model: LinearModel::zero(orders),
            state: StateEstimate::new(orders.order(), self.initial_state),
        }))
    }
}

/// Two-stage least squares `theta = argmin || P_Z (y - Phi theta) ||` with Z from the inputs
/// `u(k-nk) ... u(k-nk-nb-na-extra+1)`. The covariance is `s^2 (Phi' P_Z Phi)^-1` with `s^2 = RSS / rows`.
pub struct IvDelayed {
    regression: InstrumentalRegression,
    covariance: Covariance,
    model: LinearModel,
    state: StateEstimate,
}

impl Estimator for IvDelayed {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        let Some(pass) = passes.first_mut() else {
            return;
        };
        let mut condition = f64::NAN;
        let signals = Signals::new(window.u, window.y, &[]);
        let solved = self.regression.solve(signals, &mut condition);
        let solved = solved.and_then(|()| {
            let Self {
                regression,
                model,
                covariance,
                ..
            } = self;
            model.set_parameters(regression.theta());
            model.noise_variance = regression.residual_sum() / regression.rows() as f64;
            regression.covariance(*covariance, model.noise_variance, &mut model.covariance);
            pass.set_model(model, condition)
        });
        match solved {
            Ok(()) => self.state.estimate(window, 0, pass),
            Err(kind) => pass.fail_for(kind),
        }
    }
}
