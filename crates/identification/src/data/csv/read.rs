//! Reads records and columns of tables.

use super::clock::{Clock, Form, Forms};
use super::columns::{Columns, Role};
use super::error::RecordError;
use super::layout::{Layout, is_comment};
use super::number::{Column, Notation, Number, is_missing, is_number, settled};
use super::options::{Decimal, Missing, ReadOptions};
use super::rows::{Row as Line, Rows as Lines, Separator};
use super::runs::{Break, Kept, Pieces, Row, Run, Segment};
use super::text::Text;
use super::times::{Time, Times};
use std::io::Read;

/// A part of a table is the record only if it has at least one in so many of its rows.
const LEAST_SHARE: usize = 10;

/// A record of input and output samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// u(k), k = 0 ... K-1.
    pub u: Vec<f64>,
    /// y(k).
    pub y: Vec<f64>,
    /// r(k), the reference of a closed loop; empty in a table without one.
    pub r: Vec<f64>,
}

/// A record as it stood in a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The samples.
    pub record: Record,
    /// The time of the first sample (of dates 0) and the time between samples, seconds; `None` without a column of
    /// times, or with a single sample.
    pub times: Option<[f64; 2]>,
    /// The form of the table and the names of its columns where they are not the plain ones: cells separated by commas,
    /// decimal points, columns named u, y and t.
    pub form: Vec<String>,
    /// The part that was kept of a table with missing samples.
    pub kept: Option<Kept>,
    /// The runs between gaps, which follow each other in the record; empty if there is one.
    pub segments: Vec<Segment>,
    /// A column that was not used, but has a name like times and steps as times have.
    pub like_times: Option<LikeTimes>,
}

/// A column that is not used, but has a name and steps as times have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LikeTimes {
    /// Its name.
    pub column: String,
    /// How many of its steps are longer than the others, and the line after the first of them: samples are missing there.
    pub gaps: Option<(usize, u64)>,
}

/// Reads a record from a table with columns named u and y: [`read_table`] with the default options.
///
/// # Errors
/// [`RecordError`], with line and column.
pub fn read(from: impl Read) -> Result<Record, RecordError> {
    read_table(from, &ReadOptions::default()).map(|table| table.record)
}

/// Reads one column of a table; of the others only the numbers of samples and their times are used, which must be those
/// of consecutive samples.
///
/// # Errors
/// [`RecordError`], with line and column.
pub fn read_column(from: impl Read, name: &str) -> Result<Vec<f64>, RecordError> {
    read_table(from, &ReadOptions::column(name)).map(|table| table.record.y)
}

/// Returns which columns of a header are read; none if those that must be there are not.
pub fn uses(header: &[&str], options: &ReadOptions) -> Vec<bool> {
    let columns = Columns::find(Some(header), header.len(), 1, options);
    let used = |place| columns.as_ref().is_ok_and(|columns| columns.has(place));
    (0..header.len()).map(used).collect()
}

/// Reads a record from a table. Cells are separated by commas, semicolons, tabs or blanks, and decimals by points or
/// commas, as all its lines show. The memory used is that of the text and the two columns. A column of times shows that
/// the samples are equally spaced, up to the rounding of the printed times and a hundredth of the step.
///
/// # Errors
/// [`RecordError`], with line and column.
pub fn read_table(from: impl Read, options: &ReadOptions) -> Result<Table, RecordError> {
    let Text { text, marks } = Text::read(from)?;
    let layout = Layout::of(&text, options)?;
    let seen = Seen::of(&text, &layout)?;
    let decimal = match options.decimal {
        Some(decimal) => Some(decimal),
        None => settled(&seen.used, &seen.others, layout.separator)?,
    };
    let of_dates = seen
        .times
        .dates
        .clone()
        .map_or(vec![None], |dates| dates.into_iter().map(Some).collect());
    let attempt = |form: Option<Form>| {
        Rows::new(&layout, &seen, options, decimal, form).table(&text, &marks, &seen)
    };
    let mut tables = of_dates.into_iter().map(attempt);
    let mut best = tables.next().unwrap_or(Err(RecordError::Empty));
    // Of several ways to read dates one may show equal steps.
    for table in tables {
        let gaps = |table: &Result<Table, _>| {
            table.as_ref().map_or(2, |table| {
                i32::from(table.kept.is_some() || !table.segments.is_empty())
            })
        };
        let same =
            |one: &Table, other: &Table| (&one.record, one.times) == (&other.record, other.times);
        match (&best, &table) {
            (Ok(one), Ok(other)) if gaps(&best) == gaps(&table) && !same(one, other) => {
                return Err(seen.ambiguous(&layout));
            }
            _ if gaps(&table) < gaps(&best) => best = table,
            _ => {}
        }
    }
    best
}

