//! Maximum likelihood with errors of Student's t: prediction errors of heavy tails, by reweighting.
//!
//! `e = D/C (A y - B/F u)` from rest, `e / s` of Student's t with nu degrees of freedom. The likelihood is
//!
//! ```text
//! J = N log s + (nu + 1) / 2 sum_k log(1 + e(k)^2 / (nu s^2)) + N (log B(nu/2, 1/2) + log(nu) / 2),
//! ```
//!
//! B Euler's beta function. Steps of Gauss and Newton minimise `sum_k w_k e(k)^2` with
//! `w_k = (nu + 1) / (nu + e(k)^2 / s^2)`, at which the gradient of J is zero; s, and nu if it is not given, are
//! those of the least J at each step.
//!
//! Source: K. L. Lange, R. J. A. Little and J. M. G. Taylor, *Robust statistical modeling using the t distribution*,
//! JASA 84 (1989); for s C. Liu, D. B. Rubin and Y. N. Wu, *Parameter expansion to accelerate EM*, Biometrika 85
//! (1998).

use super::output_error_iteration::output_error;
use super::pem::search;
use crate::estimator::covariance::Covariance;
use crate::estimator::least_value::least;
use crate::estimator::method_kind::{MethodKind, Needs, OptionUnits, Problem, options};
use crate::estimator::option_error::OptionError;
use crate::estimator::prediction_error::kernels::Triangle;
use crate::estimator::prediction_error::{Beside, Descent, InitialCondition, OfRecord, PredictionError, SearchStarts};
use crate::estimator::{Estimator, FailureKind, Pass, PredictionGradient, Runs, SetupError, SinglePass, Window};
use crate::model::{LinearModel, Orders};

/// The degrees of freedom that are estimated or may be given: below, errors have no variance; above, they are as good
/// as normal.
const FREEDOM: [f64; 2] = [2.1, 100.0];

/// The decrement at which the search rests, and the largest that counts as a minimum where no step lowers J any more.
const REST: f64 = 1e-9;
const FLAT: f64 = 1e-5;
const MOST_ITERATIONS: usize = 200;
const HALVINGS: usize = 30;

/// Points of the grid of log(nu), and the most steps of the search for s.
const POINTS: u32 = 6;
const MOST_SCALINGS: usize = 500;
const SAME_SCALE: f64 = 1e-14;

options! {
    /// The options of `pem-t`.
    pub struct PemTOptions {
        /// Orders na, nb, nc, nd, nf of any structure and the delay nk, such as na=2,nb=2,nc=2,nk=1; by default nb =
        /// nf = the setting `order`, nk = 1.
        pub orders: Option<Orders>,
        /// The degrees of freedom nu of the errors, from 2.1 to 100; by default they are estimated.
        pub freedom: Option<f64>,
        /// Random starts of the search by least squares whose minimum is reweighted, besides those from linear
        /// methods; rule: by N, 8 to 128; truth: the true plant alone.
        pub starts: SearchStarts,
    }
}

impl MethodKind for PemTOptions {
    fn check(&self) -> Result<(), OptionError> {
        let [least, most] = FREEDOM;
        match (self.orders, self.freedom) {
            (Some(orders), _) if orders.na + orders.nb == 0 => Err(OptionError::new(
                "orders",
                "expected na or nb of at least 1, nc, nd, nf, nk",
            )),
            (_, Some(freedom)) if !(least..=most).contains(&freedom) => {
                let message = format!("{freedom}; expected {least} to {most}");
                Err(OptionError::new("freedom", message))
            }
            _ => Ok(()),
        }
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        Some(output_error(self.orders, setting))
    }

    fn needs(&self) -> Needs {
        self.starts.needs()
    }

    fn option_units(&self) -> OptionUnits {
        self.starts.option_units()
    }

    fn begins_at_rest(&self) -> bool {
        true
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let window = problem.shape.window;
        let orders = self.model_orders(problem.shape.order).unwrap_or_default();
        let runs = Runs::new(&[window]);
        Ok(Box::new(StudentT {
            search: search(orders, self.starts, Beside::default(), problem)?,
            freedom: self.freedom,
            weighted: Triangle::new(orders.parameters()),
            descent: Descent::new(orders, OfRecord::default(), runs),
        }))
    }
}

