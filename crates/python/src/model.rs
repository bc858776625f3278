//! A model as a class of Python, on which `asobench.Model` stands.

use super::arrays::{Signal, matrix, record, vector};
use asobench_identification::diagnosis::{
    Precision, Residuals, Root, feedback_p_value, frequency_response, step_response,
};
use asobench_identification::estimator::{Failure, FailureKind, Pass, Progress};
use asobench_identification::metric::{FitModel, fit, prediction_errors};
use asobench_identification::model::polynomial::{divide, filter};
use asobench_identification::model::{ContinuousModel, LinearModel};
use asobench_identification::names::UnknownName;
use asobench_identification::observer::{Gain, Observer};
use asobench_identification::plant::PoleFinder;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Several arrays.
type Arrays<'py, const N: usize> = [Bound<'py, PyArray1<f64>>; N];
/// Numbers in rows.
type Matrix<'py> = Bound<'py, PyArray2<f64>>;

/// A model `A y = B/F u + C/D e`, and the part of it that u drives in state space.
#[pyclass(frozen, module = "asobench._native")]
pub(crate) struct Native {
    /// The model of the record.
    pub(crate) model: LinearModel,
    /// The estimate, of the record whose output is `shift` samples earlier.
    pub(crate) pass: Pass,
    /// By how many samples.
    pub(crate) shift: usize,
}

/// Numerator, denominator, covariance, time between samples, hold and dead time in samples of a model in continuous
/// time.
type Continuous = (Vec<f64>, Vec<f64>, Vec<f64>, f64, String, usize);

#[expect(clippy::needless_pass_by_value, reason = "what map_err hands on")]
fn unknown(error: UnknownName) -> PyErr {
    refused(error.to_string())
}

