//! The data-generating process: plant, input, noise and noise level, feedback.

use super::closed_loop::run_controlled;
use super::process_error::ProcessError;
use super::source::{Drive, Plants, Resolved};
use super::{Change, Feedback, NoiseColour, PlantSource, Realisation};
use crate::plant::{StateNoise, StateSpace};
use crate::signal::{
    Input, LevelOf, LevelOver, LevelReading, NoiseFilter, ProcessVariances, Purpose, fill_white, stream,
};
#[cfg(feature = "json")]
use serde_json::{Value, json};

/// The sizes that signals may have.
const SIZES: std::ops::RangeInclusive<f64> = 1e-100..=1e100;

/// The settings of a process.
#[derive(Clone, Debug)]
pub struct ProcessSettings {
    /// The plant.
    pub plant: PlantSource,
    /// The initial state at k = 0, n numbers: that of every trial, or the mean over trials with [`Self::x0_deviation`].
    pub x0: Vec<f64>,
    /// Standard deviation d of every component of the initial state, `x(0) ~ N(x0, d^2 I)`, drawn in every trial; 0 for
    /// none. Open loop only.
    pub x0_deviation: f64,
    /// The reference r, which is u in open loop. Amplitude 0 (r = 0) is allowed in closed loop only.
    pub input: Input,
    /// The colour of the measurement noise.
    pub noise: NoiseColour,
    /// How the noise level eta is interpreted.
    pub level: LevelReading,
    /// Standard deviation of the input-measurement noise, in per cent of the input's amplitude. The amplitude is the
    /// process standard deviation of r, and of u in open loop.
    pub input_noise: f64,
    /// Standard deviation q of every component of the process noise, `w(k) ~ N(0, q^2 I)`, in the states' units; 0 for
    /// none. Open loop only.
    pub process_noise: f64,
    /// Instead of [`Self::process_noise`]: white noise with these covariances, in the states' coordinates and units.
    /// With R the measurement noise is white and of that variance, whatever the level. Open loop only.
    pub state_noise: Option<StateNoise>,
    /// The feedback that closes the loop.
    pub feedback: Feedback,
    /// How the plant changes during the record, in open loop; `None`: it does not. Noise of the colour 1/A, and the
    /// variances of the processes, stay those of the plant before.
    pub change: Option<Change>,
}

/// The process that draws records: `y(k) = x_1(k) + s f(k)` with `x(k+1) = A x(k) + b u0(k) + w(k)` from x(0). The
/// process noise w, n numbers, is white, Gaussian and independent of all else. It is zero by default, as is the spread
/// of x(0).
///
/// In open loop u0 = r. The measured input is u0 plus white Gaussian noise, zero by default.
///
/// The factor s sets the noise level eta, Eq. (6). In open loop it uses the variance of the actual x_1, including the
/// contribution of the process noise. This holds in the window ('exact') and for the variance of the processes
/// ('nominal': `amplitude^2 sum_k (c'A^k b)^2 + q^2 sum_k ||c'A^k||^2`, which makes s the same in every trial).
///
/// In closed loop, x_1 contains noise that went around the loop, so a noise-free response is used instead. With output
/// feedback it is that of the loop driven by r alone from x0, in the window k = 0 ... N-1. With a controller, whose
/// part before the record is in open loop, it is the open-loop response over that part (not over the record's window),
/// and s stays the same throughout.
#[derive(Clone, Debug)]
pub struct Process {
    settings: ProcessSettings,
    plants: Plants,
}

