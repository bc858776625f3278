//! Input sequences. Random ones have mean zero and the amplitude as standard deviation.

use super::arithmetic::with_fma;
use super::noise::NoiseFilter;
use super::normal::fill_standard_normal;
use super::random_stream::Stream;
use crate::names::named_enum;
use rand::Rng;
#[cfg(feature = "json")]
use serde_json::{Value, json};
use std::sync::Arc;

/// Random signs of an amplitude: u(k) = +amplitude or -amplitude, each with probability 1/2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RandomSigns {
    /// The amplitude, in units of u.
    pub amplitude: f64,
    /// Whether the signs repeat (reading E5).
    pub sequence: Sequence,
}

named_enum! {
    /// How the signs continue: reading E5.
    Sequence, "input sequence" {
        /// A fresh sign at every k (the default).
        Independent = "independent",
        /// The first 127 signs, repeated.
        Periodic127 = "periodic-127",
        /// The first 127 signs, and the last of them ever after.
        Held127 = "held-127",
    }
}

impl Sequence {
    /// Returns how many of `length` samples are fresh, and how far back each later one has its value.
    pub const fn fresh(self, length: usize) -> (usize, usize) {
        const PERIOD: usize = RandomSigns::PERIOD;
        match self {
            Self::Periodic127 if length > PERIOD => (PERIOD, PERIOD),
            Self::Held127 if length > PERIOD => (PERIOD, 1),
            _ => (length, PERIOD),
        }
    }
}

impl RandomSigns {
    /// The length of the paper's pseudo-random binary sequence.
    pub const PERIOD: usize = 127;

    /// Fills `u` from the stream. The sign of u(k) is bit k mod 64 of word k div 64, set for plus.
    ///
    /// A longer `u` extends a shorter one.
    pub fn fill(&self, stream: &mut Stream, u: &mut [f64]) {
        let (fresh, back) = self.sequence.fresh(u.len());
        for block in u[..fresh].chunks_mut(64) {
            let signs = stream.next_u64();
            for (k, u) in block.iter_mut().enumerate() {
                let minus = !signs >> k & 1;
                *u = f64::from_bits(self.amplitude.to_bits() ^ minus << 63);
            }
        }
        for k in fresh..u.len() {
            u[k] = u[k - back];
        }
    }
}

/// The external input of a process.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// Random signs.
    Signs(RandomSigns),
    /// White Gaussian numbers of mean zero.
    Gaussian {
        /// Their standard deviation, in units of u.
        amplitude: f64,
    },
    /// White Gaussian numbers through a filter, scaled to the amplitude and stationary from the first sample.
    Filtered {
        /// The filter.
        filter: NoiseFilter,
        /// The standard deviation of the filter's output, in units of u.
        amplitude: f64,
    },
    /// The signs of white Gaussian numbers through a filter, times the amplitude: a random binary input with a
    /// spectrum.
    Binary {
        /// The filter.
        filter: NoiseFilter,
        /// The amplitude, in units of u.
        amplitude: f64,
    },
    /// The same samples in every trial, repeated from the first after the last.
    Samples(Arc<[f64]>),
}

named_enum! {
    /// The law of an input's samples, unless a table or a file defines it.
    InputLaw, "input" {
        /// [`Input::Signs`] (the default).
        Signs = "signs",
        /// [`Input::Gaussian`].
        Gaussian = "gaussian",
    }
}

impl Input {
    /// Makes an input from its names. `sequence` applies to signs; Gaussian numbers are always fresh.
    pub const fn new(law: InputLaw, amplitude: f64, sequence: Sequence) -> Self {
        match law {
            InputLaw::Signs => Self::Signs(RandomSigns { amplitude, sequence }),
            InputLaw::Gaussian => Self::Gaussian { amplitude },
        }
    }

