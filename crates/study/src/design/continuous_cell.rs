//! A cell in continuous time.

use asobench_identification::observer::gpebo::{GpeboOptions, ObserverSpec, Scenario};
use asobench_identification::plant::ContinuousPlant;
use asobench_identification::signal::{Hold, Purpose, Signal, Wave, fill_white, stream};
use rand::RngExt;
use std::f64::consts::TAU;

/// A cell in continuous time: draws and runs its trials.
#[derive(Clone, Debug)]
pub struct ContinuousCell {
    /// The plant.
    pub plant: ContinuousPlant,
    /// x(0), n numbers.
    pub x0: Vec<f64>,
    /// The input.
    pub input: Signal,
    /// The disturbance of the output.
    pub disturbance: Vec<Term>,
    /// xi(0) and the filters of the first mixing.
    pub gpebo: GpeboOptions,
    /// The observers, in the order of the outputs.
    pub observers: Vec<ObserverSpec>,
    /// The end T, seconds.
    pub until: f64,
    /// The time from which root mean squares are taken, seconds.
    pub scored_from: f64,
    /// The longest step, seconds.
    pub step: f64,
    /// A trial with a larger relative error fails.
    pub error_limit: f64,
    /// Seconds between the stored points of the first trial.
    pub trace_every: Option<f64>,
}

/// A term of a disturbance.
#[derive(Clone, Debug, PartialEq)]
pub enum Term {
    /// The same in every trial.
    Fixed(Wave),
    /// A sine or square whose phase is uniform on [0, 2 pi), drawn anew in every trial.
    RandomPhase(Wave),
    /// White Gaussian numbers, each held for some time.
    White {
        /// Standard deviation.
        deviation: f64,
        /// Seconds.
        hold: f64,
    },
}

impl ContinuousCell {
    /// Draws the disturbance of a trial: a pure function of seed and trial.
    pub fn draw(&self, seed: u64, trial: u64) -> Signal {
        let mut phases = stream(seed, trial, Purpose::DisturbancePhase);
        let mut noise = stream(seed, trial, Purpose::Disturbance);
        let mut draw = |term: &Term| match term {
            Term::Fixed(wave) => wave.clone(),
            Term::RandomPhase(wave) => with_phase(wave, TAU * phases.random::<f64>()),
            Term::White { deviation, hold } => {
                // One more than the holds that fit, so that the last instant has one, however the quotient is rounded.
                let count = (self.until / hold).ceil() as usize + 1;
                let mut values = vec![0.0; count];
                fill_white(&mut noise, *deviation, &mut values);
                Wave::Samples {
                    interval: *hold,
                    values: values.into(),
                    hold: Hold::Zero,
                }
            }
        };
        Signal {
            waves: self.disturbance.iter().map(&mut draw).collect(),
        }
    }

    /// Whether all trials are identical.
    pub fn is_deterministic(&self) -> bool {
        let is_fixed = |term: &Term| matches!(term, Term::Fixed(_));
        self.disturbance.iter().all(is_fixed)
    }

    /// Returns the scenario with a disturbance.
    pub(crate) fn scenario(&self, delta: Signal) -> Scenario {
        Scenario {
            u: self.input.clone(),
            delta,
            x0: self.x0.clone(),
            horizon: self.until,
            scored_from: self.scored_from,
            step: self.step,
        }
    }

    /// Returns how many numbers of white noise a trial has.
    pub(crate) fn disturbance_numbers(&self) -> usize {
        let terms = self.disturbance.iter().map(|term| match term {
            Term::White { hold, .. } => (self.until / hold).ceil() as usize + 1,
            _ => 0,
        });
        terms.sum()
    }

    /// Returns the least number of steps of a trial, not counting the halved ones.
    pub fn steps(&self) -> usize {
        (self.until / self.step).ceil() as usize
    }
}

/// Returns a sine or square with another phase.
fn with_phase(wave: &Wave, phase: f64) -> Wave {
    let mut wave = wave.clone();
    if let Wave::Sine { phase: angle, .. } | Wave::Square { phase: angle, .. } = &mut wave {
        *angle = phase;
    }
    wave
}
