//! Steiglitz-McBride iterations of signals that a high-order ARX model has filtered: `B/F` of a Box-Jenkins process
//! without a model of its noise.
//!
//! Sources: Y. Zhu, H. Hjalmarsson, "The Box-Jenkins Steiglitz-McBride algorithm", Automatica 65 (2016), 170-182;
//! N. Everitt, M. Galrinho, H. Hjalmarsson, "Open-loop asymptotically efficient model reduction with the
//! Steiglitz-McBride method", Automatica 89 (2018), 221-234.

use super::output_error_iteration::{OutputErrorIteration, check_output_error, output_error, output_errors};
use crate::estimator::covariance::Covariance;
use crate::estimator::fixed_point::{Damping, MOST_PASSES, replace};
use crate::estimator::initial_state_choice::StateEstimate;
use crate::estimator::lag_sums::check_squares;
use crate::estimator::method_kind::{MethodKind, Problem, options};
use crate::estimator::noise_fit::REST;
use crate::estimator::null_space::HighOrder;
use crate::estimator::offset::{Levels, OffsetChoice};
use crate::estimator::option_error::OptionError;
use crate::estimator::output_gradient::OutputGradient;
use crate::estimator::prediction_error::{Beside, Descent, InitialCondition};
use crate::estimator::reflection::{Stabilise, stay_stable};
use crate::estimator::regression::covariance_of_triangle;
use crate::estimator::{Estimator, FailureKind, Iteration, Offset, Pass, Runs, SetupError, Window, enough_equations};
use crate::model::polynomial::filter;
use crate::model::{LinearModel, Orders, Units};

/// The output that the iteration fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Output {
    /// The record's, filtered: `A_h y`.
    Measured,
    /// The high-order model's, filtered: `A_h (B_h/A_h) u = B_h u`.
    Simulated,
}

/// Defines the options of a method; both have the same.
macro_rules! filtered_iteration {
    ($options:ident, $doc:literal, $output:expr) => {
        options! {
            #[doc = $doc]
            pub struct $options {
                /// Orders nb, nf and the delay nk, such as nb=2,nf=2,nk=1; by default nb = nf = the setting `order`, nk
                /// = 1.
                pub orders: Option<Orders>,
                /// Order of the high-order model; by default that by AIC, at most 50 and a sixth of the samples.
                pub high_order: Option<usize>,
                /// The treatment of an unstable F: reflect (its zeros into the unit circle, the default), none (the
                /// method fails).
                pub stabilise: Option<Stabilise>,
                /// The signals before the record: zero, or estimate, which fits their effect on the prediction errors.
                pub initial: InitialCondition,
                /// A constant mu of the output, `A (y - mu) = B/F u + C/D e`: none, or estimate, together with the
                /// parameters.
                pub offset: OffsetChoice,
            }
        }

        impl MethodKind for $options {
            fn check(&self) -> Result<(), OptionError> {
                if self.high_order == Some(0) {
                    return Err(OptionError::new("high_order", "0; expected at least 1"));
                }
                check_output_error(self.orders)
            }

            fn model_orders(&self, setting: usize) -> Option<Orders> {
                Some(output_error(self.orders, setting))
            }

            fn begins_at_rest(&self) -> bool {
                self.initial == InitialCondition::Zero
            }

            fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
                let orders = output_error(self.orders, problem.shape.order);
                let window = problem.shape.window;
                let stabilise = self.stabilise.unwrap_or(Stabilise::Reflect);
                let method = Morsm::new(orders, $output, self.high_order, stabilise, window)?;
                Ok(Box::new(method.with(Beside::new(self.initial, self.offset))?))
            }
        }
    };
}

filtered_iteration!(BjsmOptions, "The options of `bjsm`.", Output::Measured);
filtered_iteration!(MorsmOptions, "The options of `morsm`.", Output::Simulated);

/// Steiglitz and McBride's iteration on `A_h u` and either output, A_h and B_h by least squares. The noise behind A_h
/// is white, so with psi the gradient of `B/F A_h u` the covariance is `s^2 (psi'psi)^-1`, s^2 the variance of
/// `A_h (y - B/F u)`.
///
/// Where the start or an offset mu is fitted too, the high-order model has complete equations alone, and a constant for
/// mu. From its order on the filtered signals know all of the past that they need, so they are a record of `B/F` with a
/// start and the offset `A_h(1) mu`. The iteration on the measured output has the columns of both in its least squares.
pub struct Morsm {
    output: Output,
    beside: Beside,
    /// Of the last record, if the start or an offset is fitted.
    filtered: Option<Filtered>,
    levels: Option<Levels>,
    offsets: Vec<Offset>,
    stabilise: Stabilise,
    high: HighOrder,
    iteration: OutputErrorIteration,
    model: LinearModel,
    u: Vec<f64>,
    y: Vec<f64>,
}

