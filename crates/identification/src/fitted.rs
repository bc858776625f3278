//! A model of a record, or of several of one plant, in one call.

pub(crate) mod observation;

use crate::data::Rounding;
use crate::diagnosis::{Precision, Residuals};
use crate::estimator::InitialCondition;
use crate::estimator::initial_state::InitialState;
use crate::estimator::{Failure, FailureKind};
use crate::estimator::{Method, MethodOptions, Offset, Pass, Progress, Runs, SetupError, Window};
use crate::metric::{Ahead, Fit, fit_ahead, mean, percent};
use crate::model::{LinearModel, Units};
use crate::plant::{PoleFinder, simulate};
use faer::c64;
use std::borrow::Cow;
use std::iter;
use std::ops::Range;

/// Why there is no model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// u and y differ in length.
    #[error("u has {u} samples and y has {y}; expected equal lengths")]
    Lengths {
        /// The samples of u.
        u: usize,
        /// The samples of y.
        y: usize,
    },
    /// The method needs the reference of a closed loop: [`fit_in_loop`].
    #[error("needs the reference r of the closed loop beside u and y")]
    NoReference,
    /// The method cannot serve the record's length, or the orders.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The calculation has no model.
    #[error("the estimate failed: {0}")]
    Failed(Failure),
}

/// A model that was fitted to a record.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// A pass of the method, here the last one, with the initial state, the loss and the condition number.
    pub pass: Pass,
    /// The model of the record, with the whole delay.
    pub model: LinearModel,
    /// By how many samples y was advanced for a method without a delay: the pass is of y(k + shift).
    pub shift: usize,
}

/// Fits a model of these orders to a record: `A y = B/F u + C/D e` with e white.
///
/// The orders are those of the options; `order` is that of `iv` and `ls` without orders, which have the paper's form.
///
/// # Errors
/// [`FitError`]. A search that ends without a minimum has a model, and its kind in [`Fitted::unfinished`].
///
/// # Example
///
/// ```
/// use asobench_identification::estimator::ArxOptions;
/// use asobench_identification::fit;
///
/// let u = [1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0];
/// let mut y = [0.0; 10];
/// for k in 1..10 {
///     y[k] = 0.5 * y[k - 1] + 2.0 * u[k - 1];
/// }
/// let orders = Some("na=1,nb=1,nk=1".parse()?);
/// let model = fit(ArxOptions { orders, ..ArxOptions::default() }, 1, &u, &y)?;
/// assert!((model.linear().b[1] - 2.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fit(options: impl Into<MethodOptions>, order: usize, u: &[f64], y: &[f64]) -> Result<Fitted, FitError> {
    let options = options.into();
    if options.needs().reference.is_some() {
        return Err(FitError::NoReference);
    }
    fit_in_loop(options, order, u, y, u)
}

/// Like [`fit`] for a record of a closed loop `u = r - K(q) y`, whose reference r is known.
///
/// # Errors
/// [`FitError`].
///
/// # Panics
/// If r has fewer samples than u.
pub fn fit_in_loop(
    options: impl Into<MethodOptions>,
    order: usize,
    u: &[f64],
    y: &[f64],
    r: &[f64],
) -> Result<Fitted, FitError> {
    fit_records(options, order, &[], u, y, r)
}

/// Like [`fit`] for several records of one plant, which follow each other in u and y with these lengths. Each begins
/// with a state of its own. The estimators `arx`, `iv`, `oe`, `armax` and `bj` serve them.
///
/// # Errors
/// [`FitError`].
///
/// # Panics
/// If r has fewer samples than u, or the lengths do not add to the number of samples.
pub fn fit_records(
    options: impl Into<MethodOptions>,
    order: usize,
    lengths: &[usize],
    u: &[f64],
    y: &[f64],
    r: &[f64],
) -> Result<Fitted, FitError> {
    if u.len() != y.len() {
        let (u, y) = (u.len(), y.len());
        return Err(FitError::Lengths { u, y });
    }
    let options = options.into();
    let order = options.order(order);
    let window = Window::with_reference(u, y, r, y.len());
    let mut passes = Method::named("model", options).estimate_once(order, lengths, window, true)?;
    let pass = passes.pop().ok_or(SetupError::ZeroOrder)?;
    match pass.failure {
        Some(failure) if pass.progress < Progress::Parameters => Err(FitError::Failed(failure)),
        _ => Ok(Fitted::new(pass, 0)),
    }
}

