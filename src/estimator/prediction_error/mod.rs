//! Prediction error methods: `theta = argmin sum e(k)^2`, `e = D/C (A y - B/F u)`, all signals zero before the record.
//!
//! Levenberg-Marquardt steps with the exact gradient, computed by filtering (Ljung, *System Identification*, 2nd ed.,
//! section 10.3). The search covers models with a stable predictor (zeros of C and F inside the unit circle) and begins
//! at several starts.

mod descent;
mod starts;

use super::covariance::Covariance;
use super::known::KnownModel;
use super::least_squares::{StartState, StateEstimate};
use super::method::{MethodKind, Needs, OptionError, Problem};
use super::{Estimator, Failure, Pass, SetupError, Stage, Window};
use crate::model::{LinearModel, Orders};
use crate::names::named_enum;
pub(super) use descent::Descent;
use descent::{Found, initial_numbers};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
pub use starts::SearchStarts;
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

/// The relative step at which the search from each start ends, and at which the final search from the best ends.
const NEAR: f64 = 1e-4;
const REST: f64 = 1e-12;

/// Losses that agree to this relative accuracy at the end of searches belong to the same minimum.
const SAME: f64 = 1e-6;

/// Defines the options of a structure; all structures have the same.
macro_rules! structure {
    ($options:ident, $doc:literal, $orders_doc:literal, $check:expr, $default:expr) => {
        #[doc = $doc]
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields, default)]
        pub struct $options {
            #[doc = $orders_doc]
            pub orders: Option<Orders>,
            /// Number of random starts, besides those from linear methods; or truth: the true plant alone, which shows
            /// whether errors come from missed minima or from the method.
            pub starts: SearchStarts,
            /// The signals before the record: zero, or estimate, which fits their effect on the prediction errors.
            pub initial: InitialCondition,
            /// What standard errors assume of the prediction errors: white (the default), coloured, robust.
            pub covariance: Option<Covariance>,
        }

        impl Default for $options {
            fn default() -> Self {
                Self {
                    orders: None,
                    starts: SearchStarts::default(),
                    initial: InitialCondition::default(),
                    covariance: None,
                }
            }
        }

        impl $options {
            pub(super) fn orders(&self, order: usize) -> Orders {
                let default: fn(usize) -> Orders = $default;
                self.orders.unwrap_or_else(|| default(order))
            }
        }

        impl MethodKind for $options {
            fn check(&self) -> Result<(), OptionError> {
                let check: fn(Orders) -> Option<&'static str> = $check;
                match self.orders.and_then(check) {
                    Some(message) => Err(OptionError::new("orders", message)),
                    None => Ok(()),
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

            fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
                let orders = self.orders(problem.shape.order);
                let window = problem.shape.window;
                let initial = self.initial;
                let mut method = match self.starts {
                    SearchStarts::Random(count) => {
                        PredictionError::new(orders, count, initial, window)?
                    }
                    SearchStarts::Truth => {
                        let truth = problem.known.ok_or(SetupError::NoKnownPlant)?;
                        PredictionError::from_truth(orders, truth, initial, window)?
                    }
                };
                method.covariance = self.covariance.unwrap_or_default();
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

/// Searches for the minimum from every start and takes the lowest. For white errors the covariance is
/// `s^2 (psi'psi)^-1`, `s^2 = N V / (N - parameters)`.
pub struct PredictionError {
    starts: Starts,
    descent: Descent,
    /// The lowest minimum so far.
    best: Option<Found>,
    theta: Vec<f64>,
    /// Losses of the minima found, each once.
    minima: Vec<f64>,
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
        let starts = Starts::new(orders, random, window)?;
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
        let starts = Starts::new(orders, 0, window)?.with_truth(truth)?;
        Self::with_starts(orders, starts, initial, window)
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
            starts,
            descent: Descent::new(orders, initial, window),
            best: None,
            theta: vec![0.0; fitted],
            minima: Vec::new(),
            model: LinearModel::zero(orders),
            covariance: Covariance::White,
            state,
        })
    }

    /// Searches from each start.
    fn search(&mut self, u: &[f64], y: &[f64]) -> Option<Found> {
        self.best = None;
        self.minima.clear();
        self.starts.begin(u, y);
        let mut failed: Option<Found> = None;
        while let Some(start) = self.starts.next(u, y) {
            let found = self.descent.run(u, y, start, NEAR);
            if found.failure.is_some() {
                failed.get_or_insert(found);
                continue;
            }
            let loss = found.sum;
            let same = |other: &f64| (loss - other).abs() <= SAME * other;
            if !self.minima.iter().any(same) {
                self.minima.push(loss);
            }
            // A later loss that is equal is not better.
            if self.best.is_none_or(|best| loss < best.sum * (1.0 - SAME)) {
                self.best = Some(found);
                self.theta.copy_from_slice(self.descent.theta());
            }
        }
        let Some(best) = self.best else {
            return failed;
        };
        let mut found = self.descent.run(u, y, &self.theta, REST);
        found.iterations += best.iterations;
        self.theta.copy_from_slice(self.descent.theta());
        Some(found)
    }
}

impl Estimator for PredictionError {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        let Some(pass) = passes.first_mut() else {
            return;
        };
        let Window { u, y, .. } = window;
        let stage = Stage::Instruments;
        let fail = |kind| Failure {
            kind,
            stage,
            pass: 0,
        };
        let Some(found) = self.search(u, y) else {
            pass.fail(fail(super::FailureKind::NoConvergence));
            return;
        };
        pass.iterations = Some(found.iterations);
        if let Some(kind) = found.failure {
            pass.fail(fail(kind));
            return;
        }
        let parameters = self.model.orders().parameters();
        self.model.set_parameters(&self.theta[..parameters]);
        let (n, d) = (y.len() as f64, self.theta.len() as f64);
        let variance = found.sum / (n - d);
        self.model.noise_variance = variance;
        let condition = self.descent.condition(u, y, &self.theta);
        let set = condition.and_then(|condition| {
            self.descent
                .covariance(self.covariance, variance, &mut self.model.covariance);
            pass.loss = found.sum / n;
            pass.minima = Some(self.minima.len());
            pass.set_model(&self.model, condition)
        });
        match set {
            Ok(()) => match &mut self.state {
                None => pass.start_at_zero(),
                Some(state) => state.estimate(window, 0, pass),
            },
            Err(kind) => pass.fail(fail(kind)),
        }
    }
}

#[cfg(test)]
mod tests;
