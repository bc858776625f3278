//! A model as a class of Python, on which `asobench.Model` stands.

use super::arrays::{Signal, matrix, record, vector};
use asobench_identification::data::Rounding;
use asobench_identification::diagnosis::{FeedbackTest, Root, frequency_response, step_response};
use asobench_identification::estimator::{Failure, FailureKind, Offset, Pass, Progress};
use asobench_identification::metric::errors_ahead;
use asobench_identification::model::{ContinuousModel, LinearModel};
use asobench_identification::names::UnknownName;
use asobench_identification::observer::ObserverKind;
use asobench_identification::{Fitted, ModelObserver, NoiseCovariances};
use faer::Mat;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Several arrays.
type Arrays<'py, const N: usize> = [Bound<'py, PyArray1<f64>>; N];
/// Numbers in rows.
type Matrix<'py> = Bound<'py, PyArray2<f64>>;

/// A model `A y = B/F u + C/D e`, and the part of it that u drives in state space.
#[pyclass(frozen, module = "asobench._native")]
pub(crate) struct Native(pub(crate) Fitted);

/// Numerator, denominator, covariance, time between samples, hold and dead time in samples of a model in continuous
/// time.
type Continuous = (Vec<f64>, Vec<f64>, Vec<f64>, f64, String, f64);

/// The findings of an estimate beside the numbers of its model: the loss, the condition, iterations, minima, the kind
/// of failure of a search that left its best model or of the initial state, singular values, whether there is an
/// initial state, the model in continuous time of which this is the sampled one, and the constant of y in each record
/// with its standard error.
type Findings = (
    f64,
    f64,
    Option<usize>,
    Option<usize>,
    Option<String>,
    Vec<f64>,
    bool,
    Option<Continuous>,
    Vec<(f64, f64)>,
);

#[expect(clippy::needless_pass_by_value, reason = "what map_err hands on")]
fn unknown(error: UnknownName) -> PyErr {
    refused(error.to_string())
}

/// The most samples of a step response.
const MOST_STEPS: usize = 1_000_000;
/// The most digits of a number as text.
const MOST_DIGITS: usize = 100;

/// Refuses a length for which memory would be asked that is not there: a failed allocation ends the interpreter.
fn fits(name: &str, given: usize, most: usize) -> PyResult<()> {
    if given <= most {
        return Ok(());
    }
    Err(refused(format!(
        "{name}: {given}; expected a whole number of at most {most}"
    )))
}

fn refused(message: impl Into<String>) -> PyErr {
    PyValueError::new_err(message.into())
}

#[pymethods]
impl Native {
    /// Makes a model of its polynomials, B with its zeros of the delay.
    #[new]
    #[expect(clippy::too_many_arguments, reason = "the parts of a model")]
    fn new(
        a: Vec<f64>,
        b: Vec<f64>,
        c: Vec<f64>,
        d: Vec<f64>,
        f: Vec<f64>,
        delay: usize,
        noise_variance: f64,
        covariance: Vec<f64>,
        shift: usize,
        x0: Option<Vec<f64>>,
    ) -> PyResult<Self> {
        let model = LinearModel {
            a,
            b,
            c,
            d,
            f,
            delay,
            noise_variance,
            covariance,
        };
        let mut seen = model.clone();
        seen.delay -= shift;
        seen.b.drain(..shift);
        let n = seen.orders().order();
        let mut pass = Pass::new(n);
        pass.set_model(&seen, f64::NAN)
            .map_err(|kind| refused(format!("a model whose numbers are {kind}")))?;
        match x0 {
            None => pass.start_at_zero(),
            Some(x0) if x0.len() == n => pass.set_initial_state(&x0),
            Some(x0) => {
                let given = x0.len();
                return Err(refused(format!("x0: {given} numbers; expected the order, {n}")));
            }
        }
        Ok(Self(Fitted { pass, model, shift }))
    }