impl ProcessSettings {
    fn drive(&self) -> Drive<'_> {
        Drive {
            input: &self.input,
            process_noise: self.process_noise,
            state_noise: self.state_noise.as_ref(),
        }
    }

    /// Returns whether process noise drives the plant.
    pub fn is_disturbed(&self) -> bool {
        self.process_noise > 0.0 || self.state_noise.is_some()
    }

    /// Returns the variance of the measurement noise where it is given by itself, not by a level.
    pub fn measurement_variance(&self) -> Option<f64> {
        self.state_noise.as_ref()?.measurement()
    }

    /// Returns the factor of the noise at level `eta`; see [`LevelReading::scale`].
    fn scale(&self, eta: f64, y0: &[f64], f: &[f64], variances: ProcessVariances) -> f64 {
        match self.measurement_variance() {
            Some(variance) => variance.sqrt(),
            None => self.level.scale(eta, y0, f, variances),
        }
    }

    fn check_state_noise(&self, closed: bool) -> Result<(), ProcessError> {
        let Some(noise) = &self.state_noise else {
            return Ok(());
        };
        if noise.cross().len() != self.plant.order() || self.process_noise > 0.0 {
            return Err(ProcessError::StateNoise(self.plant.order()));
        }
        if closed {
            return Err(ProcessError::StateNoiseInLoop);
        }
        let white = |filter: &NoiseFilter| filter.numerator() == [1.0] && filter.denominator() == [1.0];
        match &self.noise {
            NoiseColour::Filter(filter) if white(filter) => Ok(()),
            _ if noise.measurement().is_none() => Ok(()),
            _ => Err(ProcessError::ColouredVariance),
        }
    }

    fn check_level(&self, closed: bool) -> Result<(), ProcessError> {
        let LevelReading { over, of } = self.level;
        match over {
            LevelOver::Nothing if of != LevelOf::NoiseFree => Err(ProcessError::LevelOfNothing { over, of }),
            LevelOver::Nothing => Ok(()),
            _ if closed && self.level != LevelReading::default() => Err(ProcessError::LevelWithFeedback { over, of }),
            LevelOver::Process if matches!(self.input, Input::Samples(_) | Input::Binary { .. }) => {
                Err(ProcessError::LevelOfSamples(over))
            }
            _ => Ok(()),
        }
    }

    /// Checks that squares of all signals, and of errors of a millionth of them, are numbers.
    fn check_sizes(&self) -> Result<(), ProcessError> {
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let amplitude = self.input.amplitude();
        let gain = match &self.plant {
            PlantSource::Fixed(plant) => largest(plant.b()),
            PlantSource::Random { .. } => 1.0,
        };
        for (name, size) in [
            ("an amplitude", amplitude),
            ("an amplitude times b", amplitude * gain),
            ("an initial state", largest(&self.x0)),
            ("an initial state's deviation", self.x0_deviation),
            ("process noise", self.process_noise),
        ] {
            if size != 0.0 && !SIZES.contains(&size) {
                return Err(ProcessError::Size(name, size));
            }
        }
        Ok(())
    }

    fn check_disturbances(&self, closed: bool) -> Result<(), ProcessError> {
        for (name, deviation) in [
            ("process_noise", self.process_noise),
            ("x0_deviation", self.x0_deviation),
        ] {
            if !(deviation >= 0.0 && deviation.is_finite()) {
                return Err(ProcessError::Deviation(name, deviation));
            }
            if closed && deviation > 0.0 {
                return Err(ProcessError::DisturbedLoop(name, deviation));
            }
        }
        Ok(())
    }
}

impl Process {
    /// Makes a process in open loop with exactly measured input.
    ///
    /// # Errors
    /// As for [`Self::from_settings`].
    pub fn new(
        plant: impl Into<PlantSource>,
        x0: Vec<f64>,
        input: impl Into<Input>,
        noise: impl Into<NoiseColour>,
        level: LevelReading,
    ) -> Result<Self, ProcessError> {
        Self::from_settings(ProcessSettings {
            plant: plant.into(),
            x0,
            x0_deviation: 0.0,
            input: input.into(),
            noise: noise.into(),
            level,
            input_noise: 0.0,
            process_noise: 0.0,
            state_noise: None,
            feedback: Feedback::None,
            change: None,
        })
    }

