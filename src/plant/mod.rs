//! The true system: the canonical SISO plant, its forms, simulation, poles.

pub mod canonical;
mod paper;
mod poles;
mod random;
mod simulate;
pub mod stability;
mod system;

pub use paper::{Numerator, nikolov2023};
pub use poles::{PoleFinder, polynomial_from_poles};
pub use random::random_stable;
pub use simulate::{drive, observe, simulate};
pub use system::{StateSpace, SystemError, TransferFunction};