    /// Returns every setting, for a manifest.
    #[cfg(feature = "json")]
    pub fn describe(&self) -> Value {
        let law = |law: InputLaw, sequence: Option<Sequence>| {
            let amplitude = self.amplitude();
            json!({ "law": law, "amplitude": amplitude, "sequence": sequence })
        };
        match self {
            Self::Signs(signs) => law(InputLaw::Signs, Some(signs.sequence)),
            Self::Gaussian { .. } => law(InputLaw::Gaussian, None),
            Self::Filtered { filter, amplitude } => json!({
                "amplitude": amplitude,
                "numerator": filter.numerator(),
                "denominator": filter.denominator(),
            }),
            Self::Binary { filter, amplitude } => json!({
                "binary": true,
                "amplitude": amplitude,
                "numerator": filter.numerator(),
                "denominator": filter.denominator(),
            }),
            Self::Samples(samples) => json!({ "samples": samples[..] }),
        }
    }

    /// Returns whether every trial has the same samples.
    pub fn is_fixed(&self) -> bool {
        matches!(self, Self::Samples(_)) || self.amplitude() == 0.0
    }

    /// Returns the standard deviation in units of u; for given samples, their root mean square.
    pub fn amplitude(&self) -> f64 {
        match self {
            Self::Signs(RandomSigns { amplitude, .. })
            | Self::Gaussian { amplitude }
            | Self::Filtered { amplitude, .. }
            | Self::Binary { amplitude, .. } => *amplitude,
            Self::Samples(samples) => {
                let squares: f64 = samples.iter().map(|u| u * u).sum();
                (squares / samples.len() as f64).sqrt()
            }
        }
    }

    /// Fills `u` from the stream. A longer `u` extends a shorter one.
    pub fn fill(&self, stream: &mut Stream, u: &mut [f64]) {
        match self {
            Self::Signs(signs) => signs.fill(stream, u),
            Self::Gaussian { amplitude } => fill_white(stream, *amplitude, u),
            Self::Filtered { filter, amplitude } => {
                filter.fill_from_one(stream, u);
                let scale = amplitude / filter.variance().sqrt();
                for u in u {
                    *u *= scale;
                }
            }
            Self::Binary { filter, amplitude } => {
                filter.fill_from_one(stream, u);
                for u in u {
                    *u = amplitude.copysign(*u);
                }
            }
            Self::Samples(samples) => {
                let samples = samples.iter().cycle();
                u.iter_mut().zip(samples).for_each(|(u, sample)| *u = *sample);
            }
        }
    }
}

impl From<RandomSigns> for Input {
    fn from(signs: RandomSigns) -> Self {
        Self::Signs(signs)
    }
}

