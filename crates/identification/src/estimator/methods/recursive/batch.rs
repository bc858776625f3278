//! A recursive estimator on a whole window: what it has found after the last sample.

use super::RecursiveEstimator;
use crate::estimator::initial_state_choice::{StartState, StateEstimate};
use crate::estimator::{FailureKind, Pass, SinglePass, Visit, Window};
use crate::model::LinearModel;

/// Runs a recursion over the window, which finds theta after the last sample, and before where it needs it. The pass's
/// `iterations` is the number of samples taken, so that it says at which k a number was found not to be finite.
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
        let last = samples.next_back();
        let ran = samples.try_for_each(|(u, y)| recursion.advance(*u, *y, false));
        let ran = ran.and_then(|()| last.map_or(Ok(()), |(u, y)| recursion.update(*u, *y)));
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

impl<R: RecursiveEstimator> SinglePass for Batch<R> {
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        self.find(window, pass)?;
        self.state.estimate(window, 0, pass);
        Ok(())
    }

    fn fit_along(&mut self, window: Window<'_>, at: &[usize], pass: &mut Pass, visit: &mut Visit<'_>) {
        let Self { recursion, model, .. } = self;
        recursion.restart();
        along(window, at, pass, |sample, pass, k| {
            let (u, y) = sample;
            let goes_on = recursion.update(u, y).is_ok();
            if let Some(k) = k {
                if goes_on && recursion.is_determined() {
                    model.set_parameters(recursion.theta());
                    // Without a model there is nothing to be said of this k.
                    let _ = pass.set_model(model, f64::NAN);
                }
                visit(k, pass, None);
            }
        });
    }
}

/// Calls `step((u, y), pass, k)` for each sample, k being the number of samples where it is one of `at`; the pass comes
/// cleared.
pub(in crate::estimator) fn along(
    window: Window<'_>,
    at: &[usize],
    pass: &mut Pass,
    mut step: impl FnMut((f64, f64), &mut Pass, Option<usize>),
) {
    let mut at = at.iter().copied().peekable();
    for (i, (u, y)) in window.u.iter().zip(window.y).enumerate() {
        let k = at.next_if_eq(&(i + 1));
        if k.is_some() {
            pass.clear();
        }
        step((*u, *y), pass, k);
    }
}
