//! The stationary signals of a cell's process.

use super::joint_state::{covariance, is_stable};
use super::missing::NoTheory;
use super::signal::{Signal, Source};
use super::spectrum::Spectrum;
use crate::data::{Feedback, NoiseColour, PlantSource, Process};
use crate::model::polynomial::multiply;
use crate::plant::StateSpace;
use crate::signal::{Input, LevelOf, LevelOver, NoiseLaw, Sequence};

/// Source of the reference; in open loop this is the input.
pub const REFERENCE: usize = 0;
/// Source of the measurement noise, with standard deviation s.
pub const NOISE: usize = 1;
/// Source of the reference's mean, where it has one: the level of the noise is taken about the mean of the output.
const MEAN: usize = 2;
/// Source of the input-measurement noise; the sources of the process noise follow it.
pub(super) const INPUT_NOISE: usize = 3;

/// A process in its stationary state; n is the plant's order.
#[derive(Clone, Debug)]
pub struct Population {
    /// The plant.
    pub plant: StateSpace,
    /// `1, alpha_1 ... alpha_n`.
    pub alpha: Vec<f64>,
    /// `0, beta_1 ... beta_n`.
    pub beta: Vec<f64>,
    /// The sources.
    pub sources: Vec<Source>,
    /// Measured output.
    pub y: Signal,
    /// Measured input.
    pub u: Signal,
    /// Reference.
    pub r: Signal,
    /// `y - y0`, with y0 the plant's response to the measured input; `v = A(q)` times it.
    pub output_error: Signal,
    /// The equation error `v = A(q) y - B(q) u`.
    pub equation_error: Signal,
    /// C and D of the noise filter.
    pub noise: (Vec<f64>, Vec<f64>),
    /// Numerator and denominator of K(q), if there is feedback.
    pub feedback: Option<(Vec<f64>, Vec<f64>)>,
    /// Whether only the reference and the measurement noise drive the record.
    pub is_plain: bool,
    /// Set only if eta holds exactly in each window: weights with products a b. To first order the window's relative
    /// change of s is `sum_i weight_i (mean(a_i b_i) - E[a_i b_i])`.
    pub level: Vec<(f64, Signal, Signal)>,
}

impl Population {
    /// Builds the stationary process of a cell at noise level `eta`, in per cent.
    ///
    /// # Errors
    /// The reason why the process has no theory.
    pub fn new(process: &Process, eta: f64) -> Result<Self, NoTheory> {
        let is_gaussian = |law: &NoiseLaw| *law == NoiseLaw::Gaussian;
        Self::of_reference(process, eta, Reference::new(process.input())?, is_gaussian)
    }

    /// As [`Self::new`] for what takes second moments alone, so noise may be of any density. Signals from a
    /// reference that is given sample by sample are not to be averaged: it is no stationary source here.
    pub(super) fn of_record(process: &Process, eta: f64) -> Result<Self, NoTheory> {
        let reference = if matches!(process.input(), Input::Samples(_)) {
            process.common_scale(eta).ok_or(NoTheory::GivenInput)?;
            Reference::of(Source::white(process.input().amplitude().powi(2), 0.0))
        } else {
            Reference::new(process.input())?
        };
        Self::of_reference(process, eta, reference, |law| law.information().is_some())
    }

    /// As [`Self::of_record`] for what does not depend on the reference, of which only the size counts.
    pub(super) fn of_any_reference(process: &Process, eta: f64) -> Result<Self, NoTheory> {
        let reference = Reference::of(Source::white(process.input().amplitude().powi(2), 0.0));
        Self::of_reference(process, eta, reference, |law| law.information().is_some())
    }

