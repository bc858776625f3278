//! Records of u and y: simulated with their truth, or read from a file.

mod change;
mod closed_loop;
mod controller;
pub mod csv;
mod detrend;
mod process;
mod process_error;
mod realisation;
mod rounding;
mod source;
mod truth;

pub use change::{Change, ChangedPlant, PlantCourse};
pub use closed_loop::{Feedback, FeedbackError, OutputFeedback};
pub use controller::{ControlLaw, Controller, History};
pub use detrend::{Detrend, Trend};
pub use process::{Process, ProcessSettings};
pub use process_error::ProcessError;
pub use realisation::Realisation;
pub use rounding::Rounding;
pub(crate) use rounding::rounding_of;
pub use source::{NoiseColour, NoiseColourError, PlantSource};
pub use truth::{DrawFailure, Truth};
