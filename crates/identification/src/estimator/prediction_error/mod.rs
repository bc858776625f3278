//! Prediction error methods: `theta = argmin sum e(k)^2`, `e = D/C (A y - B/F u)`, all signals zero before the record.
//!
//! Levenberg-Marquardt steps with the exact gradient, computed by filtering (Ljung, *System Identification*, 2nd ed.,
//! section 10.3). The search covers models with a stable predictor (zeros of C and F inside the unit circle) and begins
//! at several starts.

mod descent;
mod draws;
mod instrumental;
pub(super) mod kernels;
mod predictor;
mod search;
mod search_starts;
mod starts;

use super::chosen::{Chosen, OrderRule};
use super::covariance::Covariance;
use super::known_model::KnownModel;
use super::method_kind::{MethodKind, Needs, Problem};
use super::option_error::OptionError;
use super::start_state::{StartState, StateEstimate};
use super::{Estimator, FailureKind, Pass, SetupError, Window};
use crate::model::{LinearModel, Orders};
use crate::names::named_enum;
pub(super) use descent::Descent;
use descent::Found;
pub use predictor::initial_numbers;
use search::Search;
pub use search_starts::SearchStarts;
use starts::Starts;

named_enum! {
    /// The assumption about the signals before the record in prediction error methods.
    InitialCondition, "initial condition" {
        /// Zero (the default).
        Zero = "zero",
        /// Their contribution to the prediction errors is fitted together with the parameters.
        Estimate = "estimate",
    }
}

/// Defines the options of a structure; all structures have the same.
macro_rules! structure {
    ($options:ident, $doc:literal, $orders_doc:literal, $check:expr, $default:expr) => {
        #[doc = $doc]
        #[derive(Clone, Debug, PartialEq)]
        #[cfg_attr(
            feature = "json",
            derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema),
            serde(deny_unknown_fields, default)
        )]
        pub struct $options {
            #[doc = $orders_doc]
            pub orders: Option<Orders>,
            /// The largest number of random starts, besides those from linear methods; rule: by N, 8 to 128; truth: the
            /// true plant alone, which shows whether errors come from missed minima or from the method.
            pub starts: SearchStarts,
            /// The signals before the record: zero, or estimate, which fits their effect on the prediction errors.
            pub initial: InitialCondition,
            /// What standard errors assume of the prediction errors: white (the default), coloured, robust.
            pub covariance: Option<Covariance>,
            /// Chooses n, the order of each polynomial, from 1 to that of `orders`: aicc, aic, bic, fpe,
            /// cross-validation (errors over the last third of a model of the first two).
            pub choose: Option<OrderRule>,
        }

        impl Default for $options {
            fn default() -> Self {
                Self {
                    orders: None,
                    starts: SearchStarts::default(),
                    initial: InitialCondition::default(),
                    covariance: None,
                    choose: None,
                }
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
                    Some(orders)
                        if self.choose.is_some()
                            && orders != Self::of_order(orders.nb, orders.nk) =>
                    {
                        wrong("expected equal orders, the largest to choose from")
                    }
                    orders => orders.and_then(check).map_or(Ok(()), wrong),
                }
            }

            fn model_orders(&self, setting: usize) -> Option<Orders> {
                Some(self.orders(setting))
            }

            fn needs(&self) -> Needs {
                Needs {
                    plant: self.starts == SearchStarts::Truth,
                    ..Needs::default()
                }
            }

            fn begins_at_rest(&self) -> bool {
                self.initial == InitialCondition::Zero
            }

            fn takes_memory(&self) -> bool {
                true
            }

            fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
                let orders = self.orders(problem.shape.order);
                if let Some(rule) = self.choose {
                    return Chosen::prepare(rule, orders.nb, problem, |n, problem| {
                        let orders = Some(Self::of_order(n, orders.nk));
                        Self {
                            orders,
                            choose: None,
                            ..self.clone()
                        }
                        .prepare(problem)
                    });
                }
                let window = problem.shape.window;
                let initial = self.initial;
                let mut method = match self.starts {
                    SearchStarts::Truth => {
                        let truth = problem.known.ok_or(SetupError::NoKnownPlant)?;
                        PredictionError::from_truth(orders, truth, initial, window)?
                    }
                    starts => {
                        let random = starts.random(window);
                        PredictionError::new(orders, random, initial, window)?
                    }
                };
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
    |n| Orders {
        nb: n,
        nf: n,
        nk: 1,
        ..Orders::default()
    }
);

structure!(
    ArmaxOptions,
    "The options of `armax`, `A y = B u + C e`.",
    "Orders na, nb, nc and the delay nk, such as na=2,nb=2,nc=2,nk=1; by default na = nb = nc = the setting `order`, nk = 1.",
    |orders| (orders.nd + orders.nf > 0 || orders.na + orders.nb == 0)
        .then_some("expected na or nb of at least 1, nc, nk; the model has no D, F"),
    |n| Orders {
        na: n,
        nb: n,
        nc: n,
        nk: 1,
        ..Orders::default()
    }
);