impl Morsm {
    fn new(
        orders: Orders,
        output: Output,
        high_order: Option<usize>,
        stabilise: Stabilise,
        window: usize,
    ) -> Result<Self, SetupError> {
        let high = HighOrder::new(true, orders.nk, high_order, window);
        let needed = 2 * high_order.unwrap_or(1) + 1;
        enough_equations(orders, window, window, needed)?;
        let signal = || vec![0.0; window];
        Ok(Self {
            output,
            beside: Beside::default(),
            filtered: None,
            levels: None,
            offsets: Vec::new(),
            stabilise,
            high,
            iteration: OutputErrorIteration::new(orders, window, false, stabilise)?,
            model: LinearModel::zero(orders),
            u: signal(),
            y: signal(),
        })
    }

    /// Fits the start or an offset too.
    fn with(mut self, beside: Beside) -> Result<Self, SetupError> {
        if beside != Beside::default() {
            let (orders, window) = (self.model.orders(), self.u.len());
            let fitted = orders.parameters() + beside.count(orders);
            let most = self.high.most();
            let needed = fitted.max(2 * most) + 1 + most + orders.nk;
            enough_equations(orders, window, window, needed)?;
            self.high.equations = beside.equations();
        }
        self.levels = beside.levels();
        self.beside = beside;
        Ok(self)
    }

    fn find_in(&mut self, Window { u, y, .. }: Window<'_>, passes: &mut usize) -> Result<f64, FailureKind> {
        check_squares([u, y])?;
        self.high.fit(u, y);
        let order = self.high.order();
        if order == 0 {
            return Err(FailureKind::RankDeficient);
        }
        let high = self.high.model(order);
        filter(&high.a, u, &mut self.u);
        filter(&high.a, y, &mut self.y);
        if self.beside != Beside::default() {
            let later = |signal: &[f64]| signal[order..].to_vec();
            let gain = high.a.iter().sum();
            let signals = [later(&self.u), later(&self.y)];
            let filtered = Filtered::new(self.model.orders(), self.beside, signals, gain);
            let filtered = self.filtered.insert(filtered);
            if self.output == Output::Measured {
                return filtered.find(&mut self.model, self.stabilise, passes);
            }
        }
        if self.output == Output::Simulated {
            filter(&high.b, u, &mut self.y);
        }
        let window = Window::new(&self.u, &self.y, y.len());
        let found = self.iteration.find(window, passes);
        self.model.assign(self.iteration.model());
        found
    }

    /// Computes the covariance with the start and the offset, and the offset itself. Returns the sum of squared output
    /// errors from the best start.
    fn conclude_beside(&mut self, window: Window<'_>, at_rest: bool) -> Result<f64, FailureKind> {
        let (Some(filtered), model) = (&mut self.filtered, &mut self.model) else {
            return Err(FailureKind::RankDeficient);
        };
        model.covariance.clear();
        let about = filtered.conclude(model, at_rest)?;
        let mut y = window.y.to_vec();
        self.offsets.clear();
        if let Some(levels) = &self.levels {
            self.offsets = levels.offsets(model, &about, Units::ONE)?;
            for y in &mut y {
                *y -= self.offsets[0].value;
            }
        }
        let start = Beside::from(self.beside.initial);
        let orders = model.orders();
        let mut errors = Descent::new(orders, start.of(orders), Runs::new(&[y.len()]));
        let sum = errors.concentrate(window.u, &y, model.parameters());
        let sum = sum.ok_or(FailureKind::UnstablePredictor)?;
        let fitted = orders.parameters() + self.beside.count(orders);
        model.noise_variance = sum / (y.len() - fitted) as f64;
        Ok(sum)
    }
}

/// The signals filtered by a high-order model, from its order on.
struct Filtered {
    signals: [Vec<f64>; 2],
    /// `A_h(1)`.
    gain: f64,
    /// `A z = B w + C e` with `C = F` of the pass before, whose A is F: Steiglitz-McBride with the columns of the
    /// record.
    step: Descent,
    /// `z = B/F w + e`.
    errors: Descent,
}

impl Filtered {
    fn new(orders: Orders, beside: Beside, signals: [Vec<f64>; 2], gain: f64) -> Self {
        // Its start is always fitted: the first samples that the filter reaches are left out.
        let beside = Beside::new(InitialCondition::Estimate, beside.offset);
        let of_record = beside.of(orders);
        let refined = Orders {
            na: orders.nf,
            nc: orders.nf,
            nf: 0,
            ..orders
        };
        let runs = Runs::new(&[signals[0].len()]);
        Self {
            signals,
            gain,
            step: Descent::new(refined, of_record, runs.clone()),
            errors: Descent::new(orders, of_record, runs),
        }
    }

