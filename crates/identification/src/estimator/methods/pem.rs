//! The innovations state-space form by prediction errors, from a subspace model.
//!
//! With one input and one output, `x(k+1) = A x(k) + B u(k) + K e(k)`, `y(k) = C x(k) + D u(k) + e(k)` of order n is
//! `A(q) y = B(q) u + C(q) e` with three polynomials of degree n, `A(q) = det(I - A q^-1)` and
//! `C(q) = det(I - (A - K C) q^-1)`: each innovations form is such a model, and each such model has one. So the least
//! sum of squares over both is the same, and the search is that of `armax` without its random starts, in coordinates
//! without redundant parameters.
//!
//! Source: L. Ljung, *System Identification*, 2nd ed., sections 4.3 (the forms), 7.3 and 10.6 (subspace models as
//! starts).

use super::state_sequence::model_orders;
use crate::estimator::chosen::{Chosen, OrderRule};
use crate::estimator::covariance::Covariance;
use crate::estimator::method_kind::{MethodKind, Problem, options};
use crate::estimator::offset::{Levels, OffsetChoice};
use crate::estimator::option_error::OptionError;
use crate::estimator::prediction_error::{Beside, InitialCondition, PredictionError, SearchStarts};
use crate::estimator::{
    CvaOptions, Estimator, FailureKind, MethodOptions, ParsimKOptions, Pass, RivOptions, Runs, SetupError, SinglePass,
    SsarxOptions, Window,
};
use crate::model::Orders;
use crate::names::named_enum;

named_enum! {
    /// The subspace method whose model the search begins at.
    SubspaceStart, "start of the search" {
        /// Canonical variates (the default).
        Cva = "cva",
        /// With the future predicted by a long ARX model.
        Ssarx = "ssarx",
        /// In the predictor form.
        ParsimK = "parsim-k",
    }
}

options! {
    /// The options of `pem`.
    pub struct PemOptions {
        /// The order n and the delay nk, 0 (D is estimated) or 1, such as n=4,nk=0; by default n is the setting
        /// `order`, nk = 1.
        pub orders: Option<Orders>,
        /// The subspace method whose model is a start of searches, beside that of ssarx and the linear starts of armax:
        /// cva (the default), ssarx, parsim-k.
        pub initial_model: SubspaceStart,
        /// Block rows of the subspace method, more than n; by default its own.
        pub block_rows: Option<usize>,
        /// The signals before the record: zero, or estimate, which fits their effect on the prediction errors.
        pub initial: InitialCondition,
        /// A constant mu of the output, `A (y - mu) = B/F u + C/D e`: none, or estimate, together with the
        /// parameters.
        pub offset: OffsetChoice,
        /// The prediction errors that standard errors assume: white (the default), coloured, robust.
        pub covariance: Option<Covariance>,
        /// Chooses the order, from 1 to that of `orders`: bic, aicc, aic, fpe, cross-validation (errors over the last
        /// third of a model of the first two).
        pub choose: Option<OrderRule>,
    }
}

impl PemOptions {
    fn start(&self, orders: Orders, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let (orders, block_rows) = (Some(orders), self.block_rows);
        let problem = &Problem {
            is_start: true,
            ..*problem
        };
        match self.initial_model {
            SubspaceStart::Cva => CvaOptions {
                orders,
                block_rows,
                ..CvaOptions::default()
            }
            .prepare(problem),
            SubspaceStart::Ssarx => SsarxOptions {
                orders,
                block_rows,
                ..SsarxOptions::default()
            }
            .prepare(problem),
            SubspaceStart::ParsimK => ParsimKOptions {
                orders,
                block_rows,
                ..ParsimKOptions::default()
            }
            .prepare(problem),
        }
    }
}

impl MethodKind for PemOptions {
    fn check(&self) -> Result<(), OptionError> {
        super::subspace::check(self.orders, self.block_rows)
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        let given = self.orders.unwrap_or(Orders::arx(setting, setting, 1));
        Some(model_orders(given.na.max(given.nf), given.nk))
    }

