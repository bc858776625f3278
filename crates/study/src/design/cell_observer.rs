//! The observer that scores the outputs of a method in a cell.

use crate::design::{DiscreteCell, ObserverStart};
use asobench_identification::estimator::{FailureKind, Method, Pass, SetupError};
use asobench_identification::model::polynomial::multiply;
use asobench_identification::observer::{
    DiscreteGpebo, GainSequence, Kalman, MeasurementNoise, ObservedModel, Observer, ObserverKind, ProcessNoise,
    RiccatiError, StochasticModel, ThetaEstimator, VarianceRatio,
};
use asobench_identification::plant::StateNoise;
use faer::{Mat, MatRef};
use std::sync::Arc;

/// An observer with its buffers.
pub(crate) enum CellObserver {
    /// An observer with placed poles, for any model.
    Luenberger(Observer),
    /// GPEBO, for any model.
    Gpebo(DiscreteGpebo),
    /// The Kalman filter of the true plant, with gains computed once; or why there is none.
    Known(Result<Box<Filter>, FailureKind>),
    /// The steady-state Kalman filter of an identified model, with the most likely ratio of the noises in the first
    /// `window` samples.
    Identified {
        window: usize,
        /// Whether the measurement noise has the identified colour; else it is white.
        coloured: bool,
    },
}

/// A Kalman filter and the model that it is of.
pub(crate) struct Filter {
    model: StochasticModel,
    kalman: Kalman,
    /// The ratio of an identified model, whose covariances are relative to the variance of the measurement noise.
    ratio: Option<VarianceRatio>,
}

