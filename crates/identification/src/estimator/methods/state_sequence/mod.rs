//! Subspace methods whose states are combinations of the past, `x(t) = J z(t)`, and whose model is the innovations
//! form.
//!
//! `z(t) = (y(t-1) ... y(t-s), u(t-1) ... u(t-s))`, and J has the canonical correlations of z with the future. By least
//! squares, `y = C x + D u + e` and `x(t+1) = A x + B u + K e` follow. One output makes that `A y = B u + C e` with
//! three polynomials of degree n, `A(q) = det(I - A q^-1)` and `C(q) = det(I - (A - K C) q^-1)`.
//!
//! Sources: W. E. Larimore, "Canonical variate analysis in identification, filtering, and adaptive control", CDC 1990,
//! 596-604; M. Jansson, "Subspace identification and ARX modeling", SYSID 2003, 1625-1630; Y. Fujikoshi, L. G. Veitch,
//! "Estimation of dimensionality in canonical correlation analysis", Biometrika 66 (1979), 345-351 (the order).

mod canonical;
pub(super) mod innovations;

use super::subspace::{block_rows, longest_rows};
use crate::estimator::chosen::{Chosen, OrderRule};
use crate::estimator::excitation::excited_rows;
use crate::estimator::method_kind::{MethodKind, Problem};
use crate::estimator::null_space::long_autoregression;
use crate::estimator::option_error::OptionError;
use crate::estimator::order_choice::Criterion;
use crate::estimator::reflection::Stabilise;
use crate::estimator::{Estimator, FailureKind, InitialCondition, Pass, SetupError, SinglePass, Window};
use crate::model::{LinearModel, Orders};
use canonical::Canonical;

/// The future signals, of which the past tells the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Future {
    /// The outputs, with the future inputs projected out of them and of the past.
    Projected,
    /// The outputs less what a high-order ARX model makes of inputs and outputs since the state.
    Predicted,
}

/// Defines the options of a method whose model is the innovations form: fields of its own, their check, and how an
/// estimator is prepared for orders and a window.
macro_rules! innovations_options {
    ($options:ident, $doc:literal, {$($own:tt)*}, check: $check:expr, prepare: $prepare:expr) => {
        $crate::estimator::method_kind::options! {
            #[doc = $doc]
            pub struct $options {
                /// The order n and the delay nk, 0 (D is estimated) or 1, such as n=4,nk=0; by default n is the setting
                /// `order`, nk = 1.
                pub orders: Option<Orders>,
                /// Block rows s of the future and of the past, more than n; by default twice the order of `A y = B u +
                /// e` by AIC, as far as the record allows.
                pub block_rows: Option<usize>,
                /// Chooses the order, from 1 to that of `orders`: bic, aicc, aic, fpe, cross-validation (errors over
                /// the last third of a model of the first two).
                pub choose: Option<OrderRule>,
                $($own)*
                /// The treatment of an unstable A: none (the default), reflect (its eigenvalues into the unit circle).
                pub stabilise: Stabilise,
                /// The signals before the record: zero, or estimate, which finds the best start of the model (A, B and
                /// C do not depend on it).
                pub initial: InitialCondition,
            }
        }

        impl MethodKind for $options {
            fn check(&self) -> Result<(), OptionError> {
                let check: fn(&Self) -> Result<(), OptionError> = $check;
                check(self)?;
                crate::estimator::methods::subspace::check(self.orders, self.block_rows)
            }

            fn model_orders(&self, setting: usize) -> Option<Orders> {
                let given = self.orders.unwrap_or(Orders::arx(setting, setting, 1));
                Some(model_orders(given.na.max(given.nf), given.nk))
            }

            fn default_orders(&self, setting: usize) -> Option<Orders> {
                Some(self.orders.unwrap_or(Orders::arx(setting, setting, 1)))
            }

            fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
                let orders = self.model_orders(problem.shape.order).unwrap_or_default();
                if let Some(rule) = self.choose {
                    return Chosen::prepare(rule, orders.na, problem, |n| Self {
                        orders: Some(Orders::arx(n, n, orders.nk)),
                        choose: None,
                        ..self.clone()
                    });
                }
                type Prepare<T> =
                    fn(&T, Orders, &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError>;
                let prepare: Prepare<Self> = $prepare;
                prepare(self, orders, problem)
            }
        }
    };
}
pub(super) use innovations_options;

