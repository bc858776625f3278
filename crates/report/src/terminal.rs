//! The final output of a run on a terminal: its first measures by cells and outputs, at most one screen, and the
//! verdict on every claim.

use super::document::answer::winners;
use super::document::lead::{lead_outputs, measures, shown_at_the_end};
use super::plot::distinct;
use super::results::{Study, at, first_failed_trial, lost};
use super::verdict_table::per_cent;
use asobench_identification::metric::Quantile;
use asobench_identification::number::quantile;
use asobench_study::claim::{Judged, Verdict};
use asobench_study::study::{CellSummary, Measure, OutputSummary};
use asobench_study::text::{self, shell_word, visible, wrap};

/// Columns of a terminal.
const WIDTH: usize = 80;
/// Lines of a screen, for the table and all its notes.
const LINES: usize = 24;
/// Lines for the key of columns.
const KEY_LINES: usize = 6;
/// Longest names of a row and of a column; a longer name is replaced by a short one, and a key below the table explains
/// it.
const ROW_NAME: usize = 40;
const COLUMN_NAME: usize = 14;
/// Largest number of outputs that are all shown.
const OUTPUTS: usize = 6;

/// The first measures of a study by cells and outputs, the lost trials, and how to see more.
pub fn overview(study: &Study) -> String {
    let partial = study.partial_line().map(|line| wrap(&line, WIDTH, "  "));
    let partial = partial.unwrap_or_default();
    let notes = notes(study);
    // Besides the table there are two lines above it and the last line.
    let (table, left) = table(study, LINES.saturating_sub(3 + notes.lines().count()));
    let report = visible(shell_word(study.folder.display()));
    let left = if left.is_empty() {
        "All measures and figures"
    } else {
        &left
    };
    // A command stays on one line, whatever its length.
    format!(
        "{partial}Medians; in parentheses the standard error of the last digit:\n\n{table}{notes}{left}: asobench \
         report {report}\n"
    )
}

/// The verdict on every claim, in one or more lines that begin with its id and verdict, and how many were tested.
pub fn verdicts(study: &Study) -> String {
    let lines = study.judged.iter().map(|claim| visible(&claim.line));
    let lines = lines.map(|line| wrap(&line, WIDTH, "    "));
    let tested = study.tested().map(|line| wrap(&line, WIDTH, ""));
    lines.chain(tested).collect()
}

/// The verdicts on one screen: as [`verdicts`] if that fits, otherwise a line for each claim that is decided and a
/// count of the others.
pub fn short_verdicts(study: &Study) -> String {
    let all = verdicts(study);
    if all.lines().count() <= LINES {
        return all;
    }
    let (open, decided): (Vec<&Judged>, Vec<&Judged>) = study
        .judged
        .iter()
        .partition(|claim| claim.verdict == Verdict::Undecided);
    let mut text: String = decided.into_iter().map(in_one_line).collect();
    if !open.is_empty() {
        let more = open.iter().filter_map(|claim| claim.needed.as_ref()).count();
        let more = match more {
            0 => String::new(),
            count => format!("; more trials would decide {count} of them"),
        };
        let count = open.len();
        let claims = if count == 1 { "claim is" } else { "claims are" };
        text.push_str(&wrap(&format!("{count} {claims} undecided{more}."), WIDTH, ""));
    }
    text.extend(study.tested().map(|line| wrap(&line, WIDTH, "")));
    let folder = visible(shell_word(study.folder.display()));
    text + &format!("The numbers behind every claim: asobench report {folder}\n")
}

/// A claim as a line: its verdict, the cells that pass and fail, and as much of its text as a terminal shows.
fn in_one_line(claim: &Judged) -> String {
    let count = |says: &str| claim.cells.iter().filter(|cell| cell.says == says).count();
    let [pass, fail] = ["pass", "fail"].map(count);
    let line = format!(
        "{}  {}: {pass} of {} cells pass, {fail} fail. {}",
        claim.id,
        claim.verdict,
        claim.cells.len(),
        claim.text
    );
    let line = visible(line.trim_end());
    match line.char_indices().nth(WIDTH) {
        Some(_) => line.chars().take(WIDTH - 3).collect::<String>() + "...\n",
        None => line + "\n",
    }
}

