//! The method of weighted null-space fitting.
//!
//! Source: M. Galrinho, C. R. Rojas, H. Hjalmarsson, "Parametric identification using weighted null-space fitting",
//! IEEE Trans. Automatic Control 64 (2019), 2798-2813.

use super::output_error_iteration::output_error;
use crate::estimator::covariance::Covariance;
use crate::estimator::initial_state_choice::StateEstimate;
use crate::estimator::lag_sums::check_squares;
use crate::estimator::method_kind::{MethodKind, Problem, options};
use crate::estimator::null_space::{NullSpaceFit, reflect};
use crate::estimator::numerator::fit_numerator;
use crate::estimator::offset::{Levels, OffsetChoice};
use crate::estimator::option_error::OptionError;
use crate::estimator::prediction_error::{Beside, Descent, InitialCondition};
use crate::estimator::regression::covariance_of_triangle;
use crate::estimator::solver::rank::{check_rank_of_columns, condition_of_triangle};
use crate::estimator::{Estimator, FailureKind, Pass, Runs, SetupError, SinglePass, Window, enough_equations};
use crate::model::{LinearModel, Orders, Units};

/// The relative change of the sum of squares at which the iteration has converged.
const REST: f64 = 1e-12;

/// The largest number of weighted solutions.
const MOST_ITERATIONS: usize = 1000;

options! {
    /// The options of `wnsf`, `A y = B u + C e` or `y = B/F u + C/D e`.
    pub struct WnsfOptions {
        /// Orders of `oe` (nb, nf), `armax` (na, nb, nc) or `bj` (nb, nc, nd, nf) and the delay nk; by default nb = nf
        /// = the setting `order`, nk = 1.
        pub orders: Option<Orders>,
        /// Order of the high-order model; without it, three are tried: that by AIC, twice it, and the largest: 50 or
        /// N/6; of an output-error model 150, doubled up to N/4 until it holds the response.
        pub high_order: Option<usize>,
        /// The largest number of weighted solutions for each of them.
        pub iterations: usize = 20,
        /// The signals before the record: zero, or estimate, which fits their effect on the prediction errors.
        pub initial: InitialCondition,
        /// A constant mu of the output, `A (y - mu) = B/F u + C/D e`: none, or estimate, together with the
        /// parameters.
        pub offset: OffsetChoice,
    }
}

impl MethodKind for WnsfOptions {
    fn check(&self) -> Result<(), OptionError> {
        if let Some(orders) = self.orders {
            let Orders { na, nb, nc, nd, nf, .. } = orders;
            let armax = na > 0 && nf + nd == 0 && nc > 0;
            let fits = armax || na == 0 && nf > 0;
            if !fits || nb == 0 {
                let message = "expected an nb of at least 1, and na with nc, or nf with perhaps nc, nd";
                return Err(OptionError::new("orders", message));
            }
        }
        if self.high_order == Some(0) {
            return Err(OptionError::new("high_order", "0; expected at least 1"));
        }
        if !(1..=MOST_ITERATIONS).contains(&self.iterations) {
            let message = format!("{}; expected 1 to {MOST_ITERATIONS}", self.iterations);
            return Err(OptionError::new("iterations", message));
        }
        Ok(())
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        Some(output_error(self.orders, setting))
    }

    fn begins_at_rest(&self) -> bool {
        self.initial == InitialCondition::Zero
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let orders = self.model_orders(problem.shape.order).unwrap_or_default();
        let method = NullSpace::new(orders, self.clone(), problem.shape.window)?;
        Ok(Box::new(method))
    }
}

/// Weighted solutions from each high-order model; the one with the lowest sum of squared prediction errors is taken.
/// The covariance is that of the last weighted least squares, `s^2 (Q'W Q)^-1`, `s^2 = N V / (N - parameters)`.
///
/// Where the start or an offset is fitted too, both have their least squares at each solution, in which the errors are
/// linear, and the covariance is the joint one by the errors' gradient.
pub struct NullSpace {
    options: WnsfOptions,
    fit: NullSpaceFit,
    /// The least squares of the start and the offset, if they are fitted.
    of_record: Option<Descent>,
    levels: Option<Levels>,
    state: StateEstimate,
    /// The lowest sum of squares so far.
    least: f64,
    best: LinearModel,
    /// The lowest sum of squares of a reflected solution, which is taken if none was stable.
    least_reflected: f64,
    reflected: LinearModel,
    condition: f64,
    /// The number of weighted solutions.
    taken: usize,
    parameters: usize,
}

impl NullSpace {
    /// Makes buffers for windows of `window` samples.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`] if the record is too short for the high-order model.
    pub fn new(orders: Orders, options: WnsfOptions, window: usize) -> Result<Self, SetupError> {
        let beside = Beside::new(options.initial, options.offset);
        let mut fit = NullSpaceFit::new(orders, options.high_order, window).follow_the_record();
        let mut needed = fit.samples_needed();
        if beside != Beside::default() {
            fit = fit.of_equations(beside.equations());
            needed += fit.memory() + beside.of(orders).count();
        }
        enough_equations(orders, window, window, needed)?;
        Ok(Self {
            of_record: (beside != Beside::default())
                .then(|| Descent::new(orders, beside.of(orders), Runs::new(&[window]))),
            levels: beside.levels(),
            state: StateEstimate::new(orders.order(), beside.initial.into()),
            options,
            fit,
            least: f64::INFINITY,
            best: LinearModel::zero(orders),
            least_reflected: f64::INFINITY,
            reflected: LinearModel::zero(orders),
            condition: f64::NAN,
            taken: 0,
            parameters: orders.parameters(),
        })
    }