/// Fills `z` with white Gaussian numbers of mean zero and the given standard deviation.
pub fn fill_white(stream: &mut Stream, deviation: f64, z: &mut [f64]) {
    fill_standard_normal(stream, z);
    with_fma(
        #[inline(always)]
        || z.iter_mut().for_each(|z| *z *= deviation),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Purpose, stream};

    /// The mean and variance of Gaussian input are within 4.5 standard errors of 0 and amplitude^2.
    #[test]
    fn gaussian_input_has_the_amplitude_as_standard_deviation() {
        const COUNT: usize = 1_000_000;
        let input = Input::new(InputLaw::Gaussian, 10.0, Sequence::default());
        let mut u = vec![0.0; COUNT];
        input.fill(&mut stream(1, 0, Purpose::Input), &mut u);
        let mean = u.iter().sum::<f64>() / COUNT as f64;
        let variance = u.iter().map(|u| u * u).sum::<f64>() / COUNT as f64;
        assert!(mean.abs() < 4.5 * 10.0 / (COUNT as f64).sqrt(), "{mean}");
        let error = 100.0 * (2.0 / COUNT as f64).sqrt();
        assert!((variance - 100.0).abs() < 4.5 * error, "{variance}");
        let mut short = vec![0.0; 77];
        input.fill(&mut stream(1, 0, Purpose::Input), &mut short);
        assert_eq!(short, u[..77]);
    }

    /// The lag-1 covariance of a binary input is `amplitude^2 2/pi asin(rho)`, rho the correlation before the signs are
    /// taken (the arcsine law), within 4.5 standard errors.
    #[test]
    fn binary_input_follows_the_arcsine_law() {
        const TRIALS: u64 = 40_000;
        let filter = NoiseFilter::new(&[3.0], &[1.0, -0.8]).unwrap();
        let input = Input::Binary { filter, amplitude: 2.0 };
        let mut sum = 0.0;
        for trial in 0..TRIALS {
            let mut u = [0.0; 3];
            input.fill(&mut stream(1, trial, Purpose::Input), &mut u);
            assert!(u.iter().all(|u| u.abs() == 2.0));
            sum += u[0] * u[1];
        }
        let expected = 4.0 * std::f64::consts::FRAC_2_PI * 0.8_f64.asin();
        let error = (16.0 - expected * expected).sqrt() / (TRIALS as f64).sqrt();
        let mean = sum / TRIALS as f64;
        assert!((mean - expected).abs() < 4.5 * error, "{mean}, {expected}");
    }

    /// The variance and lag-1 covariance of an AR(1) input over trials, including its first sample, are within 4.5
    /// standard errors of amplitude^2 and amplitude^2 (-d).
    #[test]
    fn filtered_input_has_amplitude_and_spectrum_from_its_first_sample() {
        const TRIALS: u64 = 40_000;
        let filter = NoiseFilter::new(&[3.0], &[1.0, -0.8]).unwrap();
        let input = Input::Filtered { filter, amplitude: 2.0 };
        let draw = |trial: u64, u: &mut [f64]| input.fill(&mut stream(1, trial, Purpose::Input), u);
        let mut sums = [0.0; 4];
        for trial in 0..TRIALS {
            let mut u = [0.0; 12];
            draw(trial, &mut u);
            let products = [u[0] * u[0], u[0] * u[1], u[10] * u[10], u[10] * u[11]];
            sums.iter_mut().zip(products).for_each(|(s, x)| *s += x);
        }
        for (sum, expected) in sums.iter().zip([4.0, 3.2, 4.0, 3.2]) {
            let error = 4.0 * (2.0 / TRIALS as f64).sqrt();
            assert!((sum / TRIALS as f64 - expected).abs() < 4.5 * error, "{sums:?}");
        }
        let (mut short, mut long) = ([0.0; 33], [0.0; 70]);
        draw(3, &mut short);
        draw(3, &mut long);
        assert_eq!(short, long[..33]);
    }

    #[test]
    fn given_samples_are_the_same_in_every_trial_and_begin_again() {
        let input = Input::Samples([1.0, -2.0, 2.0].into());
        for trial in 0..3 {
            let mut u = [0.0; 5];
            input.fill(&mut stream(1, trial, Purpose::Input), &mut u);
            assert_eq!(u, [1.0, -2.0, 2.0, 1.0, -2.0]);
        }
        assert!(input.is_fixed() && input.amplitude() == 3.0_f64.sqrt());
    }

    fn signs(sequence: Sequence, count: usize) -> Vec<f64> {
        let mut u = vec![0.0; count];
        let input = RandomSigns {
            amplitude: 10.0,
            sequence,
        };
        input.fill(&mut stream(1, 0, Purpose::Input), &mut u);
        u
    }

    #[test]
    fn longer_inputs_extend_shorter_ones_and_periods_repeat_or_hold() {
        let long = signs(Sequence::Independent, 1000);
        assert!(long.iter().all(|u| u.abs() == 10.0));
        assert_eq!(signs(Sequence::Independent, 77), long[..77]);
        let periodic = signs(Sequence::Periodic127, 400);
        assert_eq!(periodic[..127], long[..127]);
        assert_eq!(periodic[127..], periodic[..273]);
        let held = signs(Sequence::Held127, 400);
        assert_eq!(held[..127], long[..127]);
        assert!(held[127..].iter().all(|u| *u == long[126]));
        for sequence in [Sequence::Periodic127, Sequence::Held127] {
            for count in [100, 127] {
                assert_eq!(signs(sequence, count), long[..count]);
            }
        }
    }

    #[test]
    fn signs_are_fair_and_uncorrelated() {
        const COUNT: usize = 1_000_000;
        let u = signs(Sequence::Independent, COUNT);
        let bound = 4.5 * 100.0 * (COUNT as f64).sqrt();
        assert!((u.iter().sum::<f64>() * 10.0).abs() < bound);
        for lag in [1, 2, 63, 64, 65, 127] {
            let sum: f64 = u.iter().zip(&u[lag..]).map(|(a, b)| a * b).sum();
            assert!(sum.abs() < bound, "lag {lag}: {sum}");
        }
    }
}