    /// `covers`: which noises are covered.
    fn of_reference(
        process: &Process,
        eta: f64,
        reference: Reference,
        covers: impl Fn(&NoiseLaw) -> bool,
    ) -> Result<Self, NoTheory> {
        let settings = process.settings();
        let PlantSource::Fixed(plant) = &settings.plant else {
            return Err(NoTheory::RandomPlant);
        };
        if settings.change.is_some() {
            return Err(NoTheory::ChangingPlant);
        }
        if settings.state_noise.is_some() {
            return Err(NoTheory::StateNoise);
        }
        let feedback = match &settings.feedback {
            Feedback::None => None,
            Feedback::Output(law) => Some((law.numerator().to_vec(), law.denominator())),
            Feedback::Controlled(_) => return Err(NoTheory::Controlled),
        };
        let amplitude = settings.input.amplitude();
        if amplitude == 0.0 {
            return Err(NoTheory::NoReference);
        }
        let alpha = plant.denominator();
        let beta = [&[0.0], plant.h().as_slice()].concat();
        let noise = match &settings.noise {
            NoiseColour::InverseDenominator => (vec![1.0], alpha.clone()),
            NoiseColour::Filter(filter) if !covers(filter.law()) => {
                return Err(NoTheory::NotGaussian);
            }
            NoiseColour::Filter(filter) => (filter.numerator().to_vec(), filter.denominator()),
        };
        let gaussian = |deviation: f64| Source::white(deviation * deviation, 0.0);
        let input_noise = gaussian(settings.input_noise / 100.0 * amplitude);
        let mut sources = vec![reference.source, gaussian(0.0), reference.mean, input_noise];
        sources.resize(INPUT_NOISE + 1 + plant.order(), gaussian(settings.process_noise));
        let mut population = Self::closed(plant, reference.signal, (alpha, beta), noise, feedback);
        population.is_plain = settings.input_noise == 0.0 && settings.process_noise == 0.0;
        population.sources = sources;
        if settings.input_noise > 0.0 {
            let error = Signal::new(INPUT_NOISE, &[1.0], &[1.0]);
            population.add_input_error(&error);
        }
        if settings.process_noise > 0.0 {
            population.add_process_noise();
        }
        population.check()?;
        population.set_level(process, eta)?;
        Ok(population)
    }

    /// The part of a signal that comes from the reference.
    pub fn part_of_reference(signal: &Signal) -> Signal {
        signal.from_source(REFERENCE).plus(1.0, &signal.from_source(MEAN))
    }

    /// The signals of `y = B/A u + f`, `u = r - K y`. With `Pi = A D_K + B C_K` they are
    /// `y = (B D_K r + A D_K f) / Pi`, `u = (A D_K r - A C_K f) / Pi`.
    fn closed(
        plant: &StateSpace,
        r: Signal,
        (alpha, beta): (Vec<f64>, Vec<f64>),
        noise: (Vec<f64>, Vec<f64>),
        feedback: Option<(Vec<f64>, Vec<f64>)>,
    ) -> Self {
        let of_noise = |numerator: &[f64], denominator: &[f64]| {
            let top = multiply(numerator, &noise.0);
            Signal::new(NOISE, &top, &multiply(denominator, &noise.1))
        };
        let f = of_noise(&[1.0], &[1.0]);
        let (y, u) = match &feedback {
            None => {
                let y0 = r.through(&beta, &alpha);
                (y0.plus(1.0, &f), r.clone())
            }
            Some((c, d)) => {
                let a_d = multiply(&alpha, d);
                let pi = sum(&a_d, &multiply(&beta, c));
                let minus_c: Vec<f64> = c.iter().map(|c| -c).collect();
                (
                    r.through(&multiply(&beta, d), &pi).plus(1.0, &of_noise(&a_d, &pi)),
                    r.through(&a_d, &pi)
                        .plus(1.0, &of_noise(&multiply(&alpha, &minus_c), &pi)),
                )
            }
        };
        Self {
            plant: plant.clone(),
            equation_error: f.through(&alpha, &[1.0]),
            output_error: f,
            alpha,
            beta,
            sources: Vec::new(),
            y,
            u,
            r,
            noise,
            feedback,
            is_plain: true,
            level: Vec::new(),
        }
    }

    /// Adds the error of the measured input. In closed loop K acts on y, so this error is not fed back.
    fn add_input_error(&mut self, error: &Signal) {
        let u = std::mem::take(&mut self.u);
        self.u = u.plus(1.0, error);
        let v = std::mem::take(&mut self.equation_error);
        self.equation_error = v.plus(-1.0, &error.through(&self.beta, &[1.0]));
        let e = std::mem::take(&mut self.output_error);
        self.output_error = e.plus(-1.0, &error.through(&self.beta, &self.alpha));
    }

    /// Adds white noise on every state, in open loop: the plant's response to it, component by component.
    fn add_process_noise(&mut self) {
        let n = self.plant.order();
        for i in 0..n {
            let mut unit = vec![0.0; n];
            unit[i] = 1.0;
            crate::plant::canonical::multiply_toeplitz(self.plant.a(), &mut unit);
            let numerator = [&[0.0], unit.as_slice()].concat();
            let v = Signal::new(INPUT_NOISE + 1 + i, &numerator, &[1.0]);
            let y = v.through(&[1.0], &self.alpha);
            for (signal, more) in [
                (&mut self.y, &y),
                (&mut self.output_error, &y),
                (&mut self.equation_error, &v),
            ] {
                *signal = std::mem::take(signal).plus(1.0, more);
            }
        }
    }

