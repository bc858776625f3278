//! Delayed inputs as instruments: two-stage least squares.

use super::arx::ArxOptions;
use crate::estimator::covariance::Covariance;
use crate::estimator::initial_state_choice::{StartState, StateEstimate};
use crate::estimator::instruments::{InstrumentalRegression, Instruments, Signals};
use crate::estimator::method_kind::{MethodKind, Problem, options};
use crate::estimator::option_error::OptionError;
use crate::estimator::regression::Rows;
use crate::estimator::{Estimator, FailureKind, Pass, SetupError, SinglePass, Window};
use crate::model::{LinearModel, Orders};

options! {
    /// The options of `iv-delayed`.
    pub struct IvDelayedOptions {
        /// Orders na, nb and the delay nk, such as na=2,nb=2,nk=1; by default na = nb = the setting `order`, nk = 1.
        pub orders: Option<Orders>,
        /// How many more instruments than parameters.
        pub extra: usize = 5,
        /// The equations that are used: complete, prewindow (zeros before the record), padded (zeros before and after).
        pub rows: Rows,
        /// The initial state: estimate (stage 6 for the model found), or zero.
        pub initial_state: StartState,
        /// The equation errors that standard errors assume: white (the default), coloured (and independent of the
        /// instruments), robust.
        pub covariance: Option<Covariance>,
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

impl SinglePass for IvDelayed {
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        let (regression, model) = (&mut self.regression, &mut self.model);
        let condition = regression.solve(Signals::new(window.u, window.y, &[]))?;
        model.set_parameters(regression.theta());
        model.noise_variance = regression.residual_sum() / regression.rows() as f64;
        regression.covariance(self.covariance, model.noise_variance, &mut model.covariance);
        pass.set_model(model, condition)?;
        self.state.estimate(window, 0, pass);
        Ok(())
    }
}
