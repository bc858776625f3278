//! Why a process cannot be made.

use crate::plant::{ORDER_LIMIT, SystemError};
use crate::signal::{LevelOf, LevelOver, NoiseFilterError};

/// Why a process was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProcessError {
    /// The plant's coefficients are wrong.
    #[error(transparent)]
    System(#[from] SystemError),
    /// The noise filter is wrong.
    #[error(transparent)]
    Noise(#[from] NoiseFilterError),
    /// The order or radius of random plants is out of range.
    #[error(
        "random plants need an order of at least 1 (and at most {ORDER_LIMIT}) and a radius in (0, 1), \
         not {0} and {1}"
    )]
    RandomPlant(usize, f64),
    /// x0 does not have the length of the order, or is not finite.
    #[error("x0 must be {0} finite numbers, one per state")]
    InitialState(usize),
    /// The amplitude is negative or not finite, or zero in open loop.
    #[error("the input's amplitude must be finite and positive (or 0 with feedback), not {0}")]
    Amplitude(f64),
    /// A size of a signal is so large or so small that squares of samples overflow or underflow.
    #[error("{0} of {1:e} makes signals whose squares cannot be told; expected signals of 1e-100 to 1e100")]
    Size(&'static str, f64),
    /// The input-measurement noise is out of range.
    #[error(
        "the input-measurement noise must be a finite percentage, at least 0, of a positive amplitude, \
         not {0} % of {1}"
    )]
    InputNoise(f64, f64),
    /// A standard deviation of process noise or initial states is out of range.
    #[error("{0} must be a finite standard deviation of at least 0, not {1}")]
    Deviation(&'static str, f64),
    /// Process noise or random initial states are used in a closed loop.
    #[error("{0} is for open loop only; expected 0 with feedback, not {1}")]
    DisturbedLoop(&'static str, f64),
    /// Covariances of noise do not fit the plant, or stand beside a deviation.
    #[error("covariances of the noise must be of {0} states, without a process_noise beside them")]
    StateNoise(usize),
    /// Covariances of noise in a closed loop.
    #[error("covariances of the noise are for open loop only; expected feedback = \"none\"")]
    StateNoiseInLoop,
    /// A variance of measurement noise that is not white.
    #[error("R is the variance of white measurement noise; expected noise = \"white\" beside it")]
    ColouredVariance,
    /// A reading of eta is used that only an open loop has.
    #[error("with feedback, eta must be 'exact' with the 'noise-free' output, or 'absolute', not '{over}' with '{of}'")]
    LevelWithFeedback {
        /// Realisation or process.
        over: LevelOver,
        /// Noise-free or measured output.
        of: LevelOf,
    },
    /// A reading of eta is meaningless.
    #[error("eta_over = \"{over}\" refers to no output; expected eta_of = \"noise-free\", not '{of}'")]
    LevelOfNothing {
        /// The reading of what eta is taken over, namely nothing.
        over: LevelOver,
        /// The reading of the output.
        of: LevelOf,
    },
    /// Nominal variances are asked for with an input whose process variance at the output is not known.
    #[error(
        "eta '{0}' needs the variance of the output's process, which is not known for given samples and binary inputs; \
         expected 'exact' or 'absolute'"
    )]
    LevelOfSamples(LevelOver),
    /// The plant that another becomes has another order.
    #[error("a plant of order {1} cannot become one of order {0}; expected the same order")]
    ChangedOrder(usize, usize),
    /// The factors of a change are out of range.
    #[error("a change by a gain of {0} and a factor on the poles of {1}; expected finite numbers, the second above 0")]
    ChangeFactors(f64, f64),
    /// The plant of a closed loop changes.
    #[error("a plant that changes is for open loop only; expected feedback = \"none\"")]
    ChangingLoop,
    /// The controller has too few samples before it to set the noise level.
    #[error("a controller needs at least 2 samples in open loop before it, not {0}")]
    Pilot(usize),
}