    /// The model with what an estimate found beside its numbers.
    fn with_findings(&self, findings: Findings) -> PyResult<Self> {
        let (loss, condition, iterations, minima, status, singular_values, start, continuous, offsets) = findings;
        let mut pass = self.0.pass.clone();
        if let Some((numerator, denominator, covariance, step, hold, dead_time)) = continuous {
            pass.continuous = ContinuousModel {
                numerator,
                denominator,
                covariance,
                step,
                hold: hold.parse().map_err(unknown)?,
                dead_time,
            };
            pass.unstable |= pass.continuous.has_integrator();
        }
        (pass.loss, pass.condition) = (loss, condition);
        (pass.iterations, pass.minima) = (iterations, minima);
        pass.singular_values = singular_values;
        let offsets = offsets.into_iter();
        pass.offsets = offsets.map(|(value, se)| Offset { value, se }).collect();
        if !start {
            pass.progress = Progress::Parameters;
        }
        let kind: Option<FailureKind> = status.map(|kind| kind.parse()).transpose().map_err(unknown)?;
        pass.failure = kind.map(Failure::from);
        let (model, shift) = (self.0.model.clone(), self.0.shift);
        Ok(Self(Fitted { pass, model, shift }))
    }

    /// A, B, C, D and F, each with all its coefficients.
    fn polynomials<'py>(&self, py: Python<'py>) -> Arrays<'py, 5> {
        let LinearModel { a, b, c, d, f, .. } = &self.0.model;
        [a, b, c, d, f].map(|polynomial| vector(py, polynomial.clone()))
    }

    #[getter]
    fn delay(&self) -> usize {
        self.0.model.delay
    }

    #[getter]
    fn orders(&self) -> String {
        self.0.model.orders().to_string()
    }

    #[getter]
    fn shift(&self) -> usize {
        self.0.shift
    }

    #[getter]
    fn noise_variance(&self) -> f64 {
        self.0.model.noise_variance
    }

    #[getter]
    fn unstable(&self) -> bool {
        self.0.pass.unstable
    }

    #[getter]
    fn x0<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        let known = self.0.pass.progress == Progress::InitialState;
        known.then(|| vector(py, self.0.pass.x0.clone()))
    }

    fn findings(&self) -> Findings {
        let pass = self.0.pass.clone();
        let ContinuousModel {
            numerator,
            denominator,
            covariance,
            step,
            hold,
            dead_time,
        } = pass.continuous;
        let hold = hold.name().to_owned();
        (
            pass.loss,
            pass.condition,
            pass.iterations,
            pass.minima,
            pass.failure.map(|failure| failure.kind.name().to_owned()),
            pass.singular_values,
            pass.progress == Progress::InitialState,
            (!numerator.is_empty()).then_some((numerator, denominator, covariance, step, hold, dead_time)),
            pass.offsets.iter().map(|offset| (offset.value, offset.se)).collect(),
        )
    }

    /// The parameters, in the order A, B, C, D, F.
    fn params<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.0.model.parameters().collect())
    }

    /// Their standard errors.
    fn se<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0.model.standard_errors().map(|errors| vector(py, errors))
    }

    /// Their covariance.
    fn cov<'py>(&self, py: Python<'py>) -> PyResult<Option<Matrix<'py>>> {
        let n = self.0.model.orders().parameters();
        let known = (!self.0.model.covariance.is_empty()).then(|| self.0.model.covariance.clone());
        known.map(|known| matrix(py, known, n)).transpose()
    }

    /// a, b, h and d of the state space form of the part that u drives, without the shift.
    fn canonical<'py>(&self, py: Python<'py>) -> (Arrays<'py, 3>, f64) {
        let Pass { a, b, h, direct, .. } = &self.0.pass;
        ([a, b, h].map(|part| vector(py, part.clone())), *direct)
    }

    /// The model as an equation.
    fn equation(&self, digits: usize) -> PyResult<String> {
        fits("digits", digits, MOST_DIGITS)?;
        Ok(self.0.model.equation(Some(digits)))
    }

    /// Poles, zeros (real and imaginary part, their standard errors and covariance, that of the modulus), the static
    /// gain and its standard error, and the orders without poles and zeros that may cancel.
    fn precision<'py>(&self, py: Python<'py>) -> PyResult<(Matrix<'py>, Matrix<'py>, f64, f64, Vec<String>)> {
        let precision = self.0.precision();
        let rows = |roots: &[Root]| {
            let row = |root: &Root| {
                let Root { at, error } = root;
                [at.re, at.im, error.re, error.im, error.covariance, error.modulus]
            };
            matrix(py, roots.iter().flat_map(row).collect(), 6)
        };
        let without = precision.cancellations.iter();
        let without = without.map(|pair| pair.orders_without(self.0.model.orders()).to_string());
        Ok((
            rows(&precision.poles)?,
            rows(&precision.zeros)?,
            precision.static_gain,
            precision.static_gain_se,
            without.collect(),
        ))
    }

    /// |G|, the standard error of ln |G|, the phase in rad and its standard error.
    fn frequency_response<'py>(&self, py: Python<'py>, omega: &Bound<'py, PyAny>) -> PyResult<Arrays<'py, 4>> {
        let omega = Signal::new("w", omega)?;
        let omega = omega.samples()?;
        let points = py.detach(|| frequency_response(&self.0.model, omega));
        let column = |of: fn(&asobench_identification::diagnosis::FrequencyPoint) -> f64| {
            vector(py, points.iter().map(of).collect())
        };
        Ok([
            column(|point| point.magnitude),
            column(|point| point.log_magnitude_se),
            column(|point| point.phase),
            column(|point| point.phase_se),
        ])
    }

    /// The step response and its standard errors.
    fn step_response<'py>(&self, py: Python<'py>, samples: usize) -> PyResult<Arrays<'py, 2>> {
        fits("samples", samples, MOST_STEPS)?;
        let points = py.detach(|| step_response(&self.0.model, samples));
        let value = points.iter().map(|point| point.value).collect();
        Ok([
            vector(py, value),
            vector(py, points.iter().map(|point| point.se).collect()),
        ])
    }

    /// The output under u alone with the offset, from a state at k = 0 or from rest.
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        u: &Bound<'py, PyAny>,
        x0: Option<Vec<f64>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let u = Signal::new("u", u)?;
        let u = u.samples()?;
        let Some(x) = x0 else {
            let mut y = vec![0.0; u.len()];
            py.detach(|| self.0.model.simulate(u, &mut y));
            let mu = self.0.offset().map_or(0.0, |offset| offset.value);
            for y in &mut y {
                *y += mu;
            }
            return Ok(vector(py, y));
        };
        let (given, n) = (x.len(), self.0.pass.a.len());
        if given != n {
            return Err(refused(format!("x0: {given} numbers; expected the order, {n}")));
        }
        if self.0.shift > 0 {
            let nk = self.0.model.delay;
            return Err(refused(format!(
                "x0: of a model whose delay nk = {nk} is not in its state; simulate from rest"
            )));
        }
        Ok(vector(py, py.detach(|| self.0.simulate_from(x, u))))
    }

    /// The errors of predictions some steps ahead and the first that counts; `None` if the predictor has no start.
    fn errors<'py>(
        &self,
        py: Python<'py>,
        u: &Bound<'py, PyAny>,
        y: &Bound<'py, PyAny>,
        horizon: usize,
    ) -> PyResult<Option<(usize, Bound<'py, PyArray1<f64>>)>> {
        let (u, y) = record(u, y)?;
        let (u, y) = (u.samples()?, y.samples()?);
        let y = self.0.less_offset(y);
        let errors = py.detach(|| errors_ahead(&self.0.model, u, &y, y.len(), horizon));
        Ok(errors.map(|(first, errors)| (first, vector(py, errors))))
    }

    /// The residuals with their tests, and the test of the record for feedback, as JSON; `None` where not tested.
    /// `own`: on the record of the estimate, from its start.
    fn tests(
        &self,
        py: Python<'_>,
        u: &Bound<'_, PyAny>,
        y: &Bound<'_, PyAny>,
        own: bool,
    ) -> PyResult<(Option<String>, Option<String>)> {
        let (u, y) = record(u, y)?;
        let (u, y) = (u.samples()?, y.samples()?);
        let (residuals, feedback) = py.detach(|| {
            let rounding = Rounding::of(u, y);
            (
                self.0.residuals(u, y, !own, rounding),
                FeedbackTest::of(u, y, self.0.model.delay, rounding),
            )
        });
        let residuals = residuals.map(|residuals| serde_json::to_string(&residuals));
        let feedback = feedback.map(|feedback| serde_json::to_string(&feedback));
        let failed = |error: serde_json::Error| refused(error.to_string());
        Ok((
            residuals.transpose().map_err(failed)?,
            feedback.transpose().map_err(failed)?,
        ))
    }

    /// FIT of the simulated and of the predicted output in per cent, one step and `horizon` steps ahead. `own`: on the
    /// record of the estimate, from its x0.
    fn fit(
        &self,
        py: Python<'_>,
        u: &Bound<'_, PyAny>,
        y: &Bound<'_, PyAny>,
        own: bool,
        horizon: usize,
    ) -> PyResult<(f64, f64, f64)> {
        let (u, y) = record(u, y)?;
        let (u, y) = (u.samples()?, y.samples()?);
        if self.0.pass.progress < Progress::InitialState || u.len() <= self.0.shift {
            return Ok((f64::NAN, f64::NAN, f64::NAN));
        }
        let [u, y] = self.0.shifted(u, y);
        let found = py.detach(|| {
            if own {
                self.0.compare(u, y, y.len(), 0..y.len(), horizon)
            } else {
                self.0.compare_on(u, y, horizon)
            }
        });
        let ahead = found.ahead.map_or(found.one_step, |ahead| ahead.fit);
        Ok((found.simulated, found.one_step, ahead))
    }

    /// The observer of the model, with Q by rows, r and P(0) by rows where they are known, or identified on a record.
    fn observer(
        &self,
        py: Python<'_>,
        kind: &str,
        noise: Option<(Vec<f64>, f64, Option<Vec<f64>>)>,
        u: &Bound<'_, PyAny>,
        y: &Bound<'_, PyAny>,
    ) -> PyResult<NativeObserver> {
        let kind: ObserverKind = kind.parse().map_err(|error| refused(format!("{error}")))?;
        let n = self.0.pass.a.len();
        let square = |rows: &Vec<f64>| Mat::from_fn(n, n, |i, j| rows[i * n + j]);
        let wrong = noise.iter().flat_map(|(q, _, p0)| p0.iter().chain([q]));
        if let Some(rows) = wrong.into_iter().find(|rows| rows.len() != n * n) {
            let found = rows.len();
            return Err(refused(format!("Q, P0: {found} numbers; expected {n} x {n}")));
        }
        let noise = noise.map(|(q, measurement, p0)| NoiseCovariances {
            process: square(&q),
            measurement,
            start: p0.as_ref().map(square),
        });
        let (u, y) = record(u, y)?;
        let (u, y) = (u.samples()?, y.samples()?);
        let found = py.detach(|| self.0.observer(&kind, noise.as_ref(), u, y));
        found.map(NativeObserver).map_err(|error| refused(error.to_string()))
    }
}

