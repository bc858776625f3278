//! The observers of one run.

use super::filter::Nodes;
use super::least_squares_mixing::MixedSquares;
use super::linear::LinearState;
use super::observer_spec::ObserverSpec;
use super::proposed::Proposed;
use super::recursive::{LeastSquares, LeastSquaresIntegrals};
use super::scalar::{At, ScalarEstimator};
use super::summary::{Excitation, ObserverEstimate};

/// The first mixing's result and Eq. (9) at the nodes of a step.
#[derive(Clone, Debug)]
pub struct MixedNodes {
    /// Delta.
    pub delta: Nodes,
    /// mbar, n of them.
    pub mbar: Vec<Nodes>,
    /// phi = C'Phi, n of them.
    pub phi: Vec<Nodes>,
    /// z.
    pub z: Nodes,
}

/// An observer's state.
#[derive(Clone, Debug)]
pub enum Estimator {
    /// The k-th full-order observer. Its state is part of the linear state.
    Luenberger(usize),
    /// The k-th time-varying filter, whose state is there too.
    Filter(usize),
    /// One scalar estimator for each component of Eq. (10).
    Gradient(Vec<ScalarEstimator>),
    /// The same with their estimates corrected: the share that must have been learnt.
    FiniteTime(Vec<ScalarEstimator>, f64),
    /// Scalar estimators on mixed least squares.
    LsDrem(Vec<ScalarEstimator>, MixedSquares),
    /// Eqs. (11) to (17).
    Proposed(Proposed),
    /// Least squares on Eq. (9).
    KalmanBucy(LeastSquares),
}

impl Estimator {
    /// Returns the estimators of checked settings for order n; h is the first step's length, which matters to delays
    /// only.
    pub fn all(specs: &[ObserverSpec], n: usize, h: f64) -> Vec<Self> {
        let (mut luenberger, mut filter) = (0.., 0..);
        let build = |spec: &ObserverSpec| match spec {
            ObserverSpec::Luenberger { .. } => {
                Self::Luenberger(luenberger.next().unwrap_or_default())
            }
            ObserverSpec::Filter { .. } => Self::Filter(filter.next().unwrap_or_default()),
            ObserverSpec::Gradient { gains } => Self::Gradient(scalars(gains)),
            ObserverSpec::FiniteTime { gains, share } => Self::FiniteTime(scalars(gains), *share),
            ObserverSpec::LsDrem { gains, p0, r } => {
                Self::LsDrem(scalars(gains), MixedSquares::new(r / p0, n))
            }
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

    /// Advances one step of length h, given the nodes and the integrals in the middle and at the end of the step.
    #[inline]
    pub fn step(&mut self, h: f64, nodes: &MixedNodes, information: [&LeastSquaresIntegrals; 2]) {
        match self {
            Self::Luenberger(_) | Self::Filter(_) | Self::KalmanBucy(_) => {}
            Self::Gradient(scalars) | Self::FiniteTime(scalars, _) => {
                for (scalar, mbar) in scalars.iter_mut().zip(&nodes.mbar) {
                    scalar.step(h, &nodes.delta, mbar);
                }
            }
            Self::LsDrem(scalars, squares) => {
                squares.step(information);
                for (scalar, mixed) in scalars.iter_mut().zip(&squares.mixed) {
                    scalar.step(h, &squares.delta, mixed);
                }
            }
            Self::Proposed(proposed) => proposed.step(h, &nodes.delta, &nodes.mbar),
        }
    }

    /// Notes how much has been learnt by the end t of a step.
    pub fn record(&mut self, t: f64) {
        match self {
            Self::Luenberger(_) | Self::Filter(_) | Self::KalmanBucy(_) => {}
            Self::Gradient(scalars) | Self::FiniteTime(scalars, _) | Self::LsDrem(scalars, _) => {
                for scalar in scalars.iter_mut() {
                    scalar.record(t);
                }
            }
            Self::Proposed(proposed) => proposed.scalars_mut().for_each(|scalar| scalar.record(t)),
        }
    }

    /// Computes the estimate at the end or in the middle of the last step, given the linear state and the integrals
    /// there.
    pub fn estimate(
        &mut self,
        at: At,
        linear: &LinearState,
        information: &LeastSquaresIntegrals,
        out: &mut ObserverEstimate,
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
                collect(scalars.iter(), at, &mut out.theta);
            }
            Self::FiniteTime(scalars, share) => {
                for (scalar, theta) in scalars.iter().zip(&mut out.theta) {
                    let (found, learnt) = scalar.state(at);
                    *theta = found / (-(-learnt).exp_m1()).max(*share);
                }
            }
            Self::Proposed(proposed) => collect(proposed.scalars(), at, &mut out.theta),
            Self::KalmanBucy(squares) => squares.solve(information, &mut out.theta),
        }
        linear.reconstruct(&out.theta, &mut out.x);
    }

    /// Returns what the scalar estimators have learnt over the horizon; empty if there are none.
    pub fn excitation(&self, horizon: f64) -> Excitation {
        match self {
            Self::Luenberger(_) | Self::Filter(_) | Self::KalmanBucy(_) => Excitation::default(),
            Self::Gradient(scalars) | Self::FiniteTime(scalars, _) | Self::LsDrem(scalars, _) => {
                excitation(scalars.iter(), horizon)
            }
            Self::Proposed(proposed) => excitation(proposed.scalars(), horizon),
        }
    }
}

fn scalars(gains: &[f64]) -> Vec<ScalarEstimator> {
    gains
        .iter()
        .map(|gain| ScalarEstimator::new(*gain))
        .collect()
}

fn collect<'a>(scalars: impl Iterator<Item = &'a ScalarEstimator>, at: At, theta: &mut [f64]) {
    for (scalar, theta) in scalars.zip(theta) {
        *theta = scalar.state(at).0;
    }
}

fn excitation<'a>(scalars: impl Iterator<Item = &'a ScalarEstimator>, horizon: f64) -> Excitation {
    let (integral, frozen_at) = scalars
        .map(|scalar| (scalar.integral(), scalar.frozen_at(horizon)))
        .unzip();
    Excitation {
        integral,
        frozen_at,
    }
}
