//! Signals from Python, and arrays to it.

use numpy::{Element, PyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// A signal, at its place in Python's memory or in an array that was made of what was given.
pub(crate) struct Signal<'py>(PyReadonlyArray1<'py, f64>);

impl<'py> Signal<'py> {
    /// Reads a signal of finite numbers.
    pub(crate) fn new(name: &str, given: &Bound<'py, PyAny>) -> PyResult<Self> {
        let place = given.extract::<PyReadonlyArray1<'py, f64>>().ok();
        let place = place.filter(|array| array.as_slice().is_ok());
        let signal = if let Some(array) = place {
            Self(array)
        } else {
            let arrays = given.py().import("asobench._arrays")?;
            let made = arrays.getattr("signal")?.call1((name, given))?;
            Self(made.extract()?)
        };
        match signal.samples()?.iter().position(|x| !x.is_finite()) {
            Some(k) => Err(PyValueError::new_err(format!(
                "{name}: sample {k} is {}; expected finite numbers",
                signal.samples()?[k]
            ))),
            None => Ok(signal),
        }
    }

    /// Returns the samples.
    pub(crate) fn samples(&self) -> PyResult<&[f64]> {
        Ok(self.0.as_slice()?)
    }
}

/// Reads u and y, of equal lengths.
pub(crate) fn record<'py>(u: &Bound<'py, PyAny>, y: &Bound<'py, PyAny>) -> PyResult<(Signal<'py>, Signal<'py>)> {
    let (u, y) = (Signal::new("u", u)?, Signal::new("y", y)?);
    let [of_u, of_y] = [u.samples()?.len(), y.samples()?.len()];
    if of_u != of_y {
        return Err(PyValueError::new_err(format!(
            "u has {of_u} samples and y has {of_y}; expected equal lengths"
        )));
    }
    Ok((u, y))
}

/// Returns numbers as an array.
pub(crate) fn vector<T: Element>(py: Python<'_>, numbers: Vec<T>) -> Bound<'_, PyArray1<T>> {
    PyArray::from_vec(py, numbers)
}

/// Returns numbers, row by row, as an array of so many columns.
pub(crate) fn matrix(py: Python<'_>, numbers: Vec<f64>, columns: usize) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let rows = numbers.len().checked_div(columns).unwrap_or(0);
    PyArray::from_vec(py, numbers).reshape([rows, columns])
}
