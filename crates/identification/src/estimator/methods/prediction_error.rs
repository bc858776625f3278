//! The options of `oe`, `armax`, `bj` and `general`: structures of one prediction error method.

use super::pem::search;
use crate::estimator::chosen::{Chosen, OrderRule};
use crate::estimator::covariance::Covariance;
use crate::estimator::method_kind::{MethodKind, Needs, OptionUnits, Problem, options};
use crate::estimator::offset::OffsetChoice;
use crate::estimator::option_error::OptionError;
use crate::estimator::prediction_error::{Beside, InitialCondition, SearchStarts};
use crate::estimator::{Estimator, SetupError};
use crate::model::Orders;

/// Defines the options of a structure; all structures have the same.
macro_rules! structure {
    ($options:ident, $doc:literal, $orders_doc:literal, $check:expr, $default:expr) => {
        options! {
            #[doc = $doc]
            pub struct $options {
                #[doc = $orders_doc]
                pub orders: Option<Orders>,
                /// The largest number of random starts, besides those from linear methods; rule: by N, 8 to 128; truth:
                /// the true plant alone, which shows whether errors come from missed minima or from the method.
                pub starts: SearchStarts,
                /// The signals before the record: zero, or estimate, which fits their effect on the prediction errors.
                pub initial: InitialCondition,
                /// A constant mu of the output, `A (y - mu) = B/F u + C/D e`: none, or estimate, together with the
                /// parameters.
                pub offset: OffsetChoice,
                /// The prediction errors that standard errors assume: white (the default), coloured, robust.
                pub covariance: Option<Covariance>,
                /// Chooses n, the order of each polynomial, from 1 to that of `orders`: bic, aicc, aic, fpe,
                /// cross-validation (errors over the last third of a model of the first two).
                pub choose: Option<OrderRule>,
            }
        }

        impl $options {
            pub(super) fn orders(&self, order: usize) -> Orders {
                self.orders.unwrap_or_else(|| Self::of_order(order, 1))
            }

            fn of_order(n: usize, nk: usize) -> Orders {
                let default: fn(usize) -> Orders = $default;
                Orders { nk, ..default(n) }
            }
        }

        impl MethodKind for $options {
            fn check(&self) -> Result<(), OptionError> {
                let check: fn(Orders) -> Option<&'static str> = $check;
                let wrong = |message: &str| Err(OptionError::new("orders", message));
                match self.orders {
                    Some(orders) if self.choose.is_some() && orders != Self::of_order(orders.nb, orders.nk) => {
                        wrong("expected equal orders, the largest to choose from")
                    }
                    orders => orders.and_then(check).map_or(Ok(()), wrong),
                }
            }

            fn model_orders(&self, setting: usize) -> Option<Orders> {
                Some(self.orders(setting))
            }

            fn needs(&self) -> Needs {
                self.starts.needs()
            }

            fn option_units(&self) -> OptionUnits {
                self.starts.option_units()
            }

            fn begins_at_rest(&self) -> bool {
                self.initial == InitialCondition::Zero
            }

            fn takes_runs(&self) -> bool {
                self.choose.is_none() && self.starts != SearchStarts::Truth
            }

            fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
                let orders = self.orders(problem.shape.order);
                if let Some(rule) = self.choose {
                    return Chosen::prepare(rule, orders.nb, problem, |n| Self {
                        orders: Some(Self::of_order(n, orders.nk)),
                        choose: None,
                        ..self.clone()
                    });
                }
                let beside = Beside::new(self.initial, self.offset);
                let mut method = search(orders, self.starts, beside, problem)?;
                method.set_covariance(self.covariance.unwrap_or_default());
                Ok(Box::new(method))
            }
        }
    };
}

structure!(
    OeOptions,
    "The options of `oe`, `y = B/F u + e`.",
    "Orders nb, nf and the delay nk, such as nb=2,nf=2,nk=1; by default nb = nf = the setting `order`, nk = 1.",
    |orders| (orders.na + orders.nc + orders.nd > 0 || orders.nb == 0)
        .then_some("expected nb of at least 1, nf, nk; the model has no A, C, D"),
    |n| Orders::output_error(n, n, 1)
);

structure!(
    ArmaxOptions,
    "The options of `armax`, `A y = B u + C e`.",
    "Orders na, nb, nc and the delay nk, such as na=2,nb=2,nc=2,nk=1; by default na = nb = nc = the setting `order`, \
     nk = 1.",
    |orders| (orders.nd + orders.nf > 0 || orders.na + orders.nb == 0)
        .then_some("expected na or nb of at least 1, nc, nk; the model has no D, F"),
    |n| Orders::armax(n, n, n, 1)
);

structure!(
    BjOptions,
    "The options of `bj`, `y = B/F u + C/D e`.",
    "Orders nb, nc, nd, nf and the delay nk, such as nb=2,nc=1,nd=1,nf=2,nk=1; by default nb = nc = nd = nf = the \
     setting `order`, nk = 1.",
    |orders| (orders.na > 0 || orders.nb == 0)
        .then_some("expected nb of at least 1, nc, nd, nf, nk; the model has no A"),
    |n| Orders {
        nc: n,
        nd: n,
        ..Orders::output_error(n, n, 1)
    }
);

structure!(
    GeneralOptions,
    "The options of `general`, `A y = B/F u + C/D e`.",
    "Orders na, nb, nc, nd, nf of any structure and the delay nk, such as na=1,nb=2,nc=1,nf=1,nk=1; by default nb = nf \
     = the setting `order`, nk = 1.",
    |orders| (orders.na + orders.nb == 0).then_some("expected na or nb of at least 1, nc, nd, nf, nk"),
    |n| Orders::output_error(n, n, 1)
);
