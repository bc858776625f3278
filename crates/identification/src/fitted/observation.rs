//! The observer of a model on a record: its gain, its poles, and the states with their standard deviations.

use super::Fitted;
use crate::diagnosis::Whiteness;
use crate::estimator::{Method, MethodOptions, Pass, Progress, SetupError, Shape, Window};
use crate::failure::FailureKind;
use crate::model::polynomial::multiply;
use crate::observer::{
    DiscreteGpebo, Gain, GainError, GainSequence, Kalman, MeasurementNoise, ObservedModel, Observer, ObserverKind,
    RatioError, RiccatiError, StochasticModel, lyapunov,
};
use crate::plant::PoleFinder;
use faer::{Mat, c64};
use std::sync::Arc;

/// Known covariances of the noise: `x(k+1) = A x(k) + b u(k) + w(k)`, `y(k) = x_1(k) + d u(k) + v(k)`.
#[derive(Clone, Debug, PartialEq)]
pub struct NoiseCovariances {
    /// Q (n x n) of w, in the square of y's unit.
    pub process: Mat<f64>,
    /// r, the variance of white v, or of the white noise that drives a coloured one; above 0.
    pub measurement: f64,
    /// P(0) (n x n) of x(0) about its estimate, for [`ObserverKind::KalmanVarying`].
    pub start: Option<Mat<f64>>,
}