    fn default_orders(&self, setting: usize) -> Option<Orders> {
        Some(self.orders.unwrap_or(Orders::arx(setting, setting, 1)))
    }

    fn begins_at_rest(&self) -> bool {
        self.initial == InitialCondition::Zero
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let orders = self.model_orders(problem.shape.order).unwrap_or_default();
        let of_order = |n: usize| Orders::arx(n, n, orders.nk);
        if let Some(rule) = self.choose {
            return Chosen::prepare(rule, orders.na, problem, |n| Self {
                orders: Some(of_order(n)),
                choose: None,
                ..self.clone()
            });
        }
        let beside = Beside::new(self.initial, self.offset);
        let mut search = PredictionError::new(orders, 0, beside, problem.shape.window)?;
        search.set_covariance(self.covariance.unwrap_or_default());
        Ok(Box::new(Pem {
            start: self.start(of_order(orders.na), problem)?,
            found: Pass::new(orders.na),
            search: with_other(search, orders, problem),
            levels: beside.levels(),
        }))
    }
}

/// Prepares a search from the true plant alone, or from random starts and the models of other methods.
pub(super) fn search(
    orders: Orders,
    starts: SearchStarts,
    beside: Beside,
    problem: &Problem<'_>,
) -> Result<PredictionError, SetupError> {
    let window = problem.shape.window;
    if starts == SearchStarts::Truth {
        let truth = problem.known.ok_or(SetupError::NoKnownPlant)?;
        return PredictionError::from_truth(orders, truth, beside, window);
    }
    let search = PredictionError::of_runs(orders, starts.random(window), beside, problem.runs())?;
    Ok(with_other(search, orders, problem))
}

/// Searches from the model of another method too. Where a search has the orders of an innovations form that is `ssarx`,
/// which takes no inputs or noise to be white, and reaches minima that no linear start of `armax` does. Where it has
/// those of Box and Jenkins and ends at no minimum, as on fast-sampled plants, it is `riv`.
fn with_other(mut search: PredictionError, orders: Orders, problem: &Problem<'_>) -> PredictionError {
    let Orders { na, nc, nd, nf, nk, .. } = orders;
    let is_refuge = na == 0 && nf > 0 && nc + nd > 0;
    let other: MethodOptions = if na > 0 && nk <= 1 && orders == model_orders(na, nk) {
        let orders = Some(Orders::arx(na, na, nk));
        SsarxOptions {
            orders,
            ..SsarxOptions::default()
        }
        .into()
    } else if is_refuge {
        RivOptions {
            orders: Some(orders),
            ..RivOptions::default()
        }
        .into()
    } else {
        return search;
    };
    let problem = Problem {
        is_start: true,
        covariance: false,
        ..*problem
    };
    // Neither takes several records, and a record may be too short.
    if problem.runs.len() < 2
        && let Ok(other) = other.prepare(&problem)
    {
        search.set_other(other, is_refuge);
    }
    search
}

/// Searches from the model of a subspace method and the linear starts of `armax`; the subspace method's failure is that
/// of both.
struct Pem {
    start: Box<dyn Estimator>,
    found: Pass,
    search: PredictionError,
    /// The levels about which the subspace method sees a record with an offset.
    levels: Option<Levels>,
}

impl SinglePass for Pem {
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        let found = &mut self.found;
        found.clear();
        let seen = match &mut self.levels {
            Some(levels) => levels.subtract(window, &Runs::new(&[window.len()])),
            None => window,
        };
        self.start.estimate(seen, std::slice::from_mut(found));
        pass.singular_values.clone_from(&found.singular_values);
        pass.correlations.clone_from(&found.correlations);
        found.failure.map_or(Ok(()), |failure| Err(failure.kind))?;
        self.search.estimate_with(Some(&found.model), window, pass);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
