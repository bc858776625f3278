//! Refined instrumental variables in continuous time for a closed loop: `rivc` with instruments from the reference.
//!
//! Sources: M. Gilson, H. Garnier, P. C. Young and P. Van den Hof, *Instrumental variable methods for closed-loop
//! continuous-time model identification*, in H. Garnier and L. Wang (eds.), *Identification of Continuous-time Models
//! from Sampled Data*, 2008, 133-160; P. C. Young, H. Garnier and M. Gilson, *Simple refined IV methods of closed-loop
//! system identification*, SYSID 2009.

use super::closed_loop_iv::check_long;
use super::continuous_iv::{ContinuousIv, Structure};
use crate::data::OutputFeedback;
use crate::estimator::loop_input::LoopInput;
use crate::estimator::method_kind::{MethodKind, Needs, OptionUnits, Problem, options};
use crate::estimator::option_error::OptionError;
use crate::estimator::reflection::Stabilise;
use crate::estimator::{Estimator, RivcOptions, SetupError};
use crate::model::{ContinuousModel, Hold, Orders};

options! {
    /// The options of `clrivc`: [`ContinuousIv`] whose instruments have the input v of the loop without noise instead
    /// of u, as those of [`crate::estimator::ClrivOptions`]. v is seen at the samples, so the loop is closed around the
    /// sampled model.
    pub struct ClrivcOptions {
        /// Numbers of coefficients nb of B(s), nf of A(s), nc of C(q), nd of D(q), and nk, 1 more than the dead time in
        /// samples, such as nb=1,nc=1,nd=2,nf=2,nk=1; by default nb = nc = nd = nf = the setting `order`, nk = 1.
        pub orders: Option<Orders>,
        /// The input between samples: zero-order (constant, the default), first-order (straight lines).
        pub hold: Hold,
        /// The time between samples, seconds; in studies by default 1, so that rates are per sample.
        pub ts: Option<f64>,
        /// The controller K of the loop u = r - K(q) y at the samples, if it is known: a gain, or c_0,c_1,.../1,d_1,...
        pub controller: Option<OutputFeedback>,
        /// The order of the long model from the reference; by default that by AIC, at most 50 and a
        /// sixth of the samples.
        pub long: Option<usize>,
        /// The treatment of an unstable A(s): reflect (its zeros into the left half-plane, the default), none (the
        /// method fails).
        pub stabilise: Option<Stabilise>,
    }
}

impl ClrivcOptions {
    fn as_rivc(&self) -> RivcOptions {
        RivcOptions {
            orders: self.orders,
            hold: self.hold,
            ts: self.ts,
            stabilise: self.stabilise,
            ..RivcOptions::default()
        }
    }
}

impl MethodKind for ClrivcOptions {
    fn check(&self) -> Result<(), OptionError> {
        check_long(self.long)?;
        self.as_rivc().check()
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        self.as_rivc().model_orders(setting)
    }

    fn default_orders(&self, setting: usize) -> Option<Orders> {
        self.as_rivc().default_orders(setting)
    }

    fn needs(&self) -> Needs {
        Needs {
            reference: Some(("estimator", "clrivc")),
            hold: true,
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
        let source = LoopInput::new(self.controller.clone(), self.long, window)?;
        let orders = self.as_rivc().orders(problem.shape.order);
        let continuous = ContinuousModel {
            step: self.ts.unwrap_or(1.0),
            hold: self.hold,
            dead_time: orders.nk.saturating_sub(1) as f64,
            ..ContinuousModel::default()
        };
        let structure = Structure {
            orders,
            ..Structure::default()
        };
        let stabilise = self.stabilise.unwrap_or(Stabilise::Reflect);
        let method = ContinuousIv::new(structure, continuous, stabilise, window)?;
        Ok(Box::new(method.with_source(source)))
    }
}

#[cfg(test)]
mod tests;
