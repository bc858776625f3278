//! Limits of least squares and of the paper's instrumental-variable passes (stages 7 to 11).

use super::canonical::{Asymptotic, Shape, input_vector, numerator};
use super::joint_state::covariance;
use super::joint_state::is_stable;
use super::linear::{Influence, Linear, are_orthogonal};
use super::matrix::Matrix;
use super::missing::Missing;
use super::population::Population;
use super::signal::Signal;
use crate::estimator::{Auxiliary, Drive, InstrumentSource, IvOptions, Stage10};
use crate::model::Orders;

/// The regressors `-y(k-1) ... -y(k-count)`, then `u(k-nk) ... u(k-nk-nb+1)`.
pub fn regressors(y: &Signal, u: &Signal, shape: Shape) -> Vec<Signal> {
    let mut phi = y.lags(-1.0, 1, shape.denominator);
    phi.extend(u.lags(1.0, shape.nk, shape.nb));
    phi
}

/// Least squares of any orders: `theta = R^-1 E[phi y]`.
///
/// # Errors
/// [`Missing::Singular`].
pub fn least_squares(population: &Population, shape: Shape) -> Result<Linear, Missing> {
    let phi = regressors(&population.y, &population.u, shape);
    let truth = shape.truth(population);
    let truth = truth.map(|theta| (theta, &population.equation_error));
    Linear::new(population, &phi, &phi, &population.y, truth)
}

/// The instruments `-x(k-1) ...`, then the inputs. x is the output of the model `beta / alpha` with `input`.
///
/// # Errors
/// [`Missing::UnstableModel`].
pub fn model_instruments(theta: &[f64], shape: Shape, input: &Signal) -> Result<Vec<Signal>, Missing> {
    let (a, b) = polynomials(theta, shape)?;
    Ok(regressors(&input.through(&b, &a), input, shape))
}

/// Splits parameters into denominator and B; the model must be stable.
fn polynomials(theta: &[f64], shape: Shape) -> Result<(Vec<f64>, Vec<f64>), Missing> {
    let (denominator, b) = theta.split_at(shape.denominator);
    let a = [&[1.0], denominator].concat();
    let b = [vec![0.0; shape.nk].as_slice(), b].concat();
    if is_stable(&a) {
        Ok((a, b))
    } else {
        Err(Missing::UnstableModel)
    }
}

/// One pass at its limit, without the influence of earlier passes.
struct Step {
    /// (alpha, beta) of the auxiliary model.
    model: Vec<f64>,
    linear: Linear,
    /// `E[(dz / d(alpha, beta)') e]`; `None` if z and e are uncorrelated.
    slopes: Option<Matrix>,
}

/// The result of a pass.
#[derive(Clone)]
struct Done {
    theta: Vec<f64>,
    is_consistent: bool,
    influence: Influence,
    covariance: Option<Matrix>,
}

impl From<Linear> for Done {
    fn from(linear: Linear) -> Self {
        Self {
            theta: linear.theta,
            is_consistent: linear.is_consistent,
            influence: linear.influence,
            covariance: None,
        }
    }
}

/// The paper's passes for one population and order.
pub struct Passes<'a> {
    population: &'a Population,
    options: &'a IvOptions,
    shape: Shape,
    /// The last pass computed.
    step: Option<Step>,
}

impl<'a> Passes<'a> {
    /// Prepares the passes for an order of the estimators.
    pub fn new(population: &'a Population, options: &'a IvOptions, order: usize) -> Self {
        Self {
            population,
            options,
            shape: Shape::new(Orders::arx(order, order, 1)),
            step: None,
        }
    }

    /// Returns the outputs of the passes in `reported`, which must ascend. Pass 0 is least squares.
    pub fn run(mut self, reported: &[usize]) -> Vec<Result<Asymptotic, Missing>> {
        let mut outputs = Vec::new();
        let first = least_squares(self.population, self.shape).map(Done::from);
        let mut last = first.clone();
        let mut number = 0;
        for pass in reported {
            while number < *pass {
                last = match (&first, last) {
                    (Ok(first), Ok(last)) => self.pass(first, &last),
                    (Err(missing), _) => Err(missing.clone()),
                    (_, Err(missing)) => Err(missing),
                };
                number += 1;
            }
            let result = match &mut last {
                Ok(last) => self.asymptotic(last, &first, number),
                Err(missing) => Err(missing.clone()),
            };
            outputs.push(result);
        }
        outputs
    }

    /// Limit and influence of a pass.
    #[cfg(test)]
    pub(super) fn last_of(mut self, pass: usize) -> Result<(Vec<f64>, Influence), Missing> {
        let linear = least_squares(self.population, self.shape)?;
        let first = Done::from(linear);
        let mut last = first.clone();
        for _ in 0..pass {
            last = self.pass(&first, &last)?;
        }
        Ok((last.theta, last.influence))
    }

