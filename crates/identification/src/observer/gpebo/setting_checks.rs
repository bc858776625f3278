//! Checks of single settings.

use super::delay::Operator;
use super::refusal::SettingError;

pub(super) fn vector(what: &'static str, v: &[f64], expected: usize) -> Result<(), SettingError> {
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

pub(super) fn positive(what: &'static str, v: &[f64], expected: usize) -> Result<(), SettingError> {
    vector(what, v, expected)?;
    match v.iter().find(|v| **v <= 0.0) {
        Some(&value) => Err(SettingError::NotPositive { what, value }),
        None => Ok(()),
    }
}

pub(super) const FIRST: &str = "filters in [continuous]";
pub(super) const SECOND: &str = "filters of the observer";

pub(super) fn filters(what: &'static str, v: &[Operator], expected: usize) -> Result<(), SettingError> {
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