/// Defines the options of a method of this folder; both have the same.
macro_rules! state_sequence {
    ($options:ident, $doc:literal, $future:expr) => {
        innovations_options!(
            $options,
            $doc,
            {
                /// Chooses the order, from 1 to that of `orders`, by a criterion of the canonical correlations: aic,
                /// bic.
                pub correlations: Option<Criterion>,
            },
            check: |of| {
                if let Some(criterion @ (Criterion::Aicc | Criterion::Fpe)) = of.correlations {
                    let message = format!("{criterion}; expected aic or bic");
                    return Err(OptionError::new("correlations", message));
                }
                if of.choose.is_some() && of.correlations.is_some() {
                    let message = "expected one of choose and correlations";
                    return Err(OptionError::new("correlations", message));
                }
                Ok(())
            },
            prepare: |of, orders, problem| {
                let window = problem.shape.window;
                let method = StateSequence::new(orders, of.block_rows, $future, window)?;
                Ok(Box::new(StateSequence {
                    correlations: of.correlations,
                    ending: (of.stabilise, of.initial),
                    is_start: problem.is_start,
                    ..method
                }))
            }
        );
    };
}

state_sequence!(CvaOptions, "The options of `cva`.", Future::Projected);
state_sequence!(SsarxOptions, "The options of `ssarx`.", Future::Predicted);

/// Returns the orders of the innovations form of order n as `A y = B u + C e`.
pub(super) fn model_orders(n: usize, nk: usize) -> Orders {
    Orders::armax(n, n + 1 - nk.min(1), n, nk)
}

/// Finds the states of a record, and the innovations form from them. Zeros of C outside the unit circle are reflected
/// into it, which keeps the spectrum of `C e` but for its size.
pub struct StateSequence {
    orders: Orders,
    future: Future,
    correlations: Option<Criterion>,
    /// How an unstable A is treated, and the start.
    ending: (Stabilise, InitialCondition),
    /// The number of block rows, if it is given.
    rows: Option<usize>,
    /// Whether the model is a start, for which u need not excite the block rows.
    is_start: bool,
    window: usize,
}

impl StateSequence {
    /// Makes buffers for windows of `window` samples.
    ///
    /// # Errors
    /// [`SetupError::ShortHankel`] if the Hankel matrices have fewer columns than rows.
    fn new(orders: Orders, rows: Option<usize>, future: Future, window: usize) -> Result<Self, SetupError> {
        block_rows(rows, orders.na, window)?;
        Ok(Self {
            orders,
            future,
            correlations: None,
            ending: (Stabilise::None, InitialCondition::Zero),
            rows,
            is_start: false,
            window,
        })
    }

    fn find(&mut self, u: &[f64], y: &[f64], pass: &mut Pass) -> Result<(LinearModel, f64), FailureKind> {
        let Orders { na: most, nk, .. } = self.orders;
        let high = match (self.future, self.rows) {
            (Future::Projected, Some(_)) => None,
            _ => long_autoregression(u, y, nk),
        };
        let order = high.as_ref().map_or(0, |model| model.a.len() - 1);
        let longest = longest_rows(self.window).max(most + 1);
        let rows = self.rows.unwrap_or((2 * order).clamp(most + 1, longest));
        let rows = if self.is_start {
            rows
        } else {
            excited_rows(u, rows, self.rows.unwrap_or(most + 1))?
        };
        let mut canonical = match (self.future, high) {
            (Future::Projected, _) => Canonical::projected(u, y, rows)?,
            (Future::Predicted, Some(high)) => Canonical::predicted(u, y, rows, &high)?,
            (Future::Predicted, None) => return Err(no_solution(u, y)),
        };
        let n = self
            .correlations
            .map_or(most, |criterion| canonical.order(criterion, most));
        pass.correlations.clone_from(&canonical.correlations);
        let states = canonical.states(n)?;
        let mut model = LinearModel::zero(model_orders(n, nk));
        let condition = innovations::fit(u, y, &states, rows, &mut model)?;
        Ok((model, condition))
    }
}

/// Why there is no long ARX model of a record.
fn no_solution(u: &[f64], y: &[f64]) -> FailureKind {
    let square = |signal: &[f64]| signal.iter().map(|x| x * x).sum::<f64>();
    if (square(u) + square(y)).is_finite() {
        FailureKind::RankDeficient
    } else {
        FailureKind::NonFinite
    }
}

impl SinglePass for StateSequence {
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        let found = self.find(window.u, window.y, pass)?;
        innovations::conclude(window, self.ending, found, pass)
    }
}

#[cfg(test)]
mod tests;
