//! Stage 12: the observer and its gain.

mod gain;
pub mod gpebo;
mod luenberger;
mod lyapunov;
mod placement;
mod riccati;

pub use gain::{Gain, GainError, Poles};
pub use luenberger::{ObservedModel, Observer};
pub use lyapunov::lyapunov;
pub use placement::{butterworth, parse_poles, place};
pub use riccati::{Riccati, RiccatiError, care, dare};
