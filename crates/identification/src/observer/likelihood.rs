//! The likelihood of a record from the Kalman filter's innovations, and the variance ratio that maximises it.

use super::kalman::{GainSequence, Kalman};
use super::luenberger::ObservedModel;
use super::riccati::RiccatiError;
use super::steady::SteadyGain;
use super::stochastic_model::{MeasurementNoise, StochasticModel};
use crate::failure::FailureKind;
use crate::plant::observe;
use faer::{Mat, MatRef};
use std::sync::Arc;

/// The Gaussian likelihood of a record if (Q, s, r, P0) are known up to a common factor sigma^2. It is evaluated at the
/// sigma^2 that maximises it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Likelihood {
    /// `sigma^2 = (1 / K) sum_k e(k)^2 / v(k)`, with v(k) the innovation variance for sigma = 1.
    pub sigma2: f64,
    /// `-2 log L = K (log(2 pi sigma^2) + 1) + sum_k log v(k)`.
    pub minus_two_log: f64,
}

/// How process noise of ratio rho enters the plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProcessNoise {
    /// `Q = rho I`: equally in every state.
    States,
    /// `Q = rho b b'`: through the input vector.
    Input,
}

/// The ratio of process to measurement noise with the largest likelihood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VarianceRatio {
    /// rho in `Q = rho I` or `Q = rho b b'`, with r = 1.
    pub rho: f64,
    /// The likelihood at rho. Its `sigma2` is the variance of the measurement noise, and `rho sigma2` that of the
    /// process noise.
    pub likelihood: Likelihood,
}

/// Why no ratio was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RatioError {
    /// The record's vectors differ in length or are empty, or x0 is not of the plant's order.
    #[error("the likelihood needs u and y of one length >= 1 and an x0 of the plant's order")]
    Record,
    /// The filter exists for no ratio; holds the reason for the last one tried.
    #[error(transparent)]
    Riccati(#[from] RiccatiError),
    /// No ratio has a finite likelihood: the data are not finite, or a filter predicts them exactly.
    #[error("no ratio has a finite likelihood")]
    NonFinite,
}

impl Kalman {
    /// Returns the likelihood of the record y under the input u with `xhat(0) = x0` (n numbers), maximised over
    /// sigma^2.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if the state overflows or the likelihood is not finite, as for an empty or an exactly
    /// predicted record.
    ///
    /// # Panics
    /// As for [`Kalman::run`].
    pub fn log_likelihood(&mut self, u: &[f64], y: &[f64], x0: &[f64]) -> Result<Likelihood, FailureKind> {
        let gains = Arc::clone(self.gains());
        let (mut squares, mut logs) = (0.0, 0.0);
        self.filter(u, y, x0, |k, _, e| {
            let variance = gains.variance(k);
            squares += e * e / variance;
            logs += variance.ln();
        })?;
        Likelihood::new(y.len(), squares, logs).ok_or(FailureKind::NonFinite)
    }
}

impl Likelihood {
    /// Returns the likelihood of K samples from `sum e^2 / v` and `sum log v`; `None` if it is not finite.
    fn new(samples: usize, squares: f64, logs: f64) -> Option<Self> {
        let samples = samples as f64;
        let sigma2 = squares / samples;
        let minus_two_log = samples * ((std::f64::consts::TAU * sigma2).ln() + 1.0) + logs;
        minus_two_log.is_finite().then_some(Self { sigma2, minus_two_log })
    }
}

impl ProcessNoise {
    /// Returns Q (n x n) for the ratio rho and a plant with input vector b.
    pub fn covariance(self, b: &[f64], rho: f64) -> Mat<f64> {
        Mat::from_fn(b.len(), b.len(), |i, j| match self {
            Self::States => rho * f64::from(i == j),
            Self::Input => rho * b[i] * b[j],
        })
    }
}

/// The range of log10 rho that is searched.
const RANGE: (f64, f64) = (-8.0, 4.0);
/// Number of steps of the grid.
const GRID: usize = 24;
/// The interval in log10 rho at which the golden-section search ends.
const WIDTH: f64 = 1e-5;

/// Returns the rho >= 0 that maximises the likelihood of the record for the plant `model`. The process noise has the
/// covariance rho I or rho b b', and the measurement noise is `noise`. Both are times a common sigma^2, which is
/// concentrated out.
///
/// With `p0` (n x n, relative to the measurement noise variance) the filter starts with that covariance of x(0) about
/// x0. Without it, the filter is in its steady state from the first sample.
///
/// The search is the same for all data. A grid covers log10 rho from -8 to 4 in steps of 0.5. A golden-section search
/// then narrows the interval between the neighbours of the best point (the smallest of equal ones) to 1e-5. rho = 0 is
/// tried too, and taken unless another is better. A rho for which no filter exists is skipped.
///
/// # Errors
/// [`RatioError::Record`]; [`RatioError::Riccati`] if no rho has a filter;
/// [`RatioError::NonFinite`].
pub fn maximum_likelihood_ratio(
    model: ObservedModel<'_>,
    u: &[f64],
    y: &[f64],
    process: ProcessNoise,
    noise: MeasurementNoise<'_>,
    p0: Option<MatRef<'_, f64>>,
) -> Result<VarianceRatio, RatioError> {
    if u.is_empty() || u.len() != y.len() || model.x0.len() != model.a.len() {
        return Err(RatioError::Record);
    }
    let white = noise == MeasurementNoise::white(1.0);
    let fast = p0.is_none() && process == ProcessNoise::States && white;
    let (mut steady, mut x) = (SteadyGain::new(model.a), vec![0.0; model.a.len()]);
    let mut search = Search {
        best: Err(RatioError::NonFinite),
        evaluate: |rho| {
            if fast && let Some(found) = steady_likelihood(model, u, y, &mut steady, &mut x, rho) {
                return found;
            }
            let q = process.covariance(model.b, rho);
            likelihood(model, u, y, q.as_ref(), noise, p0)
        },
    };
    search.at(0.0);
    let (low, high) = RANGE;
    let step = (high - low) / GRID as f64;
    let grid = |i: usize| low + step * i as f64;
    let costs: Vec<f64> = (0..=GRID).map(|i| search.at(10.0_f64.powf(grid(i)))).collect();
    let smallest = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let best = costs.iter().position(|cost| *cost == smallest).unwrap_or(0);
    search.golden_section(grid(best.saturating_sub(1)), grid((best + 1).min(GRID)));
    search.best
}

