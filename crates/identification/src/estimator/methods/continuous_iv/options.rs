//! The options of `srivc` and `rivc`.

use super::{ContinuousIv, sampled};
use crate::estimator::method_kind::{MethodKind, Needs, Problem, options};
use crate::estimator::option_error::OptionError;
use crate::estimator::reflection::Stabilise;
use crate::estimator::{Estimator, SetupError};
use crate::model::{ContinuousModel, Hold, Orders};

/// Defines the options of a method; both have the same but for the orders.
macro_rules! continuous {
    ($options:ident, $doc:literal, $orders:literal, noise: $noise:literal) => {
        options! {
            #[doc = $doc]
            pub struct $options {
                #[doc = $orders]
                pub orders: Option<Orders>,
                /// The input between samples: zero-order (constant, the default), first-order (straight lines).
                pub hold: Hold,
                /// The time between samples, seconds; in studies by default 1, so that rates are per sample.
                pub ts: Option<f64>,
                /// What is done if A(s) is unstable: reflect (its zeros into the left half-plane, the default), none
                /// (the method fails).
                pub stabilise: Option<Stabilise>,
            }
        }

        impl $options {
            pub(in crate::estimator) fn orders(&self, order: usize) -> Orders {
                let noise = if $noise { order } else { 0 };
                self.orders.unwrap_or(Orders {
                    nb: order,
                    nc: noise,
                    nd: noise,
                    nf: order,
                    nk: 1,
                    ..Orders::default()
                })
            }
        }

        impl MethodKind for $options {
            fn check(&self) -> Result<(), OptionError> {
                check(self.orders, $noise)?;
                match self.ts {
                    Some(ts) if !(ts > 0.0 && ts.is_finite()) => Err(OptionError::new(
                        "ts",
                        "expected a number of seconds above 0",
                    )),
                    _ => Ok(()),
                }
            }

            fn model_orders(&self, setting: usize) -> Option<Orders> {
                Some(sampled(self.orders(setting), self.hold))
            }

            fn default_orders(&self, setting: usize) -> Option<Orders> {
                Some(self.orders(setting))
            }

            fn needs(&self) -> Needs {
                Needs {
                    hold: true,
                    ..Needs::default()
                }
            }

            fn begins_at_rest(&self) -> bool {
                true
            }

            fn takes_memory(&self) -> bool {
                true
            }

            fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
                let continuous = ContinuousModel {
                    step: self.ts.unwrap_or(1.0),
                    hold: self.hold,
                    ..ContinuousModel::default()
                };
                let orders = self.orders(problem.shape.order);
                let stabilise = self.stabilise.unwrap_or(Stabilise::Reflect);
                let window = problem.shape.window;
                Ok(Box::new(ContinuousIv::new(
                    orders, continuous, stabilise, window,
                )?))
            }
        }
    };
}

continuous!(
    SrivcOptions,
    "The options of `srivc`.",
    "Numbers of coefficients nb of B(s) and nf of A(s), and nk, 1 more than the dead time in samples, such as \
     nb=2,nf=4,nk=1; by default nb = nf = the setting `order`, nk = 1.",
    noise: false
);
continuous!(
    RivcOptions,
    "The options of `rivc`.",
    "Numbers of coefficients nb of B(s), nf of A(s), nc of C(q), nd of D(q), and nk, 1 more than the dead time in \
     samples, such as nb=1,nc=1,nd=2,nf=2,nk=1; by default nb = nc = nd = nf = the setting `order`, nk = 1.",
    noise: true
);

/// Checks the orders of a model in continuous time.
fn check(orders: Option<Orders>, noise: bool) -> Result<(), OptionError> {
    let refuse = |message| Err(OptionError::new("orders", message));
    match orders {
        Some(Orders { na, nc, nd, .. }) if na + nc + nd > 0 && !noise => {
            refuse("expected nb, nf, nk; the model has no A(q), C, D")
        }
        Some(Orders { na: 1.., .. }) => refuse("expected nb, nc, nd, nf, nk; nf counts A(s)"),
        Some(Orders { nf: 0, .. }) => refuse("expected an nf of at least 1"),
        Some(Orders { nb, nf, .. }) if nb == 0 || nb > nf + 1 => {
            refuse("expected an nb of 1 to nf + 1: the degree of B(s) is nb - 1")
        }
        Some(Orders { nk: 0, .. }) => refuse("expected an nk of at least 1: 1 is no dead time"),
        None | Some(_) => Ok(()),
    }
}
