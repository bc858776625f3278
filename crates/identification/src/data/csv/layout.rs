//! Where a table begins in its file: the separator, the lines before the header, the names, the units below them.

use super::columns::Columns;
use super::error::{Place, RecordError};
use super::number::{is_error_value, is_missing, is_number};
use super::options::ReadOptions;
use super::rows::{Row, Rows, Separator};
use std::collections::BTreeMap;

/// Lines at the beginning in which the header is looked for.
const HEAD: usize = 1000;

/// How a table is laid out.
pub(super) struct Layout {
    pub(super) separator: Separator,
    /// The header's names, with units; empty cells of a table without one.
    pub(super) cells: Vec<String>,
    pub(super) is_header: bool,
    pub(super) columns: Columns,
    /// Where the rows begin, in bytes, and the lines before.
    pub(super) body: u64,
    pub(super) before: u64,
    /// Whether there is a row of units.
    has_units: bool,
    /// The first and the last of the lines before the header that are no comments.
    left_out: Option<[u64; 2]>,
    /// The line of the header, or of the first row.
    pub(super) line: u64,
}

/// A row of the head.
struct Line {
    /// Its number, and that of the last line.
    number: u64,
    last: u64,
    /// Where the next one begins.
    next: u64,
    cells: Vec<String>,
    runs_on: bool,
}

/// Whether a row is a comment: it begins with `#`, and with no error value.
pub(super) fn is_comment(row: &Row<'_>) -> Result<bool, RecordError> {
    let first = row.cells.first();
    match first.is_some_and(|cell| cell.starts_with('#') && !is_error_value(cell)) {
        true if row.more > 0 => Err(RecordError::OpenQuote(row.line)),
        is => Ok(is),
    }
}

impl Line {
    fn cells(&self) -> Vec<&str> {
        self.cells.iter().map(String::as_str).collect()
    }

    /// Whether all cells, but those that are missing, are numbers or times, and at least one.
    fn is_data(&self) -> bool {
        let filled = || self.cells.iter().filter(|cell| !is_missing(cell));
        filled().all(|cell| is_value(cell)) && filled().next().is_some()
    }
}

/// Whether a cell is a number, or looks like a date or a time.
fn is_value(cell: &str) -> bool {
    let of_time = |c: char| c.is_ascii_digit() || ":./-+, TZAPM".contains(c);
    let digits = cell.trim_start_matches(['+', '-', '\u{2212}']);
    let is_time = |cell: &str| {
        let date: Vec<&str> = cell.split(['.', '/', '-']).collect();
        let is_date = date.len() == 3 && date.iter().all(|part| part.parse::<u16>().is_ok());
        is_date || cell.contains(':') && cell.chars().all(of_time) && cell.matches(',').count() < 2
    };
    is_number(cell)
        || ["inf", "infinity"].iter().any(|word| digits.eq_ignore_ascii_case(word))
        || digits.starts_with(|c: char| c.is_ascii_digit()) && is_time(cell)
}

impl Layout {
    /// Finds it in the first lines of a text.
    pub(super) fn of(text: &str, options: &ReadOptions) -> Result<Self, RecordError> {
        let (first, rest) = text.split_once('\n').unwrap_or((text, ""));
        let declared = Separator::declared(first);
        let (text, before) = if declared.is_some() { (rest, 1) } else { (text, 0) };
        let skipped = if declared.is_some() { first.len() as u64 + 1 } else { 0 };
        let separators = declared.map_or(Separator::ALL.to_vec(), |own| vec![own]);
        let mut heads = Vec::new();
        for separator in separators {
            let head = head(text, separator, before)?;
            if head.is_empty() {
                return Err(RecordError::Empty);
            }
            if !Columns::by_number(options)
                && let Some(found) = named(&head, options)
            {
                return found.layout(&head, separator, skipped, options);
            }
            heads.push((separator, head));
        }
        // Without names the table is what has most numbers in rows of one width, below any header.
        let worth = |head: &[Line]| {
            let width = width(head);
            let lower = &head[head.len() / 2..];
            let rows = || lower.iter().map(names).filter(|row| row.len() == width);
            let cells = || rows().flatten();
            let values = cells().filter(|cell| is_value(cell) || is_missing(cell)).count();
            (width > 1, values * 1000 / cells().count().max(1))
        };
        let mut best = 0;
        for place in 1..heads.len() {
            if worth(&heads[place].1) > worth(&heads[best].1) {
                best = place;
            }
        }
        let (separator, head) = heads.swap_remove(best);
        unnamed(&head, options)?.layout(&head, separator, skipped, options)
    }
}

