//! The rows of a table one after the other, and what their cells show before numbers are read.

use super::clock::{Clock, Form, Forms};
use super::columns::Role;
use super::error::{Place, RecordError};
use super::layout::{Layout, is_comment};
use super::number::{Column, Notation, Number, is_missing, is_number};
use super::rows::{Row, Rows, Separator};

/// Calls a function for each row after the header; returns how many comments stand among them.
pub(super) fn each_row(
    text: &str,
    layout: &Layout,
    mut of: impl FnMut(&[&str], u64) -> Result<(), RecordError>,
) -> Result<usize, RecordError> {
    let mut lines = Rows::new(&text[layout.body as usize..], layout.separator, layout.before);
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
        let is_rule = expected > 1 && matches!(row.cells[..], [cell] if cell.chars().all(|c| c == '#'));
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
        let Row { line, mut cells, .. } = row;
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
fn hides_samples(row: &Row<'_>, layout: &Layout) -> bool {
    let first = row.cells[0].trim_start_matches('#').trim();
    let is_blanks = layout.separator == Separator::Blanks;
    let alone = usize::from(is_blanks && first.is_empty());
    let is_sure = !is_blanks && layout.cells.len() > 1;
    let numbers = || is_number(first) || row.cells[1..].iter().any(|cell| is_number(cell));
    row.cells.len() - alone == layout.cells.len() && (is_sure || numbers())
}

/// All that the cells of a table show before their numbers are read.
pub(super) struct Seen {
    /// The marks in the columns, by their places: those that are used, and the others.
    pub(super) used: Vec<Column>,
    pub(super) others: Vec<Column>,
    /// The forms of the times, and of what is like times.
    pub(super) times: Forms,
    pub(super) like_times: Forms,
    /// The first two cells of the times, of what is like them, and of the numbers of samples.
    first: [Vec<String>; 3],
    pub(super) comments: usize,
}

impl Seen {
    pub(super) fn of(text: &str, layout: &Layout) -> Result<Self, RecordError> {
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
            return Err(RecordError::Time(Place { line, column, text }));
        }
        Ok(own)
    }

    /// Returns the refusal of times that may be read in several ways.
    pub(super) fn ambiguous(&self, layout: &Layout) -> RecordError {
        let forms = self.times.dates.iter().flatten();
        let forms: Vec<String> = forms.map(Form::in_words).collect();
        RecordError::AmbiguousTimes {
            column: layout.columns.name(Role::T).to_owned(),
            text: self.first[0].first().cloned().unwrap_or_default(),
            forms: forms.join(" or "),
        }
    }

    /// A clock for one of the columns, which runs backwards if that begins so.
    pub(super) fn clock(&self, which: usize, form: Option<Form>, notation: Notation) -> Clock {
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
