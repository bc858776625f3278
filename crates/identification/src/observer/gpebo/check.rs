//! Checks of the settings of a run.

use super::delay::{Operator, whole_steps};
use super::expansion::HIGHEST_ORDER;
use super::grid::Grid;
use super::refusal::{CascadeError, LARGEST_BREAKPOINTS, LARGEST_STEPS, SettingError};
use super::scenario::{GpeboOptions, ObserverSpec, Scenario};

fn vector(what: &'static str, v: &[f64], expected: usize) -> Result<(), SettingError> {
    if v.len() != expected {
        return Err(SettingError::Length {
            what,
            expected,
            found: v.len(),
        });
    }
    if v.iter().all(|v| v.is_finite()) {
        Ok(())
    } else {
        Err(SettingError::NotFinite(what))
    }
}

fn positive(what: &'static str, v: &[f64], expected: usize) -> Result<(), SettingError> {
    vector(what, v, expected)?;
    match v.iter().find(|v| **v <= 0.0) {
        Some(&value) => Err(SettingError::NotPositive { what, value }),
        None => Ok(()),
    }
}

const FIRST: &str = "filters in [continuous]";
const SECOND: &str = "filters of the observer";

fn filters(what: &'static str, v: &[Operator], expected: usize) -> Result<(), SettingError> {
    let numbers: Vec<f64> = v.iter().map(Operator::number).collect();
    positive(what, &numbers, expected)?;
    let twice = (0..v.len()).find(|&k| v[..k].contains(&v[k]));
    match twice {
        Some(k) => Err(SettingError::NotDistinct {
            what,
            value: numbers[k],
        }),
        None => Ok(()),
    }
}

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

impl ObserverSpec {
    fn check(&self, n: usize) -> Result<(), SettingError> {
        match self {
            Self::Luenberger { gain, x0 } => {
                vector("the gain L", gain, n)?;
                vector("the initial estimate", x0, n)
            }
            Self::Gradient { gains } => positive("the gains", gains, n),
            Self::FiniteTime { gains, share } => {
                positive("the gains", gains, n)?;
                if *share > 0.0 && *share < 1.0 {
                    Ok(())
                } else {
                    Err(SettingError::Share(*share))
                }
            }
            Self::LsDrem { gains, p0, r } => {
                positive("the gains", gains, n)?;
                positive("the prior variance p0", &[*p0], 1)?;
                positive("the noise intensity r", &[*r], 1)
            }
            Self::Proposed {
                k,
                order,
                filters: operators,
                gains,
                ..
            } => {
                if !(1..=HIGHEST_ORDER).contains(order) {
                    return Err(SettingError::Order(*order));
                }
                positive("the filter k", &[*k], 1)?;
                filters(SECOND, operators, *order)?;
                positive("the gains", gains, n)
            }
            Self::Filter { p0, q, r, x0 } => {
                positive("the prior variance p0", &[*p0], 1)?;
                positive("the process noise's intensity q", &[*q], 1)?;
                positive("the noise intensity r", &[*r], 1)?;
                vector("the initial estimate", x0, n)
            }
            Self::KalmanBucy { p0, r } => {
                positive("the prior variance p0", &[*p0], 1)?;
                positive("the noise intensity r", &[*r], 1)
            }
        }
    }
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
    let breakpoints =
        scenario.u.breakpoint_bound(horizon) + scenario.delta.breakpoint_bound(horizon);
    if !(breakpoints <= LARGEST_BREAKPOINTS) {
        return Err(CascadeError::Breakpoints(breakpoints));
    }
    // Each breakpoint may add one step.
    let steps = horizon / step + breakpoints + 1.0;
    if !(steps <= LARGEST_STEPS) {
        return Err(CascadeError::Steps(steps));
    }
    for (k, observer) in observers.iter().enumerate() {
        observer.check(n).map_err(|source| CascadeError::Observer {
            number: k + 1,
            source,
        })?;
    }
    Ok(())
}
