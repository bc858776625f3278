//! A plant whose parameters step or drift during the record.

use super::Truth;
use super::process_error::ProcessError;
use crate::plant::{StateSpace, simulate, simulate_disturbed};
#[cfg(feature = "json")]
use serde_json::{Value, json};

/// The plant that a changing one becomes.
#[derive(Clone, Debug, PartialEq)]
pub enum ChangedPlant {
    /// This one, of the same order.
    Plant(StateSpace),
    /// The first one with b times `gain`, and all poles times `poles`, both finite; `poles` is above 0.
    Factors {
        /// The factor on b.
        gain: f64,
        /// The factor on the poles.
        poles: f64,
    },
}

/// A change of the plant: `x(k+1) = A(k) x(k) + b(k) u(k)`, where the last row of A and b are
///
/// ```text
///     a(k) = a + w(k) (a' - a),  b(k) = b + w(k) (b' - b),  w(k) = 0 for k < at, min(1, (k - at) / over) from there
/// ```
///
/// so `over` = 0 is a step: A(at) is the first new matrix, and y(at + 1) the first output that can show it.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// a' and b'.
    pub to: ChangedPlant,
    /// The sample of the step, or the last one before the drift.
    pub at: usize,
    /// The samples that a drift takes; 0: a step.
    pub over: usize,
}

impl Change {
    /// Checks that it fits plants of this order.
    pub(super) fn check(&self, order: usize) -> Result<(), ProcessError> {
        match &self.to {
            ChangedPlant::Plant(plant) if plant.order() != order => {
                Err(ProcessError::ChangedOrder(plant.order(), order))
            }
            ChangedPlant::Factors { gain, poles } if !(gain.is_finite() && *poles > 0.0 && poles.is_finite()) => {
                Err(ProcessError::ChangeFactors(*gain, *poles))
            }
            _ => Ok(()),
        }
    }

    /// Returns the plant after the change.
    pub fn after(&self, plant: &StateSpace) -> Option<StateSpace> {
        let mut after = <[Vec<f64>; 2]>::default();
        self.fill(plant, &mut after);
        let [a, b] = after;
        StateSpace::new(a, b).ok()
    }

    /// Fills `after` with a' and b'.
    fn fill(&self, plant: &StateSpace, after: &mut [Vec<f64>; 2]) {
        let (a, b, gain, poles) = match &self.to {
            ChangedPlant::Plant(to) => (to.a(), to.b(), 1.0, 1.0_f64),
            ChangedPlant::Factors { gain, poles } => (plant.a(), plant.b(), *gain, *poles),
        };
        let [after_a, after_b] = after;
        after_a.clear();
        // a_i is minus the coefficient of q^-(n+1-i), which is a sum of products of so many poles.
        let powers = (1..=a.len() as i32).rev().map(|power| poles.powi(power));
        after_a.extend(a.iter().zip(powers).map(|(a, power)| a * power));
        after_b.clear();
        after_b.extend(b.iter().map(|b| gain * b));
    }

    /// Returns every setting, for a manifest.
    #[cfg(feature = "json")]
    pub(super) fn describe(&self) -> Value {
        let to = match &self.to {
            ChangedPlant::Plant(plant) => json!({ "a": plant.a(), "b": plant.b() }),
            ChangedPlant::Factors { gain, poles } => json!({ "gain": gain, "poles": poles }),
        };
        json!({ "to": to, "at": self.at, "over": self.over })
    }
}

/// The true plant of every sample of a trial.
#[derive(Clone, Debug, Default)]
pub struct PlantCourse {
    /// `at` and `over` of the change.
    span: Option<(usize, usize)>,
    before: [Vec<f64>; 2],
    after: [Vec<f64>; 2],
    /// The present plant of a simulation.
    present: [Vec<f64>; 2],
}

impl PlantCourse {
    /// Takes over the plant of a trial, and its change.
    pub(super) fn set(&mut self, plant: &StateSpace, change: Option<&Change>) {
        for (to, from) in self.before.iter_mut().zip([plant.a(), plant.b()]) {
            to.clear();
            to.extend_from_slice(from);
        }
        self.present.clone_from(&self.before);
        self.span = change.map(|change| (change.at, change.over));
        if let Some(change) = change {
            change.fill(plant, &mut self.after);
        }
    }

