//! The operators H_i that extend a regression, and delays of the nodes of steps.

use super::filter::{Nodes, no_signal};
use crate::real::Real;

/// The longest delay in steps: its memory is that of so many steps of every delayed signal.
pub const LONGEST_DELAY: f64 = 1e4;

/// A linear operator H_i that extends a regression; of a signal that is zero before t = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Operator {
    /// The lag `a / (p + a)` with the pole a > 0 in 1/s, from zero.
    Lag(f64),
    /// The delay `e^(-d p)` of d > 0 seconds: `H(v)(t) = v(t - d)` from t = d on, and 0 before.
    Delay(f64),
}

impl Operator {
    /// Returns the pole of a lag.
    pub(super) fn lag(&self) -> Option<f64> {
        match self {
            Self::Lag(pole) => Some(*pole),
            Self::Delay(_) => None,
        }
    }

    /// Returns the seconds of a delay.
    pub(super) fn delay(&self) -> Option<f64> {
        match self {
            Self::Lag(_) => None,
            Self::Delay(seconds) => Some(*seconds),
        }
    }

    /// Returns its number, the pole or the delay.
    pub(super) fn number(&self) -> f64 {
        match self {
            Self::Lag(number) | Self::Delay(number) => *number,
        }
    }
}

/// Returns a delay as a number of steps of length h, if it is a whole number from 1 to [`LONGEST_DELAY`].
pub(super) fn whole_steps(delay: f64, h: f64) -> Option<usize> {
    let steps = (delay / h).round();
    let whole = (delay / h - steps).abs() <= 1e-12 * steps;
    (whole && (1.0..=LONGEST_DELAY).contains(&steps)).then_some(steps as usize)
}

/// Signals delayed by a whole number of steps: the nodes of a step are those of an earlier step, exactly, and zero
/// before t = 0. A jump at the start of a step stays one.
#[derive(Clone, Debug)]
pub(super) struct DelayLine<R> {
    signals: usize,
    /// A ring of the nodes of the last steps, all signals of a step together.
    ring: Vec<Nodes<R>>,
    oldest: usize,
}

impl<R: Real> DelayLine<R> {
    /// Returns the line of so many signals and steps, with zeros in it.
    pub fn new(signals: usize, steps: usize) -> Self {
        Self {
            signals,
            ring: vec![no_signal(); signals * steps],
            oldest: 0,
        }
    }

    /// Returns the delayed signals in the current step.
    pub fn delayed(&self) -> &[Nodes<R>] {
        &self.ring[self.oldest..self.oldest + self.signals]
    }

    /// Returns the same to be replaced by the signals themselves, before [`Self::advance`].
    pub fn delayed_mut(&mut self) -> &mut [Nodes<R>] {
        &mut self.ring[self.oldest..self.oldest + self.signals]
    }

    /// Ends the step.
    pub fn advance(&mut self) {
        self.oldest = (self.oldest + self.signals) % self.ring.len();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_are_whole_numbers_of_steps() {
        assert_eq!(whole_steps(0.3, 0.1), Some(3));
        assert_eq!(whole_steps(50.0, 0.005), Some(10_000));
        for (delay, h) in [(0.25, 0.1), (0.3 + 1e-9, 0.1), (0.04, 0.1), (50.005, 0.005)] {
            assert_eq!(whole_steps(delay, h), None, "{delay} {h}");
        }
    }
}
