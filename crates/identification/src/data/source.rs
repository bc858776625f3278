//! The sources of a trial's plant and of the colour of its noise.

use super::DrawFailure;
use super::process_error::ProcessError;
use crate::model::polynomial::{self, multiply};
use crate::plant::{ORDER_LIMIT, StateNoise, StateSpace, random_stable};
#[cfg(feature = "json")]
use crate::signal::NoiseLaw;
use crate::signal::{Input, NoiseFilter, NoiseFilterError, ProcessVariances, Purpose, stream};
#[cfg(feature = "json")]
use serde_json::{Value, json};
use std::borrow::Cow;

/// The plant of a process.
#[derive(Clone, Debug, PartialEq)]
pub enum PlantSource {
    /// The same plant in every trial.
    Fixed(StateSpace),
    /// A different plant in every trial, from the stream of [`Purpose::Plant`]; see [`random_stable`].
    Random {
        /// The order n.
        order: usize,
        /// The radius of the disc of poles, in (0, 1).
        radius: f64,
    },
}

impl PlantSource {
    /// Returns the order n of every trial's plant.
    pub fn order(&self) -> usize {
        match self {
            Self::Fixed(plant) => plant.order(),
            Self::Random { order, .. } => *order,
        }
    }

    /// Returns every setting, for a manifest.
    #[cfg(feature = "json")]
    pub fn describe(&self) -> Value {
        match self {
            Self::Fixed(plant) => json!({ "a": plant.a(), "b": plant.b() }),
            Self::Random { order, radius } => {
                json!({ "random": { "order": order, "radius": radius } })
            }
        }
    }
}

impl From<StateSpace> for PlantSource {
    fn from(plant: StateSpace) -> Self {
        Self::Fixed(plant)
    }
}

/// The colour of the measurement noise f.
#[derive(Clone, Debug, PartialEq)]
pub enum NoiseColour {
    /// White noise through `1/A(q)` of the trial's plant: `A(q) y = B(q) u + white`.
    InverseDenominator,
    /// White noise through a filter; [`NoiseFilter::white`] leaves it white.
    Filter(NoiseFilter),
}

impl NoiseColour {
    /// Returns every setting, for a manifest, including the coefficients if they are known.
    #[cfg(feature = "json")]
    pub(super) fn describe(&self, filter: Option<&NoiseFilter>) -> Value {
        let coefficients = |filter: &NoiseFilter| {
            let mut described = json!({ "numerator": filter.numerator(), "denominator": filter.denominator() });
            match filter.law() {
                NoiseLaw::Gaussian => {}
                NoiseLaw::StudentT(freedom) => {
                    described["drive"] = json!(format!("Student's t with {freedom} degrees of freedom"));
                }
                NoiseLaw::Contaminated { share, scale } => {
                    described["drive"] = json!(format!(
                        "normal numbers, a share of {share} of them {scale} times as large"
                    ));
                }
                NoiseLaw::Drawn(_) => described["drive"] = json!("drawn from given numbers"),
            }
            described
        };
        match (self, filter) {
            (Self::Filter(filter), _) => coefficients(filter),
            (Self::InverseDenominator, None) => json!({ "colour": self.to_string() }),
            (Self::InverseDenominator, Some(filter)) => {
                let mut described = coefficients(filter);
                described["colour"] = json!(self.to_string());
                described
            }
        }
    }
}

impl From<NoiseFilter> for NoiseColour {
    fn from(filter: NoiseFilter) -> Self {
        Self::Filter(filter)
    }
}

/// Why a noise colour was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoiseColourError {
    /// The text is not a colour.
    #[error("noise '{0}': expected white, 1/A or c_0,c_1,.../1,d_1,... (such as 1,0.5/1,-0.9 or 1/1,-0.9)")]
    Form(String),
    /// The filter is wrong.
    #[error(transparent)]
    Filter(#[from] NoiseFilterError),
}

impl std::str::FromStr for NoiseColour {
    type Err = NoiseColourError;

    /// Parses `white`, `1/A` or `c_0,c_1,.../1,d_1,...`.
    fn from_str(text: &str) -> Result<Self, NoiseColourError> {
        let form = || NoiseColourError::Form(text.to_owned());
        match text {
            "white" => return Ok(Self::Filter(NoiseFilter::white())),
            "1/A" => return Ok(Self::InverseDenominator),
            _ => {}
        }
        let (numerator, denominator) = text.split_once('/').ok_or_else(form)?;
        let numbers = |list: &str| polynomial::parse(list).ok_or_else(form);
        let filter = NoiseFilter::new(&numbers(numerator)?, &numbers(denominator)?)?;
        Ok(Self::Filter(filter))
    }
}