/// The numbers that stage 12 used, by name; matrices by columns.
pub type Used = Vec<(&'static str, Vec<f64>)>;

impl CellObserver {
    /// Makes the observer of a method: its own, or one with the cell's gain.
    ///
    /// # Errors
    /// If the gain has another order, or a filter needs knowledge that this cell does not have.
    pub(crate) fn new(cell: &DiscreteCell, method: &Method) -> Result<Self, SetupError> {
        let known = method.needs().plant;
        let gain = match method.observer() {
            None => &cell.gain,
            Some(ObserverKind::Luenberger(gain)) => gain,
            Some(ObserverKind::Gpebo(by)) => {
                return Ok(Self::Gpebo(DiscreteGpebo::new(*by, method.order(cell.order))));
            }
            Some(
                kind @ (ObserverKind::Kalman
                | ObserverKind::KalmanColoured
                | ObserverKind::KalmanNamed(_)
                | ObserverKind::KalmanVarying),
            ) => {
                if known {
                    return Ok(Self::Known(known_filter(cell, kind)?));
                }
                if let ObserverKind::KalmanNamed(_) = kind {
                    return Err(SetupError::NoKnownPlant);
                }
                return Ok(Self::Identified {
                    window: cell.window,
                    coloured: *kind == ObserverKind::KalmanColoured,
                });
            }
        };
        let order = method.order(cell.order);
        gain.check(order)?;
        let observer = Observer::new(gain.clone(), order);
        Ok(Self::Luenberger(observer))
    }

    /// Calls `visit(k, xhat(k), e(k))` for k = 0 ... K-1; xhat(k) uses data up to k - 1. e(k) is the innovation, y(k)
    /// less its prediction from the same data, of a filter that knows the plant over its standard deviation. `model` is
    /// that of the pass, with the state to start from.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if the state overflows, [`FailureKind::NoFilter`] if there is no filter. The states
    /// visited before must not be used then.
    #[inline(always)]
    pub(crate) fn run(
        &mut self,
        pass: &Pass,
        model: ObservedModel<'_>,
        u: &[f64],
        y: &[f64],
        mut visit: impl FnMut(usize, &[f64], f64),
    ) -> Result<(), FailureKind> {
        let y = &pass.less_offset(0, y);
        match self {
            Self::Luenberger(observer) => observer.run(
                model,
                u,
                y,
                #[inline(always)]
                |k, x| visit(k, x, y[k] - x[0]),
            ),
            Self::Gpebo(observer) => observer.run(model, u, y, |k, x| visit(k, x, y[k] - x[0])),
            Self::Known(Ok(filter)) => {
                let (gains, n) = (Arc::clone(filter.kalman.gains()), filter.model.states);
                filter.kalman.filter(u, y, model.x0, |k, x, e| {
                    visit(k, &x[..n], e / gains.variance(k).sqrt());
                })
            }
            Self::Known(Err(kind)) => Err(*kind),
            Self::Identified { window, coloured } => {
                let pass = coloured.then_some(pass);
                let filter = identified_filter(pass, model, &u[..*window], &y[..*window]);
                let n = model.a.len();
                filter?.kalman.filter(u, y, model.x0, |k, x, e| visit(k, &x[..n], e))
            }
        }
    }
}

/// Runs stage 12 of a pass on a record once more, for a replay: calls `visit(k, xhat(k))` and returns what it used. The
/// observer `xhat(k+1) = F xhat(k) + b u(k) + g (y(k) - h'xhat(k))` is given by `g`, the gain for all k, and of a
/// Kalman filter with more states than the plant by `F`, `b` and `h` too. A time-varying gain is `g(k), k = 0, 1, ...`,
/// whose last one serves all later k. `None` if there is no observer, or the model is of another order than it.
pub fn stage_twelve(
    cell: &DiscreteCell,
    method: &Method,
    pass: &Pass,
    (u, y): (&[f64], &[f64]),
    visit: impl FnMut(usize, &[f64]),
) -> Option<Used> {
    let zero = vec![0.0; pass.a.len()];
    let mut model = pass.observed()?;
    if cell.observer_start == ObserverStart::Zero {
        model.x0 = &zero;
    }
    if method.order(cell.order) != model.a.len() {
        return None;
    }
    let start = ("xhat(0)", model.x0.to_vec());
    let y = &pass.less_offset(0, y);
    let mut used = match CellObserver::new(cell, method).ok()? {
        CellObserver::Luenberger(mut observer) => {
            observer.run(model, u, y, visit).ok()?;
            vec![("g", observer.g().to_vec())]
        }
        CellObserver::Gpebo(mut observer) => {
            observer.run(model, u, y, visit).ok()?;
            let (name, value) = match observer.estimator() {
                ThetaEstimator::Drem(gamma) => ("gamma", gamma),
                ThetaEstimator::Squares(rho) => ("rho", rho),
            };
            vec![(name, vec![value]), ("theta_hat(K)", observer.theta().to_vec())]
        }
        CellObserver::Known(filter) => filter.ok()?.replay(model, u, y, visit)?,
        CellObserver::Identified { window, coloured } => {
            let pass = coloured.then_some(pass);
            let filter = identified_filter(pass, model, &u[..window], &y[..window]);
            filter.ok()?.replay(model, u, y, visit)?
        }
    };
    used.push(start);
    Some(used)
}

impl Filter {
    /// Runs the filter and returns what it used.
    fn replay(
        mut self,
        start: ObservedModel<'_>,
        u: &[f64],
        y: &[f64],
        visit: impl FnMut(usize, &[f64]),
    ) -> Option<Used> {
        self.kalman.run(u, y, start.x0, visit).ok()?;
        let (model, gains) = (&self.model, self.kalman.gains());
        let by_columns = |m: MatRef<'_, f64>, scale: f64| -> Vec<f64> {
            let columns = (0..m.ncols()).flat_map(|j| (0..m.nrows()).map(move |i| (i, j)));
            columns.map(|at| m[at] * scale).collect()
        };
        // The covariances of an identified model in the units of the record.
        let scale = self.ratio.map_or(1.0, |ratio| ratio.likelihood.sigma2);
        let all: Vec<f64> = (0..gains.stored()).flat_map(|k| gains.gain(k).to_vec()).collect();
        let name = if gains.stored() == 1 {
            "g"
        } else {
            "g(k), k = 0, 1, ..."
        };
        let mut used = vec![(name, all)];
        used.extend(self.ratio.map(|ratio| ("rho", vec![ratio.rho])));
        used.push(("r", vec![model.r * scale]));
        used.push(("Q", by_columns(model.q.as_ref(), scale)));
        if model.states < model.order() {
            used.push(("E[w v]", model.s.iter().map(|s| s * scale).collect()));
            used.push(("F", by_columns(model.f.as_ref(), 1.0)));
            used.push(("b", model.g.clone()));
            used.push(("h", model.h.clone()));
        }
        used.push(("P", by_columns(gains.covariance(), scale)));
        Some(used)
    }
}

