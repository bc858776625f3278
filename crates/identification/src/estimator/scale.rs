//! The scale of a record: none that can be measured changes a model.

use super::{Covariance, Estimator, OptionUnits, Pass, ProgramError, Records, Stage, Visit, Window};
use crate::model::Units;

/// The binary exponents of the largest sample that estimators are given as they are: squares, and products of four
/// samples, neither overflow nor underflow.
const BAND: std::ops::RangeInclusive<i32> = -64..=64;

/// How far the exponents of u and y may be apart: sums of both lose as many bits of the smaller one.
const APART: u32 = 8;

/// Returns the power of two that brings the largest of some samples to between 1 and 2; 1 for samples that need none,
/// because it is within 2^-64 to 2^65, zero, or not finite.
pub fn unit_of(signals: &[&[f64]]) -> f64 {
    let exponent = exponent_of(signals).filter(|exponent| !BAND.contains(exponent));
    exponent.map_or(1.0, power)
}

/// The power of two; 2^1023 / 2^1023 is 1, and the inverse of a unit is a normal number.
fn power(exponent: i32) -> f64 {
    2.0_f64.powi(exponent.max(-1022))
}

/// Returns the binary exponent of the largest of some samples; `None` if it is zero or not finite.
fn exponent_of(signals: &[&[f64]]) -> Option<i32> {
    let largest = with_fma!(|| {
        let sizes = signals.iter().map(|signal| largest_size(signal));
        sizes.fold(0.0, larger)
    });
    let exponent = ((largest.to_bits() >> 52) as i32) - 1023;
    (largest != 0.0 && largest.is_finite()).then_some(exponent)
}

/// Returns the units in which an estimator sees a record.
fn units_of(window: Window<'_>, options: OptionUnits) -> Units {
    let Window { u, y, r } = window;
    match options {
        OptionUnits::Signals => Units::ONE,
        OptionUnits::Gain => Units::shared(unit_of(&[u, y, r])),
        OptionUnits::None => {
            let [Some(input), Some(output)] = [exponent_of(&[u, r]), exponent_of(&[y])] else {
                return Units::shared(unit_of(&[u, y, r]));
            };
            let is_near = BAND.contains(&input) && BAND.contains(&output);
            if is_near && input.abs_diff(output) <= APART {
                return Units::ONE;
            }
            Units {
                input: power(input),
                output: power(output),
            }
        }
    }
}

/// The larger number; `of` where x is not a number.
#[inline(always)]
fn larger(of: f64, x: f64) -> f64 {
    if x > of { x } else { of }
}

/// Returns the largest size of some samples, those that are not numbers left out.
#[inline(always)]
fn largest_size(signal: &[f64]) -> f64 {
    let mut most = [0.0; 16];
    let (whole, rest) = signal.as_chunks::<16>();
    for samples in whole {
        for (most, x) in most.iter_mut().zip(samples) {
            *most = larger(*most, x.abs());
        }
    }
    let rest = rest.iter().map(|x| x.abs());
    most.into_iter().chain(rest).fold(0.0, larger)
}

/// An estimator that sees records far from 1 in units of its own, powers of two: one of u and r, and one of y, where no
/// option has a unit. So no sample is rounded.
pub(super) struct Scaled {
    inner: Box<dyn Estimator>,
    options: OptionUnits,
    signals: [Vec<f64>; 3],
}

impl Scaled {
    pub(super) fn new(inner: Box<dyn Estimator>, options: OptionUnits) -> Self {
        let signals = std::array::from_fn(|_| Vec::new());
        Self {
            inner,
            options,
            signals,
        }
    }

    /// Keeps the samples in their units, if these are not 1, and returns the units.
    fn rescale(&mut self, window: Window<'_>) -> Units {
        let units = units_of(window, self.options);
        if units != Units::ONE {
            let given = [window.u, window.y, window.r];
            let of_each = [units.input, units.output, units.input];
            for ((scaled, given), unit) in self.signals.iter_mut().zip(given).zip(of_each) {
                scaled.clear();
                scaled.extend(given.iter().map(|sample| sample / unit));
            }
        }
        units
    }

    fn is_needed(&self, window: Window<'_>) -> bool {
        units_of(window, self.options) != Units::ONE
    }
}

impl Estimator for Scaled {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        let units = self.rescale(window);
        let [u, y, r] = &self.signals;
        let seen = if units == Units::ONE {
            window
        } else {
            Window::with_reference(u, y, r, window.len())
        };
        self.inner.estimate(seen, passes);
        for (number, pass) in passes.iter_mut().enumerate() {
            bring_back(pass, number, units);
        }
    }

    fn estimate_from(&mut self, known: &[Pass], window: Window<'_>, passes: &mut [Pass]) {
        // In other units the known passes would have to be brought to them.
        if self.is_needed(window) {
            self.estimate(window, passes);
        } else {
            self.inner.estimate_from(known, window, passes);
        }
    }

    fn estimate_again(
        &mut self,
        covariance: Covariance,
        window: Window<'_>,
        found: &[Pass],
        passes: &mut [Pass],
    ) -> bool {
        !self.is_needed(window) && self.inner.estimate_again(covariance, window, found, passes)
    }

    fn run_along(&mut self, window: Window<'_>, at: &[usize], pass: &mut Pass, visit: &mut Visit<'_>) {
        let units = self.rescale(window);
        if units == Units::ONE {
            return self.inner.run_along(window, at, pass, visit);
        }
        let [u, y, r] = &self.signals;
        let scaled = Window::with_reference(u, y, r, window.len());
        let (mut in_samples, mut told) = (Vec::new(), pass.clone());
        self.inner.run_along(scaled, at, pass, &mut |k, pass, state| {
            in_samples.clear();
            in_samples.extend(state.into_iter().flatten().map(|x| x * units.output));
            told.assign(pass);
            bring_back(&mut told, 0, units);
            visit(k, &told, state.map(|_| &in_samples[..]));
        });
    }

    fn gather(&mut self, trial: u64, records: &mut dyn Records) -> Result<(), ProgramError> {
        self.inner.gather(trial, records)
    }
}

/// Brings a pass back from units; it fails if a number is out of the range of doubles.
fn bring_back(pass: &mut Pass, number: usize, units: Units) {
    if let Err(kind) = pass.set_units(units) {
        pass.fail_at(Stage::Other, number, kind);
    }
}

#[cfg(test)]
mod tests {
    use super::unit_of;

    #[test]
    fn units_are_powers_of_two() {
        for (largest, unit) in [
            (1.0, 1.0),
            (1e19, 1.0),
            (1e-19, 1.0),
            (0.0, 1.0),
            (f64::INFINITY, 1.0),
            (3.0 * 2.0_f64.powi(100), 2.0_f64.powi(101)),
            (1.5 * 2.0_f64.powi(-100), 2.0_f64.powi(-100)),
            (f64::MAX, 2.0_f64.powi(1023)),
            (5e-324, 2.0_f64.powi(-1022)),
        ] {
            assert_eq!(unit_of(&[&[0.0, -largest], &[largest / 4.0]]), unit);
        }
    }
}
