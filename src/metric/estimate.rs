//! A measure with its Monte-Carlo standard error.

use serde::{Deserialize, Serialize};

/// Fewest trials from which a mean has a standard error: with 6 degrees of freedom 1.96 covers 90.2
/// % of Student's law, with fewer less than 90 %.
pub const FEWEST_FOR_MEANS: u64 = 7;

/// Fewest trials from which a statistic of squares has a standard error, which is of their fourth
/// powers: that of a standard deviation, the slowest to tend to 95 %, then covers 90 % of normal
/// numbers.
pub const FEWEST_FOR_SQUARES: u64 = 40;

/// The standard normal 97.5 % point.
pub const Z: f64 = 1.959_963_984_540_054;

/// An estimate and its Monte-Carlo standard error (MCSE): how far it would scatter over repetitions
/// of the whole study (Koehler, Brown and Haneuse 2009). NaN, in files null, where it is undefined.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The estimate, in the figure's unit.
    #[serde(with = "nan_is_null")]
    pub value: f64,
    /// Its standard error, in the same unit.
    #[serde(with = "nan_is_null")]
    pub mcse: f64,
}

impl Estimate {
    /// What is estimated where there is nothing to estimate from.
    pub const UNDEFINED: Self = Self {
        value: f64::NAN,
        mcse: f64::NAN,
    };

    /// An estimate; undefined in whole where the value is not finite, and without standard error
    /// where that is not finite.
    pub(super) fn new(value: f64, mcse: f64) -> Self {
        let finite = |x: f64| if x.is_finite() { x } else { f64::NAN };
        Self {
            value: finite(value),
            mcse: finite(mcse + 0.0 * value),
        }
    }

    /// The 95 % interval `value -+ 1.96 mcse`.
    pub fn interval(&self) -> (f64, f64) {
        (self.value - Z * self.mcse, self.value + Z * self.mcse)
    }

    /// Whether a stored one can be an estimate: its error is not negative.
    pub(super) fn is_sound(&self) -> bool {
        !self.value.is_infinite() && !(self.mcse < 0.0)
    }
}

/// Whether the numbers ascend, those that are NaN left out.
pub(crate) fn ascend(numbers: impl IntoIterator<Item = f64>) -> bool {
    let numbers = numbers.into_iter().filter(|x| !x.is_nan());
    numbers.is_sorted_by(|a, b| a <= b)
}

impl Default for Estimate {
    fn default() -> Self {
        Self::UNDEFINED
    }
}

/// x, or 0 where rounding has made it negative; NaN is kept, which `max` would not do.
pub(super) fn not_negative(x: f64) -> f64 {
    if x < 0.0 { 0.0 } else { x }
}

/// NaN stands as null in files. JSON has no infinities either and makes them null, postcard keeps
/// them.
pub(super) mod nan_is_null {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
    pub fn serialize<S: Serializer>(x: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        (!x.is_nan()).then_some(*x).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
    }
}