    fn asymptotic(&self, done: &mut Done, first: &Result<Done, Missing>, number: usize) -> Result<Asymptotic, Missing> {
        let sources = &self.population.sources;
        let covariance = match &done.covariance {
            Some(covariance) => covariance.clone(),
            None => done.influence.covariance(sources)?,
        };
        done.covariance = Some(covariance.clone());
        let of_b = match first {
            Ok(first) if number > 0 && self.options.auxiliary == Auxiliary::Literal => {
                Some((first.theta.clone(), first.influence.covariance(sources)?))
            }
            _ => None,
        };
        Ok(Asymptotic {
            p: done.theta.clone(),
            is_consistent: done.is_consistent,
            covariance,
            of_b,
        })
    }

    /// Computes the pass after `last`.
    fn pass(&mut self, first: &Done, last: &Done) -> Result<Done, Missing> {
        if self.options.stage10 != Stage10::Corrected {
            return Err(Missing::Reading("stage10", self.options.stage10.name()));
        }
        if self.options.drive != Drive::Model {
            return Err(Missing::Reading("drive", self.options.drive.name()));
        }
        let n = self.shape.denominator;
        let refreshed = self.options.auxiliary == Auxiliary::Refresh;
        let (alpha, of_first) = (&last.theta[..n], &first.theta);
        let (b0, slopes_b0) = input_vector(of_first);
        let (h, of_alpha, of_b) = numerator(alpha, &b0);
        let model = if refreshed {
            last.theta.clone()
        } else {
            [alpha, &h].concat()
        };
        let known = self.step.take().filter(|step| are_close(&step.model, &model));
        let is_known = known.is_some();
        let step = match known {
            Some(step) => step,
            None => self.step(model)?,
        };
        let linear = &step.linear;
        let mut done = Done::from(linear.clone());
        match &step.slopes {
            None if is_known => done.covariance.clone_from(&last.covariance),
            None => {}
            Some(slopes) if refreshed => {
                linear.follow(slopes, &last.influence, &mut done.influence);
            }
            Some(slopes) => {
                let of_beta = slopes.part(0..2 * n, n..2 * n);
                let more = &of_beta * &of_alpha;
                let of_last = Matrix::from_fn(
                    2 * n,
                    2 * n,
                    |i, j| {
                        if j < n { slopes[(i, j)] + more[(i, j)] } else { 0.0 }
                    },
                );
                linear.follow(&of_last, &last.influence, &mut done.influence);
                let of_first = &(&of_beta * &of_b) * &slopes_b0;
                linear.follow(&of_first, &first.influence, &mut done.influence);
            }
        }
        self.step = Some(step);
        Ok(done)
    }

    fn step(&self, model: Vec<f64>) -> Result<Step, Missing> {
        let (population, shape) = (self.population, self.shape);
        let input = match self.options.instruments {
            InstrumentSource::Input => &population.u,
            InstrumentSource::Reference => &population.r,
        };
        let z = model_instruments(&model, shape, input)?;
        let phi = regressors(&population.y, &population.u, shape);
        let truth = shape.truth(population);
        let truth = truth.map(|theta| (theta, &population.equation_error));
        let linear = Linear::new(population, &z, &phi, &population.y, truth)?;
        let slopes = self.slopes(&model, input, &linear.error)?;
        Ok(Step { model, linear, slopes })
    }

    /// `E[(dz / d(alpha, beta)') e]`. With x the auxiliary model's output, `dx / dalpha_m = -x(k-m) / A` and
    /// `dx / dbeta_m = u(k-m) / A`; the inputs among the instruments do not depend on the model.
    fn slopes(&self, model: &[f64], input: &Signal, error: &Signal) -> Result<Option<Matrix>, Missing> {
        let (a, b) = polynomials(model, self.shape)?;
        let n = self.shape.denominator;
        let u = input.through(&[1.0], &a);
        let mut later = u.through(&b, &a).lags(1.0, 2, 2 * n - 1);
        later.extend(u.lags(-1.0, 2, 2 * n - 1));
        let sources = &self.population.sources;
        if are_orthogonal(sources, &later, error)? {
            return Ok(None);
        }
        let moments = covariance(sources, &later, std::slice::from_ref(error))?;
        Ok(Some(Matrix::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
            (false, _) => 0.0,
            (true, true) => moments[(i + j, 0)],
            (true, false) => moments[(2 * n - 1 + i + j - n, 0)],
        })))
    }
}

/// Whether the numbers are equal up to rounding.
fn are_close(first: &[f64], second: &[f64]) -> bool {
    let size = first.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let mut pairs = first.iter().zip(second);
    pairs.all(|(a, b)| (a - b).abs() <= 1e-11 * size)
}