impl Fitted {
    /// The model of a pass over u(k) and y(k + shift).
    pub fn new(pass: Pass, shift: usize) -> Self {
        let mut model = pass.model.clone();
        model.delay += shift;
        model.b.splice(0..0, iter::repeat_n(0.0, shift));
        Self { pass, model, shift }
    }

    /// Takes the loss and the noise variance, where the method has none, of the prediction errors over the rows that
    /// look back only within a record: their mean square over all samples, and over the degrees of freedom.
    #[must_use]
    pub fn with_loss(mut self, runs: &Runs, u: &[f64], y: &[f64]) -> Self {
        if !self.pass.loss.is_nan() {
            return self;
        }
        let model = &self.model;
        let of_run = runs.iter().map(|run| {
            let (mut e, mut scratch) = (vec![0.0; run.len()], vec![0.0; run.len()]);
            model.residuals(&u[run.clone()], &y[run.clone()], &mut e, &mut scratch);
            let e = &e[model.orders().reach().min(run.len())..];
            (e.iter().map(|e| e * e).sum::<f64>(), e.len())
        });
        let (sum, rows) = of_run.fold((0.0, 0), |(sum, rows), (more, of)| (sum + more, rows + of));
        let parameters = model.orders().parameters();
        self.pass.loss = sum / runs.samples() as f64;
        if model.noise_variance.is_nan() && rows > parameters {
            self.model.noise_variance = sum / (rows - parameters) as f64;
        }
        self
    }

    /// Makes the model one of u and y times `unit`, a power of two.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if a number overflows.
    pub fn set_unit(&mut self, unit: f64) -> Result<(), FailureKind> {
        self.model.noise_variance *= unit * unit;
        self.pass.set_units(Units::shared(unit))
    }

    /// Returns the model.
    pub const fn linear(&self) -> &LinearModel {
        &self.model
    }

    /// Returns why the search, or the initial state after it, came to no end; `None` if all is well.
    pub fn unfinished(&self) -> Option<FailureKind> {
        self.pass.failure.map(|failure| failure.kind)
    }

    /// Returns the poles of the part that u drives.
    pub fn poles(&self) -> Vec<c64> {
        let a = &self.pass.a;
        let degree = self.linear().denominator().len() - 1;
        PoleFinder::new(a.len()).poles(&a[a.len() - degree..])
    }

    /// Returns what the covariance of the parameters says of poles, zeros and static gain.
    pub fn precision(&self) -> Precision {
        let mut precision = Precision::new(self.linear(), &self.poles());
        let continuous = &self.pass.continuous;
        if let Some(last) = continuous.numerator.last()
            && continuous.has_integrator()
        {
            // The sampled F(1) is 0 up to rounding.
            precision.static_gain = f64::INFINITY.copysign(*last);
            precision.static_gain_se = f64::NAN;
        }
        precision
    }

    /// Whether the record that was fitted begins at rest: x0 = 0.
    pub fn begins_at_rest(&self) -> bool {
        self.pass.x0.iter().all(|x| *x == 0.0)
    }

    /// Returns the one-step prediction errors over a record and their tests; `None` if they cannot be tested. A record
    /// that was fitted with x0 = 0 begins at rest, of others the start is free, as it is on `another` record.
    pub fn residuals(&self, u: &[f64], y: &[f64], another: bool, rounding: Rounding) -> Option<Residuals> {
        let start = if !another && self.begins_at_rest() {
            InitialCondition::Zero
        } else {
            InitialCondition::Estimate
        };
        Residuals::new(self.linear(), u, &self.less_offset(y), start, rounding)
    }

