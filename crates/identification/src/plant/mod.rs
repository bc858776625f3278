//! The true system: the canonical SISO plant, its forms, simulation, poles.

mod balance;
pub mod canonical;
mod continuous_plant;
mod exponential;
mod observability;
mod own_states;
mod paper;
mod poles;
pub mod radius;
mod random_plant;
mod sampled_plant;
mod simulate;
pub use simulate::inlined;
pub mod stability;
mod state_noise;
mod system;

pub(crate) use balance::{Equilibrated, in_units, own_rate, power_of_two};
pub use balance::{balance, eigenvalues};
pub use continuous_plant::{ContinuousPlant, ContinuousPlantError};
pub use exponential::exponential;
pub(crate) use exponential::exponential_by;
pub(crate) use observability::Observability;
pub use observability::observability_rank;
pub use own_states::{OwnStates, sampled_noise};
pub use paper::{Numerator, nikolov2023};
pub use poles::{PoleFinder, parse_pole, polynomial_from_poles, unmatched_pole};
pub use random_plant::random_stable;
pub use sampled_plant::{SAMPLED_DEGREE_LIMIT, Sampling, SamplingError};
pub(crate) use simulate::simulate_disturbed;
pub use simulate::{drive, observe, simulate};
pub use state_noise::{StateNoise, StateNoiseError};
pub use system::{StateSpace, SystemError};

/// The largest order of a plant or a model. At this order a matrix takes some MB, and the coefficients of any stable
/// plant, which are below 2^n, are finite.
pub const ORDER_LIMIT: usize = 1000;
