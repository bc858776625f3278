//! The data-generating process: plant, input, noise and noise level.

use crate::plant::{StateSpace, SystemError};
use crate::signal::{
    LevelReading, NoiseFilter, NoiseFilterError, ProcessVariances, Purpose, RandomSigns, stream,
};
use serde_json::{Value, json};

/// What draws a record: `y(k) = x_1(k) + s f(k)` with `x(k+1) = A x(k) + b u(k)` from x0.
#[derive(Clone, Debug)]
pub struct Process {
    plant: StateSpace,
    x0: Vec<f64>,
    input: RandomSigns,
    noise: NoiseFilter,
    level: LevelReading,
    variances: ProcessVariances,
}

/// Why a process was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProcessError {
    /// The plant's coefficients.
    #[error(transparent)]
    System(#[from] SystemError),
    /// The noise filter.
    #[error(transparent)]
    Noise(#[from] NoiseFilterError),
    /// x0 has another length than the order, or is not finite.
    #[error("x0 must be {0} finite numbers, one per state")]
    InitialState(usize),
    /// The amplitude is zero or not finite.
    #[error("the input's amplitude must be finite and positive, not {0}")]
    Amplitude(f64),
}

/// Buffers for one realisation of a process.
#[derive(Clone, Debug, Default)]
pub struct Realisation {
    /// The input u(k), k = 0 ... K-1.
    pub u: Vec<f64>,
    /// The measured output y(k).
    pub y: Vec<f64>,
    /// The noise-free output x_1(k).
    pub y0: Vec<f64>,
    /// The unscaled noise f(k).
    pub f: Vec<f64>,
    /// The true states, n numbers a row: row k holds x(k).
    pub states: Vec<f64>,
    /// The factor s of the noise; NaN where the noise level cannot be reached.
    pub scale: f64,
    /// The noise filter's inner signal.
    scratch: Vec<f64>,
    /// The state under way.
    x: Vec<f64>,
}

impl Process {
    /// A process.
    ///
    /// # Errors
    /// If x0 does not fit the plant or the amplitude is not positive.
    pub fn new(
        plant: StateSpace,
        x0: Vec<f64>,
        input: RandomSigns,
        noise: NoiseFilter,
        level: LevelReading,
    ) -> Result<Self, ProcessError> {
        if x0.len() != plant.order() || !x0.iter().all(|x| x.is_finite()) {
            return Err(ProcessError::InitialState(plant.order()));
        }
        if !(input.amplitude > 0.0 && input.amplitude.is_finite()) {
            return Err(ProcessError::Amplitude(input.amplitude));
        }
        let energy = plant.energy().unwrap_or(f64::NAN);
        let variances = ProcessVariances {
            output: input.amplitude * input.amplitude * energy,
            noise: noise.variance(),
        };
        Ok(Self {
            plant,
            x0,
            input,
            noise,
            level,
            variances,
        })
    }

    /// The plant.
    pub fn plant(&self) -> &StateSpace {
        &self.plant
    }

    /// The initial state x0.
    pub fn x0(&self) -> &[f64] {
        &self.x0
    }

    /// Draws trial `trial` of `seed` for K = `horizon` samples, with noise level `eta` (per cent) in the
    /// window k = 0 ... N-1.
    ///
    /// u and f depend on seed and trial alone: the same whatever eta, window and horizon (which only
    /// cuts them).
    ///
    /// # Panics
    /// If the window is longer than the horizon.
    pub fn realise(
        &self,
        seed: u64,
        trial: u64,
        eta: f64,
        window: usize,
        horizon: usize,
        to: &mut Realisation,
    ) {
        assert!(window <= horizon);
        for buffer in [&mut to.u, &mut to.y, &mut to.y0, &mut to.f] {
            buffer.resize(horizon, 0.0);
        }
        to.states.resize(horizon * self.plant.order(), 0.0);
        let mut input = stream(seed, trial, Purpose::Input);
        self.input.fill(&mut input, &mut to.u);
        let mut start = stream(seed, trial, Purpose::NoiseStart);
        let mut drive = stream(seed, trial, Purpose::NoiseDrive);
        self.noise
            .fill(&mut start, &mut drive, &mut to.scratch, &mut to.f);
        to.x.clear();
        to.x.extend_from_slice(&self.x0);
        self.plant
            .simulate(&mut to.x, &to.u, &mut to.y0, &mut to.states);
        let (y0, f) = (&to.y0[..window], &to.f[..window]);
        to.scale = self.level.scale(eta, y0, f, self.variances);
        for ((y, y0), f) in to.y.iter_mut().zip(&to.y0).zip(&to.f) {
            *y = to.scale.mul_add(*f, *y0);
        }
    }

    /// Every setting, for a manifest.
    pub fn describe(&self) -> Value {
        json!({
            "plant": { "a": self.plant.a(), "b": self.plant.b() },
            "x0": self.x0,
            "input": { "amplitude": self.input.amplitude, "sequence": self.input.sequence },
            "noise": { "numerator": self.noise.numerator(), "denominator": self.noise.denominator() },
            "eta": { "over": self.level.over, "of": self.level.of },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Numerator, nikolov2023};
    use crate::signal::arithmetic::variance;

    #[test]
    fn the_same_trial_has_the_same_input_and_noise_whatever_the_cell() {
        let plant = nikolov2023(Numerator::default());
        let noise = NoiseFilter::new(&[1.0], &plant.denominator()).unwrap();
        let input = RandomSigns {
            amplitude: 10.0,
            sequence: Default::default(),
        };
        let process =
            Process::new(plant, vec![1.0; 6], input, noise, LevelReading::default()).unwrap();
        let (mut short, mut long) = (Realisation::default(), Realisation::default());
        process.realise(1, 3, 10.018, 98, 400, &mut short);
        process.realise(1, 3, 2.0, 218, 500, &mut long);
        assert_eq!(short.u, long.u[..400]);
        assert_eq!(short.f, long.f[..400]);
        assert_eq!(short.y0, long.y0[..400]);
        let level =
            100.0 * short.scale * (variance(&short.f[..98]) / variance(&short.y0[..98])).sqrt();
        assert!((level - 10.018).abs() < 1e-12);
        process.realise(1, 3, 0.0, 18, 400, &mut short);
        assert_eq!(short.y, short.y0);
    }
}