/// An observer of a model.
#[pyclass(frozen, module = "asobench._native")]
pub(crate) struct NativeObserver(ModelObserver);

#[pymethods]
impl NativeObserver {
    /// The gain, and the poles as rows of real and imaginary part.
    fn gain<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyArray1<f64>>, Matrix<'py>)> {
        let poles = self.0.poles.iter().flat_map(|pole| [pole.re, pole.im]);
        let poles = matrix(py, poles.collect(), 2)?;
        Ok((vector(py, self.0.gain.clone()), poles))
    }

    /// Q, r, the covariance of the states' errors in the steady state, and the variance of the innovations.
    #[expect(clippy::type_complexity, reason = "what Python unpacks")]
    fn noise<'py>(&self, py: Python<'py>) -> PyResult<(Option<Matrix<'py>>, Option<f64>, Option<Matrix<'py>>, f64)> {
        let square = |m: &Mat<f64>| {
            let n = m.nrows();
            let rows = (0..n).flat_map(|i| (0..n).map(move |j| m[(i, j)]));
            matrix(py, rows.collect(), n)
        };
        let noise = self.0.noise.as_ref();
        Ok((
            noise.map(|noise| square(&noise.process)).transpose()?,
            noise.map(|noise| noise.measurement),
            self.0.covariance.as_ref().map(square).transpose()?,
            self.0.innovation,
        ))
    }

    /// xhat(k), k = 0 ... K, their standard deviations, predictions, innovations and the p-value of their test.
    fn run<'py>(
        &self,
        py: Python<'py>,
        u: &Bound<'py, PyAny>,
        y: &Bound<'py, PyAny>,
    ) -> PyResult<(Matrix<'py>, Option<Matrix<'py>>, Arrays<'py, 2>, f64)> {
        let (u, y) = record(u, y)?;
        let (u, y) = (u.samples()?, y.samples()?);
        let found = py.detach(|| self.0.run(u, y));
        let found = found.map_err(|error| refused(error.to_string()))?;
        let n = found.order;
        let known = (!found.deviations.is_empty()).then_some(found.deviations);
        Ok((
            matrix(py, found.states, n)?,
            known.map(|known| matrix(py, known, n)).transpose()?,
            [vector(py, found.predictions), vector(py, found.innovations)],
            found.white.map_or(f64::NAN, |white| white.p_value),
        ))
    }
}

/// A value and its standard error as text, both to the place of the error's second digit.
#[pyfunction]
pub(crate) fn measured(value: f64, error: f64) -> [String; 2] {
    asobench_identification::number::measured(value, error)
}
