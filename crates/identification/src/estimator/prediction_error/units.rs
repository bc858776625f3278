//! The units in which a search sees a record: powers of two near the sizes of u and y.
//!
//! In its own units a record is the same numbers whatever powers of two its signals were multiplied with, so a search
//! takes the same steps and ends in the same minimum, to the last bit. With other factors its numbers differ by less
//! than a factor of two, which only the first solution of null-space fitting sees: a step is measured in the ratio of y
//! and u itself.

use super::descent::OUTPUT;
use crate::estimator::FailureKind;
use crate::model::Units;

/// A record in units of its own.
pub(super) struct Rescaled {
    units: Units,
    u: Vec<f64>,
    y: Vec<f64>,
}

/// Returns the power of two whose square is within a factor of two of a number; 1 for zero and what is not a normal
/// number.
fn near_root(square: f64) -> f64 {
    if !square.is_normal() {
        return 1.0;
    }
    let exponent = (square.to_bits() >> 52) as i32 - 1023;
    2.0_f64.powi((exponent + 1).div_euclid(2))
}

impl Rescaled {
    /// Makes buffers for windows of `window` samples.
    pub(super) fn new(window: usize) -> Self {
        let signal = || vec![0.0; window];
        Self {
            units: Units::ONE,
            u: signal(),
            y: signal(),
        }
    }

    /// Takes a record.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if the squares of a signal cannot be summed.
    pub(super) fn take(&mut self, u: &[f64], y: &[f64]) -> Result<(), FailureKind> {
        let square = |signal: &[f64]| signal.iter().map(|x| x * x).sum::<f64>();
        let (of_input, of_output) = (square(u), square(y));
        if !(of_input.is_finite() && of_output.is_finite()) {
            return Err(FailureKind::NonFinite);
        }
        let input = near_root(of_input / u.len() as f64);
        // A factor that u and y share moves no unit of B.
        let output = input * near_root(of_output / of_input) / OUTPUT;
        self.units = Units { input, output };
        for (to, from, unit) in [(&mut self.u, u, input), (&mut self.y, y, output)] {
            for (to, x) in to.iter_mut().zip(from) {
                *to = x / unit;
            }
        }
        Ok(())
    }

    /// Returns u and y in their units.
    pub(super) fn record(&self) -> (&[f64], &[f64]) {
        (&self.u, &self.y)
    }

    pub(super) fn units(&self) -> Units {
        self.units
    }
}
