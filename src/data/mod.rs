//! Records of u and y: simulated with their truth, or read from a file.

pub mod csv;
mod detrend;
mod process;

pub use detrend::{Detrend, Trend};
pub use process::{Process, ProcessError, Realisation};
