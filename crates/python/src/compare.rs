//! ARX models of several orders over the same equations.

use super::arrays::record;
use asobench_identification::estimator::{Criterion, OrderComparison};
use asobench_identification::model::Orders;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The loss of each model, its criteria in the order of their names, and its parameters.
type Row = (Option<f64>, Vec<Option<f64>>, Vec<f64>);

/// Compares ARX models of orders (na, nb, nk): the number of equations, the names of the criteria, a row for each
/// model, and the best row by each criterion.
#[pyfunction]
#[expect(clippy::type_complexity, reason = "a tuple for Python")]
pub(crate) fn compare_orders(
    py: Python<'_>,
    orders: Vec<(usize, usize, usize)>,
    u: &Bound<'_, PyAny>,
    y: &Bound<'_, PyAny>,
) -> PyResult<(usize, Vec<&'static str>, Vec<Row>, Vec<Option<usize>>)> {
    let (u, y) = record(u, y)?;
    let (u, y) = (u.samples()?, y.samples()?);
    let orders: Vec<Orders> = orders.into_iter().map(|(na, nb, nk)| Orders::arx(na, nb, nk)).collect();
    let comparison = py.detach(|| {
        let mut comparison = OrderComparison::new(&orders, y.len())?;
        comparison.run(u, y);
        Ok(comparison)
    });
    let comparison = comparison
        .map_err(|error: asobench_identification::estimator::SetupError| PyValueError::new_err(error.to_string()))?;
    let equations = comparison.equations();
    let row = |candidate: &asobench_identification::estimator::Candidate| {
        let loss = candidate.loss.ok();
        let value = |criterion: &Criterion| {
            let value = criterion.value(loss?, equations, candidate.orders.parameters());
            value.is_finite().then_some(value)
        };
        let values = Criterion::ALL.iter().map(value).collect();
        (loss, values, candidate.theta().to_vec())
    };
    Ok((
        equations,
        Criterion::ALL.iter().map(|criterion| criterion.name()).collect(),
        comparison.candidates().iter().map(row).collect(),
        Criterion::ALL
            .iter()
            .map(|criterion| comparison.best(*criterion).ok())
            .collect(),
    ))
}
