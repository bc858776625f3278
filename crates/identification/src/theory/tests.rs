//! Tests of each covariance against another method: spectra integrated over frequency, sums of impulse responses,
//! published numbers.

use super::joint_state::{covariance, long_run_covariance};
use super::linear::Influence;
use super::population::Population;
use super::*;
use crate::data::{Feedback, NoiseColour, OutputFeedback, PlantSource, ProcessSettings};
use crate::estimator::{ArmaxOptions, ArxOptions, Auxiliary, BjOptions, Iv4Options, SrivOptions};
use crate::estimator::{InstrumentSource, IvDelayedOptions, IvOptions, LsOptions, OeOptions};
use crate::plant::{Numerator, StateSpace, nikolov2023};
use crate::signal::{Input, InputLaw, LevelOf, LevelOver, LevelReading, NoiseFilter, Sequence};
use faer::c64;

mod cells;
mod fisher_information;
mod frequency;
mod record_information;
mod references;

/// A process in open loop with signs of amplitude 10.
fn process(plant: &StateSpace, noise: NoiseColour, level: LevelReading) -> Process {
    let input = Input::new(InputLaw::Signs, 10.0, Sequence::default());
    Process::new(plant.clone(), vec![0.0; plant.order()], input, noise, level).unwrap()
}
