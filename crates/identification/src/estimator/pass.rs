//! The result of one pass of an estimator: the model, or the failure that stopped it.

use super::parameters;
use crate::data::DrawFailure;
use crate::failure::{FailureKind, all_finite};
use crate::model::polynomial::multiply_into;
use crate::model::{ContinuousModel, LinearModel, Orders, Units, multiply};
use crate::observer::ObservedModel;
use crate::plant::canonical::reverse_negated;
use crate::plant::stability::is_stable;
use std::borrow::Cow;

/// The stage of the paper's algorithm in which something failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Stage {
    /// Stage 1: the record could not be drawn.
    Data = 1,
    /// Stage 3: p of iteration 0.
    LeastSquares = 3,
    /// Stage 6: the initial state.
    InitialState = 6,
    /// Stage 7: the auxiliary model's output.
    AuxiliaryModel = 7,
    /// Stage 10: p of an IV pass, or of a later step of another method.
    Instruments = 10,
    /// Stage 12: the observer.
    Observer = 12,
    /// A step of a method that does not have the paper's stages.
    Other = 0,
}

/// A numerical failure, which is data: it is recorded and counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Failure {
    /// The kind of failure.
    pub kind: FailureKind,
    /// The stage of the algorithm in which it occurred.
    pub stage: Stage,
    /// The pass in which it occurred. Later passes have nothing to start from and carry the same failure.
    pub pass: usize,
}

impl From<FailureKind> for Failure {
    /// Makes the failure of a method with one pass.
    fn from(kind: FailureKind) -> Self {
        Self {
            kind,
            stage: Stage::LeastSquares,
            pass: 0,
        }
    }
}

impl From<DrawFailure> for Failure {
    /// Makes the failure of every pass of a trial without a record.
    fn from(failure: DrawFailure) -> Self {
        Self {
            kind: failure.into(),
            stage: Stage::Data,
            pass: 0,
        }
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.stage {
            Stage::Other => write!(f, "{}", self.kind),
            stage => write!(f, "{} (stage {}, pass {})", self.kind, stage as usize, self.pass),
        }
    }
}

/// The constant mu of the output in `A (y - mu) = B/F u + C/D e`, in y's unit.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Offset {
    /// mu.
    pub value: f64,
    /// Its standard error; NaN without a covariance.
    pub se: f64,
}

/// How much of a pass is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Progress {
    /// Nothing is known: no number of this pass may be used.
    #[default]
    Nothing,
    /// a, b and h are known.
    Parameters,
    /// x0 is known too.
    InitialState,
}

/// One pass of an estimator on one window. It holds the model, and the part of it that u drives in the paper's form
/// `x(k+1) = A x(k) + b u(k)`, `y(k) = x_1(k) + d u(k)` of order n = [`Orders::order`].
#[derive(Clone, Debug)]
pub struct Pass {
    /// The model.
    pub model: LinearModel,
    /// The model in continuous time of which `model` is the sampled one, if the estimator has one.
    pub continuous: ContinuousModel,
    /// The mean squared prediction error over the window; NaN if the estimator does not report it.
    pub loss: f64,
    /// How many numbers of the records were fitted together with the model's parameters: of their starts, and offsets.
    pub start_numbers: usize,
    /// The constant of y in each record, if it was estimated: the model, x0 and the loss are of y less it.
    pub offsets: Vec<Offset>,
    /// The number of iterations of an iterative estimator.
    pub iterations: Option<usize>,
    /// The variances of the noises of y and u, if the estimator has them.
    pub noise_variances: Option<[f64; 2]>,
    /// The number of distinct minima that a search from several starts found.
    pub minima: Option<usize>,
    /// Singular values of a subspace method, which indicate an order; empty for others.
    pub singular_values: Vec<f64>,
    /// Canonical correlations of past and future of a subspace method, which indicate an order; empty for others.
    pub correlations: Vec<f64>,
    /// Last row of A-hat, n numbers.
    pub a: Vec<f64>,
    /// b-hat, n numbers.
    pub b: Vec<f64>,
    /// Numerator h-hat, n numbers: `B - d A` beyond its first coefficient.
    pub h: Vec<f64>,
    /// The direct term d; 0 if nk > 0.
    pub direct: f64,
    /// x0-hat, n numbers.
    pub x0: Vec<f64>,
    /// Condition number of the solve ([`super::solver::Solution::condition`]). NaN if the solve failed: the condition
    /// of a singular matrix after rounding depends on the order of operations.
    pub condition: f64,
    /// Whether A-hat has a pole on or outside the unit circle.
    pub unstable: bool,
    /// How much of the above is valid.
    pub progress: Progress,
    /// Why the pass has no more results.
    pub failure: Option<Failure>,
    /// Scratch for the stability test and for products.
    scratch: Vec<f64>,
}