/// Makes the Kalman filter that knows the plant, the process noise's covariance `q^2 I + s_u^2 b b'` with the deviation
/// s_u of the noise on the measured input (`x(k+1) = A x + b (u - e_u) + w`), the measurement noise's colour and
/// variance, and x(0) with covariance `d^2 I`. The inner error is that of a Riccati equation without a solution.
fn known_filter(cell: &DiscreteCell, kind: &ObserverKind) -> Result<Result<Box<Filter>, FailureKind>, SetupError> {
    let process = &cell.process;
    let (settings, n) = (process.settings(), cell.order);
    let known = process.open_loop();
    let (plant, noise, variances) = known.ok_or(SetupError::NoKnownPlant)?;
    let noise_of_states = match kind {
        ObserverKind::KalmanNamed(name) => {
            let named = cell.covariances.get(name);
            Some(named.ok_or_else(|| SetupError::NoKnownNoise(kind.clone()))?)
        }
        _ => settings.state_noise.as_ref(),
    };
    let variance = noise_of_states.and_then(StateNoise::measurement);
    let known_variance = variance.or(settings.measurement_variance());
    let deviation: f64 = match known_variance {
        Some(variance) => variance.sqrt(),
        None => settings.level.scale(cell.eta, &[], &[], variances),
    };
    let varies = known_variance.is_none() && settings.level.over.is_of_window() && cell.eta > 0.0;
    if varies || !deviation.is_finite() {
        return Err(SetupError::NoKnownNoise(kind.clone()));
    }
    let of_variance = |variance: f64| Mat::from_fn(n, n, |i, j| variance * f64::from(i == j));
    let of_states = settings.process_noise * settings.process_noise;
    let of_input = process.input_deviation() * process.input_deviation();
    let b = plant.b();
    let noise_in_states = match noise_of_states {
        Some(noise) => noise.covariance(),
        None => of_variance(of_states),
    } + of_input * ProcessNoise::Input.covariance(b, 1.0);
    let denominator = noise.denominator();
    let measured = MeasurementNoise {
        numerator: noise.numerator(),
        denominator: &denominator,
        deviation,
    };
    let is_measured_exactly = deviation == 0.0;
    let noise = if is_measured_exactly {
        MeasurementNoise::white(1.0)
    } else if variance.is_some() {
        MeasurementNoise::white(deviation)
    } else {
        measured
    };
    let mut model = StochasticModel::new(plant.a(), b, noise_in_states.as_ref(), noise)?;
    if let Some(noise) = noise_of_states.filter(|_| variance.is_some()) {
        model.s = noise.cross();
    }
    let spread = of_variance(settings.x0_deviation * settings.x0_deviation);
    let varying = *kind == ObserverKind::KalmanVarying;
    let gains = if is_measured_exactly && (varying || model.q.norm_max() > 0.0) {
        let start = if varying { &spread } else { &model.q };
        let samples = varying.then_some(cell.horizon);
        GainSequence::without_measurement_noise(&model, start.as_ref(), samples)
    } else if varying {
        let start = model.initial_covariance(spread.as_ref())?;
        GainSequence::time_varying(&model, start.as_ref(), cell.horizon)
    } else {
        // Where nothing drives the states the gain does not depend on r.
        GainSequence::steady(&model)
    };
    if is_measured_exactly {
        model.r = 0.0;
    }
    match gains {
        Ok(gains) => Ok(Ok(Box::new(Filter {
            kalman: Kalman::new(&model, Arc::new(gains)),
            model,
            ratio: None,
        }))),
        Err(RiccatiError::NotStabilising(_) | RiccatiError::NoConvergence(_)) => Ok(Err(FailureKind::NoFilter)),
        Err(error) => Err(error.into()),
    }
}

/// Makes the steady-state Kalman filter of a model whose measurement noise is white, or `C / (A D) e` of the model `A y
/// = B/F u + C/D e` of a pass, with the process noise that is the most likely in a window.
fn identified_filter(
    coloured: Option<&Pass>,
    model: ObservedModel<'_>,
    u: &[f64],
    y: &[f64],
) -> Result<Filter, FailureKind> {
    let denominator = coloured.map(|pass| multiply(&pass.model.a, &pass.model.d));
    let noise = match (coloured, &denominator) {
        (Some(pass), Some(denominator)) => MeasurementNoise {
            numerator: &pass.model.c,
            denominator,
            deviation: 1.0,
        },
        _ => MeasurementNoise::white(1.0),
    };
    let identified = Kalman::identified(model, noise, u, y);
    let (kalman, model, ratio) = identified.map_err(|_| FailureKind::NoFilter)?;
    Ok(Filter {
        model,
        kalman,
        ratio: Some(ratio),
    })
}