    /// Makes a process.
    ///
    /// # Errors
    /// The first setting that is wrong.
    pub fn from_settings(settings: ProcessSettings) -> Result<Self, ProcessError> {
        let order = settings.plant.order();
        if settings.x0.len() != order || !settings.x0.iter().all(|x| x.is_finite()) {
            return Err(ProcessError::InitialState(order));
        }
        let closed = !matches!(settings.feedback, Feedback::None);
        let amplitude = settings.input.amplitude();
        let positive = amplitude > 0.0 && amplitude.is_finite();
        if !(positive || closed && amplitude == 0.0) {
            return Err(ProcessError::Amplitude(amplitude));
        }
        let percent = settings.input_noise;
        if !(percent == 0.0 || percent > 0.0 && percent.is_finite() && positive) {
            return Err(ProcessError::InputNoise(percent, amplitude));
        }
        settings.check_disturbances(closed)?;
        settings.check_state_noise(closed)?;
        settings.check_sizes()?;
        settings.check_level(closed)?;
        if let Some(change) = &settings.change {
            change.check(order)?;
            if closed {
                return Err(ProcessError::ChangingLoop);
            }
        }
        if let Feedback::Controlled(law) = &settings.feedback
            && law.pilot() < 2
        {
            return Err(ProcessError::Pilot(law.pilot()));
        }
        let plants = Plants::new(&settings.plant, &settings.noise, settings.drive())?;
        Ok(Self { settings, plants })
    }

    /// Returns the factor of the noise of level `eta` if it is the same in all trials; not finite if there is no such
    /// factor.
    pub fn common_scale(&self, eta: f64) -> Option<f64> {
        let Plants::Fixed(resolved) = &self.plants else {
            return None;
        };
        let settings = &self.settings;
        let common = !settings.level.over.is_of_window() || settings.measurement_variance().is_some();
        common.then(|| settings.scale(eta, &[], &[], resolved.variances))
    }

    /// Returns the settings of the process.
    pub fn settings(&self) -> &ProcessSettings {
        &self.settings
    }

    /// Returns the order n of every trial's plant.
    pub fn order(&self) -> usize {
        self.settings.x0.len()
    }

    /// Returns the external input r.
    pub fn input(&self) -> &Input {
        &self.settings.input
    }

    /// Returns whether all trials are the same at a noise level eta (per cent). This is so for a loop around a fixed
    /// plant that only its initial state drives, and for a plant with a given input.
    pub fn is_deterministic(&self, eta: f64) -> bool {
        let settings = &self.settings;
        let spreads = [settings.x0_deviation, settings.process_noise, settings.input_noise, eta];
        let fixed = matches!(settings.plant, PlantSource::Fixed(_)) && settings.input.is_fixed();
        fixed && spreads == [0.0; 4] && settings.state_noise.is_none()
    }

    /// Draws trial `trial` of `seed` for K = `horizon` samples. The noise level `eta` (per cent) holds in the window k
    /// = 0 ... N-1, or with a controller in the part before the record.
    ///
    /// Plant, r, f and the input-measurement noise depend on seed and trial alone, not on eta, window or horizon (which
    /// only truncates them; and with [`LevelOver::WindowAlone`] f is zero after the window). A diverging loop gives
    /// values that are not finite.
    ///
    /// # Panics
    /// If the window is longer than the horizon.
    pub fn realise(&self, seed: u64, trial: u64, eta: f64, window: usize, horizon: usize, to: &mut Realisation) {
        assert!(window <= horizon);
        let settings = &self.settings;
        let pilot = settings.feedback.pilot();
        to.resize(self.order(), pilot + horizon);
        let names = (seed, trial);
        let drawn = self.plants.of_trial(names, &settings.noise, settings.drive());
        let resolved = match drawn {
            Ok(resolved) => resolved,
            Err(failure) => {
                to.begin_at(self.order(), pilot);
                return to.fail(failure);
            }
        };
        let Resolved { plant, noise, .. } = &*resolved;
        to.truth.set(plant, &settings.x0);
        to.plants.set(plant, settings.change.as_ref());
        if settings.change.is_some() {
            to.plants.set_truth(window.saturating_sub(1), &mut to.truth);
        }
        self.draw_initial_state(names, to);
        self.draw_signals(names, noise, to);
        match &settings.feedback {
            Feedback::None => {
                self.draw_process_noise(names, to);
                self.run_open(&resolved, eta, window, to);
                // Nobody knows the input better than it was measured.
                to.r.copy_from_slice(&to.u);
            }
            Feedback::Output(law) => {
                Self::rest(to);
                law.run(plant, 0.0, to);
                let (y0, f) = (&to.y0[..window], &to.f[..window]);
                to.scale = settings.level.scale(eta, y0, f, resolved.variances);
                Self::rest(to);
                law.run(plant, to.scale, to);
                Self::measure_input(to);
            }
            Feedback::Controlled(law) => {
                self.run_open(&resolved, eta, pilot, to);
                self.draw_input_noise(names, &mut to.u);
                Self::rest(to);
                let outcome = run_controlled(law, plant, to.scale, to);
                to.begin_at(self.order(), pilot);
                if let Err(failure) = outcome {
                    to.fail(failure);
                }
            }
        }
    }