impl Layout {
    /// The separator, unless it is the plain one or there is one column.
    pub(super) fn separator_in_words(&self) -> Option<&'static str> {
        self.separator.in_words().filter(|_| self.cells.len() > 1)
    }

    /// Describes what is not plain about the header.
    pub(super) fn in_words(&self) -> Vec<String> {
        let marks = [(!self.is_header, "no header"), (self.has_units, "a row of units")];
        let marks = marks
            .into_iter()
            .filter(|(is, _)| *is)
            .map(|(_, words)| words.to_owned());
        let left_out = self.left_out.map(|[first, last]| {
            if first == last {
                format!("line {first} above the table left out")
            } else {
                format!("lines {first} to {last} above the table left out")
            }
        });
        marks.chain(left_out).collect()
    }
}

/// The rows at the beginning that are no comments.
fn head(text: &str, separator: Separator, before: u64) -> Result<Vec<Line>, RecordError> {
    let mut rows = Rows::new(text, separator, before);
    let mut head = Vec::new();
    while head.len() < HEAD
        && let Some(row) = rows.next()?
    {
        if is_comment(&row)? {
            continue;
        }
        // A name may go on over a line end.
        let cells = row.cells.iter().map(|cell| cell.replace('\n', " ")).collect();
        let (line, runs_on) = (row.line, row.runs_on);
        head.push(Line {
            number: line,
            last: rows.lines(),
            next: rows.at(),
            cells,
            runs_on,
        });
    }
    Ok(head)
}

/// The commonest number of cells, the largest of several.
fn width(head: &[Line]) -> usize {
    let mut counts = BTreeMap::new();
    for line in head {
        *counts.entry(names(line).len()).or_insert(0) += 1;
    }
    let widest = counts.into_iter().max_by_key(|(width, count)| (*count, *width));
    widest.map_or(0, |(width, _)| width)
}

/// The numbers of the columns that have numbers or times in most of the lower rows of this width; others hold text.
fn numeric_columns(head: &[Line], width: usize) -> Vec<usize> {
    let lower = &head[head.len() / 2..];
    let rows = || lower.iter().filter(|line| line.cells.len() >= width);
    let is_numeric = |place: &usize| {
        let cells = || rows().map(|line| line.cells[*place].as_str());
        let values = cells().filter(|cell| is_value(cell)).count();
        let others = cells().filter(|cell| !is_value(cell) && !is_missing(cell)).count();
        values > others
    };
    let places = (0..width).filter(is_numeric);
    places.map(|place| place + 1).collect()
}

/// The place of the header in the head, or of the first row of a table without one.
struct Start {
    place: usize,
    is_header: bool,
}

/// The header is the first line that has the names.
fn named(head: &[Line], options: &ReadOptions) -> Option<Start> {
    let place = head.iter().position(|line| {
        !line.is_data() && Columns::find(Some(&names(line)), line.cells.len(), line.number, options).is_ok()
    })?;
    Some(Start { place, is_header: true })
}

/// The header is the line above the numbers, above their units.
fn unnamed(head: &[Line], options: &ReadOptions) -> Result<Start, RecordError> {
    let width = width(head);
    let by_number = Columns::by_number(options);
    let chosen = [&options.input, &options.output].into_iter().flatten();
    let chosen: Vec<usize> = chosen.filter_map(|column| column.parse().ok()).collect();
    let at = |line: &Line, number: usize| line.cells.get(number.wrapping_sub(1)).cloned().unwrap_or_default();
    let values = |line: &Line| chosen.iter().filter(|number| is_value(&at(line, **number))).count();
    let holds = |line: &Line, number: usize| is_value(&at(line, number)) || is_missing(&at(line, number));
    let numeric = numeric_columns(head, width);
    let columns = if by_number { &chosen } else { &numeric };
    let is_data = |line: &&Line| {
        let says = |number: &usize| !at(line, *number).is_empty();
        line.cells.len() >= width
            && columns.iter().all(|number| holds(line, *number))
            && (columns.iter().any(says) || line.is_data())
    };
    let Some(first) = head.iter().position(|line| is_data(&line)) else {
        return Ok(Start {
            place: 0,
            is_header: true,
        });
    };
    let wide = |place: &usize| names(&head[*place]).len() >= width;
    let above = first.checked_sub(1).filter(wide);
    if let Some(line) = above.map(|place| &head[place])
        && by_number
        && let Some(number) = chosen.iter().find(|number| !holds(line, **number))
        && values(line) > 0
    {
        return Err(RecordError::Cell(Place {
            line: line.number,
            column: number.to_string(),
            text: at(line, *number),
        }));
    }
    let is_named = |place: &usize| wide(place) && !head[*place].cells.iter().any(|cell| is_value(cell));
    let units = above.filter(|place| is_units(&head[*place].cells()));
    let higher = units.and_then(|place| place.checked_sub(1)).filter(is_named);
    let header = higher.or(above);
    Ok(Start {
        place: header.unwrap_or(first),
        is_header: header.is_some(),
    })
}

