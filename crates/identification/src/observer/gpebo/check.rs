//! Checks of the settings of a run.

use super::delay::{Operator, whole_steps};
use super::grid::Grid;
use super::observer_spec::ObserverSpec;
use super::refusal::{CascadeError, LARGEST_BREAKPOINTS, LARGEST_STEPS, SettingError};
use super::scenario::{GpeboOptions, Scenario};
use super::setting_checks::{FIRST, SECOND, filters, positive, vector};

/// Refuses delays that are not whole numbers of equal steps.
pub(super) fn check_delays(
    grid: &Grid,
    options: &GpeboOptions,
    observers: &[ObserverSpec],
) -> Result<(), CascadeError> {
    let check = |what: &'static str, filters: &[Operator]| {
        for delay in filters.iter().filter_map(Operator::delay) {
            match grid.lengths[..] {
                [step] if whole_steps(delay, step).is_some() => {}
                [step] => return Err(SettingError::Delay { what, delay, step }),
                [first, second, ..] => {
                    let steps = [first, second];
                    return Err(SettingError::UnequalSteps { what, delay, steps });
                }
                [] => {}
            }
        }
        Ok(())
    };
    check(FIRST, &options.filters)?;
    for (number, observer) in (1..).zip(observers) {
        if let ObserverSpec::Proposed { filters, .. } = observer {
            check(SECOND, filters).map_err(|source| CascadeError::Observer { number, source })?;
        }
    }
    Ok(())
}

/// Refuses settings that cannot be run for a plant of order n.
pub(super) fn check(
    n: usize,
    scenario: &Scenario,
    options: &GpeboOptions,
    observers: &[ObserverSpec],
) -> Result<(), CascadeError> {
    let Scenario { horizon, step, .. } = *scenario;
    positive("the horizon", &[horizon], 1)?;
    positive("the step", &[step], 1)?;
    vector("the start of the score", &[scenario.scored_from], 1)?;
    if step > horizon {
        return Err(CascadeError::Step { step, horizon });
    }
    vector("the initial state", &scenario.x0, n)?;
    vector("xi(0)", &options.xi0, n)?;
    filters(FIRST, &options.filters, n - 1)?;
    for (what, signal) in [("input", &scenario.u), ("disturbance", &scenario.delta)] {
        signal
            .check(horizon)
            .map_err(|source| CascadeError::Signal { what, source })?;
    }
    let breakpoints = scenario.u.breakpoint_bound(horizon) + scenario.delta.breakpoint_bound(horizon);
    if !(breakpoints <= LARGEST_BREAKPOINTS) {
        return Err(CascadeError::Breakpoints(breakpoints));
    }
    // Each breakpoint may add one step.
    let steps = horizon / step + breakpoints + 1.0;
    if !(steps <= LARGEST_STEPS) {
        return Err(CascadeError::Steps(steps));
    }
    for (k, observer) in observers.iter().enumerate() {
        observer
            .check(n)
            .map_err(|source| CascadeError::Observer { number: k + 1, source })?;
    }
    Ok(())
}
