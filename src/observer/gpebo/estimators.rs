//! The observers of one run.

use super::filter::Nodes;
use super::linear::LinearState;
use super::proposed::Proposed;
use super::recursive::{LeastSquares, LeastSquaresIntegrals};
use super::scalar::ScalarEstimator;
use super::scenario::ObserverSpec;
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
    /// One scalar estimator for each component of Eq. (10).
    Gradient(Vec<ScalarEstimator>),
    /// Eqs. (11) to (17).
    Proposed(Proposed),
    /// Least squares on Eq. (9).
    KalmanBucy(LeastSquares),
}

impl Estimator {
    /// Returns the estimators of checked settings for order n; h is the first step's length, which matters to delays
    /// only.
    pub fn all(specs: &[ObserverSpec], n: usize, h: f64) -> Vec<Self> {
        let mut luenberger = 0..;
        let build = |spec: &ObserverSpec| match spec {
            ObserverSpec::Luenberger { .. } => {
                Self::Luenberger(luenberger.next().unwrap_or_default())
            }
            ObserverSpec::Gradient { gains } => Self::Gradient(
                gains
                    .iter()
                    .map(|gain| ScalarEstimator::new(*gain))
                    .collect(),
            ),
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

    /// Advances one step of length h.
    #[inline]
    pub fn step(&mut self, h: f64, nodes: &MixedNodes) {
        match self {
            Self::Luenberger(_) | Self::KalmanBucy(_) => {}
            Self::Gradient(scalars) => {
                for (scalar, mbar) in scalars.iter_mut().zip(&nodes.mbar) {
                    scalar.step(h, &nodes.delta, mbar);
                }
            }
            Self::Proposed(proposed) => proposed.step(h, &nodes.delta, &nodes.mbar),
        }
    }

    /// Computes the estimate at t and notes how much has been learnt by then.
    pub fn estimate(
        &mut self,
        t: f64,
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
            Self::Gradient(scalars) => record(scalars.iter_mut(), t, &mut out.theta),
            Self::Proposed(proposed) => record(proposed.scalars_mut(), t, &mut out.theta),
            Self::KalmanBucy(squares) => squares.solve(information, &mut out.theta),
        }
        linear.reconstruct(&out.theta, &mut out.x);
    }

    /// Returns what the scalar estimators have learnt over the horizon; empty if there are none.
    pub fn excitation(&self, horizon: f64) -> Excitation {
        match self {
            Self::Luenberger(_) | Self::KalmanBucy(_) => Excitation::default(),
            Self::Gradient(scalars) => excitation(scalars.iter(), horizon),
            Self::Proposed(proposed) => excitation(proposed.scalars(), horizon),
        }
    }
}

fn record<'a>(scalars: impl Iterator<Item = &'a mut ScalarEstimator>, t: f64, theta: &mut [f64]) {
    for (scalar, theta) in scalars.zip(theta) {
        scalar.record(t);
        *theta = scalar.theta();
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