    /// Draws r, f and, with the input-measurement noise, u.
    fn draw_signals(&self, names: (u64, u64), noise: &NoiseFilter, to: &mut Realisation) {
        let (seed, trial) = names;
        let mut input = stream(seed, trial, Purpose::Input);
        self.settings.input.fill(&mut input, &mut to.r);
        if let Feedback::Controlled(law) = &self.settings.feedback
            && law.is_silent()
        {
            to.r[law.pilot()..].fill(0.0);
        }
        let mut start = stream(seed, trial, Purpose::NoiseStart);
        let mut drive = stream(seed, trial, Purpose::NoiseDrive);
        noise.fill(&mut start, &mut drive, &mut to.scratch, &mut to.f);
        self.draw_input_noise(names, &mut to.u);
    }

    /// Adds the random part to the initial state, which is the mean. By default nothing is drawn.
    fn draw_initial_state(&self, (seed, trial): (u64, u64), to: &mut Realisation) {
        let deviation = self.settings.x0_deviation;
        if deviation == 0.0 {
            return;
        }
        to.x.resize(self.order(), 0.0);
        let mut numbers = stream(seed, trial, Purpose::InitialState);
        fill_white(&mut numbers, deviation, &mut to.x);
        for (x0, difference) in to.truth.x0.iter_mut().zip(&to.x) {
            *x0 += difference;
        }
    }

    /// Fills row k of the states with w(k). By default nothing is drawn.
    fn draw_process_noise(&self, (seed, trial): (u64, u64), to: &mut Realisation) {
        let ProcessSettings {
            process_noise: deviation,
            state_noise,
            ..
        } = &self.settings;
        let numbers = || stream(seed, trial, Purpose::ProcessNoise);
        if let Some(noise) = state_noise {
            noise.draw(&mut numbers(), &to.f, &mut to.states);
        } else if *deviation > 0.0 {
            fill_white(&mut numbers(), *deviation, &mut to.states);
        }
    }

    /// Sets the plant's state to the initial state.
    fn rest(to: &mut Realisation) {
        to.x.clear();
        to.x.extend_from_slice(&to.truth.x0);
    }

    /// Runs the plant in open loop, u0 = r; the noise level holds in the first `window` samples. With process noise,
    /// row k of the states holds w(k) on entry.
    fn run_open(&self, resolved: &Resolved, eta: f64, window: usize, to: &mut Realisation) {
        to.u0.copy_from_slice(&to.r);
        Self::rest(to);
        let plant = &resolved.plant;
        let disturbed = self.settings.is_disturbed();
        if self.settings.change.is_some() {
            let (x, states) = (&mut to.x, &mut to.states);
            to.plants.simulate(disturbed, x, &to.u0, &mut to.y0, states);
        } else if disturbed {
            plant.simulate_disturbed(&mut to.x, &to.u0, &mut to.y0, &mut to.states);
        } else {
            plant.simulate(&mut to.x, &to.u0, &mut to.y0, &mut to.states);
        }
        let (y0, f) = (&to.y0[..window], &to.f[..window]);
        to.scale = self.settings.scale(eta, y0, f, resolved.variances);
        if self.settings.measurement_variance().is_none() {
            let noisy = self.settings.level.over.noisy(window, to.f.len());
            to.f[noisy..].fill(0.0);
        }
        let (scale, y) = (to.scale, &mut to.y);
        with_fma!(|| {
            for ((y, y0), f) in y.iter_mut().zip(&to.y0).zip(&to.f) {
                *y = scale.mul_add(*f, *y0);
            }
        });
        Self::measure_input(to);
    }