/// The outputs: all in order if they are few, otherwise those named by claims and one of each estimator.
fn outputs(study: &Study) -> Vec<String> {
    let labels = study.labels();
    if labels.len() <= OUTPUTS {
        return labels.to_vec();
    }
    let lead = lead_outputs(study).into_iter().map(|(_, label)| label);
    distinct(study.claimed().into_iter().chain(lead))
}

/// Below the table: why medians are missing, the lost trials, and how to see one.
fn notes(study: &Study) -> String {
    let mut notes = String::new();
    let reasons = ["what it times did not come before the end", "they failed"];
    for (why, failed) in reasons.into_iter().zip([false, true]) {
        if none_there(study, failed) {
            notes.push_str(&format!(
                "none: half of the trials or more have no such measure ({why}).\n"
            ));
        }
    }
    let most = most_lost(study);
    notes.push_str(&wrap(&worst(study, most), WIDTH, "  "));
    notes.extend(first_failed(study, most));
    let first = shown_at_the_end(study).into_iter().next();
    let best = first.map_or_else(String::new, |of| winners(study, of));
    if !best.is_empty() {
        notes.push_str(&wrap(&visible(best), WIDTH, "  "));
    }
    notes
}

/// Whether a median that is shown falls among trials without the measure, of an output of which half of the trials
/// failed, or did not.
fn none_there(study: &Study, failed: bool) -> bool {
    let measures = shown_at_the_end(study);
    study.all_outputs().any(|(_, output)| {
        let mut found = measures.iter().filter_map(|of| output.measures.get(of));
        (output.failed.share < 0.5) != failed && found.any(|of| of.q50.lost)
    })
}

/// A cell and one of its outputs.
type Place<'a> = (&'a CellSummary, &'a OutputSummary);

/// The output and cell with the largest share of lost trials, if any was lost.
fn most_lost(study: &Study) -> Option<Place<'_>> {
    let worst = study
        .all_outputs()
        .max_by(|a, b| lost(a.1).share.total_cmp(&lost(b.1).share));
    worst.filter(|(_, output)| lost(output).count > 0)
}

/// Where most trials are lost.
fn worst(study: &Study, most: Option<Place<'_>>) -> String {
    let Some((cell, output)) = most else {
        return "No trial was lost.".to_owned();
    };
    visible(format!(
        "The largest share of lost trials (failed or unstable): {} %, of {}{}.",
        per_cent(lost(output)),
        output.label(),
        at(cell, &study.varying())
    ))
}

/// The command that replays a failed trial, as one line: of the output and cell that lose most trials, or where none
/// of these failed (they are unstable), of those with most failures, which it names.
fn first_failed(study: &Study, most: Option<Place<'_>>) -> Option<String> {
    let own = most.filter(|place| first_failed_trial(place.1).is_some());
    let listed = study
        .all_outputs()
        .filter(|place| first_failed_trial(place.1).is_some());
    let place = own.or_else(|| listed.max_by(|a, b| a.1.failed.share.total_cmp(&b.1.failed.share)))?;
    let (cell, output) = place;
    let command = study.replay_command(cell.cell, first_failed_trial(output)?);
    let whose = match own {
        Some(_) => String::new(),
        None => format!(" of {}{}", output.label(), at(cell, &study.varying())),
    };
    Some(visible(format!("To see a failed trial{whose}: {command}")) + "\n")
}

/// A group of columns: the medians of a measure, or without one the lost trials.
type Group = Option<Measure>;

fn number(group: Group, output: Option<&OutputSummary>) -> String {
    match (group, output) {
        (_, None) => "-".to_owned(),
        (None, Some(output)) => per_cent(lost(output)),
        (Some(measure), Some(output)) => {
            let statistics = output.measures.get(&measure);
            quantile(statistics.map_or(Quantile::UNDEFINED, |of| of.q50))
        }
    }
}

/// The first measures, and the lost trials if there are any.
fn groups(study: &Study) -> Vec<Group> {
    let measures = shown_at_the_end(study).into_iter();
    let mut groups: Vec<Group> = measures.map(Some).collect();
    if study.all_outputs().any(|(_, of)| lost(of).count > 0) {
        groups.insert(groups.len().min(1), None);
    }
    groups
}

/// The name of a row or a column.
struct Name {
    /// Short enough to stand beside numbers.
    shown: String,
    /// The complete name, wrapped, if that is too long; otherwise empty.
    key: String,
}

impl Name {
    fn whole(shown: String) -> Self {
        let key = String::new();
        Self { shown, key }
    }
}

