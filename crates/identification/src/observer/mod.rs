//! Stage 12: the observer and its gain, or a Kalman filter instead.

mod ackermann;
mod discrete_gpebo;
pub mod gpebo;
mod kalman;
mod kind;
mod likelihood;
mod luenberger;
mod lyapunov;
mod pole_placement;
mod riccati;
mod steady;
mod stochastic_model;

pub use ackermann::{butterworth, parse_poles, place};
pub use discrete_gpebo::{DiscreteGpebo, ThetaEstimator};
pub use kalman::{GainSequence, Kalman};
pub use kind::{ObserverKind, ObserverKindError};
pub use likelihood::{Likelihood, ProcessNoise, RatioError, VarianceRatio, maximum_likelihood_ratio};
pub use luenberger::{ObservedModel, Observer};
pub use lyapunov::lyapunov;
pub use pole_placement::{Gain, GainError, Poles};
pub use riccati::{Riccati, RiccatiError, care, care_correlated, dare};
use steady::{determinant, eliminate};
pub use stochastic_model::{MeasurementNoise, StochasticModel};
