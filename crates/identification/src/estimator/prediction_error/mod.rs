//! Prediction error methods: `theta = argmin sum e(k)^2`, `e = D/C (A y - B/F u)`, all signals zero before the record.
//!
//! The start of a record and a constant of its output, less which it counts then, may be parameters too ([`Beside`]).
//!
//! Levenberg-Marquardt steps with the exact gradient, computed by filtering (Ljung, *System Identification*, 2nd ed.,
//! section 10.3). The search covers models with a stable predictor (zeros of C and F inside the unit circle) and begins
//! at several starts.

mod descent;
mod draws;
mod gradient;
mod instrumental;
pub(in crate::estimator) mod kernels;
mod predictor;
mod search;
mod search_starts;
mod starts;
mod units;

use super::covariance::Covariance;
use super::initial_state_choice::{StartState, StateEstimate};
use super::known_model::KnownModel;
use super::null_space::Equations;
use super::offset::{Levels, OffsetChoice};
use super::{Estimator, FailureKind, Pass, Runs, SetupError, Window, enough_equations};
use crate::model::{LinearModel, Orders};
use crate::names::named_enum;
use descent::Found;
pub(in crate::estimator) use descent::{Descent, solve_positive};
pub(crate) use gradient::PredictionGradient;
pub(in crate::estimator) use predictor::OfRecord;
pub use predictor::initial_numbers;
use search::Search;
pub use search_starts::SearchStarts;
use starts::Starts;
use std::ops::Range;
use units::Rescaled;

named_enum! {
    /// The assumption about the signals before the record in prediction error methods.
    InitialCondition, "initial condition" {
        /// Zero (the default).
        Zero = "zero",
        /// Their contribution to the prediction errors is fitted together with the parameters.
        Estimate = "estimate",
    }
}

impl From<InitialCondition> for StartState {
    /// Where the start is fitted, x0 is that of the model found.
    fn from(initial: InitialCondition) -> Self {
        match initial {
            InitialCondition::Zero => Self::Zero,
            InitialCondition::Estimate => Self::Estimate,
        }
    }
}

/// The parameters of a record beside those of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Beside {
    /// The parameters of its start.
    pub initial: InitialCondition,
    /// The constant of its output.
    pub offset: OffsetChoice,
}

impl From<InitialCondition> for Beside {
    fn from(initial: InitialCondition) -> Self {
        Self::new(initial, OffsetChoice::None)
    }
}

impl Beside {
    pub(super) const fn new(initial: InitialCondition, offset: OffsetChoice) -> Self {
        Self { initial, offset }
    }

    pub(super) fn of(self, orders: Orders) -> OfRecord {
        OfRecord {
            offset: self.offset == OffsetChoice::Estimate,
            initial: match self.initial {
                InitialCondition::Zero => 0,
                InitialCondition::Estimate => initial_numbers(orders),
            },
        }
    }

    /// The equations of a high-order model that know them.
    pub(super) fn equations(self) -> Equations {
        match (self.offset, self.initial) {
            (OffsetChoice::Estimate, _) => Equations::WithConstant,
            (OffsetChoice::None, InitialCondition::Estimate) => Equations::Complete,
            (OffsetChoice::None, InitialCondition::Zero) => Equations::Prewindow,
        }
    }

    /// How many they are, of one record.
    pub(super) fn count(self, orders: Orders) -> usize {
        self.of(orders).count()
    }

    /// The levels about which a search sees the records, if they have an offset.
    pub(super) fn levels(self) -> Option<Levels> {
        let of_input = self.initial == InitialCondition::Estimate;
        (self.offset == OffsetChoice::Estimate).then(|| Levels::new(of_input))
    }
}

/// Takes the lowest minimum of the search. For white errors the covariance is `s^2 (psi'psi)^-1`,
/// `s^2 = N V / (N - parameters)`.
///
/// If no search ends at a minimum, the best model is returned with [`FailureKind::Boundary`] or
/// [`FailureKind::IterationLimit`], without covariance.
pub struct PredictionError {
    search: Search,
    rescaled: Rescaled,
    model: LinearModel,
    covariance: Covariance,
    /// Another method, whose model is a start.
    other: Option<(Box<dyn Estimator>, Pass)>,
    /// Whether that is asked only where the search ends at no minimum.
    other_is_refuge: bool,
    /// The result of the last search.
    found: Option<Found>,
    /// Estimates x0 of the first record if the signals before it are not taken as zero.
    state: Option<StateEstimate>,
    first: Range<usize>,
    /// The records, and the levels about which the search sees them if each has an offset.
    runs: Runs,
    levels: Option<Levels>,
}

impl PredictionError {
    /// Makes buffers for windows of `window` samples.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`].
    pub fn new(orders: Orders, random: usize, beside: impl Into<Beside>, window: usize) -> Result<Self, SetupError> {
        Self::of_runs(orders, random, beside.into(), Runs::new(&[window]))
    }

    /// Makes buffers for several records, one after the other in a window. Each has an own start and an own offset.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`].
    pub(super) fn of_runs(orders: Orders, random: usize, beside: Beside, runs: Runs) -> Result<Self, SetupError> {
        let starts = Starts::new(orders, random, runs.samples());
        Self::with_starts(orders, starts, beside, runs)
    }

    /// Makes buffers for a search from one start: the true plant with a noise model of its residuals.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`]; [`SetupError::TruthOfOtherOrders`] if the true plant is not a model of these
    /// orders.
    pub fn from_truth(orders: Orders, truth: &KnownModel, beside: Beside, window: usize) -> Result<Self, SetupError> {
        let starts = Starts::new(orders, 0, window).with_truth(truth)?;
        Self::with_starts(orders, starts, beside, Runs::new(&[window]))
    }