/// Names; names of more than `most` characters are replaced by the letters A, B, ..., Z, A2, ...
fn short(names: Vec<String>, most: usize) -> Vec<Name> {
    let turns = std::iter::once(String::new()).chain((2..).map(|turn: usize| turn.to_string()));
    let letters = turns.flat_map(|turn| ('A'..='Z').map(move |letter| format!("{letter}{turn}")));
    let taken = names.clone();
    let mut free = letters.filter(|letter| !taken.contains(letter));
    let mut name = |name: String| {
        if name.chars().count() <= most {
            return Name::whole(name);
        }
        let shown = free.next().unwrap_or_default();
        let key = wrap(&format!("{shown}: {name}"), WIDTH, "   ");
        Name { shown, key }
    };
    names.into_iter().map(&mut name).collect()
}

/// The heading and the names of cells: a column for every setting that varies, or the numbers of the cells if these are
/// too wide.
fn of_cells(study: &Study) -> (String, Vec<Name>) {
    let keys = study.varying();
    let cells = &study.summary.cells;
    let mut lines = vec![String::new(); 1 + cells.len()];
    for (i, key) in keys.iter().enumerate() {
        let texts = cells.iter().map(|cell| visible(cell.setting(*key)));
        let heading = std::iter::once(key.name().replace('_', " "));
        append(&mut lines, if i > 0 { 2 } else { 0 }, heading.chain(texts));
    }
    let mut names = lines.iter().map(|line| line.trim_end().to_owned());
    if names.clone().all(|name| name.chars().count() <= ROW_NAME) {
        let heading = names.next().unwrap_or_default();
        return (heading, names.map(Name::whole).collect());
    }
    let name = |cell: &CellSummary| {
        let words = visible(cell.place().words(&keys));
        let key = wrap(&format!("cell {}: {words}", cell.cell), WIDTH, "    ");
        let shown = cell.cell.to_string();
        Name { shown, key }
    };
    ("cell".to_owned(), cells.iter().map(name).collect())
}

fn widest(texts: &[String]) -> usize {
    let widths = texts.iter().map(|text| text.chars().count());
    widths.max().unwrap_or(0)
}

/// Adds a column to lines, after a gap.
fn append(lines: &mut [String], gap: usize, texts: impl Iterator<Item = String>) {
    let start = widest(lines) + gap;
    for (line, text) in lines.iter_mut().zip(texts) {
        *line = format!("{line:start$}{text}");
    }
}

/// Keeps the first names that need at most `room` lines, `each` and those of its key, but at least one name; returns
/// how many lines these are.
fn keep(names: &mut Vec<Name>, room: usize, each: usize) -> usize {
    let (mut count, mut used) = (0, 0);
    for name in &*names {
        let needed = used + each + name.key.lines().count();
        if count > 0 && needed > room {
            break;
        }
        (count, used) = (count + 1, needed);
    }
    names.truncate(count);
    used
}

/// A table of at most `room` lines with its keys, and what it leaves out. Cells are rows and outputs columns, or the
/// reverse if there are more outputs than cells.
fn table(study: &Study, room: usize) -> (String, String) {
    let cells = &study.summary.cells;
    let labels = outputs(study);
    let turned = labels.len() > cells.len();
    let names = labels.iter().map(visible).collect();
    let ((heading, rows), columns) = if turned {
        let keys = study.varying();
        let places = cells.iter().map(|cell| visible(cell.place().words(&keys)));
        let rows = ("output".to_owned(), short(names, ROW_NAME));
        (rows, short(places.collect(), COLUMN_NAME))
    } else {
        (of_cells(study), short(names, COLUMN_NAME))
    };
    let mut sheet = Sheet::new(heading, rows, columns, room);
    let mut count = 0;
    for group in groups(study) {
        let heading = group.map_or("lost, %".to_owned(), |measure| format!("median {measure}"));
        let added = sheet.add(&heading, |row, column| {
            let (cell, label) = if turned { (column, row) } else { (row, column) };
            number(group, study.output(&cells[cell], &labels[label]))
        });
        count += usize::from(added && group.is_some());
    }
    let mut shown = [sheet.rows.len(), sheet.columns.len()];
    if turned {
        shown.reverse();
    }
    let left = [
        (cells.len() - shown[0], "more cell"),
        (study.labels().len() - shown[1], "more output"),
        (measures(study).len() - count, "more measure"),
    ];
    let left = left.into_iter().filter(|(more, _)| *more > 0);
    let left: Vec<String> = left.map(|(more, word)| text::count(more as u64, word)).collect();
    (sheet.text(), left.join(", "))
}