    /// Iterates until F does not change; the best model of all passes if it never stays.
    fn find(&mut self, model: &mut LinearModel, stabilise: Stabilise, passes: &mut usize) -> Result<f64, FailureKind> {
        let Orders { nb, nf, .. } = model.orders();
        let [u, y] = &self.signals;
        let (plant, of_c) = (nf + nb, nf + nb..2 * nf + nb);
        let mut theta = vec![0.0; self.step.theta().len()];
        let mut damping = Damping::none();
        let (mut best, mut least) = (None::<Vec<f64>>, f64::INFINITY);
        let mut scratch = Vec::new();
        *passes = 0;
        loop {
            let mut new = theta.clone();
            if !self.step.step_beside(u, y, &mut new, of_c.clone()) {
                return Err(FailureKind::RankDeficient);
            }
            let [way, size] = replace(&mut theta[..plant], &new[..plant], damping.share, |_| 1.0);
            theta[of_c.end..].copy_from_slice(&new[of_c.end..]);
            let change = way / size;
            model.set_plant(&theta[..plant]);
            if *passes > 0 && change <= REST {
                return self.rest(model).map(|(_, _, condition)| condition);
            }
            if *passes == MOST_PASSES {
                let best = best.ok_or(FailureKind::UnstablePredictor)?;
                model.set_parameters(&best);
                return Err(FailureKind::IterationLimit);
            }
            *passes += 1;
            stay_stable(&mut model.f, stabilise, &mut scratch)?;
            if let Some(sum) = self.errors.concentrate(u, y, model.parameters())
                && sum < least
            {
                (least, best) = (sum, Some(model.parameters().collect()));
            }
            if damping.goes_around(*passes, change) {
                match &best {
                    Some(best) => model.set_parameters(best),
                    // There is nothing to begin again at.
                    None => damping.share *= 2.0,
                }
            }
            model.write_plant(&mut theta[..plant]);
            theta[of_c.clone()].copy_from_slice(&model.f[1..]);
        }
    }

    /// Finds the start and the offset at a model. Returns the sum of squared errors, all parameters and the condition
    /// there.
    fn rest(&mut self, model: &LinearModel) -> Result<(f64, Vec<f64>, f64), FailureKind> {
        let [u, y] = &self.signals;
        let sum = self.errors.concentrate(u, y, model.parameters());
        let sum = sum.ok_or(FailureKind::UnstablePredictor)?;
        let theta = self.errors.theta().to_vec();
        let condition = self.errors.condition(u, y, &theta)?;
        Ok((sum, theta, condition))
    }

    /// Computes the covariance of the parameters and the offset, if the iteration came to rest; returns the offset
    /// about the levels, if there is one.
    fn conclude(&mut self, model: &mut LinearModel, at_rest: bool) -> Result<Vec<f64>, FailureKind> {
        let n = model.orders().parameters();
        let (sum, theta, _) = self.rest(model)?;
        if at_rest {
            let variance = sum / (self.signals[1].len() - theta.len()) as f64;
            let covariance = &mut model.covariance;
            self.errors.covariance(Covariance::White, variance, covariance);
            let width = covariance.len().isqrt();
            for i in n..width {
                for j in 0..width {
                    covariance[i * width + j] /= self.gain;
                    covariance[j * width + i] /= self.gain;
                }
            }
        }
        // A gain alone has no start, and only the offset or the start, which comes last, is beside the model.
        Ok(theta[n..].iter().take(1).map(|mu| mu / self.gain).collect())
    }
}

impl Iteration for Morsm {
    fn find(&mut self, window: Window<'_>, passes: &mut usize) -> Result<f64, FailureKind> {
        let mut levels = self.levels.take();
        let seen = match &mut levels {
            Some(levels) => levels.subtract(window, &Runs::new(&[window.len()])),
            None => window,
        };
        let found = self.find_in(seen, passes);
        self.levels = levels;
        found
    }

    fn of_record(&mut self, window: Window<'_>, pass: &mut Pass) {
        let orders = self.model.orders();
        pass.start_numbers = self.beside.count(orders);
        pass.offsets.clone_from(&self.offsets);
        let y = pass.less_offset(0, window.y);
        StateEstimate::new(orders.order(), self.beside.initial.into()).estimate(Window { y: &y, ..window }, 0, pass);
    }

    fn conclude(&mut self, window: Window<'_>, at_rest: bool) -> Result<f64, FailureKind> {
        if self.beside != Beside::default() {
            return self.conclude_beside(window, at_rest);
        }
        let (Window { u, y, .. }, model) = (window, &mut self.model);
        let (mut e, mut x) = (vec![0.0; y.len()], vec![0.0; y.len()]);
        let sum = output_errors(model, u, y, [&mut e, &mut x]);
        if at_rest {
            let high = self.high.model(self.high.order());
            filter(&high.a, &e, &mut x);
            let parameters = model.orders().parameters();
            let freedom = (y.len() - parameters) as f64;
            let variance = x.iter().map(|x| x * x).sum::<f64>() / freedom;
            let r = OutputGradient::new(model, &self.u)?.psi;
            covariance_of_triangle(r.r(), variance, &mut vec![0.0; parameters], &mut model.covariance);
        }
        Ok(sum)
    }

    fn model(&self) -> &LinearModel {
        &self.model
    }
}

#[cfg(test)]
mod tests;