    /// Returns the constant of the output, if one was estimated; of several records that of the first.
    pub fn offset(&self) -> Option<Offset> {
        self.pass.offsets.first().copied()
    }

    /// Returns y less the offset, of which the model is.
    pub fn less_offset<'a>(&self, y: &'a [f64]) -> Cow<'a, [f64]> {
        self.pass.less_offset(0, y)
    }

    /// Returns the model with the offset of the i-th of the records that it was fitted to.
    #[must_use]
    pub fn of_record(&self, i: usize) -> Self {
        let mut of_record = self.clone();
        if i < of_record.pass.offsets.len() {
            of_record.pass.offsets.swap(0, i);
        }
        of_record
    }

    /// Returns u(k) and y(k + shift) of a record, of which the pass is.
    pub fn shifted<'a>(&self, u: &'a [f64], y: &'a [f64]) -> [&'a [f64]; 2] {
        let shift = self.shift.min(y.len());
        [&u[..u.len() - shift], &y[shift..]]
    }

    /// Returns the FIT over a range of samples of a record that begins with the one that was fitted; u and y are
    /// [`Self::shifted`].
    ///
    /// # Panics
    /// If u and y differ in length, or are shorter than the range or than `window`, the samples that were fitted.
    pub fn compare(&self, u: &[f64], y: &[f64], window: usize, range: Range<usize>, horizon: usize) -> Fit {
        self.compare_from(&self.pass.x0, u, y, window, range, horizon)
    }

    /// Returns the FIT on another record from [`Self::start_on`] it; u and y are [`Self::shifted`].
    ///
    /// # Panics
    /// If u and y differ in length.
    pub fn compare_on(&self, u: &[f64], y: &[f64], horizon: usize) -> Fit {
        self.compare_from(&self.start_on(u, y), u, y, y.len(), 0..y.len(), horizon)
    }

    /// Returns the FIT over a range of samples from an initial state, predicted one step and `horizon` steps ahead too.
    /// The first `window` samples determine the start of the predictor, unless the state is 0: then both begin at rest.
    ///
    /// # Panics
    /// If u and y differ in length, or are shorter than the range or than `window`.
    pub fn compare_from(
        &self,
        x0: &[f64],
        u: &[f64],
        y: &[f64],
        window: usize,
        range: Range<usize>,
        horizon: usize,
    ) -> Fit {
        assert!(u.len() == y.len() && range.end <= y.len());
        let Pass {
            model, a, b, direct: d, ..
        } = &self.pass;
        let y = self.less_offset(y);
        let (of_range, mut simulated, mut x) = (&y[range.clone()], 0.0, x0.to_vec());
        simulate(
            a,
            b,
            &mut x,
            &u[..range.end],
            #[inline(always)]
            |k, x| {
                if k >= range.start {
                    let error = y[k] - x[0] - d * u[k];
                    simulated += error * error;
                }
            },
        );
        let window = if x0.iter().all(|x| *x == 0.0) { 0 } else { window };
        let predicted = |horizon| fit_ahead(model, u, &y, window, range.clone(), horizon);
        Fit {
            simulated: percent(simulated, of_range, mean(of_range)),
            one_step: predicted(1),
            ahead: (horizon > 1).then(|| Ahead {
                steps: horizon,
                fit: predicted(horizon),
            }),
        }
    }

    /// Returns the initial state on another record, by least squares of the simulated output; NaN if it overflows. u
    /// and y are [`Self::shifted`].
    pub fn start_on(&self, u: &[f64], y: &[f64]) -> Vec<f64> {
        let Pass { a, b, direct, .. } = &self.pass;
        let y = self.less_offset(y);
        let y: Vec<f64> = y.iter().zip(u).map(|(y, u)| y - direct * u).collect();
        let mut x0 = vec![0.0; a.len()];
        let found = InitialState::new(x0.len()).estimate(a, b, Window::new(u, &y, y.len()), &mut x0);
        found.map_or_else(|_| vec![f64::NAN; a.len()], |()| x0)
    }

    /// Returns the output under u alone from a state at k = 0, of n numbers, with the offset.
    pub fn simulate_from(&self, mut x: Vec<f64>, u: &[f64]) -> Vec<f64> {
        let Pass { a, b, direct, .. } = &self.pass;
        let mu = self.offset().map_or(0.0, |offset| offset.value);
        let mut y = Vec::with_capacity(u.len());
        simulate(a, b, &mut x, u, |k, x| y.push(x[0] + direct * u[k] + mu));
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::{ArxOptions, ClrivOptions, InitialCondition, IvOptions, LsOptions, OeOptions, OffsetChoice};

    #[test]
    fn lengths_windows_and_singular_records_are_told() {
        let arx = || ArxOptions {
            orders: Some("na=2,nb=2,nk=1".parse().unwrap()),
            ..ArxOptions::default()
        };
        let error = fit(arx(), 2, &[1.0; 4], &[1.0; 5]).unwrap_err();
        assert_eq!(error, FitError::Lengths { u: 4, y: 5 });
        assert!(matches!(fit(arx(), 2, &[1.0; 5], &[1.0; 5]), Err(FitError::Setup(_))));
        let error = fit(arx(), 2, &[0.0; 50], &[0.0; 50]).unwrap_err();
        assert!(matches!(error, FitError::Failed(_)), "{error}");
    }

    /// A method for closed loops does not take u for r.
    #[test]
    fn a_loop_needs_its_reference() {
        let u: Vec<f64> = (0..80).map(|k| f64::from((k * k) % 7) - 3.0).collect();
        let mut y = vec![0.0; 80];
        for k in 1..80 {
            y[k] = 0.6 * y[k - 1] + 2.0 * u[k - 1];
        }
        let options = || ClrivOptions {
            orders: Some("nb=1,nf=1,nk=1".parse().unwrap()),
            ..ClrivOptions::default()
        };
        let error = fit(options(), 1, &u, &y).unwrap_err();
        assert_eq!(error, FitError::NoReference);
        // In open loop r is u.
        let model = fit_in_loop(options(), 1, &u, &y, &u).unwrap();
        assert!((model.linear().b[1] - 2.0).abs() < 1e-9);
    }

    /// A plant that runs about another operating point in each of two records, without noise: the model is exact on
    /// both, on a third about the first point, and in simulation.
    #[test]
    fn a_model_with_an_offset_has_it_on_other_records() {
        let input = |k: usize| 5.0 + ((k * k) % 7) as f64;
        let output = |count: usize, mu: f64| {
            let u: Vec<f64> = (0..count).map(input).collect();
            let mut y = vec![3.0; count];
            for k in 1..count {
                y[k] = 0.8 * y[k - 1] + 0.5 * u[k - 1];
            }
            for y in &mut y {
                *y += mu;
            }
            [u, y]
        };
        let [[u1, y1], [u2, y2], [u3, y3]] = [(60, 40.0), (50, -20.0), (30, 40.0)].map(|(n, mu)| output(n, mu));
        let options = OeOptions {
            orders: Some("nb=1,nf=1,nk=1".parse().unwrap()),
            initial: InitialCondition::Estimate,
            offset: OffsetChoice::Estimate,
            ..OeOptions::default()
        };
        let (u, y) = ([u1.clone(), u2.clone()].concat(), [y1, y2.clone()].concat());
        let fitted = fit_records(options, 1, &[60, 50], &u, &y, &u).unwrap();
        let of = |fitted: &Fitted| fitted.offset().unwrap().value;
        let second = fitted.of_record(1);
        assert!((of(&fitted) - 40.0).abs() < 1e-8 && (of(&second) + 20.0).abs() < 1e-8);
        for (fitted, u, y) in [(&second, &u2, &y2), (&fitted, &u3, &y3)] {
            let fit = fitted.compare_on(u, y, 3);
            assert!(fit.simulated.min(fit.one_step).min(fit.ahead.unwrap().fit) > 99.9999);
            let simulated = fitted.simulate_from(fitted.start_on(u, y), u);
            let off = simulated.iter().zip(y).map(|(simulated, y)| (simulated - y).abs());
            assert!(off.fold(0.0, f64::max) < 1e-7);
        }
        let from_x0 = fitted.simulate_from(fitted.pass.x0.clone(), &u1);
        assert!(from_x0.iter().zip(&y).all(|(found, y)| (found - y).abs() < 1e-7));
    }

    /// Given orders count, whatever the order is.
    #[test]
    fn orders_of_the_options_come_first() {
        let u: Vec<f64> = (0..60).map(|k| f64::from((k * k) % 7) - 3.0).collect();
        let mut y = vec![0.0; 60];
        for k in 2..60 {
            y[k] = 1.2 * y[k - 1] - 0.5 * y[k - 2] + u[k - 1] + 0.3 * u[k - 2];
        }
        for order in [1, 2, 5] {
            let orders = Some("na=2,nb=2,nk=1".parse().unwrap());
            let options = ArxOptions {
                orders,
                ..ArxOptions::default()
            };
            let model = fit(options, order, &u, &y).unwrap();
            assert_eq!(model.poles().len(), 2);
            assert!((model.linear().a[1] + 1.2).abs() < 1e-10);
        }
    }

    /// The paper's form by its order, without noise: exact.
    #[test]
    fn the_papers_form_has_no_orders() {
        let u: Vec<f64> = (0..60).map(|k| f64::from((k * k) % 7) - 3.0).collect();
        let mut y = vec![0.0; 60];
        for k in 2..60 {
            y[k] = 1.2 * y[k - 1] - 0.5 * y[k - 2] + u[k - 1] + 0.3 * u[k - 2];
        }
        for model in [
            fit(LsOptions::default(), 2, &u, &y).unwrap(),
            fit(IvOptions::default(), 2, &u, &y).unwrap(),
        ] {
            assert!((model.pass.a[1] - 1.2).abs() < 1e-10 && (model.pass.a[0] + 0.5).abs() < 1e-10);
            assert_eq!(model.poles().len(), 2);
            assert!(model.compare(&u, &y, 60, 0..60, 1).simulated > 99.9999);
        }
    }

    #[test]
    fn a_perfect_model_has_100_and_the_mean_has_0() {
        let u: Vec<f64> = (0..50).map(|k| f64::from((k * 7) % 5) - 2.0).collect();
        let fitted = |a: f64, b: f64| {
            let mut pass = Pass::new(1);
            (pass.a, pass.b) = (vec![a], vec![b]);
            pass.model = LinearModel::from_canonical(&[a], &[b], 1);
            Fitted::new(pass, 0)
        };
        let mut y = Vec::new();
        simulate(&[0.5], &[2.0], &mut [3.0], &u, |_, x| y.push(x[0]));
        let model = fitted(0.5, 2.0);
        let perfect = model.compare_from(&[3.0], &u, &y, 50, 10..50, 2);
        assert!((perfect.simulated - 100.0).abs() < 1e-10 && (perfect.one_step - 100.0).abs() < 1e-10);
        assert!((perfect.ahead.unwrap().fit - 100.0).abs() < 1e-10);
        let mean = y[10..].iter().sum::<f64>() / 40.0;
        let constant = fitted(1.0, 0.0).compare_from(&[mean], &u, &y, 50, 10..50, 1);
        assert!(constant.simulated.abs() < 1e-10);
        let level = model.compare_from(&[3.0], &u, &[1.0; 50], 50, 0..50, 2);
        assert!(level.simulated.is_nan());
    }
}
