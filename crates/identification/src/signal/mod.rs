//! Input sequences, coloured noise and the random streams behind them.
//!
//! All of it follows [`arithmetic`], so that simulated data have the same bits on every machine. The exception is the
//! waves of continuous time, which take sine and cosine from the platform.

pub mod arithmetic;
mod input;
mod level;
pub mod noise;
pub mod normal;
pub mod periodic_input;
mod random_stream;
mod wave;
mod wave_sum;

pub use input::{Input, InputLaw, RandomSigns, Sequence, fill_white};
pub use level::{LevelOf, LevelOver, LevelReading, ProcessVariances};
pub use noise::{NoiseFilter, NoiseFilterError, NoiseLaw};
pub use random_stream::state_of;
pub use random_stream::{Purpose, Stream, stream};
pub use wave::{Hold, SignalError, Wave};
pub use wave_sum::Signal;