/// Calls a function for each row after the header; returns how many comments stand among them.
fn each_row(
    text: &str,
    layout: &Layout,
    mut of: impl FnMut(&[&str], u64) -> Result<(), RecordError>,
) -> Result<usize, RecordError> {
    let mut lines = Lines::new(
        &text[layout.body as usize..],
        layout.separator,
        layout.before,
    );
    let (expected, mut comments) = (layout.cells.len(), 0);
    let mut next = layout.before + 1;
    // Lines above the first row of a table without a header are no rows.
    let mut may_be_row = layout.is_header;
    while let Some(row) = lines.next()? {
        // An empty line of a single column is an empty cell.
        for line in (next..row.line).filter(|_| expected == 1) {
            of(&[""], line)?;
        }
        next = row.line + row.more + 1;
        let is_rule =
            expected > 1 && matches!(row.cells[..], [cell] if cell.chars().all(|c| c == '#'));
        if is_comment(&row)? || is_rule {
            if may_be_row && hides_samples(&row, layout) {
                return Err(RecordError::HashRow(row.line));
            }
            comments += 1;
            continue;
        }
        if row.runs_on {
            return Err(RecordError::OpenQuote(row.line));
        }
        let Line {
            line, mut cells, ..
        } = row;
        // A row may end with separators that the header has not.
        if cells.iter().skip(expected).all(|cell| cell.is_empty()) {
            cells.truncate(expected);
        }
        if cells.len() != expected {
            return Err(RecordError::RowLength {
                line,
                found: cells.len(),
                expected,
                has_header: layout.is_header,
            });
        }
        may_be_row = true;
        of(&cells, line)?;
    }
    Ok(comments)
}

/// Whether a line that begins with `#` may be a row.
fn hides_samples(row: &Line<'_>, layout: &Layout) -> bool {
    let first = row.cells[0].trim_start_matches('#').trim();
    let is_blanks = layout.separator == Separator::Blanks;
    let alone = usize::from(is_blanks && first.is_empty());
    let is_sure = !is_blanks && layout.cells.len() > 1;
    let numbers = || is_number(first) || row.cells[1..].iter().any(|cell| is_number(cell));
    row.cells.len() - alone == layout.cells.len() && (is_sure || numbers())
}

/// What the cells of a table show before their numbers are read.
struct Seen {
    /// The marks in the columns, by their places: those that are used, and the others.
    used: Vec<Column>,
    others: Vec<Column>,
    /// The forms of the times, and of what is like times.
    times: Forms,
    like_times: Forms,
    /// The first two cells of the times, of what is like them, and of the numbers of samples.
    first: [Vec<String>; 3],
    comments: usize,
}

