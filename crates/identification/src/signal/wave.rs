//! Terms of continuous-time signals: constants, ramps, sines, square waves and sampled records.

use crate::text::number;
use std::f64::consts::PI;
use std::sync::Arc;

/// The value of a sampled record between its samples.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Hold {
    /// The last sample.
    Zero,
    /// The straight line to the next sample.
    Linear,
}

/// One term of a signal, for t >= 0 in seconds.
#[derive(Clone, Debug, PartialEq)]
pub enum Wave {
    /// `value`.
    Constant {
        /// The value.
        value: f64,
    },
    /// `slope t`.
    Ramp {
        /// Units per second.
        slope: f64,
    },
    /// `amplitude sin(frequency t + phase)`.
    Sine {
        /// The amplitude.
        amplitude: f64,
        /// rad/s, positive.
        frequency: f64,
        /// rad.
        phase: f64,
    },
    /// `amplitude` if `sin(frequency t + phase) >= 0`, else `-amplitude`.
    Square {
        /// The amplitude.
        amplitude: f64,
        /// rad/s, positive.
        frequency: f64,
        /// rad.
        phase: f64,
    },
    /// `values[k]` at `t = k interval`.
    Samples {
        /// Seconds, positive.
        interval: f64,
        /// The samples.
        values: Arc<[f64]>,
        /// The value between the samples.
        hold: Hold,
    },
}

/// Why a wave cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SignalError {
    /// A number is not finite.
    #[error("a wave's numbers must be finite")]
    NotFinite,
    /// A frequency or an interval is not positive.
    #[error("a wave's {what} must be positive, not {}", number(*.value))]
    NotPositive {
        /// `frequency` or `interval`.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// The record ends before the horizon.
    #[error("the samples cover {length} s, less than the horizon of {horizon} s")]
    TooShort {
        /// Seconds that the record covers.
        length: f64,
        /// Seconds needed.
        horizon: f64,
    },
}

impl Wave {
    /// Returns the value at t; at a switch or a sample, the value after it.
    pub fn value(&self, t: f64) -> f64 {
        match self.line(t, t) {
            Some((value, _)) => value,
            None => self.sine(t).0,
        }
    }

    /// Returns `(amplitude sin, amplitude cos)` of `frequency t + phase`; zero unless the wave is a sine.
    pub fn sine(&self, t: f64) -> (f64, f64) {
        match *self {
            Self::Sine {
                amplitude,
                frequency,
                phase,
            } => {
                let (sin, cos) = (frequency * t + phase).sin_cos();
                (amplitude * sin, amplitude * cos)
            }
            _ => (0.0, 0.0),
        }
    }

    /// Returns the straight line of the wave's piece around the time `inside`: its value at t and its slope. `None` for
    /// a sine.
    ///
    /// t may be an end of the piece. The value is then the limit from the side of `inside`, which a step that ends or
    /// starts there needs.
    pub fn line(&self, t: f64, inside: f64) -> Option<(f64, f64)> {
        match self {
            Self::Constant { value } => Some((*value, 0.0)),
            Self::Ramp { slope } => Some((slope * t, *slope)),
            Self::Sine { .. } => None,
            Self::Square {
                amplitude,
                frequency,
                phase,
            } => {
                let half_periods = ((frequency * inside + phase) / PI).floor();
                let even = half_periods.rem_euclid(2.0) == 0.0;
                Some((if even { *amplitude } else { -amplitude }, 0.0))
            }
            Self::Samples { interval, values, hold } => {
                let at = |k: usize| values.get(k).or(values.last()).copied().unwrap_or(0.0);
                let k = (inside / interval).floor().max(0.0);
                let index = k as usize;
                Some(match hold {
                    Hold::Zero => (at(index), 0.0),
                    Hold::Linear => {
                        let slope = (at(index.saturating_add(1)) - at(index)) / interval;
                        (at(index) + slope * (t - k * interval), slope)
                    }
                })
            }
        }
    }

    /// Returns the distance between breakpoints and the time of the first (which may be negative), if there are any.
    pub(super) fn comb(&self) -> Option<(f64, f64)> {
        match *self {
            Self::Square { frequency, phase, .. } => Some((PI / frequency, -phase.rem_euclid(PI) / frequency)),
            Self::Samples { interval, .. } => Some((interval, 0.0)),
            _ => None,
        }
    }

    /// Checks that the wave is valid and defined up to `until` seconds.
    pub(super) fn check(&self, until: f64) -> Result<(), SignalError> {
        let (numbers, positive): ([f64; 3], _) = match *self {
            Self::Constant { value } => ([value; 3], None),
            Self::Ramp { slope } => ([slope; 3], None),
            Self::Sine {
                amplitude,
                frequency,
                phase,
            }
            | Self::Square {
                amplitude,
                frequency,
                phase,
            } => ([amplitude, frequency, phase], Some(("frequency", frequency))),
            Self::Samples { interval, .. } => ([interval; 3], Some(("interval", interval))),
        };
        if !numbers.iter().all(|v| v.is_finite()) {
            return Err(SignalError::NotFinite);
        }
        if let Some((what, value)) = positive
            && value <= 0.0
        {
            return Err(SignalError::NotPositive { what, value });
        }
        match self {
            Self::Samples { interval, values, hold } => check_samples(*interval, values, *hold, until),
            _ => Ok(()),
        }
    }
}

fn check_samples(interval: f64, values: &[f64], hold: Hold, horizon: f64) -> Result<(), SignalError> {
    if !values.iter().all(|v| v.is_finite()) {
        return Err(SignalError::NotFinite);
    }
    let pieces = match hold {
        Hold::Zero => values.len(),
        Hold::Linear => values.len().saturating_sub(1),
    };
    let length = pieces as f64 * interval;
    // Rounding such as 3 * 0.1 > 0.3 must not matter.
    if values.is_empty() || length < horizon * (1.0 - 1e-12) {
        return Err(SignalError::TooShort { length, horizon });
    }
    Ok(())
}