    /// Fills `u` with the input-measurement noise. By default it is zero and nothing is drawn.
    fn draw_input_noise(&self, (seed, trial): (u64, u64), u: &mut [f64]) {
        let deviation = self.input_deviation();
        if deviation == 0.0 {
            u.fill(0.0);
        } else {
            fill_white(&mut stream(seed, trial, Purpose::InputNoise), deviation, u);
        }
    }

    /// Adds the true input to the noise in `u`.
    fn measure_input(to: &mut Realisation) {
        for (u, u0) in to.u.iter_mut().zip(&to.u0) {
            *u += u0;
        }
    }

    /// Returns the standard deviation of the input-measurement noise.
    pub fn input_deviation(&self) -> f64 {
        self.settings.input_noise / 100.0 * self.settings.input.amplitude()
    }

    /// Returns the same as [`Self::open_loop`] if only the measured input and the initial state drive the plant.
    pub fn undisturbed(&self) -> Option<(&StateSpace, &NoiseFilter, ProcessVariances)> {
        let ProcessSettings {
            process_noise,
            x0_deviation,
            input_noise,
            ..
        } = self.settings;
        self.open_loop()
            .filter(|_| [process_noise, x0_deviation, input_noise] == [0.0; 3])
            .filter(|_| self.settings.state_noise.is_none())
    }

    /// Returns the plant if it is the same in every trial and sample, and no estimate of it is fed back.
    pub fn plant(&self) -> Option<&StateSpace> {
        let known = !matches!(self.settings.feedback, Feedback::Controlled(_));
        let known = known && self.settings.change.is_none();
        match &self.plants {
            Plants::Fixed(resolved) if known => Some(&resolved.plant),
            _ => None,
        }
    }

    /// Returns plant, noise filter and variances if they are the same in every trial and sample, and the loop is open.
    pub fn open_loop(&self) -> Option<(&StateSpace, &NoiseFilter, ProcessVariances)> {
        let open = matches!(self.settings.feedback, Feedback::None);
        let open = open && self.settings.change.is_none();
        let Plants::Fixed(resolved) = &self.plants else {
            return None;
        };
        let Resolved {
            plant,
            noise,
            variances,
        } = resolved;
        open.then_some((plant, noise, *variances))
    }

