//! The options of `srivc` and `rivc`.

use super::{ContinuousIv, DeadTime, Structure};
use crate::estimator::method_kind::{MethodKind, Needs, Problem, options};
use crate::estimator::option_error::OptionError;
use crate::estimator::reflection::Stabilise;
use crate::estimator::{Estimator, InitialCondition, OffsetChoice, SetupError};
use crate::model::{ContinuousModel, Hold, Orders};

/// A dead time that is this near to a whole number of samples is one: times between samples are rounded.
const NEARLY_WHOLE: f64 = 1e-6;

/// Samples beyond any record: a longer dead time is refused as this one is.
const MOST_DEAD: f64 = 4e9;

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
                /// The dead time instead of nk: seconds, which need be no multiple of ts, estimate (from 0 to 30
                /// samples, at most a quarter of the record), or a range LOW:HIGH in seconds to estimate it on.
                pub dead_time: Option<DeadTime>,
                /// Whether a pole is fixed at 0, A(s) = s F(s); nf then counts F(s), by default the setting `order`
                /// less 1.
                pub integrator: bool,
                /// The signals before the record: zero, or estimate, which fits their effect on the prediction errors.
                pub initial: InitialCondition,
                /// A constant mu of the output, `A (y - mu) = B/F u + C/D e`: none, or estimate, together with the
                /// parameters.
                pub offset: OffsetChoice,
                /// The treatment of an unstable A(s): reflect (its zeros into the left half-plane, the default), none
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
                    nf: order.saturating_sub(usize::from(self.integrator)),
                    nk: 1,
                    ..Orders::default()
                })
            }

            /// Returns the numbers that are estimated on a window, and the least dead time in samples.
            fn structure(&self, order: usize, window: usize) -> (Structure, f64) {
                let orders = self.orders(order);
                let samples = |seconds: f64| {
                    let samples = (seconds / self.ts.unwrap_or(1.0)).min(MOST_DEAD);
                    let is_whole = (samples - samples.round()).abs() <= NEARLY_WHOLE;
                    if is_whole { samples.round() } else { samples }
                };
                let range = match self.dead_time {
                    Some(DeadTime::Estimate(None)) => Some([0.0, DeadTime::MOST_SAMPLES.min(window / 4) as f64]),
                    Some(DeadTime::Estimate(Some(range))) => Some(range.map(samples)),
                    Some(DeadTime::Known(_)) | None => None,
                };
                let dead_time = match (self.dead_time, range) {
                    (_, Some([low, _])) => low,
                    (Some(DeadTime::Known(seconds)), _) => samples(seconds),
                    _ => orders.nk.saturating_sub(1) as f64,
                };
                let structure = Structure {
                    orders: Orders { nk: 1, ..orders },
                    integrator: self.integrator,
                    initial: self.initial == InitialCondition::Estimate,
                    offset: self.offset == OffsetChoice::Estimate,
                    range,
                };
                (structure, dead_time)
            }
        }

        impl MethodKind for $options {
            fn check(&self) -> Result<(), OptionError> {
                let Self {
                    hold,
                    dead_time,
                    integrator,
                    ..
                } = *self;
                check(self.orders, $noise, integrator)?;
                if let (Some(_), Some(Orders { nk: 2.., .. })) = (dead_time, self.orders) {
                    return Err(OptionError::new(
                        "dead_time",
                        "expected no delay nk beside it: it is all of the dead time",
                    ));
                }
                let jumps = |orders: Orders| hold == Hold::Zero && orders.nb > orders.nf + usize::from(integrator);
                if matches!(dead_time, Some(DeadTime::Estimate(_))) && self.orders.is_some_and(jumps) {
                    return Err(OptionError::new(
                        "dead_time",
                        "an input that acts at once makes a loss that jumps with the dead time; expected an nb \
                         of at most the degree of A(s), or the hold first-order",
                    ));
                }
                if integrator && self.initial == InitialCondition::Estimate && self.offset == OffsetChoice::Estimate {
                    return Err(OptionError::new(
                        "offset",
                        "the level of an integrator is in its state; expected initial or offset estimated, not both",
                    ));
                }
                match self.ts {
                    Some(ts) if !(ts > 0.0 && ts.is_finite()) => {
                        Err(OptionError::new("ts", "expected a number of seconds above 0"))
                    }
                    _ => Ok(()),
                }
            }

            fn model_orders(&self, setting: usize) -> Option<Orders> {
                let (structure, dead_time) = self.structure(setting, usize::MAX);
                Some(structure.sampled(self.hold, dead_time))
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
                self.initial == InitialCondition::Zero
            }

            fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
                let window = problem.shape.window;
                let step = self.ts.unwrap_or(1.0);
                let (seconds, record) = (
                    self.dead_time.map_or(0.0, DeadTime::longest),
                    window as f64 * step,
                );
                if seconds >= record {
                    return Err(SetupError::LongDeadTime { seconds, record });
                }
                let (structure, dead_time) = self.structure(problem.shape.order, window);
                let continuous = ContinuousModel {
                    step,
                    hold: self.hold,
                    dead_time,
                    ..ContinuousModel::default()
                };
                let stabilise = self.stabilise.unwrap_or(Stabilise::Reflect);
                Ok(Box::new(ContinuousIv::new(
                    structure, continuous, stabilise, window,
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
fn check(orders: Option<Orders>, noise: bool, integrator: bool) -> Result<(), OptionError> {
    let refuse = |message| Err(OptionError::new("orders", message));
    match orders {
        Some(Orders { na, nc, nd, .. }) if na + nc + nd > 0 && !noise => {
            refuse("expected nb, nf, nk; the model has no A(q), C, D")
        }
        Some(Orders { na: 1.., .. }) => refuse("expected nb, nc, nd, nf, nk; nf counts A(s)"),
        Some(Orders { nf: 0, .. }) if !integrator => refuse("expected an nf of at least 1"),
        Some(Orders { nb, nf, .. }) if integrator && (nb == 0 || nb > nf + 2) => {
            refuse("expected an nb of 1 to nf + 2: A(s) = s F(s), and the degree of B(s) is nb - 1")
        }
        Some(Orders { nb, nf, .. }) if !integrator && (nb == 0 || nb > nf + 1) => {
            refuse("expected an nb of 1 to nf + 1: the degree of B(s) is nb - 1")
        }
        Some(Orders { nk: 0, .. }) => refuse("expected an nk of at least 1: 1 is no dead time"),
        None | Some(_) => Ok(()),
    }
}
