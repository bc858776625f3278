//! Times of samples as numbers or as dates and times of day.

use super::columns::{Columns, Role};
use super::error::RecordError;
use super::number::{is_missing, is_number};
use super::options::Decimal;
use super::times::Time;
use jiff::civil::DateTime;
use jiff::fmt::strtime::BrokenDownTime;

/// Dates: of two that fit, the first one is tried first.
const DATES: &str = "%Y-%m-%d|%Y/%m/%d|%Y.%m.%d|%Y%m%d|%d.%m.%Y|%d.%m.%y|%m/%d/%Y|%d/%m/%Y|%m/%d/%y|%d/%m/%y|\
                     %d-%m-%Y|%m-%d-%Y|%d-%b-%Y|%d %b %Y|%b %d %Y";
/// Times behind a date, and times alone.
const HOURS: &str = "%H:%M:%S%.f|%I:%M:%S%.f %p|%H:%M:%S:%f|%H:%M|%I:%M %p|%H%M%S%.f";
const ALONE: &str = "%H:%M:%S%.f|%I:%M:%S%.f %p|%H:%M:%S:%f|%H:%M|%I:%M %p|%M:%S%.f";
const ZONES: [&str; 3] = ["", "%:z", " %z"];
const WORDS: &str = "%Y=year %y=year %m=month %b=month %d=day %H=hour %I=hour %M=minute %S=second %p=am/pm \
                     %f=fraction %:z=zone %z=zone";
const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
const DAY: f64 = 86400.0;

/// A way to read times.
#[derive(Clone, Debug)]
pub(super) struct Form {
    format: String,
    /// Seconds in the unit of what is printed last.
    unit: f64,
    /// Seconds after which times begin anew.
    period: Option<f64>,
}

/// The forms of a column of times that all of its cells have.
#[derive(Clone, Debug, Default)]
pub(super) struct Forms {
    /// `None` before a cell was seen, or if cells are numbers.
    pub(super) dates: Option<Vec<Form>>,
    has_numbers: bool,
    /// The first cell that is no time, and its line.
    pub(super) wrong: Option<(u64, String)>,
}

impl Forms {
    /// Looks at a cell.
    pub(super) fn see(&mut self, cell: &str, line: u64) {
        if self.has_numbers || self.wrong.is_some() || is_missing(cell) {
            return;
        }
        let left = match &self.dates {
            None if is_number(cell) => {
                self.has_numbers = true;
                return;
            }
            None => forms().filter(|form| form.read(cell).is_some()).collect(),
            Some(forms) if forms.iter().all(|form| form.read(cell).is_some()) => return,
            Some(forms) => {
                let left = forms.iter().filter(|form| form.read(cell).is_some());
                left.cloned().collect::<Vec<_>>()
            }
        };
        if left.is_empty() {
            self.wrong = Some((line, cell.to_owned()));
        } else {
            self.dates = Some(left);
        }
    }
}

fn forms() -> impl Iterator<Item = Form> {
    let days = DATES.split('|').flat_map(|date| {
        let hours = HOURS.split('|').flat_map(move |hour| {
            let both = ["T", " "].map(|between| format!("{date}{between}{hour}"));
            let zoned = |of: String| ZONES.map(|zone| format!("{of}{zone}"));
            both.into_iter().flat_map(zoned)
        });
        hours.chain([date.to_owned()])
    });
    days.chain(ALONE.split('|').map(str::to_owned)).map(Form::new)
}

/// A cell as the forms have it: fractions after a point, the time of Greenwich without its name.
fn plain(cell: &str) -> String {
    let cell = cell.replace(['\u{a0}', '\u{202f}'], " ").replace(", ", " ");
    let cell = cell.replace(',', ".");
    let zones = ["Z", "UTC", "GMT"].into_iter();
    let mut without = zones.filter_map(|zone| cell.strip_suffix(zone));
    match without.next() {
        Some(rest) if rest.ends_with(|c: char| c.is_ascii_digit() || c == ' ') => rest.trim_end().to_owned(),
        _ => cell,
    }
}

impl Form {
    fn new(format: String) -> Self {
        let has = |code: &str| format.contains(code);
        let unit = [("%S", 1.0), ("%M", MINUTE)];
        let unit = unit.into_iter().find(|(code, _)| has(code));
        let hour = if has("%H") || has("%I") { DAY } else { HOUR };
        Self {
            unit: unit.map_or(DAY, |(_, unit)| unit),
            period: (!has("%d")).then_some(hour),
            format,
        }
    }

