//! Input sequences, all of mean zero and of the amplitude as standard deviation.

use super::arithmetic::with_fma;
use super::normal::fill_standard_normal;
use super::stream::Stream;
use crate::names::named_enum;
use rand::Rng;

/// Random signs of an amplitude: u(k) = +amplitude or -amplitude, each with probability 1/2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RandomSigns {
    /// The amplitude, in units of u.
    pub amplitude: f64,
    /// Whether the signs repeat (reading E5).
    pub sequence: Sequence,
}

named_enum! {
    /// How the signs go on: reading E5.
    Sequence, "input sequence" {
        /// A fresh sign at every k (the default).
        Independent = "independent",
        /// The first 127 signs, repeated.
        Periodic127 = "periodic-127",
    }
}

impl RandomSigns {
    /// The period of the paper's pseudo-random binary sequence.
    pub(crate) const PERIOD: usize = 127;

    /// Fills `u` from the stream: the sign of u(k) is bit k mod 64 of word k div 64, set for plus.
    ///
    /// A longer `u` extends a shorter one.
    pub fn fill(&self, stream: &mut Stream, u: &mut [f64]) {
        let fresh = match self.sequence {
            Sequence::Independent => u.len(),
            Sequence::Periodic127 => u.len().min(Self::PERIOD),
        };
        for block in u[..fresh].chunks_mut(64) {
            let signs = stream.next_u64();
            for (k, u) in block.iter_mut().enumerate() {
                let minus = !signs >> k & 1;
                *u = f64::from_bits(self.amplitude.to_bits() ^ minus << 63);
            }
        }
        for k in fresh..u.len() {
            u[k] = u[k - Self::PERIOD];
        }
    }
}

/// The external input of a process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Input {
    /// Random signs.
    Signs(RandomSigns),
    /// White Gaussian numbers of mean zero.
    Gaussian {
        /// Their standard deviation, in units of u.
        amplitude: f64,
    },
}

named_enum! {
    /// The law of an input's samples.
    InputLaw, "input" {
        /// [`Input::Signs`] (the default).
        Signs = "signs",
        /// [`Input::Gaussian`].
        Gaussian = "gaussian",
    }
}

impl Input {
    /// An input by its names. `sequence` holds for signs; Gaussian numbers are always fresh.
    pub const fn new(law: InputLaw, amplitude: f64, sequence: Sequence) -> Self {
        match law {
            InputLaw::Signs => Self::Signs(RandomSigns {
                amplitude,
                sequence,
            }),
            InputLaw::Gaussian => Self::Gaussian { amplitude },
        }
    }

    /// The law's name.
    pub const fn law(&self) -> InputLaw {
        match self {
            Self::Signs(_) => InputLaw::Signs,
            Self::Gaussian { .. } => InputLaw::Gaussian,
        }
    }

    /// Whether signs repeat; `None` for other laws, which are always fresh.
    pub const fn sequence(&self) -> Option<Sequence> {
        match self {
            Self::Signs(signs) => Some(signs.sequence),
            Self::Gaussian { .. } => None,
        }
    }

    /// The standard deviation, in units of u.
    pub const fn amplitude(&self) -> f64 {
        match *self {
            Self::Signs(RandomSigns { amplitude, .. }) | Self::Gaussian { amplitude } => amplitude,
        }
    }

    /// Fills `u` from the stream. A longer `u` extends a shorter one.
    pub fn fill(&self, stream: &mut Stream, u: &mut [f64]) {
        match *self {
            Self::Signs(signs) => signs.fill(stream, u),
            Self::Gaussian { amplitude } => fill_white(stream, amplitude, u),
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
    use crate::signal::stream::{Purpose, stream};

    /// Mean and variance of Gaussian input within 4.5 standard errors of 0 and amplitude^2.
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
    fn longer_inputs_extend_shorter_ones_and_periods_repeat() {
        let long = signs(Sequence::Independent, 1000);
        assert!(long.iter().all(|u| u.abs() == 10.0));
        assert_eq!(signs(Sequence::Independent, 77), long[..77]);
        let periodic = signs(Sequence::Periodic127, 400);
        assert_eq!(periodic[..127], long[..127]);
        assert_eq!(periodic[127..], periodic[..273]);
        assert_eq!(signs(Sequence::Periodic127, 100), long[..100]);
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