    /// Chooses what standard errors assume of the prediction errors.
    pub(super) fn set_covariance(&mut self, covariance: Covariance) {
        self.covariance = covariance;
    }

    /// Searches from the model of another method of these orders too; `as_refuge` only where the search ends at no
    /// minimum.
    pub(super) fn set_other(&mut self, other: Box<dyn Estimator>, as_refuge: bool) {
        self.other = Some((other, Pass::new(self.model.orders().order())));
        self.other_is_refuge = as_refuge;
    }

    /// Estimates by searches from a model of these orders too.
    pub(super) fn estimate_with(&mut self, start: Option<&LinearModel>, window: Window<'_>, pass: &mut Pass) {
        self.found = None;
        let seen = match &mut self.levels {
            Some(levels) => levels.subtract(window, &self.runs),
            None => window,
        };
        if let Err(kind) = self.rescaled.take(seen.u, seen.y) {
            return pass.fail_for(kind);
        }
        let gain = self.rescaled.units().gain();
        let rescaled = |model: &LinearModel| {
            let mut theta: Vec<f64> = model.parameters().collect();
            let of_input = of_input(model.orders());
            theta[of_input].iter_mut().for_each(|b| *b /= gain);
            theta
        };
        let mut of_other = || {
            let (other, pass) = self.other.as_mut()?;
            pass.clear();
            other.estimate(seen, std::slice::from_mut(pass));
            pass.failure.is_none().then(|| rescaled(&pass.model))
        };
        let is_refuge = self.other_is_refuge;
        let mut given = Vec::from_iter(start.map(rescaled));
        let (u, y) = self.rescaled.record();
        let other = || if is_refuge { None } else { of_other() };
        let mut found = self.search.run(u, y, gain, &given, other);
        if found.failure.is_some()
            && is_refuge
            && let Some(theta) = of_other()
        {
            given.push(theta);
            let before = found.iterations;
            found = self.search.run(u, y, gain, &given, || None);
            found.iterations += before;
        }
        self.found = Some(found);
        if let Err(kind) = self.report(window, found, pass) {
            pass.fail_for(kind);
        }
    }

    fn with_starts(orders: Orders, starts: Starts, beside: Beside, runs: Runs) -> Result<Self, SetupError> {
        let window = runs.samples();
        let state = || StateEstimate::new(orders.order(), StartState::Estimate);
        let of_record = beside.of(orders);
        let fitted = orders.parameters() + of_record.count() * runs.count();
        enough_equations(orders, window, window, fitted + 1)?;
        Ok(Self {
            first: runs.first(orders.order()),
            search: Search::new(starts, Descent::new(orders, of_record, runs.clone()), window),
            levels: beside.levels(),
            runs,
            rescaled: Rescaled::new(window),
            model: LinearModel::zero(orders),
            covariance: Covariance::White,
            other: None,
            other_is_refuge: false,
            found: None,
            state: (beside.initial == InitialCondition::Estimate).then(state),
        })
    }

    /// Fills the pass from the result of the search.
    fn report(&mut self, window: Window<'_>, found: Found, pass: &mut Pass) -> Result<(), FailureKind> {
        let (u, y) = self.rescaled.record();
        pass.iterations = Some(found.iterations);
        let theta = self.search.theta();
        let (n, d) = (y.len() as f64, theta.len() as f64);
        let orders = self.model.orders();
        let parameters = orders.parameters();
        let of_records = parameters..theta.len();
        self.model.set_parameters(&theta[..parameters]);
        let variance = found.sum / (n - d);
        self.model.noise_variance = variance;
        self.model.covariance.clear();
        let mut condition = f64::NAN;
        match found.failure {
            None => {
                let descent = &mut self.search.descent;
                condition = descent.condition(u, y, &self.search.theta)?;
                let covariance = &mut self.model.covariance;
                descent.covariance(self.covariance, variance, covariance);
                pass.minima = Some(self.search.minima());
            }
            Some(kind) if !kind.leaves_a_model() => return Err(kind),
            Some(_) => {}
        }
        pass.loss = found.sum / n;
        pass.start_numbers = of_records.len();
        let units = self.rescaled.units();
        pass.offsets.clear();
        if let Some(levels) = &self.levels {
            let offsets = &self.search.theta[of_records][..self.runs.count()];
            pass.offsets = levels.offsets(&mut self.model, offsets, units)?;
        }
        pass.set_model(&self.model, condition)?;
        pass.set_units(units)?;
        match &mut self.state {
            None => pass.start_at_zero(),
            Some(state) => {
                let first = self.runs.iter().position(|run| *run == self.first);
                let part = window.part(self.first.clone());
                let y = pass.less_offset(first.unwrap_or(0), part.y);
                state.estimate(Window { y: &y, ..part }, 0, pass);
            }
        }
        found.failure.map_or(Ok(()), Err)
    }
}

/// Where B stands among the parameters of a model.
fn of_input(orders: Orders) -> std::ops::Range<usize> {
    orders.na..orders.na + orders.nb
}

impl Estimator for PredictionError {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        if let Some(pass) = passes.first_mut() {
            self.estimate_with(None, window, pass);
        }
    }

    /// The search does not depend on the covariance.
    fn estimate_again(&mut self, covariance: Covariance, window: Window<'_>, _: &[Pass], passes: &mut [Pass]) -> bool {
        let (Some(found), Some(pass)) = (self.found, passes.first_mut()) else {
            return false;
        };
        let own = std::mem::replace(&mut self.covariance, covariance);
        if let Err(kind) = self.report(window, found, pass) {
            pass.fail_for(kind);
        }
        self.covariance = own;
        true
    }
}

#[cfg(test)]
mod tests;
