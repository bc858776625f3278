//! Refined instrumental variables for a closed loop: `riv` with instruments from the reference.
//!
//! Sources: M. Gilson, H. Garnier, P. C. Young and P. Van den Hof, *Optimal instrumental variable method for
//! closed-loop identification*, IET Control Theory & Applications 5 (2011); P. C. Young, *Recursive Estimation and
//! Time-Series Analysis*, 2nd ed., 2011, chapter 9.

use super::riv::{RefinedIv, RivOptions};
use crate::data::OutputFeedback;
use crate::estimator::loop_input::LoopInput;
use crate::estimator::method_kind::{MethodKind, Needs, OptionUnits, Problem, options};
use crate::estimator::option_error::OptionError;
use crate::estimator::reflection::Stabilise;
use crate::estimator::{Estimator, SetupError};
use crate::model::Orders;

options! {
    /// The options of `clriv`: [`RefinedIv`] whose instruments have the input of the loop without noise instead of u.
    ///
    /// With a known controller that input is `F M/(F M + B N) r` of each pass's model; without, what of u follows from
    /// r in a long model `A u = B r + e`. Both are consistent whatever the noise; where C/D holds its colour and the
    /// controller is known, the covariance `s^2 (Z'Z)^-1` is that of optimal instruments.
    pub struct ClrivOptions {
        /// Orders nb, nc, nd, nf and the delay nk, such as nb=2,nc=1,nd=1,nf=2,nk=1; by default nb = nc = nd = nf = the
        /// setting `order`, nk = 1.
        pub orders: Option<Orders>,
        /// The controller K of the loop u = r - K(q) y, if it is known: a gain, or c_0,c_1,.../1,d_1,...
        pub controller: Option<OutputFeedback>,
        /// The order of the long model from the reference; by default that by AIC, at most 50 and a
        /// sixth of the samples.
        pub long: Option<usize>,
        /// The treatment of an unstable F: reflect (its zeros into the unit circle, the default), none (the method
        /// fails).
        pub stabilise: Option<Stabilise>,
    }
}

/// Checks the order of a long model.
pub(super) fn check_long(long: Option<usize>) -> Result<(), OptionError> {
    match long {
        Some(long) if !(1..=500).contains(&long) => {
            Err(OptionError::new("long", "expected a whole number from 1 to 500"))
        }
        _ => Ok(()),
    }
}

impl ClrivOptions {
    fn as_riv(&self) -> RivOptions {
        RivOptions {
            orders: self.orders,
            stabilise: self.stabilise,
        }
    }
}

impl MethodKind for ClrivOptions {
    fn check(&self) -> Result<(), OptionError> {
        check_long(self.long)?;
        self.as_riv().check()
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        self.as_riv().model_orders(setting)
    }

    fn needs(&self) -> Needs {
        Needs {
            reference: Some(("estimator", "clriv")),
            ..Needs::default()
        }
    }

    fn begins_at_rest(&self) -> bool {
        true
    }

    fn option_units(&self) -> OptionUnits {
        OptionUnits::Gain.only_if(self.controller.is_some())
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let window = problem.shape.window;
        let orders = self.as_riv().as_bj().orders(problem.shape.order);
        let source = LoopInput::new(self.controller.clone(), self.long, window)?;
        let stabilise = self.stabilise.unwrap_or(Stabilise::Reflect);
        let method = RefinedIv::new(orders, window, stabilise)?;
        Ok(Box::new(method.with_source(source)))
    }
}

#[cfg(test)]
mod tests;