    /// Returns w(k).
    fn weight(&self, k: usize) -> f64 {
        let Some((at, over)) = self.span else {
            return 0.0;
        };
        match k.checked_sub(at) {
            None => 0.0,
            Some(since) if since >= over => 1.0,
            Some(since) => since as f64 / over as f64,
        }
    }

    /// Fills `a` and `b` with a(k) and b(k).
    ///
    /// # Panics
    /// If they are not of length n.
    pub fn at(&self, k: usize, a: &mut [f64], b: &mut [f64]) {
        let weight = self.weight(k);
        for (i, to) in [a, b].into_iter().enumerate() {
            // Either plant has its own bits.
            if weight == 1.0 {
                to.copy_from_slice(&self.after[i]);
                continue;
            }
            to.copy_from_slice(&self.before[i]);
            if weight > 0.0 {
                for (to, after) in to.iter_mut().zip(&self.after[i]) {
                    *to = weight.mul_add(after - *to, *to);
                }
            }
        }
    }

    /// Sets a, b and h of the truth to those of sample k.
    pub(super) fn set_truth(&self, k: usize, truth: &mut Truth) {
        self.at(k, &mut truth.a, &mut truth.b);
        truth.follow_b();
    }

    /// Simulates the plant from the state x, as [`StateSpace::simulate`] does or, where `disturbed`,
    /// [`StateSpace::simulate_disturbed`]. Before the change all bits are those of a plant without one.
    pub(super) fn simulate(&mut self, disturbed: bool, x: &mut [f64], u: &[f64], y0: &mut [f64], states: &mut [f64]) {
        let (n, samples) = (x.len(), u.len());
        let (at, over) = self.span.unwrap_or((samples, 0));
        let settled = at.saturating_add(over);
        let mut k = 0;
        while k < samples {
            let end = match k {
                _ if k < at => at.min(samples),
                _ if k < settled => k + 1,
                _ => samples,
            };
            let [mut a, mut b] = std::mem::take(&mut self.present);
            self.at(k, &mut a, &mut b);
            let rows = &mut states[k * n..end * n];
            if disturbed {
                simulate_disturbed(&a, &b, x, &u[k..end], rows);
            } else {
                simulate(&a, &b, x, &u[k..end], |i, x| {
                    rows[i * n..(i + 1) * n].copy_from_slice(x);
                });
            }
            self.present = [a, b];
            k = end;
        }
        for (y0, x) in y0.iter_mut().zip(states.chunks_exact(n)) {
            *y0 = x[0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::{Process, ProcessSettings, Realisation};
    use crate::plant::PoleFinder;
    use crate::signal::{Input, InputLaw, LevelReading, NoiseFilter, Sequence};

    const SAMPLES: usize = 60;

    fn plant() -> StateSpace {
        StateSpace::new(vec![-0.7, 1.5], vec![1.0, 2.0]).unwrap()
    }

    fn settings(change: Option<Change>, process_noise: f64) -> ProcessSettings {
        ProcessSettings {
            plant: plant().into(),
            x0: vec![1.0, -1.0],
            x0_deviation: 0.0,
            input: Input::new(InputLaw::Signs, 1.0, Sequence::Independent),
            noise: NoiseFilter::white().into(),
            level: LevelReading::default(),
            input_noise: 0.0,
            process_noise,
            state_noise: None,
            feedback: Default::default(),
            change,
        }
    }

    fn drawn(change: Option<Change>, process_noise: f64) -> Realisation {
        let process = Process::from_settings(settings(change, process_noise)).unwrap();
        let mut record = Realisation::default();
        process.realise(7, 3, 10.0, 50, SAMPLES, &mut record);
        record
    }

    fn change(at: usize, over: usize) -> Change {
        let to = StateSpace::new(vec![-0.2, 0.9], vec![0.5, 1.0]).unwrap();
        Change {
            to: ChangedPlant::Plant(to),
            at,
            over,
        }
    }

    /// Each state from the one before, by the definition.
    #[test]
    fn the_states_obey_the_plant_of_each_sample() {
        for (at, over) in [(0, 0), (20, 0), (20, 15), (40, 100), (59, 0), (200, 3)] {
            let record = drawn(Some(change(at, over)), 0.0);
            let (mut a, mut b) = ([0.0; 2], [0.0; 2]);
            for k in 0..SAMPLES - 1 {
                let w = if k < at {
                    0.0
                } else if over == 0 {
                    1.0
                } else {
                    ((k - at) as f64 / over as f64).min(1.0)
                };
                let by_hand = |from: f64, to: f64| from + w * (to - from);
                let expected = [by_hand(-0.7, -0.2), by_hand(1.5, 0.9)];
                record.plants.at(k, &mut a, &mut b);
                for (a, expected) in a.iter().zip(expected) {
                    assert!((a - expected).abs() < 1e-15, "{at} {over} {k}");
                }
                assert!((b[1] - by_hand(2.0, 1.0)).abs() < 1e-15);
                let (x, next) = (&record.states[2 * k..][..2], &record.states[2 * k + 2..][..2]);
                let u = record.u[k];
                assert!((next[0] - (x[1] + b[0] * u)).abs() < 1e-13);
                assert!((next[1] - (a[0] * x[0] + a[1] * x[1] + b[1] * u)).abs() < 1e-13);
                assert_eq!(record.y0[k].to_bits(), x[0].to_bits());
            }
            // The truth is that of the window's last sample.
            record.plants.at(49, &mut a, &mut b);
            assert_eq!((&record.truth.a[..], &record.truth.b[..]), (&a[..], &b[..]));
            assert!((record.truth.h[1] - (b[1] - a[1] * b[0])).abs() < 1e-15);
        }
    }

    /// The same draws, and the same bits before the change; with process noise too.
    #[test]
    fn nothing_moves_before_the_change() {
        for process_noise in [0.0, 0.3] {
            let (constant, changing) = (drawn(None, process_noise), drawn(Some(change(30, 5)), process_noise));
            assert_eq!(constant.u, changing.u);
            assert_eq!(constant.f, changing.f);
            // At k = 30 the drift begins with weight 0.
            assert_eq!(constant.states[..2 * 32], changing.states[..2 * 32]);
            assert_ne!(constant.states[2 * 33..], changing.states[2 * 33..]);
        }
    }

    #[test]
    fn factors_move_poles_and_gain() {
        let to = ChangedPlant::Factors { gain: -2.0, poles: 0.5 };
        let (at, over) = (1, 0);
        let after = Change { to, at, over }.after(&plant()).unwrap();
        assert_eq!(after.b(), [-2.0, -4.0]);
        let (poles, halved) = (
            PoleFinder::new(2).poles(plant().a()),
            PoleFinder::new(2).poles(after.a()),
        );
        for (pole, halved) in poles.iter().zip(&halved) {
            assert!((pole.re / 2.0 - halved.re).abs() < 1e-14);
            assert!((pole.im / 2.0 - halved.im).abs() < 1e-14);
        }
    }

    #[test]
    fn mistakes_get_one_line() {
        let factors = |gain, poles| ChangedPlant::Factors { gain, poles };
        let other = StateSpace::new(vec![0.5], vec![1.0]).unwrap();
        for (to, part) in [
            (ChangedPlant::Plant(other), "order 2 cannot become one of order 1"),
            (factors(f64::NAN, 1.0), "gain of NaN"),
            (factors(1.0, 0.0), "factor on the poles of 0"),
        ] {
            let change = Change { to, at: 5, over: 0 };
            let error = Process::from_settings(settings(Some(change), 0.0)).unwrap_err();
            assert!(error.to_string().contains(part), "{error}");
        }
        let closed = ProcessSettings {
            feedback: crate::data::Feedback::Output("0.1".parse().unwrap()),
            ..settings(Some(change(5, 0)), 0.0)
        };
        let error = Process::from_settings(closed).unwrap_err();
        assert!(error.to_string().contains("open loop only"), "{error}");
    }
}
