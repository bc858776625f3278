//! Collects the rows of a table to a record.

use super::clock::{Clock, Form};
use super::columns::Role;
use super::error::{Place, RecordError};
use super::layout::Layout;
use super::number::{Notation, Number, is_missing};
use super::options::{Decimal, Missing, ReadOptions};
use super::runs::{Break, Pieces, Row, Run, Segment};
use super::seen::{Seen, each_row};
use super::table::{Record, Table};
use super::times::shortest;
use super::unused_times::Followed;

/// A part of a table is the record only if it has at least one in so many of its rows.
const LEAST_SHARE: usize = 10;

/// Collects rows.
pub(super) struct Rows<'a> {
    layout: &'a Layout,
    notation: Notation,
    clock: Clock,
    /// The whole table, which has no gaps.
    run: Run,
    /// Its runs between gaps, if gaps are allowed.
    pieces: Option<Pieces>,
    /// A column that may hold times.
    like_times: Option<Followed>,
}

impl<'a> Rows<'a> {
    /// Of a table whose cells were seen before.
    pub(super) fn new(
        layout: &'a Layout,
        seen: &Seen,
        options: &ReadOptions,
        decimal: Option<Decimal>,
        form: Option<Form>,
    ) -> Self {
        let notation = Notation {
            decimal,
            has_thousands: false,
        };
        let has_times = layout.columns.has_role(Role::T);
        let clock = seen.clock(if has_times { 0 } else { 2 }, form, notation);
        let like = seen.like_times.dates.as_ref().and_then(|dates| dates.first().cloned());
        let like_times = layout.columns.like_times;
        Self {
            like_times: like_times.map(|place| Followed::new(place, seen.clock(1, like, notation))),
            layout,
            notation,
            clock,
            run: Run::new(false),
            pieces: match options.missing {
                Missing::Refuse => None,
                Missing::LongestRun => Some(Pieces::new(false)),
                Missing::Equations => Some(Pieces::new(true)),
            },
        }
    }

    /// Reads a number of a row; `None` if it is missing and that is allowed.
    fn number(&mut self, row: &[&str], line: u64, role: Role) -> Result<Option<f64>, RecordError> {
        let columns = &self.layout.columns;
        let Some(cell) = columns.cell(row, role) else {
            return Ok(None);
        };
        let column = columns.name(role);
        if role == Role::T && self.clock.form.is_some() && !is_missing(cell) {
            return Ok(Some(0.0));
        }
        match self.notation.number(cell, line, column)? {
            Number::Known(number) => Ok(Some(number)),
            Number::Missing if self.pieces.is_some() => Ok(None),
            Number::Missing => Err(RecordError::Missing(Place {
                line,
                column: column.to_owned(),
                text: cell.to_owned(),
            })),
        }
    }

    /// Follows the column that may hold times.
    fn follow(&mut self, row: &[&str], line: u64) {
        let Some(followed) = &mut self.like_times else {
            return;
        };
        let cell = row[followed.place];
        // Thousands are those of the columns that are used.
        let number = match self.notation.clone().number(cell, line, "") {
            Ok(Number::Known(value)) => Some(value),
            _ => followed.clock.form.as_ref().map(|_| 0.0),
        };
        let mark = self.notation.mark();
        let time = number.and_then(|number| followed.clock.time(cell, number, mark));
        match time {
            Some(time) => followed.add(time, line),
            None => self.like_times = None,
        }
    }

    fn add(&mut self, row: &[&str], line: u64) -> Result<(), RecordError> {
        if let Some(pieces) = &mut self.pieces {
            pieces.rows += 1;
        }
        self.follow(row, line);
        let has = |role| self.layout.columns.has_role(role);
        let (has_number, has_time, has_reference) = (has(Role::K), has(Role::T), has(Role::R));
        let k = self.number(row, line, Role::K)?;
        let time = self.number(row, line, Role::T)?;
        let r = self.number(row, line, Role::R)?;
        let u = self.number(row, line, Role::U)?;
        let y = self.number(row, line, Role::Y)?;
        let u = if has(Role::U) { u } else { y };
        let (Some(u), Some(y), true) = (
            u,
            y,
            k.is_some() == has_number && time.is_some() == has_time && r.is_some() == has_reference,
        ) else {
            self.pieces.as_mut().into_iter().for_each(Pieces::end);
            return Ok(());
        };
        let cell = self.layout.columns.cell(row, Role::T).unwrap_or_default();
        let mark = self.notation.mark();
        let time = time.and_then(|value| self.clock.time(cell, value, mark));
        let row = Row {
            line,
            k: k.map(|k| k * self.clock.sign),
            time,
            u,
            y,
            r,
        };
        match &mut self.pieces {
            Some(pieces) => pieces.add(row),
            None => self.run.add(row).map_err(|(reason, _)| self.refusal(reason, line))?,
        }
        Ok(())
    }

