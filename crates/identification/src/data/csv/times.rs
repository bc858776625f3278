//! The times of a record's samples, which must be equally spaced up to the rounding of what was printed.

use super::number::divided;
use super::options::Decimal;

/// How far a step in time may be from the first one, relative to it. It must exceed the rounding of printed times: with
/// two decimals, steps of 1/30 s are 0.03 or 0.04. A missing sample is a step of twice the length.
const SPACING: f64 = 0.5;
/// How far a time may be from a multiple of the step, in steps, beyond the rounding of printed times.
const JITTER: f64 = 0.01;
/// How many digits before the decimal point are told apart.
const CLASSES: usize = 40;

/// A time as it is printed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Time {
    pub(super) value: f64,
    /// The decimals of what is printed; negative if an exponent makes it a multiple of 10, 100 and so on.
    decimals: i32,
}

impl Time {
    /// Returns the time of a cell, whose number is known already.
    pub(super) fn printed(cell: &str, value: f64, decimal: Decimal) -> Self {
        let (digits, exponent) = divided(cell);
        let exponent = exponent.unwrap_or("0");
        let fraction = digits.split_once(decimal.mark()).map_or(0, |(_, after)| after.len());
        let exponent: i32 = exponent.parse().unwrap_or(0);
        let decimals = (fraction.min(400) as i32).saturating_sub(exponent);
        Self {
            value,
            decimals: decimals.clamp(-300, 300),
        }
    }

    /// Returns a time that is printed with so many decimals.
    pub(super) const fn rounded(value: f64, decimals: i32) -> Self {
        Self { value, decimals }
    }
}

/// Equal steps end before a line.
pub(super) struct Unequal {
    /// The line whose sample is not a step after the one before.
    pub(super) line: u64,
    /// The time since the sample before.
    pub(super) found: f64,
    /// The time between the first two samples.
    pub(super) first: f64,
}

/// The times of the samples so far.
#[derive(Clone, Debug)]
pub(super) struct Times {
    first: f64,
    last: f64,
    count: u64,
    first_step: f64,
    /// The step that differs most from the first one, and its line.
    odd: (f64, u64),
    /// The smallest and the largest step for which all times so far are its multiples.
    steps: [f64; 2],
    /// The largest number of decimals of a time with so many digits before the decimal point: a program that prints six
    /// digits leaves out others, or zeros at the end. Smaller times have as many decimals as larger ones, or more.
    decimals: [i32; CLASSES],
}

impl Times {
    pub(super) fn new() -> Self {
        Self {
            first: 0.0,
            last: 0.0,
            count: 0,
            first_step: 0.0,
            odd: (0.0, 0),
            steps: [0.0, f64::INFINITY],
            decimals: [i32::MIN; CLASSES],
        }
    }

    /// Returns the mean step; `None` of a single sample.
    pub(super) fn step(&self) -> Option<f64> {
        (self.count > 1).then(|| (self.last - self.first) / (self.count - 1) as f64)
    }

    /// Returns the mean step in seconds, of which a unit of the times has so many: the shortest number within its
    /// rounding. The binary fractions of times such as 0.01 and 0.99 do not tell more.
    pub(super) fn seconds(&self, unit: f64) -> Option<f64> {
        let step = self.step()?;
        let ends = (self.first.abs() + self.last.abs()) / (self.count - 1) as f64;
        let rounding = f64::EPSILON * (2.0 * step.abs() + ends) * unit;
        Some(shortest(step * unit, rounding))
    }