/// The names of a header, without empty cells at its end.
fn names(line: &Line) -> Vec<&str> {
    let mut cells = line.cells();
    while cells.len() > 1 && cells.last() == Some(&"") {
        cells.pop();
    }
    cells
}

impl Start {
    fn layout(
        self,
        head: &[Line],
        separator: Separator,
        skipped: u64,
        options: &ReadOptions,
    ) -> Result<Layout, RecordError> {
        let Self { place, is_header } = self;
        let start = &head[place];
        let mut cells: Vec<String> = names(start).into_iter().map(str::to_owned).collect();
        let above = &head[..place];
        if let Some(line) = above
            .iter()
            .find(|line| line.is_data() && line.cells.len() >= cells.len())
        {
            return Err(RecordError::DataAbove {
                line: line.number,
                header: start.number,
            });
        }
        if let Some(line) = above.iter().find(|line| line.runs_on) {
            return Err(RecordError::OpenQuote(line.number));
        }
        let units = head
            .get(place + 1)
            .filter(|line| is_header && line.cells.len() >= cells.len() && is_units(&line.cells()[..cells.len()]));
        for (name, unit) in cells.iter_mut().zip(units.iter().flat_map(|line| &line.cells)) {
            let unit = unit.trim_matches(['[', ']', '(', ')']);
            if (unit.contains(is_of_unit) || unit == "-") && !name.contains(['[', '(']) {
                *name = format!("{name} [{unit}]");
            }
        }
        let end = match (is_header, units) {
            (true, Some(units)) => Some(units),
            (true, None) => Some(start),
            // The first row is data.
            (false, _) => above.last(),
        };
        let names: Vec<&str> = cells.iter().map(String::as_str).collect();
        let columns = Columns::find(is_header.then_some(&names), cells.len(), start.number, options)?;
        Ok(Layout {
            separator,
            columns,
            is_header,
            body: skipped + end.map_or(0, |line| line.next),
            before: end.map_or(u64::from(skipped > 0), |line| line.last),
            has_units: units.is_some(),
            left_out: above
                .first()
                .zip(above.last())
                .map(|(first, last)| [first.number, last.last]),
            line: start.number,
            cells,
        })
    }
}

/// Whether a row below the names has their units, or is a rule.
fn is_units(row: &[&str]) -> bool {
    let may_be = |cell: &&str| !is_value(cell) && !is_absent(cell);
    let is_rule = |cell: &&str| cell.len() > 1 && cell.chars().all(|c| c == '-' || c == '=');
    row.iter().all(may_be) && row.iter().any(|cell| cell.contains(is_of_unit)) || row.iter().all(is_rule)
}

/// Whether a character is one of a unit's name: the unit of a number without one, `-`, is beside others.
fn is_of_unit(c: char) -> bool {
    c.is_alphabetic() || "%°‰".contains(c)
}

/// Whether a cell says that there is no number: no unit is called so.
fn is_absent(cell: &str) -> bool {
    const WORDS: [&str; 8] = ["n.v.", "n. v.", "n.a.", "n. a.", "k.a.", "missing", "invalid", "error"];
    let is_word = WORDS.iter().any(|word| cell.eq_ignore_ascii_case(word));
    cell.starts_with('#') || is_word || !cell.is_empty() && is_missing(cell)
}
