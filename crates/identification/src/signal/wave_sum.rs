//! Continuous-time signals as sums of waves.

use super::wave::{SignalError, Wave};

/// A signal: the sum of its waves, zero if there are none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signal {
    /// The terms.
    pub waves: Vec<Wave>,
}

impl Signal {
    /// Makes the sum of `waves`.
    pub fn new(waves: Vec<Wave>) -> Self {
        Self { waves }
    }

    /// Returns the value at t; at a switch or a sample, the value after it.
    pub fn value(&self, t: f64) -> f64 {
        self.waves.iter().map(|wave| wave.value(t)).sum()
    }

    /// Returns the sum of all waves except the sines. Around the time `inside` it is a straight line, given by its
    /// value at t and its slope. t may be an end of the piece.
    pub fn line(&self, t: f64, inside: f64) -> (f64, f64) {
        self.waves
            .iter()
            .filter_map(|wave| wave.line(t, inside))
            .fold((0.0, 0.0), |sum, line| (sum.0 + line.0, sum.1 + line.1))
    }

    /// Checks that all waves are valid and defined up to `until` seconds.
    ///
    /// # Errors
    /// If a number is not finite, a frequency or interval is not positive, or a record is too
    /// short.
    pub fn check(&self, until: f64) -> Result<(), SignalError> {
        self.waves.iter().try_for_each(|wave| wave.check(until))
    }

    /// Returns an upper bound on the number of breakpoints before `until`.
    pub fn breakpoint_bound(&self, until: f64) -> f64 {
        self.waves
            .iter()
            .filter_map(Wave::comb)
            .map(|(distance, _)| until / distance + 1.0)
            .sum()
    }

    /// Appends the times in (0, `until`) at which a square wave switches or a record has a sample, in any order.
    ///
    /// Check the signal first: then there are at most [`Self::breakpoint_bound`] of them.
    pub fn breakpoints(&self, until: f64, out: &mut Vec<f64>) {
        for (distance, first) in self.waves.iter().filter_map(Wave::comb) {
            let times = (0_u64..).map(|k| first + k as f64 * distance);
            out.extend(times.skip_while(|t| *t <= 0.0).take_while(|t| *t < until));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::wave::Hold;
    use super::*;
    use std::f64::consts::PI;

    fn square(phase: f64) -> Wave {
        Wave::Square {
            amplitude: 2.0,
            frequency: PI,
            phase,
        }
    }

    #[test]
    fn square_switches_where_the_sine_does() {
        let mut times = vec![];
        Signal::new(vec![square(PI / 4.0)]).breakpoints(3.0, &mut times);
        assert_eq!(times.len(), 3);
        for (found, expected) in times.iter().zip([0.75, 1.75, 2.75]) {
            assert!((found - expected).abs() < 1e-15);
        }
        for phase in [-7.0, -0.3, 0.0, 0.3, 9.0] {
            for t in [0.1, 0.77, 1.9, 12.3] {
                let sign = (PI * t + phase).sin().signum();
                assert_eq!(square(phase).value(t), 2.0 * sign);
            }
        }
    }

    #[test]
    fn a_piece_is_taken_from_inside() {
        assert_eq!(square(0.0).line(1.0, 0.5), Some((2.0, 0.0)));
        assert_eq!(square(0.0).line(1.0, 1.5), Some((-2.0, 0.0)));
        let record = |hold| Wave::Samples {
            interval: 0.5,
            values: [1.0, 3.0, 2.0].into(),
            hold,
        };
        assert_eq!(record(Hold::Zero).line(0.5, 0.25), Some((1.0, 0.0)));
        assert_eq!(record(Hold::Zero).line(0.5, 0.75), Some((3.0, 0.0)));
        assert_eq!(record(Hold::Linear).line(0.5, 0.25), Some((3.0, 4.0)));
        assert_eq!(record(Hold::Linear).line(0.5, 0.75), Some((3.0, -2.0)));
        assert_eq!(record(Hold::Linear).value(0.25), 2.0);
    }

    #[test]
    fn sums() {
        let sine = Wave::Sine {
            amplitude: 3.0,
            frequency: 2.0,
            phase: 0.5,
        };
        let signal = Signal::new(vec![Wave::Constant { value: 1.0 }, Wave::Ramp { slope: -2.0 }, sine]);
        let t: f64 = 0.7;
        assert_eq!(signal.value(t), 1.0 - 2.0 * t + 3.0 * (2.0 * t + 0.5).sin());
        assert_eq!(signal.line(t, 0.0), (1.0 - 2.0 * t, -2.0));
        assert_eq!(Signal::default().value(1.0), 0.0);
    }

    #[test]
    fn refusals() {
        let check = |wave: Wave, until| Signal::new(vec![wave]).check(until);
        let record = |n: usize, hold| Wave::Samples {
            interval: 0.1,
            values: vec![0.0; n].into(),
            hold,
        };
        assert_eq!(check(record(3, Hold::Zero), 0.3), Ok(()));
        assert_eq!(check(record(4, Hold::Linear), 0.3), Ok(()));
        assert!(matches!(
            check(record(3, Hold::Linear), 0.3),
            Err(SignalError::TooShort { horizon: 0.3, .. })
        ));
        assert!(check(record(0, Hold::Zero), 0.3).is_err());
        assert_eq!(check(Wave::Ramp { slope: f64::NAN }, 1.0), Err(SignalError::NotFinite));
        let still = Wave::Sine {
            amplitude: 1.0,
            frequency: 0.0,
            phase: 0.0,
        };
        assert_eq!(
            check(still, 1.0),
            Err(SignalError::NotPositive {
                what: "frequency",
                value: 0.0
            })
        );
    }
}
