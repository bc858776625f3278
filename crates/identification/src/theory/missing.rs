//! Why there is no theory for a cell.

/// The largest number of coefficients of a polynomial for which there is theory: its time grows with the fourth power.
pub const LARGEST: usize = 60;

/// Why a cell has no theory.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoTheory {
    /// The plant, the noise or a model has so many coefficients that the theory takes minutes.
    #[error("{0} coefficients of a polynomial; theory is for {LARGEST} at most")]
    Large(usize),
    /// Continuous time.
    #[error("continuous time: there is no record to estimate from")]
    ContinuousTime,
    /// Each trial has its own random plant.
    #[error("every trial has its own random plant")]
    RandomPlant,
    /// The plant changes during the record.
    #[error("the plant changes during the record, so nothing is stationary")]
    ChangingPlant,
    /// 127 signs that each trial draws anew, repeated or held.
    #[error("the input has 127 signs of its own in every trial, so every trial has its own limit")]
    PeriodicInput,
    /// An input given sample by sample.
    #[error("the input is given sample by sample, so it is not a stationary process")]
    GivenInput,
    /// Errors that depend on fourth moments of a random binary input.
    #[error("it depends on fourth moments of the binary input, which are not computed")]
    BinaryInput,
    /// A binary input whose spectrum is too narrow for lines.
    #[error("the correlations of the binary input do not decay within 4,096 samples")]
    SlowInput,
    /// A long period.
    #[error("the input has a period of {0} samples; theory is for 16,384 at most")]
    LongPeriod(usize),
    /// Noise drawn from given numbers, or of heavy tails.
    #[error("noise that is not Gaussian is not covered")]
    NotGaussian,
    /// A controller based on an estimate.
    #[error("the state feedback depends on an estimate, so the record is not stationary")]
    Controlled,
    /// r = 0 in closed loop.
    #[error("no reference drives the loop")]
    NoReference,
    /// An unstable plant: the output has no stationary variance.
    #[error("the plant is not stable, so its output is not stationary")]
    UnstablePlant,
    /// An unstable closed loop.
    #[error("the closed loop is not stable, so no signal is stationary")]
    UnstableLoop,
    /// No noise has this level.
    #[error("no noise has this level")]
    NoLevel,
    /// A signal without a stationary covariance.
    #[error("a signal is not stationary")]
    NotStationary,
}

/// Why an output or a bound is missing in a cell that has theory.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Missing {
    /// The process has no theory.
    #[error(transparent)]
    Process(#[from] NoTheory),
    /// A matrix to be inverted is singular.
    #[error("the information matrix is singular")]
    Singular,
    /// A model or predictor is unstable in the limit.
    #[error("a model or predictor is not stable in the limit")]
    UnstableModel,
    /// The true process is not in the model structure.
    #[error("the true process is not in the model structure")]
    Structure,
    /// The estimate is biased, and the bias is not computed.
    #[error("the estimate is biased here, and its limit is not computed")]
    Biased,
    /// There is other noise than the measurement noise.
    #[error("no bound with process noise or noise on the input")]
    OtherNoise,
    /// Noise on the input beside what the information does not cover.
    #[error(
        "noise on the input has an information in open loop alone, with a white Gaussian input and white noise on the \
         output"
    )]
    NoisyInput,
    /// The noise has a zero on the unit circle.
    #[error("the noise has a zero on the unit circle")]
    NoNoiseModel,
    /// The information of a record is that from rest.
    #[error("the record does not begin at rest")]
    NotAtRest,
    /// Feedback and plant act on each other within a sample, so that e has a gain that depends on the plant.
    #[error("no information of a loop whose plant and controller both act without delay")]
    DirectLoop,
    /// A reading that the theory does not cover.
    #[error("{0} = \"{1}\" is not covered")]
    Reading(&'static str, &'static str),
    /// A method that the theory does not cover.
    #[error("the asymptotic covariance of {0} is not covered")]
    Method(&'static str),
}