/// The most samples of a step response, and of what is as long as a record.
const MOST_STEPS: usize = 1_000_000;
const MOST_SAMPLES: usize = 1 << 27;
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
                return Err(refused(format!(
                    "x0: {given} numbers; expected the order, {n}"
                )));
            }
        }
        Ok(Self { model, pass, shift })
    }

    /// The model with what an estimate found beside its numbers.
    #[expect(clippy::too_many_arguments, reason = "what an estimate found")]
    fn with_findings(
        &self,
        loss: f64,
        condition: f64,
        iterations: Option<usize>,
        minima: Option<usize>,
        status: Option<&str>,
        singular_values: Vec<f64>,
        start: bool,
        continuous: Option<Continuous>,
    ) -> PyResult<Self> {
        let mut pass = self.pass.clone();
        if let Some((numerator, denominator, covariance, step, hold, dead_time)) = continuous {
            pass.continuous = ContinuousModel {
                numerator,
                denominator,
                covariance,
                step,
                hold: hold.parse().map_err(unknown)?,
                dead_time,
            };
        }
        (pass.loss, pass.condition) = (loss, condition);
        (pass.iterations, pass.minima) = (iterations, minima);
        pass.singular_values = singular_values;
        if !start {
            pass.progress = Progress::Parameters;
        }
        let kind: Option<FailureKind> = status.map(str::parse).transpose().map_err(unknown)?;
        pass.failure = kind.map(Failure::from);
        let (model, shift) = (self.model.clone(), self.shift);
        Ok(Self { model, pass, shift })
    }

    /// A, B, C, D and F, each with all its coefficients.
    fn polynomials<'py>(&self, py: Python<'py>) -> Arrays<'py, 5> {
        let LinearModel { a, b, c, d, f, .. } = &self.model;
        [a, b, c, d, f].map(|polynomial| vector(py, polynomial.clone()))
    }

    #[getter]
    fn delay(&self) -> usize {
        self.model.delay
    }

    #[getter]
    fn orders(&self) -> String {
        self.model.orders().to_string()
    }

    #[getter]
    fn shift(&self) -> usize {
        self.shift
    }

    #[getter]
    fn noise_variance(&self) -> f64 {
        self.model.noise_variance
    }

    #[getter]
    fn loss(&self) -> f64 {
        self.pass.loss
    }

    #[getter]
    fn condition(&self) -> f64 {
        self.pass.condition
    }

    #[getter]
    fn iterations(&self) -> Option<usize> {
        self.pass.iterations
    }

    #[getter]
    fn minima(&self) -> Option<usize> {
        self.pass.minima
    }

    #[getter]
    fn unstable(&self) -> bool {
        self.pass.unstable
    }

    /// The kind of failure of a search that left its best model, or of the initial state.
    #[getter]
    fn status(&self) -> Option<&str> {
        let failure: Option<&Failure> = self.pass.failure.as_ref();
        failure.map(|failure| failure.kind.name())
    }

    /// The model in continuous time of which this is the sampled one.
    #[getter]
    fn continuous(&self) -> Option<Continuous> {
        let ContinuousModel {
            numerator,
            denominator,
            covariance,
            step,
            hold,
            dead_time,
        } = self.pass.continuous.clone();
        let parts = (
            numerator,
            denominator,
            covariance,
            step,
            hold.name().to_owned(),
            dead_time,
        );
        (!parts.0.is_empty()).then_some(parts)
    }

    #[getter]
    fn singular_values<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.pass.singular_values.clone())
    }

    #[getter]
    fn x0<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        let known = self.pass.progress == Progress::InitialState;
        known.then(|| vector(py, self.pass.x0.clone()))
    }

    /// The parameters, in the order A, B, C, D, F.
    fn params<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.model.parameters().collect())
    }

    /// Their standard errors.
    fn se<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.model
            .standard_errors()
            .map(|errors| vector(py, errors))
    }

    /// Their covariance.
    fn cov<'py>(&self, py: Python<'py>) -> PyResult<Option<Matrix<'py>>> {
        let n = self.model.orders().parameters();
        let known = (!self.model.covariance.is_empty()).then(|| self.model.covariance.clone());
        known.map(|known| matrix(py, known, n)).transpose()
    }

    /// a, b, h and d of the state space form of the part that u drives, without the shift.
    fn canonical<'py>(&self, py: Python<'py>) -> (Arrays<'py, 3>, f64) {
        let Pass {
            a, b, h, direct, ..
        } = &self.pass;
        ([a, b, h].map(|part| vector(py, part.clone())), *direct)
    }

    /// The model as an equation.
    fn equation(&self, digits: usize) -> PyResult<String> {
        fits("digits", digits, MOST_DIGITS)?;
        Ok(self.model.equation().rounded(digits).to_string())
    }

    /// Poles, zeros (real and imaginary part, their standard errors and covariance, that of the modulus), the static
    /// gain and its standard error, and the orders without poles and zeros that may cancel.
    fn precision<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Matrix<'py>, Matrix<'py>, f64, f64, Vec<String>)> {
        let precision = Precision::new(&self.model, &self.poles());
        let rows = |roots: &[Root]| {
            let row = |root: &Root| {
                let Root { at, error } = root;
                [
                    at.re,
                    at.im,
                    error.re,
                    error.im,
                    error.covariance,
                    error.modulus,
                ]
            };
            matrix(py, roots.iter().flat_map(row).collect(), 6)
        };
        let without = precision.cancellations.iter();
        let without = without.map(|pair| pair.orders_without(self.model.orders()).to_string());
        Ok((
            rows(&precision.poles)?,
            rows(&precision.zeros)?,
            precision.static_gain,
            precision.static_gain_se,
            without.collect(),
        ))
    }

    /// |G|, the standard error of ln |G|, the phase in rad and its standard error.
    fn frequency_response<'py>(
        &self,
        py: Python<'py>,
        omega: &Bound<'py, PyAny>,
    ) -> PyResult<Arrays<'py, 4>> {
        let omega = Signal::new("w", omega)?;
        let omega = omega.samples()?;
        let points = py.detach(|| frequency_response(&self.model, omega));
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
        let points = py.detach(|| step_response(&self.model, samples));
        let value = points.iter().map(|point| point.value).collect();
        Ok([
            vector(py, value),
            vector(py, points.iter().map(|point| point.se).collect()),
        ])
    }

    /// The output under u alone, from a state at k = 0 or from rest.
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        u: &Bound<'py, PyAny>,
        x0: Option<Vec<f64>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let u = Signal::new("u", u)?;
        let u = u.samples()?;
        let Pass { a, b, direct, .. } = &self.pass;
        let Some(mut x) = x0 else {
            let mut y = vec![0.0; u.len()];
            py.detach(|| self.model.simulate(u, &mut y));
            return Ok(vector(py, y));
        };
        if x.len() != a.len() {
            let (given, n) = (x.len(), a.len());
            return Err(refused(format!(
                "x0: {given} numbers; expected the order, {n}"
            )));
        }
        if self.shift > 0 {
            let nk = self.model.delay;
            return Err(refused(format!(
                "x0: of a model whose delay nk = {nk} is not in its state; simulate from rest"
            )));
        }
        let mut y = Vec::with_capacity(u.len());
        py.detach(|| {
            asobench_identification::plant::simulate(a, b, &mut x, u, |k, x| {
                y.push(x[0] + direct * u[k]);
            });
        });
        Ok(vector(py, y))
    }

    /// The prediction errors and the first that counts; `None` if the predictor has no start.
    fn errors<'py>(
        &self,
        py: Python<'py>,
        u: &Bound<'py, PyAny>,
        y: &Bound<'py, PyAny>,
    ) -> PyResult<Option<(usize, Bound<'py, PyArray1<f64>>)>> {
        let (u, y) = record(u, y)?;
        let (u, y) = (u.samples()?, y.samples()?);
        let errors = py.detach(|| prediction_errors(&self.model, u, y, y.len()));
        Ok(errors.map(|(first, errors)| (first, vector(py, errors))))
    }

    /// The first `count` samples of the impulse response of C/(A D).
    fn noise_response<'py>(
        &self,
        py: Python<'py>,
        count: usize,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        fits("count", count, MOST_SAMPLES)?;
        let (mut impulse, mut h) = (vec![0.0; count], vec![0.0; count]);
        impulse[..1.min(count)].fill(1.0);
        filter(&self.model.c, &impulse, &mut h);
        divide(&self.model.d, &mut h);
        divide(&self.model.a, &mut h);
        Ok(vector(py, h))
    }

    /// The residuals with their tests as JSON, and the p-value of feedback in the record; `None` where not tested.
    fn tests(
        &self,
        py: Python<'_>,
        u: &Bound<'_, PyAny>,
        y: &Bound<'_, PyAny>,
    ) -> PyResult<(Option<String>, Option<f64>)> {
        let (u, y) = record(u, y)?;
        let (u, y) = (u.samples()?, y.samples()?);
        let (residuals, feedback) = py.detach(|| {
            let residuals = Residuals::new(&self.model, u, y);
            (residuals, feedback_p_value(u, y, self.model.delay))
        });
        let written = residuals.map(|residuals| serde_json::to_string(&residuals));
        let written = written
            .transpose()
            .map_err(|error| refused(error.to_string()))?;
        Ok((written, feedback))
    }

    /// FIT of the simulated and of the predicted output in per cent. `own`: on the record of the estimate, from its x0.
    fn fit(
        &self,
        py: Python<'_>,
        u: &Bound<'_, PyAny>,
        y: &Bound<'_, PyAny>,
        own: bool,
    ) -> PyResult<(f64, f64)> {
        let (u, y) = record(u, y)?;
        let (u, y) = (u.samples()?, y.samples()?);
        if self.pass.progress < Progress::InitialState || u.len() <= self.shift {
            return Ok((f64::NAN, f64::NAN));
        }
        let (u, y) = (&u[..u.len() - self.shift], &y[self.shift..]);
        let Pass {
            model,
            a,
            b,
            direct,
            x0,
            ..
        } = &self.pass;
        let found = py.detach(|| {
            let start = if own { x0.clone() } else { self.start_on(u, y) };
            let model = FitModel {
                model,
                a,
                b,
                d: *direct,
                x0: &start,
            };
            fit(model, u, y, y.len(), 0..y.len())
        });
        Ok((found.simulated, found.one_step))
    }

    /// The states of the observer, k = 0 ... K, and its gain.
    fn observe<'py>(
        &self,
        py: Python<'py>,
        gain: &str,
        u: &Bound<'py, PyAny>,
        y: &Bound<'py, PyAny>,
    ) -> PyResult<(Matrix<'py>, Bound<'py, PyArray1<f64>>)> {
        let gain: Gain = gain.parse().map_err(|error| refused(format!("{error}")))?;
        let n = self.pass.a.len();
        gain.check(n).map_err(|error| refused(error.to_string()))?;
        let (u, y) = record(u, y)?;
        let (u, y) = (u.samples()?, y.samples()?);
        let shift = self.shift.min(y.len());
        let (u, y) = (&u[..u.len() - shift], &y[shift..]);
        let model = self.pass.observed().ok_or_else(|| {
            refused("the observer needs a delay nk of at least 1 and an initial state; this model has not both")
        })?;
        let mut states = Vec::with_capacity((y.len() + 1) * n);
        let mut observer = Observer::new(gain, n);
        let observed = py.detach(|| observer.run(model, u, y, |_, x| states.extend_from_slice(x)));
        observed.map_err(|kind| refused(format!("the observer's state is {kind}")))?;
        states.extend_from_slice(observer.state());
        Ok((matrix(py, states, n)?, vector(py, observer.g().to_vec())))
    }
}

impl Native {
    /// Returns the poles of B/(A F), without those at 0 that a delay adds.
    fn poles(&self) -> Vec<faer::c64> {
        let a = &self.pass.a;
        let degree = self.model.a.len() + self.model.f.len() - 2;
        PoleFinder::new(a.len()).poles(&a[a.len() - degree..])
    }

    /// Returns the initial state on another record, by least squares of the simulated output; NaN if it overflows.
    fn start_on(&self, u: &[f64], y: &[f64]) -> Vec<f64> {
        use asobench_identification::estimator::Window;
        use asobench_identification::estimator::initial_state::InitialState;
        let Pass { a, b, direct, .. } = &self.pass;
        let y: Vec<f64> = y.iter().zip(u).map(|(y, u)| y - direct * u).collect();
        let mut x0 = vec![0.0; a.len()];
        let found =
            InitialState::new(x0.len()).estimate(a, b, Window::new(u, &y, y.len()), &mut x0);
        found.map_or_else(|_| vec![f64::NAN; a.len()], |()| x0)
    }
}
