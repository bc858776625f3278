//! Records of u and y: simulated with their truth, or read from a file.

mod controller;
pub mod csv;
mod detrend;
mod feedback;
mod process;
mod realisation;
mod source;

pub use controller::{ControlLaw, Controller, History};
pub use detrend::{Detrend, Trend};
pub use feedback::{Feedback, FeedbackError, OutputFeedback};
pub use process::{Process, ProcessError, ProcessSettings};
pub use realisation::{DrawFailure, Realisation, Truth};
pub use source::{NoiseColour, NoiseColourError, PlantSource};