    /// Runs the iteration from each high-order model.
    ///
    /// # Errors
    /// [`FailureKind::IterationLimit`] if no solution was stable: the model is a reflected one, without covariance.
    /// [`FailureKind::RankDeficient`] if a high-order model of no order has a solution; [`FailureKind::NonFinite`].
    fn find(&mut self, u: &[f64], y: &[f64]) -> Result<(), FailureKind> {
        self.taken = 0;
        check_squares([u, y])?;
        let orders = self.fit.begin(u, y);
        let mut failed = FailureKind::RankDeficient;
        (self.least, self.least_reflected) = (f64::INFINITY, f64::INFINITY);
        for (i, order) in orders.into_iter().enumerate() {
            if orders[..i].contains(&order) || !self.fit.start(order) {
                continue;
            }
            let mut before = f64::INFINITY;
            for _ in 0..self.options.iterations {
                if !self.fit.refine() {
                    break;
                }
                self.taken += 1;
                if !self.fit.is_stable() {
                    failed = FailureKind::UnstablePredictor;
                    self.keep_reflected(u, y);
                    continue;
                }
                let [sum, variance] = self.sum(u, y);
                if sum < self.least {
                    self.least = sum;
                    self.take(variance)?;
                }
                if (sum - before).abs() <= REST * sum {
                    break;
                }
                before = sum;
            }
        }
        if self.least.is_finite() {
            Ok(())
        } else if self.least_reflected.is_finite() {
            Err(FailureKind::IterationLimit)
        } else {
            Err(failed)
        }
    }

    /// While no solution was stable: keeps the present one with C and F reflected and B fitted to them, if its sum of
    /// squares is the lowest of such.
    fn keep_reflected(&mut self, u: &[f64], y: &[f64]) {
        if self.least.is_finite() {
            return;
        }
        let model = &mut self.reflected;
        model.assign(&self.fit.model);
        if !reflect(model, &mut Vec::new()) || fit_numerator(model, u, y).is_err() {
            return;
        }
        std::mem::swap(&mut self.reflected, &mut self.fit.model);
        let [sum, variance] = self.sum(u, y);
        std::mem::swap(&mut self.reflected, &mut self.fit.model);
        if sum < self.least_reflected {
            self.least_reflected = sum;
            self.best.assign(&self.reflected);
            self.best.noise_variance = variance;
            self.best.covariance.clear();
        }
    }

    /// Returns the sum of squared prediction errors of the present model, and over the degrees of freedom; infinite if
    /// there is none.
    fn sum(&mut self, u: &[f64], y: &[f64]) -> [f64; 2] {
        let mut fitted = self.parameters;
        let sum = if let Some(of_record) = &mut self.of_record {
            fitted = of_record.theta().len();
            let sum = of_record.concentrate(u, y, self.fit.model.parameters());
            sum.unwrap_or(f64::INFINITY)
        } else {
            let mut e = vec![0.0; y.len()];
            self.fit.model.residuals(u, y, &mut e, &mut vec![0.0; y.len()]);
            e.iter().map(|e| e * e).sum()
        };
        [sum, sum / (y.len() - fitted) as f64]
    }

    /// Takes the joint covariance of the parameters, the start and the offset, if these are fitted, which it returns.
    fn conclude(&mut self, u: &[f64], y: &[f64]) -> Result<Vec<f64>, FailureKind> {
        let (Some(of_record), model) = (&mut self.of_record, &mut self.best) else {
            return Ok(Vec::new());
        };
        let sum = of_record.concentrate(u, y, model.parameters());
        sum.ok_or(FailureKind::UnstablePredictor)?;
        let mut theta = of_record.theta().to_vec();
        if !model.covariance.is_empty() {
            self.condition = of_record.condition(u, y, &theta)?;
            let covariance = &mut model.covariance;
            of_record.covariance(Covariance::White, model.noise_variance, covariance);
        }
        Ok(theta.split_off(self.parameters))
    }

    /// Takes the present model with its covariance.
    fn take(&mut self, variance: f64) -> Result<(), FailureKind> {
        let r = self.fit.r();
        self.condition = condition_of_triangle(r)?;
        check_rank_of_columns(self.condition, self.parameters)?;
        self.best.assign(&self.fit.model);
        self.best.noise_variance = variance;
        covariance_of_triangle(r, variance, &mut vec![0.0; self.parameters], &mut self.best.covariance);
        Ok(())
    }
}

impl SinglePass for NullSpace {
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        let mut levels = self.levels.take();
        let seen = match &mut levels {
            Some(levels) => levels.subtract(window, &Runs::new(&[window.len()])),
            None => window,
        };
        let found = self.find(seen.u, seen.y);
        pass.iterations = Some(self.taken);
        let of_records = match found {
            Err(kind) if !kind.leaves_a_model() => Err(kind),
            _ => self.conclude(seen.u, seen.y),
        };
        let offsets = match (&levels, &of_records) {
            (Some(levels), Ok(of)) => levels.offsets(&mut self.best, &of[..1], Units::ONE),
            _ => Ok(Vec::new()),
        };
        self.levels = levels;
        pass.start_numbers = of_records?.len();
        pass.offsets = offsets?;
        let (sum, condition) = match found {
            Ok(()) => (self.least, self.condition),
            Err(_) => (self.least_reflected, f64::NAN),
        };
        pass.loss = sum / window.len() as f64;
        let is_cut = found.is_ok() && self.fit.is_cut();
        if is_cut {
            self.best.covariance.clear();
            pass.offsets.iter_mut().for_each(|mu| mu.se = f64::NAN);
        }
        pass.set_model(&self.best, condition)?;
        let y = pass.less_offset(0, window.y);
        self.state.estimate(Window { y: &y, ..window }, 0, pass);
        if is_cut {
            return Err(FailureKind::Implausible);
        }
        found
    }
}

#[cfg(all(test, feature = "json"))]
mod tests;