impl std::fmt::Display for NoiseColour {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self::Filter(filter) = self else {
            return f.write_str("1/A");
        };
        if *filter == NoiseFilter::white() {
            return f.write_str("white");
        }
        let [numerator, denominator] = [filter.numerator(), &filter.denominator()].map(polynomial::text);
        write!(f, "{numerator}/{denominator}")
    }
}

/// The signals that drive the plant in open loop.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drive<'a> {
    pub(super) input: &'a Input,
    /// Standard deviation of every component of the process noise.
    pub(super) process_noise: f64,
    /// Noise that has covariances instead.
    pub(super) state_noise: Option<&'a StateNoise>,
}

/// A plant and what depends on it.
#[derive(Clone, Debug)]
pub(super) struct Resolved {
    pub(super) plant: StateSpace,
    pub(super) noise: NoiseFilter,
    /// The variances in open loop, process noise included.
    pub(super) variances: ProcessVariances,
}

impl Resolved {
    fn new(plant: StateSpace, noise: &NoiseColour, drive: Drive<'_>) -> Result<Self, NoiseFilterError> {
        let noise = match noise {
            NoiseColour::InverseDenominator => NoiseFilter::new(&[1.0], &plant.denominator())?,
            NoiseColour::Filter(filter) => filter.clone(),
        };
        let Drive {
            input,
            process_noise,
            state_noise,
        } = drive;
        let mut output = input.amplitude().powi(2) * input_energy(&plant, input).unwrap_or(f64::NAN);
        if process_noise > 0.0 {
            let energy = plant.disturbance_energy().unwrap_or(f64::NAN);
            output += process_noise * process_noise * energy;
        }
        if let Some(noise) = state_noise {
            output += noise.output_variance(&plant).unwrap_or(f64::NAN);
        }
        let variances = ProcessVariances {
            output,
            noise: noise.variance(),
        };
        Ok(Self {
            plant,
            noise,
            variances,
        })
    }
}

/// Returns the variance of the output for an input of variance 1; `None` if there is none.
fn input_energy(plant: &StateSpace, input: &Input) -> Option<f64> {
    match input {
        Input::Signs(_) | Input::Gaussian { .. } => plant.energy(),
        Input::Filtered { filter, .. } => {
            let numerator = multiply(filter.numerator(), &plant.h());
            let denominator = multiply(&filter.denominator(), &plant.denominator());
            let both = NoiseFilter::new(&numerator, &denominator).ok()?;
            Some(both.variance() / filter.variance())
        }
        Input::Binary { .. } | Input::Samples(_) => None,
    }
}

/// The checked plants of a process.
#[derive(Clone, Debug)]
pub(super) enum Plants {
    Fixed(Resolved),
    Random { order: usize, radius: f64 },
}

impl Plants {
    pub(super) fn new(source: &PlantSource, noise: &NoiseColour, drive: Drive<'_>) -> Result<Self, ProcessError> {
        match *source {
            PlantSource::Fixed(ref plant) => {
                let resolved = Resolved::new(plant.clone(), noise, drive)?;
                Ok(Self::Fixed(resolved))
            }
            PlantSource::Random { order, radius } => {
                if (1..=ORDER_LIMIT).contains(&order) && radius > 0.0 && radius < 1.0 {
                    Ok(Self::Random { order, radius })
                } else {
                    Err(ProcessError::RandomPlant(order, radius))
                }
            }
        }
    }

    /// Returns the noise filter if it is the same in every trial.
    #[cfg(feature = "json")]
    pub(super) fn noise(&self) -> Option<&NoiseFilter> {
        match self {
            Self::Fixed(resolved) => Some(&resolved.noise),
            Self::Random { .. } => None,
        }
    }

    /// Returns the plant of a trial. Fails if rounding makes a random plant's `1/A` look unstable.
    pub(super) fn of_trial(
        &self,
        (seed, trial): (u64, u64),
        noise: &NoiseColour,
        drive: Drive<'_>,
    ) -> Result<Cow<'_, Resolved>, DrawFailure> {
        match *self {
            Self::Fixed(ref resolved) => Ok(Cow::Borrowed(resolved)),
            Self::Random { order, radius } => {
                let plant = random_stable(order, radius, &mut stream(seed, trial, Purpose::Plant));
                let resolved = Resolved::new(plant, noise, drive);
                resolved.map(Cow::Owned).map_err(|_| DrawFailure::NonFinite)
            }
        }
    }
}
