//! A recursive estimator on a whole window: what it has found after the last sample.

use super::RecursiveEstimator;
use crate::estimator::start_state::{StartState, StateEstimate};
use crate::estimator::{Estimator, FailureKind, Pass, Window};
use crate::model::LinearModel;

/// Runs a recursion over the window. `iterations` of the pass is the number of samples taken, so that it says at which k
/// a recursion diverged.
pub(super) struct Batch<R> {
    recursion: R,
    model: LinearModel,
    state: StateEstimate,
    covariance: bool,
}

impl<R: RecursiveEstimator> Batch<R> {
    /// `covariance`: whether P is a covariance but for a factor.
    pub(super) fn new(recursion: R, start: StartState, covariance: bool) -> Self {
        let orders = recursion.orders();
        Self {
            model: LinearModel::zero(orders),
            state: StateEstimate::new(orders.order(), start),
            recursion,
            covariance,
        }
    }

    fn find(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        let recursion = &mut self.recursion;
        recursion.restart();
        let mut samples = window.u.iter().zip(window.y);
        let ran = samples.try_for_each(|(u, y)| recursion.update(*u, *y));
        pass.iterations = Some(recursion.samples());
        ran.map_err(|diverged| diverged.kind)?;
        if !recursion.is_determined() {
            return Err(FailureKind::RankDeficient);
        }
        let (model, d) = (&mut self.model, recursion.theta().len());
        model.set_parameters(recursion.theta());
        model.noise_variance = recursion.noise_variance();
        model.covariance.clear();
        if self.covariance && model.noise_variance.is_finite() {
            model.covariance.resize(d * d, 0.0);
            recursion.covariance(&mut model.covariance);
        }
        pass.set_model(model, f64::NAN)
    }
}

impl<R: RecursiveEstimator> Estimator for Batch<R> {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        let Some(pass) = passes.first_mut() else {
            return;
        };
        pass.clear();
        match self.find(window, pass) {
            Ok(()) => self.state.estimate(window, 0, pass),
            Err(kind) => pass.fail_for(kind),
        }
    }
}
