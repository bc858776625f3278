//! A measure with its Monte-Carlo standard error.

use serde::{Deserialize, Serialize};

/// Fewest trials for which a mean has a standard error. With 6 degrees of freedom, 1.96 covers 90.2 % of Student's law;
/// with fewer, less than 90 %.
pub const FEWEST_FOR_MEANS: u64 = 7;

/// Fewest trials for which a statistic of squares has a standard error, which depends on fourth powers. With this many,
/// the interval of a standard deviation, whose coverage tends to 95 % most slowly, covers 90 % for normal numbers.
pub const FEWEST_FOR_SQUARES: u64 = 40;

/// The standard normal 97.5 % point.
pub const Z: f64 = 1.959_963_984_540_054;

/// An estimate and its Monte-Carlo standard error (MCSE): its standard deviation over repetitions of the whole study
/// (Koehler, Brown and Haneuse 2009). Undefined numbers are NaN, in files null.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The estimate, in the unit of the measure.
    #[serde(with = "nan_is_null")]
    pub value: f64,
    /// Its standard error, in the same unit.
    #[serde(with = "nan_is_null")]
    pub mcse: f64,
}

impl Estimate {
    /// The estimate if there is nothing to estimate from.
    pub const UNDEFINED: Self = Self {
        value: f64::NAN,
        mcse: f64::NAN,
    };

    /// Makes an estimate. It is undefined as a whole if the value is not finite, and has no standard error if `mcse` is
    /// not finite.
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
}

impl Default for Estimate {
    fn default() -> Self {
        Self::UNDEFINED
    }
}

/// Returns x, or 0 if rounding has made it negative. Unlike `max`, it keeps NaN.
pub(super) fn not_negative(x: f64) -> f64 {
    if x < 0.0 { 0.0 } else { x }
}

/// Writes NaN as null in files. JSON also turns infinities into null; postcard keeps them.
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