impl Pass {
    /// Makes buffers for order n.
    pub fn new(order: usize) -> Self {
        let vector = || vec![f64::NAN; order];
        Self {
            model: LinearModel::zero(Orders::arx(order, order, 1)),
            continuous: ContinuousModel::default(),
            loss: f64::NAN,
            start_numbers: 0,
            offsets: Vec::new(),
            iterations: None,
            noise_variances: None,
            minima: None,
            singular_values: Vec::new(),
            correlations: Vec::new(),
            direct: 0.0,
            a: vector(),
            b: vector(),
            h: vector(),
            x0: vector(),
            condition: f64::NAN,
            unstable: false,
            progress: Progress::Nothing,
            failure: None,
            scratch: vector(),
        }
    }

    /// The number of parameters that were fitted, those of the record's start and offset too: what criteria of orders
    /// count.
    pub fn fitted_numbers(&self) -> usize {
        self.model.orders().parameters() + self.start_numbers
    }

    /// Returns y of the i-th of the records that were fitted less its offset, of which the model is; y itself if none
    /// was estimated.
    pub fn less_offset<'a>(&self, i: usize, y: &'a [f64]) -> Cow<'a, [f64]> {
        match self.offsets.get(i) {
            None => y.into(),
            Some(Offset { value, .. }) => y.iter().map(|y| y - value).collect(),
        }
    }

    /// Clears all results.
    pub fn clear(&mut self) {
        for vector in [&mut self.a, &mut self.b, &mut self.h, &mut self.x0] {
            vector.fill(f64::NAN);
        }
        self.model.noise_variance = f64::NAN;
        self.model.covariance.clear();
        self.continuous.numerator.clear();
        self.loss = f64::NAN;
        self.start_numbers = 0;
        self.offsets.clear();
        self.iterations = None;
        self.noise_variances = None;
        self.minima = None;
        self.singular_values.clear();
        self.correlations.clear();
        self.direct = 0.0;
        self.condition = f64::NAN;
        self.unstable = false;
        self.progress = Progress::Nothing;
        self.failure = None;
    }

    /// Takes over all results of another pass, reusing the buffers.
    pub fn assign(&mut self, other: &Self) {
        let Self {
            model,
            continuous,
            loss,
            start_numbers,
            offsets,
            iterations,
            noise_variances,
            minima,
            singular_values,
            correlations,
            a,
            b,
            h,
            direct,
            x0,
            condition,
            unstable,
            progress,
            failure,
            scratch,
        } = other;
        self.model.assign(model);
        self.continuous.clone_from(continuous);
        self.loss = *loss;
        self.start_numbers = *start_numbers;
        self.offsets.clone_from(offsets);
        self.iterations = *iterations;
        self.noise_variances = *noise_variances;
        self.minima = *minima;
        self.singular_values.clone_from(singular_values);
        self.correlations.clone_from(correlations);
        self.a.clone_from(a);
        self.b.clone_from(b);
        self.h.clone_from(h);
        self.direct = *direct;
        self.x0.clone_from(x0);
        self.condition = *condition;
        self.unstable = *unstable;
        self.progress = *progress;
        self.failure = *failure;
        self.scratch.clone_from(scratch);
    }

    /// Sets the model `A = 1 + alpha_1 q^-1 + ...`, `B = beta_1 q^-1 + ...` from `p = (alpha, beta)`, with a, b and h
    /// (stages 4 and 5), and tests stability.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if a coefficient is not finite; [`Pass::progress`] is then unchanged.
    ///
    /// # Panics
    /// If `p` is not of length 2n.
    pub fn set_parameters(&mut self, p: &[f64], condition: f64) -> Result<(), FailureKind> {
        let (alpha, beta) = p.split_at(self.a.len());
        self.model.a[1..].copy_from_slice(alpha);
        self.model.b[1..].copy_from_slice(beta);
        parameters::from_p(p, &mut self.a, &mut self.h);
        parameters::input_vector(&self.a, &self.h, &mut self.b);
        all_finite(p.iter().chain(&self.b))?;
        self.take_parameters(condition);
        Ok(())
    }

    /// Takes a model of any orders. The part that u drives becomes (a, b, h, d), reusing the buffers.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] as for [`Self::set_parameters`].
    pub fn set_model(&mut self, model: &LinearModel, condition: f64) -> Result<(), FailureKind> {
        self.model.assign(model);
        let n = model.orders().order();
        for vector in [&mut self.a, &mut self.b, &mut self.h, &mut self.x0] {
            vector.resize(n, f64::NAN);
        }
        multiply_into(&model.a, &model.f, &mut self.scratch);
        self.scratch.resize(n + 1, 0.0);
        let denominator = &self.scratch[1..];
        reverse_negated(denominator, &mut self.a);
        let coefficient = |i: usize| model.b.get(i).copied().unwrap_or(0.0);
        self.direct = coefficient(0);
        for (i, (h, alpha)) in self.h.iter_mut().zip(denominator).enumerate() {
            *h = coefficient(i + 1);
            if self.direct != 0.0 {
                *h -= self.direct * alpha;
            }
        }
        parameters::input_vector(&self.a, &self.h, &mut self.b);
        all_finite([&self.a, &self.b, &self.h].into_iter().flatten())?;
        self.scratch.truncate(n);
        self.take_parameters(condition);
        Ok(())
    }

    fn take_parameters(&mut self, condition: f64) {
        self.condition = condition;
        self.unstable = !is_stable(&self.a, &mut self.scratch);
        self.progress = Progress::Parameters;
    }

    /// Returns what the observer needs of the pass; `None` if x0 is not known or if u acts on y without delay.
    pub fn observed(&self) -> Option<ObservedModel<'_>> {
        (self.progress == Progress::InitialState && self.direct == 0.0).then_some(ObservedModel {
            a: &self.a,
            b: &self.b,
            x0: &self.x0,
        })
    }

    /// Sets x0.
    ///
    /// # Panics
    /// If `x0` is not of length n.
    pub fn set_initial_state(&mut self, x0: &[f64]) {
        self.x0.copy_from_slice(x0);
        self.progress = Progress::InitialState;
    }

    /// Sets x0 = 0, for methods that take all signals before the record as zero.
    pub fn start_at_zero(&mut self) {
        self.x0.fill(0.0);
        self.progress = Progress::InitialState;
    }

    /// Takes the results, which are of samples in these units, powers of two, for those of the samples themselves.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if a number leaves the range of doubles; then nothing is known any more.
    pub fn set_units(&mut self, units: Units) -> Result<(), FailureKind> {
        let mut lost = !self.model.covariance.iter().all(|p| p.is_finite());
        if units == Units::ONE && !lost {
            return Ok(());
        }
        self.model.set_units(units, &mut lost);
        self.continuous.set_units(units, &mut lost);
        let of_input = self.b.iter_mut().chain(&mut self.h);
        for number in of_input.chain([&mut self.direct]) {
            multiply(number, units.gain(), &mut lost);
        }
        let states = self.x0.iter_mut().chain(&mut self.singular_values);
        let of_offsets = self.offsets.iter_mut();
        let states = states.chain(of_offsets.flat_map(|Offset { value, se }| [value, se]));
        for number in states.chain([&mut self.loss]) {
            multiply(number, units.output, &mut lost);
        }
        multiply(&mut self.loss, units.output, &mut lost);
        if let Some(variances) = &mut self.noise_variances {
            for (variance, unit) in variances.iter_mut().zip([units.output, units.input]) {
                multiply(variance, unit, &mut lost);
                multiply(variance, unit, &mut lost);
            }
        }
        if lost {
            self.progress = Progress::Nothing;
            return Err(FailureKind::NonFinite);
        }
        Ok(())
    }

    /// Records a failure; results known so far stay valid.
    pub fn fail(&mut self, failure: Failure) {
        self.failure = Some(failure);
    }

    /// Records the failure of pass number `pass` in a stage.
    pub(super) fn fail_at(&mut self, stage: Stage, pass: usize, kind: FailureKind) {
        self.fail(Failure { kind, stage, pass });
    }

    /// Records the failure of a method that does not have the paper's stages.
    pub(super) fn fail_for(&mut self, kind: FailureKind) {
        self.fail_at(Stage::Other, 0, kind);
    }
}
