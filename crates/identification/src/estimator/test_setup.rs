//! The setup of estimators' tests: an estimate of a whole record, a plant by its orders, random numbers.

use super::{MethodKind, Pass, Shape, Window};
use crate::model::LinearModel;
use crate::signal::{Input, InputLaw, Purpose, Sequence, stream};

/// The estimate of a whole record by a method with one pass.
pub(super) fn estimate(options: &dyn MethodKind, order: usize, u: &[f64], y: &[f64]) -> Pass {
    let window = y.len();
    let mut method = options.prepare(&Shape { order, window }.into()).unwrap();
    let mut passes = [Pass::new(order)];
    method.estimate(Window::new(u, y, window), &mut passes);
    let [pass] = passes;
    pass
}

/// The model of these orders, such as "nb=2,nf=2", with these coefficients.
pub(super) fn plant(orders: &str, parameters: &[f64]) -> LinearModel {
    let mut model = LinearModel::zero(orders.parse().unwrap());
    model.set_parameters(parameters);
    model
}

/// n independent normal numbers of variance 1.
pub(super) fn normal(seed: u64, trial: u64, purpose: Purpose, n: usize) -> Vec<f64> {
    let mut signal = vec![0.0; n];
    let input = Input::new(InputLaw::Gaussian, 1.0, Sequence::Independent);
    input.fill(&mut stream(seed, trial, purpose), &mut signal);
    signal
}