impl Seen {
    fn of(text: &str, layout: &Layout) -> Result<Self, RecordError> {
        let columns = &layout.columns;
        let marks = || vec![Column::default(); layout.cells.len()];
        let mut own = Self {
            used: marks(),
            others: marks(),
            times: Forms::default(),
            like_times: Forms::default(),
            first: Default::default(),
            comments: 0,
        };
        own.comments = each_row(text, layout, |row, line| {
            for (place, cell) in row.iter().enumerate() {
                let name = || {
                    if layout.is_header {
                        layout.cells[place].clone()
                    } else {
                        (place + 1).to_string()
                    }
                };
                if columns.has(place) {
                    own.used[place].see(cell, line, name);
                } else {
                    own.others[place].see(cell, line, name);
                }
            }
            let like = columns.like_times.map(|place| row[place]);
            let time = columns.cell(row, Role::T);
            if let Some(cell) = time {
                own.times.see(cell, line);
            }
            if let Some(cell) = like {
                own.like_times.see(cell, line);
            }
            let cells = [time, like, columns.cell(row, Role::K)];
            for (first, cell) in own.first.iter_mut().zip(cells) {
                if first.len() < 2 {
                    first.extend(cell.filter(|cell| !is_missing(cell)).map(str::to_owned));
                }
            }
            Ok(())
        })?;
        if let Some((line, text)) = own.times.wrong.take() {
            let column = columns.name(Role::T).to_owned();
            return Err(RecordError::Time { line, column, text });
        }
        Ok(own)
    }

    fn ambiguous(&self, layout: &Layout) -> RecordError {
        let forms = self.times.dates.iter().flatten();
        let forms: Vec<String> = forms.map(Form::in_words).collect();
        RecordError::AmbiguousTimes {
            column: layout.columns.name(Role::T).to_owned(),
            text: self.first[0].first().cloned().unwrap_or_default(),
            forms: forms.join(" or "),
        }
    }

    /// A clock for one of the columns, which runs backwards if that begins so.
    fn clock(&self, which: usize, form: Option<Form>, notation: Notation) -> Clock {
        let mut clock = Clock::new(form.clone(), 1.0);
        let mut notation = notation;
        let mut times = self.first[which].iter().filter_map(|cell| {
            let number = match notation.number(cell, 0, "") {
                Ok(Number::Known(number)) => number,
                _ => f64::NAN,
            };
            clock.time(cell, number, notation.mark())
        });
        let falls = matches!((times.next(), times.next()), (Some(first), Some(second)) if second.value < first.value);
        Clock::new(form, if falls { -1.0 } else { 1.0 })
    }
}

/// A column that is not used, but may hold times.
struct Followed {
    place: usize,
    clock: Clock,
    times: Times,
    are_equal: bool,
    /// The times with their lines.
    all: Vec<(f64, u64)>,
}

impl Followed {
    fn new(place: usize, clock: Clock) -> Self {
        Self {
            place,
            clock,
            times: Times::new(),
            are_equal: true,
            all: Vec::new(),
        }
    }

    fn add(&mut self, time: Time, line: u64) {
        self.are_equal = self.are_equal && self.times.add(time, line).is_ok();
        self.all.push((time.value, line));
    }

    /// Returns what is like times, and whether they fall: at equal steps, or with a few gaps.
    fn finish(self, layout: &Layout) -> Option<(LikeTimes, bool)> {
        let gaps = if self.are_equal {
            self.times.step().filter(|step| *step > 0.0)?;
            None
        } else {
            Some(gaps(&self.all)?)
        };
        let column = layout.cells[self.place].clone();
        Some((LikeTimes { column, gaps }, self.clock.sign < 0.0))
    }
}

/// Counts the steps that are longer than the others, and returns the line after the first of them; `None` if not nearly
/// all steps are equal, or none is longer.
fn gaps(times: &[(f64, u64)]) -> Option<(usize, u64)> {
    const LONGER: f64 = 1.5;
    const FEW: usize = 10;
    let steps = || {
        times
            .windows(2)
            .map(|pair| (pair[1].0 - pair[0].0, pair[1].1))
    };
    let mut sorted: Vec<f64> = steps().map(|(step, _)| step).collect();
    sorted.sort_by(f64::total_cmp);
    let middle = *sorted.get(sorted.len() / 2)?;
    let shortest = *sorted.first()?;
    let mut longer = steps().filter(|(step, _)| *step >= LONGER * middle);
    let (_, line) = longer.next()?;
    let count = 1 + longer.count();
    // A step shorter than half the others is no gap.
    (shortest > (2.0 - LONGER) * middle && count * FEW <= sorted.len()).then_some((count, line))
}

