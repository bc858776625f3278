//! The plant in a closed loop from signals that follow from the reference: two-stage and joint input-output methods.
//!
//! Sources: P. Van den Hof and R. Schrama, *An indirect method for transfer function estimation from closed loop data*,
//! Automatica 29 (1993); T. Soderstrom and P. Stoica, *System Identification*, 1989, section 10.5.

use super::closed_loop_iv::check_long;
use super::output_error_iteration::{check_output_error, output_error, output_errors};
use super::riv::RefinedIv;
use crate::estimator::loop_input::LoopInput;
use crate::estimator::method_kind::{MethodKind, Needs, Problem, options};
use crate::estimator::option_error::OptionError;
use crate::estimator::reflection::Stabilise;
use crate::estimator::{Estimator, FailureKind, Iteration, SetupError, Window};
use crate::model::{LinearModel, Orders};

/// Defines the options of a method; both have the same.
macro_rules! staged {
    ($options:ident, $doc:literal, $name:literal, joint: $joint:literal) => {
        options! {
            #[doc = $doc]
            pub struct $options {
                /// Orders nb, nf and the delay nk, such as nb=2,nf=2,nk=1; by default nb = nf = the setting `order`, nk
                /// = 1.
                pub orders: Option<Orders>,
                /// The order of the long model from the reference; by default that by AIC, at most 50
                /// and a sixth of the samples.
                pub long: Option<usize>,
                /// The treatment of an unstable F: reflect (its zeros into the unit circle, the default), none (the
                /// method fails).
                pub stabilise: Option<Stabilise>,
            }
        }

        impl MethodKind for $options {
            fn check(&self) -> Result<(), OptionError> {
                check_long(self.long)?;
                check_output_error(self.orders)
            }

            fn model_orders(&self, setting: usize) -> Option<Orders> {
                Some(output_error(self.orders, setting))
            }

            fn needs(&self) -> Needs {
                Needs {
                    reference: Some(("estimator", $name)),
                    ..Needs::default()
                }
            }

            fn begins_at_rest(&self) -> bool {
                true
            }

            fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
                let orders = output_error(self.orders, problem.shape.order);
                let window = problem.shape.window;
                let long = || LoopInput::new(None, self.long, window);
                let stabilise = self.stabilise.unwrap_or(Stabilise::Reflect);
                Ok(Box::new(TwoStage {
                    input: long()?,
                    output: if $joint { Some(long()?) } else { None },
                    plant: RefinedIv::new(orders, window, stabilise)?,
                    model: LinearModel::zero(orders),
                }))
            }
        }
    };
}

staged!(TwoStageOptions, "The options of `two-stage`.", "two-stage", joint: false);
staged!(JointOptions, "The options of `joint`.", "joint", joint: true);

/// (1) The part of u from r, by least squares of the long model `A u = B r + e`; (2) the output-error model from it
/// to y, at rest of `sriv`. Joint input-output takes what of y follows from r instead of y in (2): `G = T/S`, S and T
/// being the long models from r to u and to y. Both are consistent whatever the noise as N and the long order grow.
pub struct TwoStage {
    input: LoopInput,
    output: Option<LoopInput>,
    plant: RefinedIv,
    model: LinearModel,
}

impl Iteration for TwoStage {
    fn find(&mut self, Window { u, y, r }: Window<'_>, passes: &mut usize) -> Result<f64, FailureKind> {
        self.input.follow(u, r)?;
        let y = match &mut self.output {
            Some(output) => {
                output.follow(y, r)?;
                &output.hat
            }
            None => y,
        };
        let window = Window::new(&self.input.hat, y, y.len());
        self.plant.find(window, passes)
    }

    fn conclude(&mut self, Window { u, y, .. }: Window<'_>, _: bool) -> Result<f64, FailureKind> {
        self.model.assign(self.plant.model());
        let scratch = [&mut vec![0.0; u.len()][..], &mut vec![0.0; u.len()]];
        Ok(output_errors(&mut self.model, u, y, scratch))
    }

    fn model(&self) -> &LinearModel {
        &self.model
    }
}