/// The law of errors that makes them most likely.
#[derive(Clone, Copy, Debug)]
struct Law {
    freedom: f64,
    /// s^2.
    square: f64,
    /// J.
    loss: f64,
}

impl Law {
    /// The law of given degrees of freedom; `square` is where the search for s begins. s solves
    /// `(nu + 1) sum_k q_k = N`, `q_k = e(k)^2 / (nu s^2 + e(k)^2)`, by Newton's steps in log(s^2), of 1 at most,
    /// between the ends that the sign of the left side leaves.
    fn of(errors: &[f64], freedom: f64, mut square: f64) -> Self {
        let count = errors.len() as f64;
        let (mut least, mut most) = (0.0, f64::INFINITY);
        for _ in 0..MOST_SCALINGS {
            let (mut sum, mut slope) = (0.0, 0.0);
            for e in errors {
                let q = e * e / (freedom * square + e * e);
                sum += q;
                slope += q * (1.0 - q);
            }
            let excess = sum - count / (freedom + 1.0);
            *(if excess > 0.0 { &mut least } else { &mut most }) = square;
            let by = (excess / slope).clamp(-1.0, 1.0);
            if by.abs() <= SAME_SCALE || !by.is_finite() {
                break;
            }
            let next = square * libm::exp(by);
            square = if next > least && next < most {
                next
            } else {
                (least * most).sqrt()
            };
        }
        let log = |e: &f64| libm::log1p(e * e / (freedom * square));
        let spread = errors.iter().map(log).sum::<f64>();
        let gamma = libm::lgamma;
        let norm = gamma(0.5 * freedom) - gamma(0.5 * (freedom + 1.0)) + 0.5 * libm::log(freedom);
        let loss = count * (0.5 * libm::log(square) + norm) + 0.5 * (freedom + 1.0) * spread;
        Self { freedom, square, loss }
    }

    /// The law of the least J, over log(nu) too if it is not given.
    fn new(errors: &[f64], freedom: Option<f64>, square: f64) -> Self {
        if let Some(freedom) = freedom {
            return Self::of(errors, freedom, square);
        }
        let [low, high] = FREEDOM.map(libm::log);
        let grid = (0..POINTS).map(|i| low + (high - low) * f64::from(i) / f64::from(POINTS - 1));
        let mut best = Self {
            freedom: f64::NAN,
            square,
            loss: f64::INFINITY,
        };
        least(grid, |log| {
            let law = Self::of(errors, libm::exp(log), best.square);
            if law.loss < best.loss {
                best = law;
            }
            law.loss
        });
        best
    }

    fn weight(&self, e: f64) -> f64 {
        (self.freedom + 1.0) / (self.freedom + e * e / self.square)
    }
}

/// The search by least squares, then reweighting.
struct StudentT {
    search: PredictionError,
    freedom: Option<f64>,
    weighted: Triangle,
    descent: Descent,
}

