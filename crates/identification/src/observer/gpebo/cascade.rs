//! Plant, first mixing and all observers on one time grid.

use super::grid::Grid;
use super::linear::LinearSystem;
use super::operators::{LONGEST_DELAY, Operator, whole_steps};
use super::settings::{CascadeError, FIRST, GpeboOptions, ObserverSpec, SECOND, Scenario, check};
use crate::plant::ContinuousPlant;
use crate::text::number;

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
    /// whole part of it, at most 10^4 to a delay, or if there would be more than 10^7 steps, 10^6 breakpoints or 4096
    /// different step lengths.
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

/// Refuses delays that are not whole numbers of equal steps.
fn check_delays(grid: &Grid, options: &GpeboOptions, observers: &[ObserverSpec]) -> Result<(), CascadeError> {
    let check = |what: &str, filters: &[Operator]| {
        for delay in filters.iter().filter_map(Operator::delay) {
            match grid.lengths[..] {
                [step] if whole_steps(delay, step).is_some() => {}
                [step] => {
                    return Err(format!(
                        "{what}: a delay of {} s; expected a whole number of steps of {} s, from 1 to {LONGEST_DELAY}",
                        number(delay),
                        number(step)
                    ));
                }
                [first, second, ..] => {
                    return Err(format!(
                        "{what}: a delay of {} s among steps of {} s and {} s; expected steps of one length: an end, a \
                         start of the score and switches of signals that are multiples of it",
                        number(delay),
                        number(first),
                        number(second)
                    ));
                }
                [] => {}
            }
        }
        Ok(())
    };
    check(FIRST, &options.filters).map_err(CascadeError::Setting)?;
    for (number, observer) in (1..).zip(observers) {
        if let ObserverSpec::Proposed { filters, .. } = observer {
            check(SECOND, filters).map_err(|mistake| CascadeError::Observer { number, mistake })?;
        }
    }
    Ok(())
}
