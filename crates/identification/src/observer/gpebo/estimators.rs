//! The observers of one run.

use super::exponentials::exp_m1;
use super::filter::Nodes;
use super::least_squares_mixing::MixedSquares;
use super::linear::LinearState;
use super::observer_spec::ObserverSpec;
use super::proposed::Proposed;
use super::recursive::{LeastSquares, LeastSquaresIntegrals};
use super::scalar::{At, Excited, ScalarEstimator};
use super::summary::{Excitation, ObserverEstimate};
use crate::real::{MOST_LANES, Real};

/// The first mixing's result and Eq. (9) at the nodes of a step.
#[derive(Clone, Debug)]
pub struct MixedNodes<R> {
    /// Delta.
    pub delta: Nodes<R>,
    /// mbar, n of them.
    pub mbar: Vec<Nodes<R>>,
    /// phi = C'Phi, n of them.
    pub phi: Vec<Nodes<R>>,
    /// z.
    pub z: Nodes<R>,
}

/// An observer's state.
#[derive(Clone, Debug)]
pub enum Estimator<R> {
    /// The k-th full-order observer. Its state is part of the linear state.
    Luenberger(usize),
    /// The k-th time-varying filter, whose state is there too.
    Filter(usize),
    /// One scalar estimator for each component of Eq. (10).
    Gradient(Vec<ScalarEstimator<R>>),
    /// The same with their estimates corrected: the share that must have been learnt.
    FiniteTime(Vec<ScalarEstimator<R>>, f64),
    /// Scalar estimators on mixed least squares.
    LsDrem(Vec<ScalarEstimator<R>>, MixedSquares<R>),
    /// Eqs. (11) to (17).
    Proposed(Proposed<R>),
    /// Least squares on Eq. (9).
    KalmanBucy(LeastSquares<R>),
}

impl<R: Real> Estimator<R> {
    /// Returns the estimators of checked settings for order n; h is the first step's length, which matters to delays
    /// only.
    pub fn all(specs: &[ObserverSpec], n: usize, h: f64) -> Vec<Self> {
        let (mut luenberger, mut filter) = (0.., 0..);
        let build = |spec: &ObserverSpec| match spec {
            ObserverSpec::Luenberger { .. } => Self::Luenberger(luenberger.next().unwrap_or_default()),
            ObserverSpec::Filter { .. } => Self::Filter(filter.next().unwrap_or_default()),
            ObserverSpec::Gradient { gains } => Self::Gradient(scalars(gains)),
            ObserverSpec::FiniteTime { gains, share } => Self::FiniteTime(scalars(gains), *share),
            ObserverSpec::LsDrem { gains, p0, r } => Self::LsDrem(scalars(gains), MixedSquares::new(r / p0, n)),
            ObserverSpec::Proposed {
                k,
                order,
                filters,
                gains,
                factor,
            } => Self::Proposed(Proposed::new(*k, *order, filters, gains, *factor, h)),
            ObserverSpec::KalmanBucy { p0, r } => Self::KalmanBucy(LeastSquares::new(*p0, *r, n)),
        };
        specs.iter().map(build).collect()
    }

    /// Advances one step of length h, given the nodes, whether they may have jumped at its start, and the integrals
    /// in the middle and at the end of the step.
    #[inline(always)]
    pub fn step(&mut self, h: R, nodes: &MixedNodes<R>, jump: bool, information: [&LeastSquaresIntegrals<R>; 2]) {
        match self {
            Self::Luenberger(_) | Self::Filter(_) | Self::KalmanBucy(_) => {}
            Self::Gradient(scalars) | Self::FiniteTime(scalars, _) => {
                step_all(scalars, h, &nodes.delta, &nodes.mbar);
            }
            Self::LsDrem(scalars, squares) => {
                squares.step(information);
                step_all(scalars, h, &squares.delta, &squares.mixed);
            }
            Self::Proposed(proposed) => proposed.step(h, &nodes.delta, &nodes.mbar, jump),
        }
    }

    /// Notes how much has been learnt by the ends t of a step, in each lane.
    #[inline(always)]
    pub fn record(&mut self, t: &[f64; MOST_LANES]) {
        match self {
            Self::Luenberger(_) | Self::Filter(_) | Self::KalmanBucy(_) => {}
            Self::Gradient(scalars) | Self::FiniteTime(scalars, _) | Self::LsDrem(scalars, _) => {
                for scalar in scalars.iter_mut() {
                    scalar.record(t);
                }
            }
            Self::Proposed(proposed) => {
                for scalar in proposed.scalars_mut() {
                    scalar.record(t);
                }
            }
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
        match self {
            Self::Luenberger(k) => {
                let n = out.x.len();
                out.x.copy_from_slice(linear.luenberger(*k, n));
                return;
            }
            Self::Filter(k) => {
                out.x.copy_from_slice(linear.filters[*k].x());
                return;
            }
            Self::Gradient(scalars) | Self::LsDrem(scalars, _) => {
                for i in 0..scalars.len() {
                    out.theta[i] = scalars[i].state(at).0;
                }
            }
            Self::FiniteTime(scalars, share) => {
                for i in 0..scalars.len() {
                    let (found, learnt) = scalars[i].state(at);
                    let (learnt, share) = (-exp_m1(-learnt), R::splat(*share));
                    let enough = share.less(learnt);
                    out.theta[i] = found / R::select(enough, learnt, share);
                }
            }
            Self::Proposed(proposed) => {
                for (i, scalar) in proposed.scalars().enumerate() {
                    out.theta[i] = scalar.state(at).0;
                }
            }
            Self::KalmanBucy(squares) => squares.solve(information, &mut out.theta),
        }
        linear.reconstruct(&out.theta, &mut out.x);
    }

    /// Returns what the scalar estimators have learnt over the horizon, in a lane; empty if there are none.
    pub fn excitation(&self, horizon: f64, lane: usize) -> Excitation {
        let (integral, frozen_at) = self
            .scalars()
            .into_iter()
            .map(|scalar| {
                let integral = scalar.integral().lane(lane);
                (integral, scalar.frozen_at(horizon, lane))
            })
            .unzip();
        Excitation { integral, frozen_at }
    }

    fn scalars(&self) -> Vec<&ScalarEstimator<R>> {
        match self {
            Self::Luenberger(_) | Self::Filter(_) | Self::KalmanBucy(_) => vec![],
            Self::Gradient(scalars) | Self::FiniteTime(scalars, _) | Self::LsDrem(scalars, _) => {
                scalars.iter().collect()
            }
            Self::Proposed(proposed) => proposed.scalars().collect(),
        }
    }
}

fn scalars<R: Real>(gains: &[f64]) -> Vec<ScalarEstimator<R>> {
    gains.iter().map(|gain| ScalarEstimator::new(*gain)).collect()
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