structure!(
    BjOptions,
    "The options of `bj`, `y = B/F u + C/D e`.",
    "Orders nb, nc, nd, nf and the delay nk, such as nb=2,nc=1,nd=1,nf=2,nk=1; by default nb = nc = nd = nf = the setting `order`, nk = 1.",
    |orders| (orders.na > 0 || orders.nb == 0)
        .then_some("expected nb of at least 1, nc, nd, nf, nk; the model has no A"),
    |n| Orders {
        nb: n,
        nc: n,
        nd: n,
        nf: n,
        nk: 1,
        ..Orders::default()
    }
);

/// Takes the lowest minimum of the search. For white errors the covariance is `s^2 (psi'psi)^-1`,
/// `s^2 = N V / (N - parameters)`.
///
/// If no search ends at a minimum, the best model is returned with [`FailureKind::Boundary`] or
/// [`FailureKind::IterationLimit`], without covariance.
pub struct PredictionError {
    search: Search,
    model: LinearModel,
    covariance: Covariance,
    /// Estimates x0 if the signals before the record are not taken as zero.
    state: Option<StateEstimate>,
}

impl PredictionError {
    /// Makes buffers for windows of `window` samples.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`].
    pub fn new(
        orders: Orders,
        random: usize,
        initial: InitialCondition,
        window: usize,
    ) -> Result<Self, SetupError> {
        let starts = Starts::new(orders, random, window);
        Self::with_starts(orders, starts, initial, window)
    }

    /// Makes buffers for a search from one start: the true plant with a noise model of its residuals.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`]; [`SetupError::TruthOfOtherOrders`] if the true plant is not a model of these
    /// orders.
    pub fn from_truth(
        orders: Orders,
        truth: &KnownModel,
        initial: InitialCondition,
        window: usize,
    ) -> Result<Self, SetupError> {
        let starts = Starts::new(orders, 0, window).with_truth(truth)?;
        Self::with_starts(orders, starts, initial, window)
    }

    /// Chooses what standard errors assume of the prediction errors.
    pub(super) fn set_covariance(&mut self, covariance: Covariance) {
        self.covariance = covariance;
    }

    /// Estimates by one search from a model of these orders.
    pub(super) fn estimate_from(
        &mut self,
        start: &LinearModel,
        window: Window<'_>,
        pass: &mut Pass,
    ) {
        let start: Vec<f64> = start.parameters().collect();
        let found = self.search.run_from(window.u, window.y, &start);
        if let Err(kind) = self.report(window, found, pass) {
            pass.fail_for(kind);
        }
    }

    fn with_starts(
        orders: Orders,
        starts: Starts,
        initial: InitialCondition,
        window: usize,
    ) -> Result<Self, SetupError> {
        let (initial, state) = match initial {
            InitialCondition::Zero => (0, None),
            InitialCondition::Estimate => {
                let state = StateEstimate::new(orders.order(), StartState::Estimate);
                (initial_numbers(orders), Some(state))
            }
        };
        let fitted = orders.parameters() + initial;
        if window <= fitted {
            return Err(SetupError::ShortRecord {
                orders,
                window,
                rows: window,
                needed: fitted + 1,
            });
        }
        Ok(Self {
            search: Search::new(starts, Descent::new(orders, initial, window), window),
            model: LinearModel::zero(orders),
            covariance: Covariance::White,
            state,
        })
    }

    /// Fills the pass from the result of the search.
    fn report(
        &mut self,
        window: Window<'_>,
        found: Found,
        pass: &mut Pass,
    ) -> Result<(), FailureKind> {
        let Window { u, y, .. } = window;
        pass.iterations = Some(found.iterations);
        let theta = self.search.theta();
        let (n, d) = (y.len() as f64, theta.len() as f64);
        let parameters = self.model.orders().parameters();
        self.model.set_parameters(&theta[..parameters]);
        let variance = found.sum / (n - d);
        self.model.noise_variance = variance;
        self.model.covariance.clear();
        let mut condition = f64::NAN;
        match found.failure {
            None => {
                let descent = &mut self.search.descent;
                condition = descent.condition(u, y, &self.search.theta)?;
                descent.covariance(self.covariance, variance, &mut self.model.covariance);
                pass.minima = Some(self.search.minima());
            }
            Some(kind) if !kind.leaves_a_model() => return Err(kind),
            Some(_) => {}
        }
        pass.loss = found.sum / n;
        pass.set_model(&self.model, condition)?;
        match &mut self.state {
            None => pass.start_at_zero(),
            Some(state) => state.estimate(window, 0, pass),
        }
        found.failure.map_or(Ok(()), Err)
    }
}

impl Estimator for PredictionError {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        let Some(pass) = passes.first_mut() else {
            return;
        };
        let found = self.search.run(window.u, window.y);
        if let Err(kind) = self.report(window, found, pass) {
            pass.fail_for(kind);
        }
    }
}

#[cfg(test)]
mod tests;