/// Why a model has no observer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ObservationError {
    /// The poles do not fit the model's order.
    #[error(transparent)]
    Gain(#[from] GainError),
    /// The model has no initial state.
    #[error("the model has no initial state from which an observer begins")]
    NoStart,
    /// A time-varying filter without its covariances.
    #[error("kalman-varying needs Q, r and the covariance P(0) of the start")]
    NoCovariances,
    /// Covariances that only an experiment file has.
    #[error("kalman:{0} names covariances of an experiment file; expected kalman, with Q and r")]
    NamedCovariances(String),
    /// A Riccati equation without a solution, or covariances that are none.
    #[error(transparent)]
    Riccati(#[from] RiccatiError),
    /// No noise explains the record.
    #[error("the noise was not identified: {0}")]
    Noise(#[from] RatioError),
    /// The adaptive observer cannot serve the record's length or the order.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The calculation failed.
    #[error("the states are lost: {}", .0.name())]
    Failed(FailureKind),
}

/// An observer of a model, `xhat(k+1) = F xhat(k) + g u(k) + K (y(k) - h'xhat(k) - d u(k))`, from the model's x0.
#[derive(Clone, Debug)]
pub struct ModelObserver {
    a: Vec<f64>,
    b: Vec<f64>,
    x0: Vec<f64>,
    direct: f64,
    /// The constant of the output, 0 if none was estimated.
    offset: f64,
    shift: usize,
    fitted: usize,
    filter: Filter,
    /// K: n numbers, then those of coloured noise; the gain of the steady state where it varies, empty if
    /// there is none, and of GPEBO.
    pub gain: Vec<f64>,
    /// The eigenvalues of F - K h', largest modulus first; empty where there is no gain.
    pub poles: Vec<c64>,
    /// The covariances that the observer takes, known or identified; `None` of an observer without any.
    pub noise: Option<NoiseCovariances>,
    /// The steady-state covariance P (n x n) of x(k) - xhat(k); `None` where the noise is not known, or P has no limit.
    pub covariance: Option<Mat<f64>>,
    /// h'P h + r, the variance of the innovations in the steady state; NaN where P is not known.
    pub innovation: f64,
}

#[derive(Clone, Debug)]
enum Filter {
    Luenberger(Gain),
    Gpebo(DiscreteGpebo),
    Steady(Kalman),
    Varying(Box<StochasticModel>, Mat<f64>),
}

/// The states of a record.
#[derive(Clone, Debug)]
pub struct Observation {
    /// The order n.
    pub order: usize,
    /// xhat(k), k = 0 ... K, n numbers each, from u and y up to k - 1.
    pub states: Vec<f64>,
    /// The standard deviations of x(k) - xhat(k), in the same places; empty where they are not known.
    pub deviations: Vec<f64>,
    /// The prediction of y(k) from u up to k and y up to k - 1, K numbers.
    pub predictions: Vec<f64>,
    /// y(k) less its prediction.
    pub innovations: Vec<f64>,
    /// Whether the innovations, over their standard deviations where these vary, are white: at 1 %, by Ljung and Box,
    /// less the parameters of A, C and D, and rho where it was identified. `None` if they are fewer than four, or zero.
    pub white: Option<Whiteness>,
}

impl Fitted {
    /// Returns the observer of this model in the form [`crate::fit`] has it in, y being that of [`Self::shifted`].
    ///
    /// Where `noise` is not known, [`ObserverKind::Kalman`] and [`ObserverKind::KalmanColoured`] identify it on the
    /// record u, y: process noise rho r I and measurement noise of variance r, by maximum likelihood
    /// ([`Kalman::identified`]). The colour is C / (A D) of the model. A known noise gives an observer with placed
    /// poles the covariance of its errors, `P = F P F' + Q + r g g'` with F = A - g c'.
    ///
    /// # Errors
    /// [`ObservationError`].
    ///
    /// # Panics
    /// If u and y differ in length.
    ///
    /// # Example
    ///
    /// ```
    /// use asobench_identification::fit;
    /// use asobench_identification::estimator::ArxOptions;
    ///
    /// let u: Vec<f64> = (0..60).map(|k| f64::from(k * k % 7) - 3.0).collect();
    /// let mut y = vec![0.0; 60];
    /// for k in 1..60 {
    ///     y[k] = 0.5 * y[k - 1] + 2.0 * u[k - 1] + 0.01 * f64::from(k as u32 * 31 % 11);
    /// }
    /// let model = fit(ArxOptions::default(), 1, &u, &y)?;
    /// let observer = model.observer(&"dead-beat".parse()?, None, &u, &y)?;
    /// let observed = observer.run(&u, &y)?;
    /// assert_eq!(observed.states.len(), 61);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn observer(
        &self,
        kind: &ObserverKind,
        noise: Option<&NoiseCovariances>,
        u: &[f64],
        y: &[f64],
    ) -> Result<ModelObserver, ObservationError> {
        let Pass { a, b, direct, .. } = &self.pass;
        let n = a.len();
        if self.pass.progress < Progress::InitialState {
            return Err(ObservationError::NoStart);
        }
        if let Some(r) = noise.map(|noise| noise.measurement).filter(|r| !(*r > 0.0)) {
            return Err(RiccatiError::Variance(r).into());
        }
        let orders = self.model.orders();
        let mut observer = ModelObserver {
            a: a.clone(),
            b: b.clone(),
            x0: self.pass.x0.clone(),
            direct: *direct,
            offset: self.offset().map_or(0.0, |offset| offset.value),
            shift: self.shift,
            fitted: orders.na + orders.nc + orders.nd,
            filter: Filter::Luenberger(Gain::DeadBeat),
            gain: Vec::new(),
            poles: Vec::new(),
            noise: noise.cloned(),
            covariance: None,
            innovation: f64::NAN,
        };
        let coloured = *kind == ObserverKind::KalmanColoured;
        let denominator = multiply(&self.pass.model.a, &self.pass.model.d);
        let measured = |variance: f64| {
            let deviation = variance.sqrt();
            if coloured {
                MeasurementNoise {
                    numerator: &self.pass.model.c,
                    denominator: &denominator,
                    deviation,
                }
            } else {
                MeasurementNoise::white(deviation)
            }
        };
        let known = |of: &NoiseCovariances| StochasticModel::new(a, b, of.process.as_ref(), measured(of.measurement));
        match (kind, noise) {
            (ObserverKind::Luenberger(gain), noise) => {
                gain.check(n)?;
                // Also refuses what is no covariance.
                noise.map(known).transpose()?;
                observer.place(gain, noise);
            }
            (ObserverKind::Gpebo(by), _) => {
                observer.filter = Filter::Gpebo(DiscreteGpebo::new(*by, n));
            }
            (ObserverKind::KalmanVarying, Some(of)) => {
                let start = of.start.as_ref().ok_or(ObservationError::NoCovariances)?;
                let model = known(of)?;
                // Without a limit there is a filter all the same.
                if let Ok(kalman) = Kalman::steady(&model) {
                    observer.take(&kalman, &model, 1.0);
                }
                let start = model.initial_covariance(start.as_ref())?;
                observer.filter = Filter::Varying(Box::new(model), start);
            }
            (ObserverKind::KalmanNamed(name), _) => {
                return Err(ObservationError::NamedCovariances(name.clone()));
            }
            (ObserverKind::KalmanVarying, None) => return Err(ObservationError::NoCovariances),
            (ObserverKind::Kalman | ObserverKind::KalmanColoured, Some(of)) => {
                let model = known(of)?;
                let kalman = Kalman::steady(&model)?;
                observer.take(&kalman, &model, 1.0);
                observer.filter = Filter::Steady(kalman);
            }
            (ObserverKind::Kalman | ObserverKind::KalmanColoured, None) => {
                let (u, y) = observer.seen(u, y);
                let of = ObservedModel {
                    a,
                    b,
                    x0: &self.pass.x0,
                };
                let (kalman, model, ratio) = Kalman::identified(of, measured(1.0), u, &y)?;
                let sigma2 = ratio.likelihood.sigma2;
                observer.take(&kalman, &model, sigma2);
                observer.filter = Filter::Steady(kalman);
                observer.fitted += 1;
                observer.noise = Some(NoiseCovariances {
                    process: Mat::from_fn(n, n, |i, j| ratio.rho * sigma2 * f64::from(i == j)),
                    measurement: sigma2,
                    start: None,
                });
            }
        }
        Ok(observer)
    }
}

/// Runs a method that estimates state and parameters sample by sample over a record of u(k) and y(k): `kreisselmeier`,
/// `zhang` or `joint-ekf`, from xhat(0) = 0. The innovations are tested over the second half, when the observer has
/// adapted.
///
/// # Errors
/// [`ObservationError::Setup`], or [`ObservationError::Failed`] if a number is not finite, or the method has no state
/// of its own.
///
/// # Panics
/// If u and y differ in length.
pub fn observe_adaptively(
    options: impl Into<MethodOptions>,
    order: usize,
    u: &[f64],
    y: &[f64],
) -> Result<Observation, ObservationError> {
    let method = Method::named("model", options.into());
    let window = y.len();
    let mut estimator = method.prepare(Shape { order, window })?;
    let at: Vec<usize> = (1..=window).collect();
    let mut states = vec![0.0; order];
    let mut visit = |_: usize, _: &Pass, state: Option<&[f64]>| {
        states.extend_from_slice(state.unwrap_or_default());
    };
    estimator.run_along(Window::new(u, y, window), &at, &mut Pass::new(order), &mut visit);
    if states.len() != (window + 1) * order || states.iter().any(|x| !x.is_finite()) {
        return Err(ObservationError::Failed(FailureKind::NonFinite));
    }
    let predictions: Vec<f64> = states.chunks(order).map(|x| x[0]).take(window).collect();
    let innovations: Vec<f64> = y.iter().zip(&predictions).map(|(y, of)| y - of).collect();
    Ok(Observation {
        order,
        deviations: Vec::new(),
        white: Whiteness::of(&innovations[window / 2..], 0),
        states,
        predictions,
        innovations,
    })
}

impl ModelObserver {
    /// Takes a placed gain, and the covariance of its errors where the noise is known.
    fn place(&mut self, gain: &Gain, noise: Option<&NoiseCovariances>) {
        let n = self.a.len();
        let mut g = vec![0.0; n];
        gain.compute(&self.a, &mut g);
        let own = PoleFinder::new(n).poles(&self.a);
        self.poles = gain.placed(&own);
        self.filter = Filter::Luenberger(gain.clone());
        if let Some(noise) = noise {
            let f = Mat::from_fn(n, n, |i, j| {
                let of_a = if i + 1 == n { self.a[j] } else { f64::from(i + 1 == j) };
                of_a - if j == 0 { g[i] } else { 0.0 }
            });
            let r = noise.measurement;
            let driven = Mat::from_fn(n, n, |i, j| noise.process[(i, j)] + r * g[i] * g[j]);
            self.covariance = lyapunov(f.as_ref(), driven.as_ref()).ok();
            self.innovation = self.covariance.as_ref().map_or(f64::NAN, |p| p[(0, 0)] + r);
        }
        self.gain = g;
    }

    /// Takes the steady state of a filter whose covariances are those of the model times a number.
    fn take(&mut self, kalman: &Kalman, model: &StochasticModel, scale: f64) {
        let (gains, n) = (kalman.gains(), self.a.len());
        self.gain = gains.gain(0).to_vec();
        let closed = Mat::from_fn(model.order(), model.order(), |i, j| {
            model.f[(i, j)] - self.gain[i] * model.h[j]
        });
        self.poles = closed.eigenvalues().unwrap_or_default();
        self.poles
            .sort_by(|p, q| q.norm().total_cmp(&p.norm()).then(q.im.total_cmp(&p.im)));
        let p = gains.covariance();
        self.covariance = Some(Mat::from_fn(n, n, |i, j| scale * p[(i, j)]));
        self.innovation = scale * gains.variance(0);
    }

    /// u(k), and y(k + shift) - d u(k) less the offset.
    fn seen<'a>(&self, u: &'a [f64], y: &[f64]) -> (&'a [f64], Vec<f64>) {
        let shift = self.shift.min(y.len());
        let u = &u[..u.len() - shift];
        let y = y[shift..].iter().zip(u);
        (u, y.map(|(y, u)| y - self.direct * u - self.offset).collect())
    }

    /// Observes a record, whose y is advanced by the model's shift.
    ///
    /// # Errors
    /// [`ObservationError::Failed`] if the state overflows; [`ObservationError::Riccati`] if a time-varying covariance
    /// does.
    ///
    /// # Panics
    /// If u and y differ in length.
    pub fn run(&self, u: &[f64], y: &[f64]) -> Result<Observation, ObservationError> {
        let (u, mut y) = self.seen(u, y);
        let (n, samples, direct) = (self.a.len(), y.len(), self.direct);
        // xhat(K) is that before a further sample, whatever it is.
        let u: Vec<f64> = u.iter().copied().chain([0.0]).collect();
        y.push(0.0);
        let model = ObservedModel {
            a: &self.a,
            b: &self.b,
            x0: &self.x0,
        };
        let (mut states, mut innovations) = (Vec::with_capacity(n * y.len()), Vec::new());
        let mut take = |x: &[f64], innovation: f64| {
            states.extend_from_slice(&x[..n]);
            innovations.push(innovation);
        };
        let mut varying = None;
        let done = match &self.filter {
            Filter::Luenberger(gain) => {
                let mut observer = Observer::new(gain.clone(), n);
                observer.run(model, &u, &y, |k, x| take(x, y[k] - x[0]))
            }
            Filter::Gpebo(observer) => observer.clone().run(model, &u, &y, |k, x| take(x, y[k] - x[0])),
            Filter::Steady(kalman) => kalman.clone().filter(&u, &y, &self.x0, |_, x, e| take(x, e)),
            Filter::Varying(model, start) => {
                let gains = GainSequence::time_varying(model, start.as_ref(), y.len())?;
                let gains = Arc::new(gains);
                varying = Some(Arc::clone(&gains));
                Kalman::new(model, gains).filter(&u, &y, &self.x0, |_, x, e| take(x, e))
            }
        };
        done.map_err(ObservationError::Failed)?;
        innovations.truncate(samples);
        y.truncate(samples);
        let deviations = match (&varying, &self.covariance) {
            (Some(gains), _) => (0..=samples)
                .flat_map(|k| gains.state_variances(k)[..n].to_vec())
                .map(|variance| variance.max(0.0).sqrt())
                .collect(),
            (None, Some(p)) => {
                let of: Vec<f64> = (0..n).map(|i| p[(i, i)].max(0.0).sqrt()).collect();
                of.repeat(samples + 1)
            }
            (None, None) => Vec::new(),
        };
        let tested: Vec<f64> = match &varying {
            Some(gains) => {
                let numbered = innovations.iter().enumerate();
                numbered.map(|(k, e)| e / gains.variance(k).sqrt()).collect()
            }
            None => innovations.clone(),
        };
        let outputs = y.iter().zip(&innovations).zip(&u);
        Ok(Observation {
            order: n,
            states,
            deviations,
            predictions: outputs.map(|((y, e), u)| y - e + direct * u + self.offset).collect(),
            white: Whiteness::of(&tested, self.fitted),
            innovations,
        })
    }
}

#[cfg(test)]
mod tests;
