//! The likelihood of a record by the Kalman filter's innovations, and the ratio of noises that
//! maximises it.

use super::kalman::{GainSequence, Kalman};
use super::luenberger::ObservedModel;
use super::riccati::RiccatiError;
use super::stochastic_model::{MeasurementNoise, StochasticModel};
use crate::estimator::FailureKind;
use faer::{Mat, MatRef};
use std::sync::Arc;

/// The Gaussian likelihood of a record where (Q, s, r, P0) are known up to a common factor sigma^2,
/// at the sigma^2 that maximises it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Likelihood {
    /// `sigma^2 = (1 / K) sum_k e(k)^2 / v(k)`, v(k) the innovation's variance for sigma = 1.
    pub sigma2: f64,
    /// `-2 log L = K (log(2 pi sigma^2) + 1) + sum_k log v(k)`.
    pub minus_two_log: f64,
}

/// How process noise of ratio rho enters the plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProcessNoise {
    /// `Q = rho I`: in every state alike.
    States,
    /// `Q = rho b b'`: where the input does.
    Input,
}

/// The ratio of process to measurement noise of the largest likelihood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VarianceRatio {
    /// `Q = rho I` or `rho b b'` for r = 1.
    pub rho: f64,
    /// The likelihood at rho; its `sigma2` is the measurement noise's variance, `rho sigma2` the
    /// process noise's.
    pub likelihood: Likelihood,
}

/// Why no ratio was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RatioError {
    /// The record's vectors differ in length or are empty, or x0 is not of the plant's order.
    #[error("the likelihood needs u and y of one length >= 1 and an x0 of the plant's order")]
    Record,
    /// No ratio has a filter; the reason for the last one.
    #[error(transparent)]
    Riccati(#[from] RiccatiError),
    /// No ratio has a finite likelihood: the data are not finite, or some filter predicts them
    /// exactly.
    #[error("no ratio has a finite likelihood")]
    NonFinite,
}

impl Kalman {
    /// The likelihood of the record y under the input u with `xhat(0) = x0` (n numbers), sigma^2
    /// concentrated out.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] where the state overflows or the likelihood is not finite, as for
    /// an empty record or one that is predicted exactly.
    ///
    /// # Panics
    /// As for [`Kalman::run`].
    pub fn log_likelihood(
        &mut self,
        u: &[f64],
        y: &[f64],
        x0: &[f64],
    ) -> Result<Likelihood, FailureKind> {
        let gains = Arc::clone(self.shared_gains());
        let (mut squares, mut logs) = (0.0, 0.0);
        self.filter(u, y, x0, |k, _, e| {
            let variance = gains.variance(k);
            squares += e * e / variance;
            logs += variance.ln();
        })?;
        let samples = y.len() as f64;
        let sigma2 = squares / samples;
        let minus_two_log = samples * ((std::f64::consts::TAU * sigma2).ln() + 1.0) + logs;
        if minus_two_log.is_finite() {
            Ok(Likelihood {
                sigma2,
                minus_two_log,
            })
        } else {
            Err(FailureKind::NonFinite)
        }
    }
}

impl ProcessNoise {
    /// Q (n x n) of ratio rho for a plant with input vector b.
    pub fn covariance(self, b: &[f64], rho: f64) -> Mat<f64> {
        Mat::from_fn(b.len(), b.len(), |i, j| match self {
            Self::States => rho * f64::from(i == j),
            Self::Input => rho * b[i] * b[j],
        })
    }
}

/// The range of log10 rho that is searched.
const RANGE: (f64, f64) = (-8.0, 4.0);
/// Steps of the grid.
const GRID: usize = 24;
/// Where the golden section ends, in log10 rho.
const WIDTH: f64 = 1e-5;

/// The rho >= 0 that maximises the likelihood of the record for the plant `model` with process
/// noise of covariance rho I or rho b b' and white measurement noise of variance 1, times a common
/// sigma^2 that is concentrated out.
///
/// With `p0` (n x n, relative to the measurement noise's variance) the filter begins with that
/// covariance of x(0) about x0; without, it is in its steady state from the first sample. The
/// search is the same for all data: log10 rho from -8 to 4 in steps of 0.5, golden section to 1e-5
/// between the neighbours of the best (the smallest of equal ones), and rho = 0, which is taken
/// unless another is better. A rho without a filter is left out.
///
/// # Errors
/// [`RatioError::Record`]; [`RatioError::Riccati`] where no rho has a filter;
/// [`RatioError::NonFinite`].
pub fn maximum_likelihood_ratio(
    model: ObservedModel<'_>,
    u: &[f64],
    y: &[f64],
    process: ProcessNoise,
    p0: Option<MatRef<'_, f64>>,
) -> Result<VarianceRatio, RatioError> {
    if u.is_empty() || u.len() != y.len() || model.x0.len() != model.a.len() {
        return Err(RatioError::Record);
    }
    let mut search = Search {
        best: Err(RatioError::NonFinite),
        evaluate: |rho| likelihood(model, u, y, process.covariance(model.b, rho).as_ref(), p0),
    };
    search.at(0.0);
    let (low, high) = RANGE;
    let step = (high - low) / GRID as f64;
    let grid = |i: usize| low + step * i as f64;
    let costs: Vec<f64> = (0..=GRID)
        .map(|i| search.at(10.0_f64.powf(grid(i))))
        .collect();
    let smallest = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let best = costs.iter().position(|cost| *cost == smallest).unwrap_or(0);
    search.golden_section(grid(best.saturating_sub(1)), grid((best + 1).min(GRID)));
    search.best
}

/// The likelihood for one Q.
fn likelihood(
    model: ObservedModel<'_>,
    u: &[f64],
    y: &[f64],
    q: MatRef<'_, f64>,
    p0: Option<MatRef<'_, f64>>,
) -> Result<Likelihood, RatioError> {
    let stochastic = StochasticModel::new(model.a, model.b, q, MeasurementNoise::white(1.0))?;
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

impl<E: Fn(f64) -> Result<Likelihood, RatioError>> Search<E> {
    /// `-2 log L` at rho, infinite where there is none.
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
