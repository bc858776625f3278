//! The observers of one run.

use super::exponentials::exp_m1;
use super::least_squares::{LeastSquares, LeastSquaresIntegrals, MixedSquares};
use super::linear::LinearState;
use super::mixed_signals::MixedNodes;
use super::operators::Nodes;
use super::proposed::Proposed;
use super::scalar::{At, Excited, ScalarEstimator};
use super::settings::ObserverSpec;
use super::summary::{Excitation, ObserverEstimate};
use crate::real::{MOST_LANES, Real};

/// An observer's state.
#[derive(Clone, Debug)]
pub struct Estimator<R> {
    kind: Kind<R>,
    /// One for each component of theta; none without scalar regressions.
    scalars: Vec<ScalarEstimator<R>>,
}

/// Where the scalar regressions or the estimate come from.
#[derive(Clone, Debug)]
enum Kind<R> {
    /// The k-th state observer, whose estimate is part of the linear state.
    State(usize),
    /// Eq. (10).
    Gradient,
    /// The same with the estimates corrected: the share that must have been learnt.
    FiniteTime(f64),
    /// Mixed least squares.
    LsDrem(MixedSquares<R>),
    /// Eqs. (11) to (17).
    Proposed(Proposed<R>),
    /// Least squares on Eq. (9).
    KalmanBucy(LeastSquares<R>),
}

impl<R: Real> Estimator<R> {
    /// Returns the estimators of checked settings for order n; h is the first step's length, which matters to delays
    /// only.
    pub fn all(specs: &[ObserverSpec], n: usize, h: f64) -> Vec<Self> {
        let mut states = 0..;
        let build = |spec: &ObserverSpec| Self {
            kind: match spec {
                ObserverSpec::Luenberger { .. } | ObserverSpec::Filter { .. } => {
                    Kind::State(states.next().unwrap_or_default())
                }
                ObserverSpec::Gradient { .. } => Kind::Gradient,
                ObserverSpec::FiniteTime { share, .. } => Kind::FiniteTime(*share),
                ObserverSpec::LsDrem { p0, r, .. } => Kind::LsDrem(MixedSquares::new(r / p0, n)),
                ObserverSpec::Proposed {
                    k,
                    order,
                    filters,
                    factor,
                    ..
                } => Kind::Proposed(Proposed::new(*k, *order, filters, n, *factor, h)),
                ObserverSpec::KalmanBucy { p0, r } => Kind::KalmanBucy(LeastSquares::new(*p0, *r, n)),
            },
            scalars: spec.gains().iter().map(|gain| ScalarEstimator::new(*gain)).collect(),
        };
        specs.iter().map(build).collect()
    }

    /// Advances one step of length h, given the nodes, whether they may have jumped at its start, and the integrals
    /// in the middle and at the end of the step.
    #[inline(always)]
    pub fn step(&mut self, h: R, nodes: &MixedNodes<R>, jump: bool, information: [&LeastSquaresIntegrals<R>; 2]) {
        let scalars = &mut self.scalars[..];
        match &mut self.kind {
            Kind::State(_) | Kind::KalmanBucy(_) => {}
            Kind::Gradient | Kind::FiniteTime(_) => step_all(scalars, h, &nodes.delta, &nodes.mbar),
            Kind::LsDrem(squares) => {
                squares.step(information);
                step_all(scalars, h, &squares.delta, &squares.mixed);
            }
            Kind::Proposed(proposed) => proposed.step(scalars, h, &nodes.delta, &nodes.mbar, jump),
        }
    }

    /// Notes how much has been learnt by the ends t of a step, in each lane.
    #[inline(always)]
    pub fn record(&mut self, t: &[f64; MOST_LANES]) {
        for scalar in &mut self.scalars {
            scalar.record(t);
        }
    }

    /// Computes the estimate at the end or in the middle of the last step, given the linear state and the integrals
    /// there.
    #[inline(always)]
    pub fn estimate(
        &mut self,
        at: At,
        linear: &LinearState<R>,
        information: &LeastSquaresIntegrals<R>,
        out: &mut ObserverEstimate<R>,
    ) {
        match &mut self.kind {
            Kind::State(k) => {
                out.x.copy_from_slice(&linear.observers[*k].x);
                return;
            }
            Kind::FiniteTime(share) => {
                for i in 0..self.scalars.len() {
                    let (found, learnt) = self.scalars[i].state(at);
                    let (learnt, share) = (-exp_m1(-learnt), R::splat(*share));
                    let enough = share.less(learnt);
                    out.theta[i] = found / R::select(enough, learnt, share);
                }
            }
            Kind::Gradient | Kind::LsDrem(_) | Kind::Proposed(_) => {
                for i in 0..self.scalars.len() {
                    out.theta[i] = self.scalars[i].state(at).0;
                }
            }
            Kind::KalmanBucy(squares) => squares.solve(information, &mut out.theta),
        }
        linear.reconstruct(&out.theta, &mut out.x);
    }

    /// Returns what the scalar estimators have learnt over the horizon, in a lane; empty if there are none.
    pub fn excitation(&self, horizon: f64, lane: usize) -> Excitation {
        let of = |scalar: &ScalarEstimator<R>| (scalar.integral.lane(lane), scalar.window.frozen_at(horizon, lane));
        let (integral, frozen_at) = self.scalars.iter().map(of).unzip();
        Excitation { integral, frozen_at }
    }
}

/// Advances estimators that have Delta in common.
#[inline(always)]
fn step_all<R: Real>(scalars: &mut [ScalarEstimator<R>], h: R, delta: &Nodes<R>, mixed: &[Nodes<R>]) {
    let excited = Excited::new(h, delta);
    let mut decay = None;
    for i in 0..scalars.len() {
        scalars[i].step_with(&excited, &mixed[i], &mut decay);
    }
}
