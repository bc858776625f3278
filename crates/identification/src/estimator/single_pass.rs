//! Estimators with one pass: what they all do at its begin and at its end.

use super::{Estimator, FailureKind, Pass, Visit, Window};
use crate::model::{ContinuousModel, LinearModel};

/// An estimator with one pass.
pub trait SinglePass: Send {
    /// Fills a cleared pass.
    ///
    /// # Errors
    /// The failure of the pass; numbers set before it stay valid.
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind>;

    /// As [`Estimator::run_along`].
    fn fit_along(&mut self, _: Window<'_>, _at: &[usize], _: &mut Pass, _visit: &mut Visit<'_>) {}
}

impl<T: SinglePass> Estimator for T {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        if let Some(pass) = passes.first_mut()
            && let Err(kind) = self.fit(window, pass)
        {
            pass.fail_for(kind);
        }
    }

    fn run_along(&mut self, window: Window<'_>, at: &[usize], pass: &mut Pass, visit: &mut Visit<'_>) {
        self.fit_along(window, at, pass, visit);
    }
}

/// An iteration to a model. One that does not come to rest may leave its best model
/// ([`FailureKind::leaves_a_model`]), without covariance and condition.
pub trait Iteration: Send {
    /// Iterates, and counts the steps. Returns the condition of the last.
    ///
    /// # Errors
    /// Why it did not come to rest.
    fn find(&mut self, window: Window<'_>, steps: &mut usize) -> Result<f64, FailureKind>;

    /// Computes the model's noise variance, and its covariance if the iteration came to rest. Returns the sum of
    /// squared prediction errors.
    ///
    /// # Errors
    /// Why there is no model or no covariance.
    fn conclude(&mut self, window: Window<'_>, at_rest: bool) -> Result<f64, FailureKind>;

    /// Returns the model that was found.
    fn model(&self) -> &LinearModel;

    /// Writes what is of the record beside the model: its start, at rest by default.
    fn of_record(&mut self, _window: Window<'_>, pass: &mut Pass) {
        pass.start_at_zero();
    }

    /// Returns the model in continuous time, if the method has one.
    fn continuous(&self) -> Option<&ContinuousModel> {
        None
    }
}

impl<T: Iteration> SinglePass for T {
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        let mut steps = 0;
        let found = self.find(window, &mut steps);
        pass.iterations = Some(steps);
        if let Err(kind) = found
            && !kind.leaves_a_model()
        {
            return Err(kind);
        }
        pass.loss = self.conclude(window, found.is_ok())? / window.len() as f64;
        pass.set_model(self.model(), found.unwrap_or(f64::NAN))?;
        if let Some(continuous) = self.continuous() {
            pass.continuous.clone_from(continuous);
            // A pole at 1 has rounding on either side.
            pass.unstable |= continuous.has_integrator();
        }
        self.of_record(window, pass);
        found.map(|_| ())
    }
}
