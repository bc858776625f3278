//! The observer that scores the outputs of a method in a cell.

use super::Cell;
use crate::estimator::{FailureKind, Method, SetupError};
use crate::observer::{
    Kalman, MeasurementNoise, ObservedModel, Observer, ObserverKind, ProcessNoise, RiccatiError,
    StochasticModel, maximum_likelihood_ratio,
};
use crate::signal::LevelOver;
use faer::Mat;

/// An observer with its buffers.
pub(super) enum CellObserver {
    /// An observer with placed poles, for any model.
    Luenberger(Observer),
    /// The Kalman filter of the true plant, with gains computed once; or why there is none.
    Known(Result<Box<Kalman>, FailureKind>),
    /// The steady-state Kalman filter of an identified model, with the most likely ratio of the noises in the first
    /// `window` samples.
    Identified { window: usize },
}

impl CellObserver {
    /// Makes the observer of a method: its own, or one with the cell's gain.
    ///
    /// # Errors
    /// If the gain has another order, or a filter needs knowledge that this cell does not have.
    pub(super) fn new(cell: &Cell, method: &Method) -> Result<Self, SetupError> {
        let known = method.needs().plant;
        let gain = match method.observer() {
            None => &cell.gain,
            Some(ObserverKind::Luenberger(gain)) => gain,
            Some(kind) if known => return Ok(Self::Known(known_filter(cell, kind)?)),
            Some(_) => {
                return Ok(Self::Identified {
                    window: cell.window,
                });
            }
        };
        let order = method.order(cell.order);
        gain.check(order)?;
        let observer = Observer::new(gain.clone(), order);
        Ok(Self::Luenberger(observer))
    }

    /// Calls `visit(k, xhat(k))` for k = 0 ... K-1; xhat(k) uses data up to k - 1.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if the state overflows, [`FailureKind::NoFilter`] if there is no filter. The states
    /// visited before must not be used then.
    #[inline(always)]
    pub(super) fn run(
        &mut self,
        model: ObservedModel<'_>,
        u: &[f64],
        y: &[f64],
        visit: impl FnMut(usize, &[f64]),
    ) -> Result<(), FailureKind> {
        match self {
            Self::Luenberger(observer) => observer.run(model, u, y, visit),
            Self::Known(Ok(filter)) => filter.run(u, y, model.x0, visit),
            Self::Known(Err(kind)) => Err(*kind),
            Self::Identified { window } => {
                identified_filter(model, &u[..*window], &y[..*window])?.run(u, y, model.x0, visit)
            }
        }
    }
}

/// Makes the Kalman filter that knows the plant, the process noise's covariance `q^2 I`, the measurement noise's colour
/// and variance, and x(0) with covariance `d^2 I`. The inner error is that of a Riccati equation without a solution.
fn known_filter(
    cell: &Cell,
    kind: &ObserverKind,
) -> Result<Result<Box<Kalman>, FailureKind>, SetupError> {
    let process = cell.process().ok_or(SetupError::ContinuousTime)?;
    let (settings, n) = (process.settings(), cell.order);
    let known = process.open_loop();
    let (plant, noise, variances) = known.ok_or(SetupError::NoKnownPlant)?;
    let deviation = settings.level.scale(cell.eta, &[], &[], variances);
    if settings.level.over == LevelOver::Window || !(deviation > 0.0) {
        return Err(SetupError::NoKnownNoise(kind.clone()));
    }
    let of_variance = |variance: f64| Mat::from_fn(n, n, |i, j| variance * f64::from(i == j));
    let process = of_variance(settings.process_noise * settings.process_noise);
    let noise = MeasurementNoise {
        numerator: noise.numerator(),
        denominator: &noise.denominator(),
        deviation,
    };
    let model = StochasticModel::new(plant.a(), plant.b(), process.as_ref(), noise)?;
    let filter = if *kind == ObserverKind::KalmanVarying {
        let spread = of_variance(settings.x0_deviation * settings.x0_deviation);
        let start = model.initial_covariance(spread.as_ref())?;
        Kalman::time_varying(&model, start.as_ref(), cell.horizon)
    } else {
        Kalman::steady(&model)
    };
    match filter {
        Ok(filter) => Ok(Ok(Box::new(filter))),
        Err(RiccatiError::NotStabilising { .. } | RiccatiError::NoConvergence { .. }) => {
            Ok(Err(FailureKind::NoFilter))
        }
        Err(error) => Err(error.into()),
    }
}

/// Makes the steady-state Kalman filter of a model with process noise of covariance `rho I` and white measurement noise
/// of variance 1. rho >= 0 maximises the likelihood in a window.
fn identified_filter(
    model: ObservedModel<'_>,
    u: &[f64],
    y: &[f64],
) -> Result<Kalman, FailureKind> {
    let states = ProcessNoise::States;
    let ratio = maximum_likelihood_ratio(model, u, y, states, None);
    let rho = ratio.map_err(|_| FailureKind::NoFilter)?.rho;
    let process = states.covariance(model.b, rho);
    let white = MeasurementNoise::white(1.0);
    let stochastic = StochasticModel::new(model.a, model.b, process.as_ref(), white);
    let filter = stochastic.and_then(|stochastic| Kalman::steady(&stochastic));
    filter.map_err(|_| FailureKind::NoFilter)
}