/// Collects rows.
struct Rows<'a> {
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
    fn new(
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
        let like = seen
            .like_times
            .dates
            .as_ref()
            .and_then(|dates| dates.first().cloned());
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
            Number::Missing => Err(RecordError::Missing {
                line,
                column: column.to_owned(),
                text: cell.to_owned(),
            }),
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
            None => self
                .run
                .add(row)
                .map_err(|(reason, _)| self.refusal(reason, line))?,
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
    fn table(
        mut self,
        text: &str,
        marks: &[&'static str],
        seen: &Seen,
    ) -> Result<Table, RecordError> {
        let layout = self.layout;
        each_row(text, layout, |row, line| self.add(row, line))?;
        let falls = self.clock.sign < 0.0;
        let whole = |run| Ok((run, None, Vec::new()));
        let pieces = std::mem::take(&mut self.pieces);
        let run = std::mem::replace(&mut self.run, Run::new(false));
        let found = pieces.map_or_else(|| whole(run), Pieces::finish);
        let (run, kept, mut segments) =
            found.map_err(|unequal| self.refusal(Break::Time(unequal), 0))?;
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
            return Err(RecordError::ShortRun {
                samples: used,
                rows,
            });
        }
        if falls {
            segments.reverse();
        }
        let like_times = self.like_times.and_then(|of| of.finish(layout)).map_or(
            Ok(None),
            |(like, falls)| {
                if falls {
                    Err(RecordError::Falling(like.column))
                } else {
                    Ok(Some(like))
                }
            },
        )?;
        let (unit, words) = self
            .clock
            .unit(&layout.columns, run.times.ends()[0], layout.line)?;
        let times = run.times.step().map(|step| {
            let [first, last] = run.times.ends();
            [if falls { -last } else { first }, step].map(|time| time * unit)
        });
        let times = times.map(|[first, step]| {
            [
                if self.clock.form.is_some() {
                    0.0
                } else {
                    first
                },
                step,
            ]
        });
        let mut form: Vec<String> = layout
            .separator_in_words()
            .into_iter()
            .map(str::to_owned)
            .collect();
        form.extend(
            self.notation
                .in_words()
                .chain(marks.iter().copied())
                .map(str::to_owned),
        );
        form.extend(layout.in_words());
        form.extend(match seen.comments {
            0 => None,
            1 => Some("1 comment line among the rows".to_owned()),
            count => Some(format!("{count} comment lines among the rows")),
        });
        form.extend(falls.then(|| "newest first: rows turned round".to_owned()));
        form.extend(layout.columns.in_words(layout.is_header));
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
        }
        Ok(Table {
            record,
            times,
            form,
            kept,
            segments,
            like_times,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::error::LONGEST_LINE;
    use super::*;

    fn error(text: &str) -> String {
        read(text.as_bytes()).unwrap_err().to_string()
    }

    /// An error value of a spreadsheet is a missing sample wherever it stands; other rows that begin with # are comments.
    #[test]
    fn error_values_are_no_comments() {
        for value in ["#N/A", "#NV", "#DIV/0!", "#WERT!", "#VALEUR!", "#NAME?"] {
            for s in [",", ";", "\t", " "] {
                let missing =
                    |column: &str| format!("line 3, column {column}: a sample is missing");
                let found = error(&format!("u{s}y\n1{s}2\n{value}{s}3\n4{s}5\n"));
                assert!(found.contains(&missing("u")), "{value}{s}: {found}");
                let found = error(&format!("u{s}y\n1{s}2\n3{s}{value}\n4{s}5\n"));
                assert!(found.contains(&missing("y")), "{value}{s}: {found}");
            }
        }
        assert!(error("u,y\n1,2\n####,3\n").contains("a sample is missing"));
        for comment in [
            "# a, b, c",
            "## by hand",
            "#a",
            "#m/s,V,s",
            "#####",
            "#! run",
            "#NV is the noise",
            "#",
        ] {
            let text = format!("u,y\n1,2\n{comment}\n3,4\n");
            assert_eq!(read(text.as_bytes()).unwrap().y, [2.0, 4.0], "{comment}");
        }
        // One that has as many cells as the rows may be a row.
        for row in ["# a, b", "#1,2", "#m/s,V"] {
            let found = error(&format!("u,y\n1,2\n{row}\n3,4\n"));
            assert!(found.starts_with("line 3"), "{row}: {found}");
        }
    }

    /// A row without a number below the names has the units; a missing sample is none.
    #[test]
    fn units_may_stand_below_the_names() {
        let table = |text: &str| read_table(text.as_bytes(), &ReadOptions::default()).unwrap();
        let found = table("time,u,y\n(ms),(V),(rpm)\n0,1,2\n100,3,4\n");
        assert_eq!(found.record.u, [1.0, 3.0]);
        assert_eq!(found.times, Some([0.0, 0.1]));
        assert!(found.form.contains(&"a row of units".to_owned()));
        assert_eq!(table("u;y\nV;\n1;2\n").record.y, [2.0]);
        assert!(error("u,y\nNaN,NaN\n1,2\n").contains("a sample is missing"));
        assert!(error("u,y\n1,x\n1,2\n").contains("'x' is not a finite number"));
        assert_eq!(
            table("t,u,y\ns,-,1/min\n0,1,2\n1,3,4\n").record.u,
            [1.0, 3.0]
        );
        for row in ["inf,1e400", "n.v.,n.v.", "-inf,-1e999"] {
            let cell = row.split(',').next().unwrap();
            let message = format!("line 2, column u: '{cell}' is not a finite number");
            assert_eq!(error(&format!("u,y\n{row}\n1,2\n")), message);
        }
        assert!(error("u;y\n1,5E400;2\n1;2\n").contains("'1,5E400' is not a finite number"));
    }

    #[test]
    fn a_record_survives_writing_and_reading() {
        let record = Record {
            u: vec![1.0, -0.1, 1e-300],
            y: vec![std::f64::consts::PI, -1.0 / 3.0, 12345.678],
            r: Vec::new(),
        };
        let mut text = Vec::new();
        crate::data::csv::write(&mut text, &["truth".to_owned()], &record.u, &record.y).unwrap();
        assert_eq!(read(text.as_slice()).unwrap(), record);
    }

    #[test]
    fn columns_may_stand_in_any_order_and_k_may_start_anywhere() {
        let record = read("# a\ny, u ,k\n1,2,7\n# b\n\n3,4,8\r\n".as_bytes()).unwrap();
        assert_eq!((record.u, record.y), (vec![2.0, 4.0], vec![1.0, 3.0]));
        let record = read("time,u,y\n0.03,1,2\n0.07,3,4\n0.1,5,6\n".as_bytes()).unwrap();
        assert_eq!(record.u, [1.0, 3.0, 5.0]);
        let record = read("\u{feff}u,y\n1,2\n".as_bytes()).unwrap();
        assert_eq!(record.y, [2.0]);
    }

    #[test]
    fn one_column_of_any_table() {
        let table = "# a\nt, in ,out\n0,1,x\n\n1,-2.5,y\n";
        let column = |name: &str| read_column(table.as_bytes(), name);
        assert_eq!(column("in").unwrap(), [1.0, -2.5]);
        for (text, message) in [
            (
                "1,2\n",
                "line 1: no header, so no column 'u'; expected its number, 1 to 2",
            ),
            ("y,u\n", "no samples after the header"),
            ("y,u\n1\n", "line 2: 1 cell, but the header has 2"),
            (
                "y,u\n1,nan\n",
                "line 2, column u: a sample is missing ('nan')",
            ),
        ] {
            assert_eq!(
                read_column(text.as_bytes(), "u").unwrap_err().to_string(),
                message
            );
        }
    }

    #[test]
    fn refusals_name_line_and_column() {
        assert!(error("").starts_with("the file is empty"));
        assert!(error("# only\n").starts_with("the file is empty"));
        assert!(error("1,2\n3,4\n").starts_with("line 1: no header"));
        assert!(error("# c\nu,z\n1,2\n").starts_with("line 2: unknown column 'z'"));
        assert!(error("u,u,y\n").starts_with("line 1: column 'u' appears twice"));
        assert!(error("k,y\n").starts_with("line 1: no column 'u'"));
        assert!(error("u,y\n").starts_with("no samples"));
        for last in ["0.4", "0.2", "0.1"] {
            let message = error(&format!("t,u,y\n0,1,2\n0.1,1,2\n0.2,1,3\n{last},1,2\n"));
            assert!(
                message.starts_with("line 5, column t: a step of "),
                "{message}"
            );
        }
        assert!(error("t,time,u,y\n").starts_with("line 1: column 't' appears twice"));
        let long = "\0".repeat(LONGEST_LINE as usize + 1);
        assert!(error(&long).starts_with("line 1: longer than"));
        assert!(error(&format!("u,y\n{long}")).starts_with("line 2: expected text"));
        assert!(error("u,y\n1,2\n3\n").starts_with("line 3: 1 cell, but the header has 2"));
        for cell in ["abc", "inf", "-infinity", "1e999", "1.234.5"] {
            let message = error(&format!("# c\nu,y\n1,2\n3,{cell}\n"));
            assert_eq!(
                message,
                format!("line 4, column y: '{cell}' is not a finite number")
            );
        }
        assert!(
            error("k,u,y\n0,1,1\n2,1,1\n").starts_with("line 3, column k: found 2, expected 1")
        );
    }
    /// Reads with options; u, y and what was recognised.
    fn table(text: &[u8], options: &ReadOptions) -> (Vec<f64>, Vec<f64>, String) {
        let table = read_table(text, options).unwrap();
        (table.record.u, table.record.y, table.form.join(", "))
    }

    fn chosen(input: &str, output: &str) -> ReadOptions {
        ReadOptions {
            input: Some(input.to_owned()),
            output: Some(output.to_owned()),
            ..ReadOptions::default()
        }
    }

    /// The same two rows as programs of several countries write them.
    #[test]
    fn separators_and_decimals_are_recognised() {
        let plain = ReadOptions::default();
        for (text, form) in [
            ("u,y\n1.5,2\n-3,0.25\n", ""),
            (
                "u;y\n1,5;2\n-3;0,25\n",
                "separated by semicolons, decimal commas",
            ),
            ("u;y;\r\n1.5;2;\r\n-3;0.25;\r\n", "separated by semicolons"),
            (
                "sep=;\nu;y\n1,5;2\n-3;0,25\n",
                "separated by semicolons, decimal commas",
            ),
            (
                "u\ty\n1,5\t2\n-3\t0,25\n",
                "separated by tabs, decimal commas",
            ),
            ("  u   y\n 1.5 2\n-3 2.5e-1\n", "separated by blanks"),
            (
                "\"u\",\"y\"\n\"1,5\",\"2\"\n\"-3\",\"0,25\"\n",
                "decimal commas",
            ),
            ("\u{feff}u,y\n1.5,2\n-3,0.25\n", "a byte order mark"),
            (
                "in,Output\n1.5,2\n-3,0.25\n",
                "u is column 'in', y is column 'Output'",
            ),
            (
                "U [V];Y (K)\n1.5;2\n-3;0.25\n",
                "separated by semicolons, u is column 'U [V]', y is column 'Y (K)'",
            ),
        ] {
            let read = table(text.as_bytes(), &plain);
            assert_eq!(
                read,
                (vec![1.5, -3.0], vec![2.0, 0.25], form.to_owned()),
                "{text}"
            );
        }
        let latin = b"u;Druck;y \xb0C\n1;7;2\n";
        assert_eq!(
            table(latin, &chosen("u", "3")).2,
            "separated by semicolons, Latin-1, y is column 'y \u{b0}C', not used: 'Druck'"
        );
        let mixed = "u;y\n1,5;2\n3.5;2\n";
        assert_eq!(
            error(mixed),
            "line 3, column u: '3.5', but earlier numbers have decimal commas"
        );
        let ambiguous = error("u,y\n1,5,2,5\n");
        assert!(
            ambiguous
                .starts_with("line 2: 4 cells, but the header has 2; numbers with decimal commas")
        );
        assert!(error("u;y\n1.34,5;2\n").starts_with("line 2, column u: '1.34,5' is not"));
    }

    #[test]
    fn columns_are_chosen_by_name_or_number() {
        let text = "time [ms],valve,flow,temp\n0,1,2,3\n10,4,5,6\n20,7,8,9\n";
        let read = read_table(text.as_bytes(), &chosen("valve", "4")).unwrap();
        assert_eq!(
            (read.record.u, read.record.y),
            (vec![1.0, 4.0, 7.0], vec![3.0, 6.0, 9.0])
        );
        assert_eq!(read.times, Some([0.0, 0.01]));
        // Without a header, by number alone.
        let bare = chosen("2", "1");
        assert_eq!(
            table(b"1 2\n3 4\n", &bare),
            (
                vec![2.0, 4.0],
                vec![1.0, 3.0],
                "separated by blanks, no header, u is column 2, y is column 1".to_owned()
            )
        );
        for (text, options, message) in [
            (
                "a,b\n1,2\n",
                chosen("a", "c"),
                "line 1: no column 'c' among 'a', 'b'; expected one of these, or its number from 1",
            ),
            (
                "a,b\n1,2\n",
                chosen("a", "1"),
                "line 1: column 'a' is chosen as input and as output",
            ),
            (
                "a,a\n1,2\n",
                chosen("a", "2"),
                "line 1: several columns are named 'a'; expected a column's number, from 1",
            ),
            (
                "1,2\n",
                chosen("u", "2"),
                "line 1: no header, so no column 'u'; expected its number, 1 to 2",
            ),
            (
                "u,y,t (d)\n1,2,3\n",
                chosen("u", "y"),
                "line 1: the unit of column 't (d)' is unknown; expected s, ms, us, min or h",
            ),
        ] {
            assert_eq!(
                read_table(text.as_bytes(), &options)
                    .unwrap_err()
                    .to_string(),
                message
            );
        }
        // A column that is no time, although its name says so.
        let none = ReadOptions {
            time: Some("none".to_owned()),
            ..chosen("u", "y")
        };
        assert_eq!(
            table(b"t,u,y\n0,1,2\n7,3,4\n9,5,6\n", &none).0,
            [1.0, 3.0, 5.0]
        );
    }

    #[test]
    fn the_longest_run_without_a_gap() {
        let longest = ReadOptions {
            missing: Missing::LongestRun,
            ..ReadOptions::default()
        };
        let kept = |text: &str| {
            let table = read_table(text.as_bytes(), &longest).unwrap();
            let lines = table.kept.map(|kept| (kept.lines, kept.rows, kept.parts));
            (table.record.u, lines, table.times)
        };
        let run = |u: [f64; 3], lines, rows, parts| (u.to_vec(), Some((lines, rows, parts)), None);
        let text = "u,y\n1,1\n2,\n3,1\nNaN,1\n5,1\n6,1\n7,1\n8,NA\n";
        assert_eq!(error(text), "line 3, column y: a sample is missing ('')");
        assert_eq!(kept(text), run([5.0, 6.0, 7.0], [6, 8], 8, 3));
        let text = "k,u,y\n0,1,1\n1,2,1\n4,5,1\n5,6,1\n6,7,1\n";
        assert_eq!(kept(text), run([5.0, 6.0, 7.0], [4, 6], 5, 2));
        // The step that differs is the first one of the part before.
        let text = "t,u,y\n0,1,1\n0.1,2,1\n0.3,5,1\n0.4,6,1\n0.5,7,1\n";
        let (u, lines, times) = kept(text);
        assert_eq!((u, lines), (vec![5.0, 6.0, 7.0], Some(([4, 6], 5, 2))));
        let [start, step] = times.unwrap();
        assert!(start == 0.3 && (step - 0.1).abs() < 1e-15);
        assert_eq!(kept("u,y\n1,1\n2,1\n").1, None);
    }
}
