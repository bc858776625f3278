//! The unit of a record of very large or very small numbers.

use super::report::{Report, Validation};
use crate::data::csv::Record;
use crate::estimator::unit_of;
use crate::text::rounded;

/// The least and the most that the largest sample of a column may be.
const SIZES: [f64; 2] = [1e-290, 1e300];
/// How many times as large as that of the other column it may be.
const RATIO: f64 = 1e100;
/// Units from 2^-220 to 2^220 (about 1e-66 to 1e66) have fourth powers, which tests of residuals print, that are
/// numbers of doubles.
const TOLD: i32 = 220;

/// Divides a record by the unit of its window, and returns the unit. So no square of a sample overflows or underflows.
pub(super) fn in_own_unit(record: &mut Record, window: usize) -> Result<f64, String> {
    let [u, y] = [&record.u, &record.y].map(|column| {
        let samples = column[..window].iter();
        samples.fold(0.0_f64, |largest, sample| largest.max(sample.abs()))
    });
    let [least, most] = SIZES;
    for (name, size, other) in [("u", u, y), ("y", y, u)] {
        let known = format!("the largest sample of column {name} is {}", rounded(size, 3));
        if !(least..=most).contains(&size) {
            return Err(format!("{known}; expected {least:e} to {most:e}: choose another unit"));
        }
        if size > RATIO * other {
            return Err(format!(
                "{known}, that of the other column {}; expected at most {RATIO:e} times as much: choose other units",
                rounded(other, 3)
            ));
        }
    }
    let unit = unit_of(&[&record.u[..window], &record.y[..window]]);
    for column in [&mut record.u, &mut record.y, &mut record.r] {
        for sample in column {
            *sample /= unit;
        }
    }
    Ok(unit)
}

impl Report {
    /// The unit in which results are computed, if they can be told in that of the file; otherwise 1.
    pub(super) fn told_unit(&self) -> f64 {
        let exponent = self.unit.log2();
        if exponent.abs() <= f64::from(TOLD) {
            self.unit
        } else {
            1.0
        }
    }

    /// Brings the record and all results to the unit of the file, if they can be told in it.
    pub(super) fn tell_in_unit_of_file(&mut self) {
        let unit = self.told_unit();
        if unit == 1.0 {
            return;
        }
        self.unit /= unit;
        let Record { u, y, r } = &mut self.record;
        u.iter_mut().chain(y).chain(r).for_each(|sample| *sample *= unit);
        if let Some(Validation { record, .. }) = &mut self.validation {
            let Record { u, y, .. } = record;
            u.iter_mut().chain(y).for_each(|sample| *sample *= unit);
        }
        for trend in &mut self.trends {
            *trend = trend.times(unit);
        }
        for estimate in &mut self.estimates {
            for (_, report) in &mut estimate.passes {
                // Nothing is lost: told_unit saw to it.
                let _ = report.fitted.set_unit(unit);
                if let Some(residuals) = &mut report.residuals {
                    residuals.set_unit(unit);
                }
            }
            for part in &mut estimate.parts {
                if let Some(residuals) = &mut part.residuals {
                    residuals.set_unit(unit);
                }
            }
            if let Some(observed) = &mut estimate.observer {
                observed.states.iter_mut().for_each(|x| *x *= unit);
            }
        }
    }

    /// Says in which unit u, y and the states are, if it is not that of the file, and why.
    pub(super) fn unit_in_words(&self) -> Option<String> {
        (self.unit != 1.0).then(|| {
            format!(
                "u, y, states, noise and loss are in units of 2^{} = {}: powers of the file's unit are beyond doubles",
                self.unit.log2(),
                rounded(self.unit, 6)
            )
        })
    }
}