    fn check(&self) -> Result<(), NoTheory> {
        let signals = [&self.y, &self.u];
        let parts = signals.iter().flat_map(|signal| &signal.parts);
        for part in parts {
            if !is_stable(&part.denominator) {
                return Err(match self.feedback {
                    None => NoTheory::UnstablePlant,
                    Some(_) => NoTheory::UnstableLoop,
                });
            }
        }
        Ok(())
    }

    /// Sets s, Eq. (6), and the terms of a level that holds in each window. With `Y = E[y0^2]`, `F = E[f^2]` and e =
    /// eta/100: `s^2 = e^2 Y / F` for a level relative to the noise-free output. Relative to the measured one, this is
    /// divided by `1 - e^2`. In the window `ds/s = (dY/Y - dF/F) / 2`, and for the measured output `+ s dC / Y`, with C
    /// the covariance of y0 and f.
    fn set_level(&mut self, process: &Process, eta: f64) -> Result<(), NoTheory> {
        let others = [NOISE, MEAN, INPUT_NOISE];
        let mut y0 = Signal::default();
        for source in (0..self.sources.len()).filter(|source| !others.contains(source)) {
            y0 = y0.plus(1.0, &self.y.from_source(source));
        }
        let f = Signal::new(NOISE, &self.noise.0, &self.noise.1);
        self.sources[NOISE].variance = 1.0;
        let variances = [&y0, &f].map(|signal| self.variance(signal));
        let [output, noise] = variances;
        let (output, noise) = (output?, noise?);
        let level = process.settings().level;
        let e2 = (eta / 100.0).powi(2);
        let share = match level.of {
            LevelOf::NoiseFree => e2,
            LevelOf::Measured => e2 / (1.0 - e2),
        };
        let square = if eta == 0.0 {
            0.0
        } else if level.over == LevelOver::Nothing {
            e2
        } else {
            share * output / noise
        };
        if !square.is_finite() || (square > 0.0) != (eta > 0.0) {
            return Err(NoTheory::NoLevel);
        }
        self.sources[NOISE].variance = square;
        if level.over.is_of_window() && square > 0.0 {
            let scaled = square * noise;
            self.level = vec![
                (0.5 / output, y0.clone(), y0.clone()),
                (-0.5 / scaled, f.clone(), f.clone()),
            ];
            if level.of == LevelOf::Measured {
                self.level.push((1.0 / output, y0, f));
            }
        }
        Ok(())
    }

    fn variance(&self, signal: &Signal) -> Result<f64, NoTheory> {
        let one = std::slice::from_ref(signal);
        Ok(covariance(&self.sources, one, one)?[(0, 0)])
    }
}

/// The external input as a signal of sources.
struct Reference {
    source: Source,
    /// The source of the line at frequency 0; of variance 0 where there is none.
    mean: Source,
    signal: Signal,
}

impl Reference {
    /// A reference that is one source.
    fn of(source: Source) -> Self {
        Self {
            source,
            mean: Source::white(0.0, 0.0),
            signal: Signal::new(REFERENCE, &[1.0], &[1.0]),
        }
    }

    fn of_spectrum(spectrum: Spectrum) -> Self {
        let (mean, others) = spectrum.split_mean();
        let mut reference = Self::of(Source::lines(others));
        if let Some(mean) = mean {
            let constant = Signal::new(MEAN, &[1.0], &[1.0]);
            reference.mean = Source::lines(mean);
            reference.signal = reference.signal.plus(1.0, &constant);
        }
        reference
    }

    fn new(input: &Input) -> Result<Self, NoTheory> {
        let square = input.amplitude().powi(2);
        Ok(match input {
            Input::Signs(signs) => match signs.sequence {
                Sequence::Independent => Self::of(Source::white(square, -2.0)),
                Sequence::Periodic127 | Sequence::Held127 => return Err(NoTheory::PeriodicInput),
            },
            Input::Gaussian { .. } => Self::of(Source::white(square, 0.0)),
            Input::Filtered { filter, .. } => Self {
                signal: Signal::new(REFERENCE, filter.numerator(), &filter.denominator()),
                ..Self::of(Source::white(square / filter.variance(), 0.0))
            },
            Input::Binary { filter, amplitude } => Self::of_spectrum(Spectrum::of_signs(filter, *amplitude)?),
            Input::Samples(period) => Self::of_spectrum(Spectrum::of_period(period)?),
        })
    }
}

/// The sum of two polynomials.
pub fn sum(first: &[f64], second: &[f64]) -> Vec<f64> {
    let at = |c: &[f64], i: usize| c.get(i).copied().unwrap_or(0.0);
    let length = first.len().max(second.len());
    (0..length).map(|i| at(first, i) + at(second, i)).collect()
}