/// Rows and columns of numbers, in blocks one below the other.
struct Sheet {
    /// Those that are shown.
    rows: Vec<Name>,
    columns: Vec<Name>,
    /// The lines with which a block begins: headings and names of rows.
    start: Vec<String>,
    blocks: Vec<Vec<String>>,
    /// Lines left for further blocks.
    room: usize,
    /// Whether a column was left out.
    full: bool,
}

impl Sheet {
    /// A sheet with as many names as fit, without numbers.
    fn new(heading: String, mut rows: Vec<Name>, mut columns: Vec<Name>, room: usize) -> Self {
        // A column that is the only one has no name, and needs no line for it.
        let named = columns.iter().any(|name| !name.shown.is_empty());
        let mut start = vec![String::new(); usize::from(named)];
        start.push(heading);
        let room = room.saturating_sub(keep(&mut columns, KEY_LINES, 0) + start.len());
        let room = room.saturating_sub(keep(&mut rows, room, 1));
        start.extend(rows.iter().map(|row| row.shown.clone()));
        Self {
            rows,
            columns,
            blocks: vec![start.clone()],
            start,
            room,
            full: false,
        }
    }

    /// Adds a group of columns if there is room for all, of the first group those for which there is; returns whether
    /// any were added.
    fn add(&mut self, heading: &str, number: impl Fn(usize, usize) -> String) -> bool {
        if self.full {
            return false;
        }
        let texts = |column: usize| {
            let numbers = (0..self.rows.len()).map(|row| number(row, column));
            let named = self.start.len() > self.rows.len() + 1;
            let name = named.then(|| self.columns[column].shown.clone());
            name.into_iter().chain(numbers).collect()
        };
        let texts: Vec<Vec<String>> = (0..self.columns.len()).map(texts).collect();
        let before = self.blocks.clone();
        let count = self.place(heading, &texts);
        self.full = count < texts.len();
        if self.full && before != [self.start.as_slice()] {
            self.blocks = before;
            return false;
        }
        self.columns.truncate(count);
        true
    }

    /// Puts columns side by side, and starts further blocks while there is room for their lines; returns the number of
    /// columns that found room.
    fn place(&mut self, heading: &str, columns: &[Vec<String>]) -> usize {
        let whole = |block: &[String]| {
            let columns = columns.iter().enumerate();
            let all = columns.fold(block.to_vec(), |block, (i, column)| {
                beside(&block, (i == 0).then_some(heading), column)
            });
            widest(&all)
        };
        let mut block = self.blocks.pop().unwrap_or_default();
        // A group that fits into one block is not divided.
        let mut begin = whole(&block) > WIDTH && whole(&self.start) <= WIDTH;
        let mut title = Some(heading);
        let mut count = 0;
        for column in columns {
            begin |= widest(&beside(&block, title, column)) > WIDTH;
            if std::mem::take(&mut begin) && block != self.start {
                if 1 + block.len() > self.room {
                    break;
                }
                self.room -= 1 + block.len();
                self.blocks.push(block);
                (block, title) = (self.start.clone(), Some(heading));
            }
            block = beside(&block, title.take(), column);
            count += 1;
        }
        self.blocks.push(block);
        count
    }

    /// The blocks, then the keys of their names.
    fn text(&self) -> String {
        let line = |line: &String| line.trim_end().to_owned() + "\n";
        let blocks = self.blocks.iter();
        let blocks = blocks.map(|block| block.iter().map(line).collect::<String>());
        let mut text = blocks.collect::<Vec<_>>().join("\n");
        text.extend(self.columns.iter().chain(&self.rows).map(|name| &*name.key));
        text
    }
}

/// A block with one more column, and the heading of its group above it if it is the first of these.
fn beside(block: &[String], heading: Option<&str>, column: &[String]) -> Vec<String> {
    let mut block = block.to_vec();
    let width = widest(column);
    let column = column.iter().map(|text| format!("{text:width$}"));
    match heading {
        Some(heading) => {
            let heading = std::iter::once(heading.to_owned());
            append(&mut block, 2, heading.chain(column));
        }
        None => append(&mut block[1..], 2, column),
    }
    block
}

#[cfg(test)]
mod tests;