    fn refusal(&self, reason: Break, line: u64) -> RecordError {
        let (columns, sign) = (&self.layout.columns, self.clock.sign);
        match reason {
            Break::Number(found, expected) => RecordError::Gap {
                line,
                column: columns.name(Role::K).to_owned(),
                found: sign * found,
                expected: sign * expected,
            },
            Break::Time(unequal) => RecordError::Spacing {
                line: unequal.line,
                column: columns.name(Role::T).to_owned(),
                found: sign * unequal.found,
                first: sign * unequal.first,
                falls: sign < 0.0,
            },
        }
    }

    /// Reads all rows.
    pub(super) fn table(mut self, text: &str, marks: &[&'static str], seen: &Seen) -> Result<Table, RecordError> {
        let layout = self.layout;
        each_row(text, layout, |row, line| self.add(row, line))?;
        let falls = self.clock.sign < 0.0;
        let whole = |run| Ok((run, None, Vec::new()));
        let pieces = std::mem::take(&mut self.pieces);
        let run = std::mem::replace(&mut self.run, Run::new(false));
        let found = pieces.map_or_else(|| whole(run), Pieces::finish);
        let (mut run, kept, mut segments) = found.map_err(|unequal| self.refusal(Break::Time(unequal), 0))?;
        if run.y.is_empty() {
            return Err(RecordError::NoSamples);
        }
        let long = |of: &Segment| if of.samples > 1 { of.samples } else { 0 };
        let used = match segments.as_slice() {
            [] => run.y.len(),
            all => all.iter().map(long).sum(),
        };
        let rows = kept.map_or(run.y.len(), |kept| kept.rows);
        if used * LEAST_SHARE < rows {
            return Err(RecordError::ShortRun { samples: used, rows });
        }
        if falls {
            segments.reverse();
        }
        let like_times =
            self.like_times
                .take()
                .and_then(|of| of.finish(layout))
                .map_or(Ok(None), |(like, falls)| {
                    if falls {
                        Err(RecordError::Falling(like.column))
                    } else {
                        Ok(Some(like))
                    }
                })?;
        let (unit, words) = self.clock.unit(&layout.columns, run.times.ends()[0], layout.line)?;
        let times = run.times.seconds(unit).map(|step| {
            let [first, last] = run.times.ends();
            let first = if falls { -last } else { first };
            let first = if self.clock.form.is_some() { 0.0 } else { first };
            let first = first * unit;
            [shortest(first, f64::EPSILON * first.abs()), step]
        });
        let mut form = self.form(marks, seen);
        form.extend(words);
        let mut record = Record {
            u: run.u,
            y: run.y,
            r: run.r,
        };
        if falls {
            let Record { u, y, r } = &mut record;
            for column in [u, y, r] {
                column.reverse();
            }
            run.lines.reverse();
        }
        Ok(Table {
            record,
            lines: run.lines,
            times,
            form,
            kept,
            segments,
            like_times,
        })
    }

    /// Describes where the table is not plain.
    fn form(&self, marks: &[&'static str], seen: &Seen) -> Vec<String> {
        let layout = self.layout;
        let mut form: Vec<String> = layout.separator_in_words().into_iter().map(str::to_owned).collect();
        form.extend(self.notation.in_words().chain(marks.iter().copied()).map(str::to_owned));
        form.extend(layout.in_words());
        form.extend(match seen.comments {
            0 => None,
            1 => Some("1 comment line among the rows".to_owned()),
            count => Some(format!("{count} comment lines among the rows")),
        });
        form.extend((self.clock.sign < 0.0).then(|| "newest first: rows turned round".to_owned()));
        form.extend(layout.columns.in_words(layout.is_header));
        form
    }
}