    /// Checks that the times of another run have the same step, if both have one; takes them if these have none.
    pub(super) fn same_step(&mut self, other: &Self, line: u64) -> Result<(), Unequal> {
        match (self.step(), other.step()) {
            (Some(first), Some(found)) if (found - first).abs() > JITTER * first => Err(Unequal { line, found, first }),
            (None, Some(_)) => {
                *self = other.clone();
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Returns the times of the first and of the last sample.
    pub(super) fn ends(&self) -> [f64; 2] {
        [self.first, self.last]
    }

    /// Half a unit of the last digit of printed times of this size.
    fn rounding(&self, time: f64) -> f64 {
        let decimals = self.decimals[class(time)..].iter().max();
        let decimals = decimals.copied().unwrap_or_default();
        0.5 * 10.0_f64.powi(-decimals) + 4.0 * f64::EPSILON * time.abs()
    }

    /// Adds the time of the next sample.
    pub(super) fn add(&mut self, printed: Time, line: u64) -> Result<(), Unequal> {
        let time = printed.value;
        let known = &mut self.decimals[class(time)];
        *known = printed.decimals.max(*known);
        let found = time - std::mem::replace(&mut self.last, time);
        self.count += 1;
        match self.count {
            1 => {
                self.first = time;
                return Ok(());
            }
            2 => (self.first_step, self.odd) = (found, (found, line)),
            _ => {}
        }
        let steps = (self.count - 1) as f64;
        let length = time - self.first;
        let mean = length / steps;
        let allowed = self.rounding(time) + self.rounding(self.first) + JITTER * mean;
        let [least, most] = self.steps;
        self.steps = [
            least.max((length - allowed) / steps),
            most.min((length + allowed) / steps),
        ];
        let first = self.first_step;
        if (found - first).abs() > (self.odd.0 - first).abs() {
            self.odd = (found, line);
        }
        let is_near = found > 0.0 && (found - first).abs() <= SPACING * first;
        if is_near && self.steps[0] <= self.steps[1] {
            return Ok(());
        }
        // Where the steps are equal again, the odd one before them is to blame.
        let is_equal = is_near && (found - first).abs() <= JITTER * first;
        let (found, line) = if is_equal { self.odd } else { (found, line) };
        Err(Unequal { line, found, first })
    }
}

/// The number with the fewest digits that is no further away than this.
pub(super) fn shortest(value: f64, within: f64) -> f64 {
    let shorter = (0..17).filter_map(|digits| format!("{value:.digits$e}").parse().ok());
    let mut near = shorter.filter(|short: &f64| (short - value).abs() <= within);
    near.next().unwrap_or(value)
}

/// The number of digits before the decimal point.
fn class(time: f64) -> usize {
    let digits = time.abs().log10().floor() + 1.0;
    (digits.max(0.0) as usize).min(CLASSES - 1)
}

#[cfg(test)]
mod tests {
    use crate::data::csv::{ReadOptions, read, read_table};

    fn error(text: &str) -> String {
        read(text.as_bytes()).unwrap_err().to_string()
    }

    /// A record with these times, and u, y of no meaning.
    fn timed(times: impl IntoIterator<Item = String>) -> String {
        let rows = times.into_iter().map(|t| format!("{t},1,2\n"));
        format!("t,u,y\n{}", rows.collect::<String>())
    }

    /// Equal steps as programs print them are equal, whatever it rounds or leaves out.
    #[test]
    fn equal_steps_as_programs_print_them() {
        for step in [0.1, 1.0 / 30.0, 0.25, 1e-3, 3600.0, 1.0 / 3.0] {
            for start in [0.0, -1.0, 999.9, 1.7e9] {
                let time = |k: usize| start + step * k as f64;
                let all = || (0..300).map(time);
                let decimals = if step < 0.01 { 4 } else { 2 };
                for text in [
                    timed(all().map(|t| t.to_string())),
                    timed(all().map(|t| format!("{t:.decimals$}"))),
                    timed(all().map(|t| format!("{t:.12e}"))),
                    // Zeros at the end are left out.
                    timed(all().map(|t| format!("{}", format!("{t:.decimals$}").parse::<f64>().unwrap()))),
                ] {
                    let read = read(text.as_bytes());
                    assert_eq!(read.unwrap().y.len(), 300, "{step} from {start}");
                }
            }
        }
        // Steps that were added up.
        let mut t = 0.0;
        let sums = (0..100_000).map(|_| {
            t += 0.1;
            t.to_string()
        });
        assert!(read(timed(sums).as_bytes()).is_ok());
    }

    /// The step of times that are multiples of a decimal is that decimal, whatever their binary fractions are.
    #[test]
    fn steps_are_as_short_as_they_are_known() {
        for (step, in_ms, start) in [
            (0.01, 1e-5, 0.0),
            (0.01, 1e-5, 0.99),
            (1.1, 0.0011, 5.0),
            (0.05, 5e-5, 1e4),
            (7.0, 0.007, -3.0),
        ] {
            for count in [2, 3, 100, 301] {
                let times = (0..count).map(|k| (start + step * f64::from(k)).to_string());
                let text = timed(times);
                for (text, expected) in [(text.clone(), step), (text.replacen("t,", "t [ms],", 1), in_ms)] {
                    let read = read_table(text.as_bytes(), &ReadOptions::default());
                    let found = read.unwrap().times.unwrap()[1];
                    assert_eq!(found, expected, "from {start}, {count} samples");
                }
            }
        }
    }

    /// Sample i is on line i + 2.
    #[test]
    fn unequal_steps_are_refused_where_they_begin() {
        let times = |step: fn(usize) -> f64| {
            let mut t = 0.0;
            let times = (0..100).map(move |k| {
                t += step(k);
                format!("{t:.4}")
            });
            timed(times)
        };
        for (text, line) in [
            (times(|k| if k == 40 { 0.15 } else { 0.1 }), "line 42,"),
            (times(|k| if k == 40 { 0.112 } else { 0.1 }), "line 42,"),
            (times(|k| if k < 40 { 0.1 } else { 0.11 }), "line 42,"),
            (times(|k| if k < 40 { 0.1 } else { 0.05 }), "line 42,"),
            (times(|k| 0.1 + 0.012 * (k as f64).sin()), "line 5,"),
            (times(|k| if k == 40 { 0.0 } else { 0.1 }), "line 42,"),
            (times(|k| if k == 40 { -0.1 } else { 0.1 }), "line 42,"),
        ] {
            let error = error(&text);
            assert!(
                error.starts_with(line) && error.contains("equally spaced"),
                "{line} {error}"
            );
        }
        // One decimal might be rounded, until the others show that zeros are left out.
        let times = (0..400).map(|k| f64::from(k) / 10.0 + if k < 20 { 0.0 } else { 0.05 });
        let error = error(&timed(times.map(|t| t.to_string())));
        assert!(
            error.starts_with("line 22,") && error.contains("step of 0.15"),
            "{error}"
        );
    }
}
