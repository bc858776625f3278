//! Stage 12: the observer's gain. The observer itself is [`crate::plant::observe`].

mod gain;

pub use gain::{Gain, GainError};
