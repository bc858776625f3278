//! Stage 12: the observer and its gain.

mod gain;
mod luenberger;

pub use gain::{Gain, GainError, Poles};
pub use luenberger::{ObservedModel, Observer};