impl Kalman {
    /// Returns the steady-state filter of a model whose noise is identified, and the model and the ratio that it is of.
    /// The process noise has the covariance `rho I`, the measurement noise `noise` a deviation of 1, both times the
    /// common `sigma2` of the ratio; rho maximises the likelihood of the record as in [`maximum_likelihood_ratio`].
    ///
    /// # Errors
    /// As for [`maximum_likelihood_ratio`].
    pub fn identified(
        model: ObservedModel<'_>,
        noise: MeasurementNoise<'_>,
        u: &[f64],
        y: &[f64],
    ) -> Result<(Self, StochasticModel, VarianceRatio), RatioError> {
        let states = ProcessNoise::States;
        let ratio = maximum_likelihood_ratio(model, u, y, states, noise, None)?;
        let process = states.covariance(model.b, ratio.rho);
        let stochastic = StochasticModel::new(model.a, model.b, process.as_ref(), noise)?;
        Ok((Self::steady(&stochastic)?, stochastic, ratio))
    }
}

/// Returns the likelihood for one rho in the steady state, `x` having room for the state; `None` if the gain has to be
/// found by the general solver.
fn steady_likelihood(
    model: ObservedModel<'_>,
    u: &[f64],
    y: &[f64],
    steady: &mut SteadyGain,
    x: &mut [f64],
    rho: f64,
) -> Option<Result<Likelihood, RatioError>> {
    let (gain, innovation) = steady.solve(rho)?;
    x.copy_from_slice(model.x0);
    let mut squares = 0.0;
    observe(
        model.a,
        model.b,
        gain,
        x,
        u,
        y,
        #[inline(always)]
        |k, x| {
            let e = y[k] - x[0];
            squares += e * e;
        },
    );
    let logs = y.len() as f64 * innovation.ln();
    let found = Likelihood::new(y.len(), squares / innovation, logs);
    Some(found.ok_or(RatioError::NonFinite))
}

/// Returns the likelihood for one Q.
fn likelihood(
    model: ObservedModel<'_>,
    u: &[f64],
    y: &[f64],
    q: MatRef<'_, f64>,
    noise: MeasurementNoise<'_>,
    p0: Option<MatRef<'_, f64>>,
) -> Result<Likelihood, RatioError> {
    let stochastic = StochasticModel::new(model.a, model.b, q, noise)?;
    let gains = match p0 {
        None => GainSequence::steady(&stochastic)?,
        Some(p0) => GainSequence::time_varying(&stochastic, p0, y.len())?,
    };
    Kalman::new(&stochastic, Arc::new(gains))
        .log_likelihood(u, y, model.x0)
        .map_err(|_| RatioError::NonFinite)
}

/// The best of the ratios tried.
struct Search<E> {
    best: Result<VarianceRatio, RatioError>,
    evaluate: E,
}

impl<E: FnMut(f64) -> Result<Likelihood, RatioError>> Search<E> {
    /// Returns `-2 log L` at rho; infinite if there is none.
    fn at(&mut self, rho: f64) -> f64 {
        match (self.evaluate)(rho) {
            Ok(likelihood) => {
                let cost = likelihood.minus_two_log;
                if !matches!(&self.best, Ok(best) if best.likelihood.minus_two_log <= cost) {
                    self.best = Ok(VarianceRatio { rho, likelihood });
                }
                cost
            }
            Err(error) => {
                if self.best.is_err() {
                    self.best = Err(error);
                }
                f64::INFINITY
            }
        }
    }

    /// Narrows `[low, high]`, in log10 rho, to [`WIDTH`].
    fn golden_section(&mut self, mut low: f64, mut high: f64) {
        let ratio = (5.0_f64.sqrt() - 1.0) / 2.0;
        let at = |search: &mut Self, z: f64| search.at(10.0_f64.powf(z));
        let mut left = high - ratio * (high - low);
        let mut right = low + ratio * (high - low);
        let (mut at_left, mut at_right) = (at(self, left), at(self, right));
        while high - low > WIDTH {
            if at_left <= at_right {
                (high, right, at_right) = (right, left, at_left);
                left = high - ratio * (high - low);
                at_left = at(self, left);
            } else {
                (low, left, at_left) = (left, right, at_right);
                right = low + ratio * (high - low);
                at_right = at(self, right);
            }
        }
    }
}
