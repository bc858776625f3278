//! Plant, first mixing and all observers on one time grid.

use super::check::{check, check_delays};
use super::grid::Grid;
use super::linear::LinearSystem;
use super::observer_spec::ObserverSpec;
use super::refusal::CascadeError;
use super::scenario::{GpeboOptions, Scenario};
use crate::plant::ContinuousPlant;

/// A plant, a scenario and observers that fit together.
#[derive(Clone, Debug)]
pub struct Cascade {
    pub(super) n: usize,
    pub(super) horizon: f64,
    pub(super) scored_from: f64,
    /// The true theta = x(0) - xi(0).
    pub(super) theta: Vec<f64>,
    pub(super) specs: Vec<ObserverSpec>,
    pub(super) system: LinearSystem,
    /// The rows of M that delays make, from 1 on, with the delay in seconds.
    pub(super) delays: Vec<(usize, f64)>,
    pub(super) grid: Grid,
}

impl Cascade {
    /// Checks the settings and prepares the matrices and the grid.
    ///
    /// # Errors
    /// If a length does not fit the plant's order, a filter or gain is not positive, filters are not distinct, or
    /// the step or a signal does not fit the horizon. Also if there is a delay and not all steps are equal and a
    /// whole part of it, or if there would be more than [`super::LARGEST_STEPS`] steps,
    /// [`super::LARGEST_BREAKPOINTS`] breakpoints or [`super::LARGEST_LENGTHS`] different step lengths.
    pub fn new(
        plant: &ContinuousPlant,
        scenario: &Scenario,
        options: &GpeboOptions,
        observers: &[ObserverSpec],
    ) -> Result<Self, CascadeError> {
        check(plant.order(), scenario, options, observers)?;
        let grid = Grid::new(scenario)?;
        check_delays(&grid, options, observers)?;
        Ok(Self {
            n: plant.order(),
            horizon: scenario.horizon,
            scored_from: scenario.scored_from,
            theta: scenario.x0.iter().zip(&options.xi0).map(|(x, xi)| x - xi).collect(),
            specs: observers.to_vec(),
            system: LinearSystem::new(plant, scenario, options, observers),
            delays: (1..)
                .zip(&options.filters)
                .filter_map(|(row, operator)| Some((row, operator.delay()?)))
                .collect(),
            grid,
        })
    }

    /// Returns the number of observers.
    pub fn observers(&self) -> usize {
        self.specs.len()
    }

    /// Returns the true theta = x(0) - xi(0), of length n.
    pub fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Whether both may run in lock step: all but the signals and the grid is the same, and nothing is delayed.
    pub(super) fn fits(&self, other: &Self) -> bool {
        self.delays.is_empty()
            && !self.specs.iter().any(ObserverSpec::delays)
            && (self.horizon, self.scored_from) == (other.horizon, other.scored_from)
            && (self.n, &self.theta, &self.specs) == (other.n, &other.theta, &other.specs)
            && self.system.is_like(&other.system)
    }
}