    /// Names the parts in their order, such as day.month.year hour:minute.
    pub(super) fn in_words(&self) -> String {
        let plain = self.format.replace("T%", " %").replace("%.f", "");
        let words = WORDS.split(' ').filter_map(|pair| pair.split_once('='));
        words.fold(plain, |text, (code, word)| text.replace(code, word))
    }

    /// The nanoseconds of a time since some day, and the digits printed of a second.
    fn read(&self, cell: &str) -> Option<(i128, i32)> {
        let cell = plain(cell);
        let of = BrokenDownTime::parse(&self.format, &cell).ok()?;
        let digits = match cell.rsplit_once(if self.format.contains(":%f") { ':' } else { '.' }) {
            Some((before, after)) if self.unit == 1.0 && (before.contains(':') || before.len() > 10) => {
                after.bytes().take_while(u8::is_ascii_digit).count() as i32
            }
            _ => 0,
        };
        let nanoseconds = if self.period.is_some() {
            let hour = of.hour().map(|_| of.to_time()).transpose().ok()?;
            let hour = hour.map_or(0, jiff::civil::Time::hour);
            let fields = [Some(hour), of.minute(), of.second()];
            let fields = fields.map(|field| i128::from(field.unwrap_or(0)));
            let seconds = (fields[0] * 60 + fields[1]) * 60 + fields[2];
            seconds * 1_000_000_000 + i128::from(of.subsec_nanosecond().unwrap_or(0))
        } else if of.offset().is_some() {
            of.to_timestamp().ok()?.as_nanosecond()
        } else {
            let since = of.to_datetime().ok()?.duration_since(DateTime::default());
            since.as_nanos()
        };
        Some((nanoseconds, digits))
    }
}

/// Reads the cells of a column of times one after the other.
#[derive(Clone, Debug)]
pub(super) struct Clock {
    /// `None` if times are numbers.
    pub(super) form: Option<Form>,
    /// -1 if the newest sample is the first.
    pub(super) sign: f64,
    /// The first and the last time, in nanoseconds, and the periods between.
    first: Option<i128>,
    last: Option<i128>,
    periods: i128,
}

impl Clock {
    pub(super) fn new(form: Option<Form>, sign: f64) -> Self {
        Self {
            form,
            sign,
            first: None,
            last: None,
            periods: 0,
        }
    }

    /// Returns the time of a cell since the first one; of a number itself, which is known already.
    pub(super) fn time(&mut self, cell: &str, number: f64, decimal: Decimal) -> Option<Time> {
        let Some(form) = &self.form else {
            return Some(Time::printed(cell, self.sign * number, decimal));
        };
        let (now, digits) = form.read(cell)?;
        let first = *self.first.get_or_insert(now);
        if let Some(period) = form.period {
            let period = (period * 1e9) as i128;
            let step = now - self.last.unwrap_or(now);
            self.periods += if step * 2 <= -period { period } else { 0 };
            self.periods -= if step * 2 > period { period } else { 0 };
        }
        self.last = Some(now);
        let since = (now - first + self.periods) as f64 / 1e9;
        Some(Time::rounded(self.sign * since / form.unit, digits))
    }

    /// The seconds in a unit of the times, and what is not plain about them in words. `first` is the first one.
    pub(super) fn unit(&self, columns: &Columns, first: f64, line: u64) -> Result<(f64, Option<String>), RecordError> {
        if let Some(form) = &self.form {
            return Ok((form.unit, Some(format!("times as {}", form.in_words()))));
        }
        let unknown = || RecordError::TimeUnit(line, columns.name(Role::T).to_owned());
        let unit = columns.unit.ok_or_else(unknown)?;
        let since = |scale: f64| (5e8..5e9).contains(&(first.abs() * scale));
        let epochs = [(1e-3, "milliseconds"), (1e-6, "microseconds"), (1e-9, "nanoseconds")];
        let epoch = epochs
            .into_iter()
            .find(|(scale, _)| !columns.names_unit && since(*scale));
        Ok(epoch.map_or((unit, None), |(scale, word)| {
            (scale, Some(format!("times in {word} since 1970")))
        }))
    }
}
