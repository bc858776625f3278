//! The unit of a record of very large or very small numbers.

use super::Report;
use crate::data::csv::Record;
use crate::estimator::unit_of;
use crate::text::rounded;

/// The least and the most that the largest sample of a column may be.
const SIZES: [f64; 2] = [1e-290, 1e300];
/// How many times as large as that of the other column it may be.
const RATIO: f64 = 1e100;

/// Divides a record by the unit of its window, and returns the unit. So no square of a sample overflows or underflows.
pub(super) fn in_own_unit(record: &mut Record, window: usize) -> Result<f64, String> {
    let [u, y] = [&record.u, &record.y].map(|column| {
        let samples = column[..window].iter();
        samples.fold(0.0_f64, |largest, sample| largest.max(sample.abs()))
    });
    let [least, most] = SIZES;
    for (name, size, other) in [("u", u, y), ("y", y, u)] {
        let known = format!(
            "the largest sample of column {name} is {}",
            rounded(size, 3)
        );
        if !(least..=most).contains(&size) {
            return Err(format!(
                "{known}; expected {least:e} to {most:e}: choose another unit"
            ));
        }
        if size > RATIO * other {
            return Err(format!(
                "{known}, that of the other column {}; expected at most {RATIO:e} times as much: choose other units",
                rounded(other, 3)
            ));
        }
    }
    let unit = unit_of(&[&record.u[..window], &record.y[..window]]);
    for column in [&mut record.u, &mut record.y] {
        for sample in column {
            *sample /= unit;
        }
    }
    Ok(unit)
}

impl Report {
    /// Says in which unit u, y and the states are, if it is not 1.
    pub(super) fn unit_in_words(&self) -> Option<String> {
        (self.unit != 1.0).then(|| {
            format!(
                "u, y, states, noise and loss are in units of 2^{} = {}",
                self.unit.log2(),
                rounded(self.unit, 6)
            )
        })
    }
}