impl StudentT {
    /// Takes the model to the least J; returns the law of the errors, their sum of squares and the number of steps.
    fn descend(
        &mut self,
        model: &mut LinearModel,
        Window { u, y, .. }: Window<'_>,
        steps: &mut usize,
    ) -> Result<(Law, f64), FailureKind> {
        let at = |model: &LinearModel| PredictionGradient::new(model, u, y, InitialCondition::Zero);
        let mut here = at(model).ok_or(FailureKind::UnstablePredictor)?;
        let sum = |errors: &[f64]| errors.iter().map(|e| e * e).sum::<f64>();
        let mean = sum(&here.errors) / y.len() as f64;
        if mean == 0.0 {
            return Err(FailureKind::Singular);
        }
        let mut law = Law::new(&here.errors, self.freedom, mean);
        let (mut trial, mut last) = (model.clone(), f64::INFINITY);
        for _ in 0..MOST_ITERATIONS {
            if !law.loss.is_finite() {
                return Err(FailureKind::NonFinite);
            }
            let (mut step, decrement) = self.step(&here, law)?;
            if decrement <= REST {
                return Ok((law, sum(&here.errors)));
            }
            (*steps, last) = (*steps + 1, decrement);
            let mut taken = false;
            for _ in 0..HALVINGS {
                let moved = model.parameters().zip(&step).map(|(theta, by)| theta - by);
                trial.set_parameters(&moved.collect::<Vec<f64>>());
                if let Some(there) = at(&trial) {
                    let next = Law::new(&there.errors, self.freedom, law.square);
                    // Rounding hides whether the last steps lower J.
                    let allowed = if decrement < FLAT { 1e-9 } else { 0.0 };
                    if next.loss <= law.loss + allowed {
                        (here, law, taken) = (there, next, true);
                        std::mem::swap(model, &mut trial);
                        break;
                    }
                }
                for x in &mut step {
                    *x /= 2.0;
                }
            }
            if !taken {
                break;
            }
        }
        // Rounding allows no smaller one.
        if last < FLAT {
            return Ok((law, sum(&here.errors)));
        }
        Err(FailureKind::IterationLimit)
    }

    /// The step of Gauss and Newton, to be subtracted, and the share of the weighted errors that it removes.
    fn step(&mut self, of: &PredictionGradient, law: Law) -> Result<(Vec<f64>, f64), FailureKind> {
        let roots: Vec<f64> = of.errors.iter().map(|e| law.weight(*e).sqrt()).collect();
        let columns = of.signals.iter().flat_map(|(signal, delays)| {
            let signal = signal.as_slice();
            delays.clone().map(move |delay| (signal, delay))
        });
        let columns: Vec<(&[f64], usize)> = columns.chain([(&of.errors[..], 0)]).collect();
        self.weighted.run(of.errors.len(), |j, first, to| {
            let (signal, delay) = columns[j];
            for (k, to) in (first..).zip(to) {
                *to = k.checked_sub(delay).map_or(0.0, |past| roots[k] * signal[past]);
            }
        })?;
        let mut step = self.weighted.top().to_vec();
        let removed = step.iter().map(|x| x * x).sum::<f64>();
        let all = of.errors.iter().zip(&roots).map(|(e, root)| (e * root).powi(2));
        if !self.weighted.solve(&mut step) {
            return Err(FailureKind::NotIdentifiable);
        }
        Ok((step, (removed / all.sum::<f64>()).sqrt()))
    }
}

impl SinglePass for StudentT {
    /// The covariance is `s^2 (nu + 3) / (nu + 1) (psi'psi)^-1`, the inverse of the information of this record, with
    /// s^2 times `N / (N - parameters)`.
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        self.search.estimate_with(None, window, pass);
        if let Some(failure) = pass.failure {
            return Err(failure.kind);
        }
        let mut model = pass.model.clone();
        let mut steps = 0;
        model.covariance.clear();
        let found = self.descend(&mut model, window, &mut steps);
        pass.iterations = pass.iterations.map(|before| before + steps);
        let (law, sum) = match found {
            Ok(found) => found,
            Err(kind) if kind.leaves_a_model() => {
                model.noise_variance = f64::NAN;
                pass.set_model(&model, f64::NAN)?;
                pass.start_at_zero();
                return Err(kind);
            }
            Err(kind) => return Err(kind),
        };
        let theta: Vec<f64> = model.parameters().collect();
        let count = window.len() as f64;
        let square = law.square * count / (count - theta.len() as f64);
        let nu = law.freedom;
        model.noise_variance = square * nu / (nu - 2.0);
        let condition = self.descent.condition(window.u, window.y, &theta)?;
        let variance = square * (nu + 3.0) / (nu + 1.0);
        self.descent
            .covariance(Covariance::White, variance, &mut model.covariance);
        pass.loss = sum / count;
        pass.set_model(&model, condition)?;
        pass.start_at_zero();
        Ok(())
    }
}

#[cfg(test)]
mod tests;
