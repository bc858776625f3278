//! Stage 12: the observer and its gain, or a Kalman filter instead.

pub mod adaptive;
mod discrete_gpebo;
mod gain;
pub mod gpebo;
mod kalman;
mod kind;
mod likelihood;
mod luenberger;
mod lyapunov;
mod placement;
mod riccati;
mod steady;
mod stochastic_model;

pub use discrete_gpebo::{DiscreteGpebo, ThetaEstimator};
pub use gain::{Gain, GainError, Poles};
pub use kalman::{GainSequence, Kalman};
pub use kind::{ObserverKind, ObserverKindError};
pub use likelihood::{
    Likelihood, ProcessNoise, RatioError, VarianceRatio, maximum_likelihood_ratio,
};
pub use luenberger::{ObservedModel, Observer};
pub use lyapunov::lyapunov;
pub use placement::{butterworth, parse_poles, place};
pub use riccati::{Riccati, RiccatiError, care, dare};
use steady::eliminate;
pub use stochastic_model::{MeasurementNoise, StochasticModel};