    /// Returns every setting, for a manifest.
    #[cfg(feature = "json")]
    pub fn describe(&self) -> Value {
        let ProcessSettings {
            plant,
            x0,
            x0_deviation,
            input,
            noise,
            level,
            input_noise,
            process_noise,
            state_noise,
            feedback,
            change,
        } = &self.settings;
        let mut described = json!({
            "plant": plant.describe(),
            "x0": x0,
            "input": input.describe(),
            "noise": noise.describe(self.plants.noise()),
            "eta": { "over": level.over, "of": level.of },
            "input_noise": input_noise,
            "feedback": feedback.describe(),
        });
        for (name, deviation) in [("x0_deviation", x0_deviation), ("process_noise", process_noise)] {
            if *deviation > 0.0 {
                described[name] = json!(deviation);
            }
        }
        if let Some(noise) = state_noise {
            let q = noise.covariance();
            let rows = q.row_iter().map(|row| row.iter().copied().collect());
            described["state_noise"] = json!({
                "Q": rows.collect::<Vec<Vec<f64>>>(),
                "R": noise.measurement(),
                "S": noise.cross(),
            });
        }
        if let Some(change) = change {
            described["change"] = change.describe();
        }
        described
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::OutputFeedback;
    use crate::plant::{Numerator, nikolov2023};
    use crate::signal::RandomSigns;
    use crate::signal::arithmetic::variance;

    /// A loop with r = 0 and without noise is the same in every trial. With r, noise or random plants it is not.
    #[test]
    fn a_loop_that_nothing_random_drives() {
        let settings = |amplitude: f64, plant: PlantSource| ProcessSettings {
            x0: vec![1.0; plant.order()],
            plant,
            x0_deviation: 0.0,
            input: Input::Gaussian { amplitude },
            noise: NoiseFilter::white().into(),
            level: LevelReading::default(),
            input_noise: 0.0,
            process_noise: 0.0,
            state_noise: None,
            feedback: Feedback::Output(OutputFeedback::new(&[0.1], &[1.0]).unwrap()),
            change: None,
        };
        let process = |amplitude: f64, plant| Process::from_settings(settings(amplitude, plant)).unwrap();
        let plant = || PlantSource::Fixed(nikolov2023(Numerator::default()));
        let silent = process(0.0, plant());
        let (mut first, mut other) = (Realisation::default(), Realisation::default());
        silent.realise(1, 0, 0.0, 18, 40, &mut first);
        silent.realise(1, 7, 0.0, 18, 40, &mut other);
        assert_eq!((&first.y, &first.states), (&other.y, &other.states));
        assert!(silent.is_deterministic(0.0) && !silent.is_deterministic(1.0));
        assert!(!process(1.0, plant()).is_deterministic(0.0));
        let random = PlantSource::Random { order: 6, radius: 0.5 };
        assert!(!process(0.0, random).is_deterministic(0.0));
    }

    #[test]
    fn the_same_trial_has_the_same_input_and_noise_whatever_the_cell() {
        let plant = nikolov2023(Numerator::default());
        let noise = NoiseFilter::new(&[1.0], &plant.denominator()).unwrap();
        let input = RandomSigns {
            amplitude: 10.0,
            sequence: Default::default(),
        };
        let process = Process::new(plant, vec![1.0; 6], input, noise, LevelReading::default()).unwrap();
        let (mut short, mut long) = (Realisation::default(), Realisation::default());
        process.realise(1, 3, 10.018, 98, 400, &mut short);
        process.realise(1, 3, 2.0, 218, 500, &mut long);
        assert_eq!(short.u, long.u[..400]);
        assert_eq!(short.f, long.f[..400]);
        assert_eq!(short.y0, long.y0[..400]);
        let level = 100.0 * short.scale * (variance(&short.f[..98]) / variance(&short.y0[..98])).sqrt();
        assert!((level - 10.018).abs() < 1e-12);
        process.realise(1, 3, 0.0, 18, 400, &mut short);
        assert_eq!(short.y, short.y0);
    }

    /// With noise in the window alone a record is the usual one there, and without noise after it.
    #[test]
    fn noise_may_end_with_the_window() {
        let of = |over| {
            let level = LevelReading {
                over,
                ..LevelReading::default()
            };
            let input = RandomSigns {
                amplitude: 10.0,
                sequence: Default::default(),
            };
            let plant = nikolov2023(Numerator::default());
            let noise = NoiseFilter::new(&[1.0], &plant.denominator()).unwrap();
            let process = Process::new(plant, vec![1.0; 6], input, noise, level).unwrap();
            let mut record = Realisation::default();
            process.realise(1, 3, 10.0, 98, 400, &mut record);
            record
        };
        let (usual, alone) = (of(LevelOver::Window), of(LevelOver::WindowAlone));
        assert_eq!((alone.scale, &alone.y[..98]), (usual.scale, &usual.y[..98]));
        assert_eq!(alone.y[98..], usual.y0[98..]);
        assert_ne!(alone.y[98..], usual.y[98..]);
    }
}
