//! The final output of a run on a terminal: its first measures by cells and outputs, at most one screen, and the
//! verdict on every claim.

use super::document::lead::{AT_THE_END, lead_outputs, measures, shown_at_the_end};
use super::results::Study;
use asobench_identification::metric::{Quantile, Share};
use asobench_identification::number::{quantile, uncertain};
use asobench_study::study::{CellSummary, Measure, Outcomes};
use asobench_study::text::{shell_word, visible, wrap};

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
    let mut text = String::new();
    if let Some(line) = study.partial_line() {
        text.push_str(&wrap(&line, WIDTH, "  "));
    }
    text.push_str("Medians; in parentheses the standard error of the last digit:\n\n");
    let mut worst = wrap(&worst(study), WIDTH, "  ");
    worst.extend(first_failed(study));
    for (why, is_there) in ["they failed", NOT_REACHED].iter().zip(none_there(study)) {
        if is_there {
            let none = format!("none: half of the trials or more have no such measure ({why}).\n");
            worst.insert_str(0, &none);
        }
    }
    // Besides the table there are two lines above it and the last line.
    let sheet = Sheet::new(study, LINES.saturating_sub(3 + worst.lines().count()));
    text.push_str(&sheet.text());
    text.push_str(&worst);
    let report = format!(
        "asobench report {}",
        visible(shell_word(study.folder.display()))
    );
    let left = sheet.left_out();
    // A command stays on one line, whatever its length.
    if left.is_empty() {
        text.push_str(&format!("All measures and figures: {report}\n"));
    } else {
        text.push_str(&format!("{left}: {report}\n"));
    }
    text
}

/// The verdict on every claim, in one or more lines that begin with its id and verdict, and how many were tested.
pub fn verdicts(study: &Study) -> String {
    let lines = study.judged.iter().map(|claim| visible(&claim.line));
    let lines = lines.map(|line| wrap(&line, WIDTH, "    "));
    let tested = study.tested().map(|line| wrap(&line, WIDTH, ""));
    lines.chain(tested).collect()
}

/// The outputs: all in order if they are few, otherwise those named by claims and one of each estimator.
fn outputs(study: &Study) -> Vec<String> {
    let labels = study.labels();
    if labels.len() <= OUTPUTS {
        return labels.to_vec();
    }
    let mut outputs = study.claimed();
    for (_, label) in lead_outputs(study) {
        if !outputs.contains(&label) {
            outputs.push(label);
        }
    }
    outputs
}

/// Why a trial that did not fail has no measure.
const NOT_REACHED: &str = "what it times did not come before the end";

/// Whether the median of a measure falls among trials without it: since half of them failed, or although they did not.
fn none_there(study: &Study) -> [bool; 2] {
    let measures = shown_at_the_end(study);
    let cells = study.summary.cells.iter();
    let mut found = [false; 2];
    for output in cells.flat_map(|cell| &cell.outputs) {
        let mut of_output = measures
            .iter()
            .filter_map(|measure| output.measures.get(measure));
        if of_output.any(|statistics| statistics.q50.lost) {
            found[usize::from(output.failed.share < 0.5)] = true;
        }
    }
    found
}

fn lost(outcomes: &Outcomes) -> Share {
    Share::new(outcomes.lost_trials().0, outcomes.trials)
}

/// A share in per cent with its standard error; where that is not known, with the decimals that one trial makes.
fn per_cent(share: Share) -> String {
    let value = 100.0 * share.share;
    if share.mcse.is_nan() && share.count > 0 {
        let decimals = (share.total as f64 / 100.0).log10().ceil().max(0.0);
        return format!("{value:.0$}", decimals as usize);
    }
    uncertain(value, 100.0 * share.mcse)
}

/// The output and cell with the largest share of lost trials.
fn worst(study: &Study) -> String {
    let cells = study.summary.cells.iter();
    let all = cells.flat_map(|cell| cell.outputs.iter().map(move |output| (cell, output)));
    let worst = all.max_by(|a, b| {
        let share = |outcomes: &Outcomes| lost(outcomes).share;
        share(&a.1.outcomes).total_cmp(&share(&b.1.outcomes))
    });
    match worst {
        Some((cell, output)) if lost(&output.outcomes).count > 0 => {
            let place = cell.place().words(&study.varying());
            let at = if place.is_empty() { "" } else { " at " };
            visible(format!(
                "The largest share of lost trials (failed or unstable): {} %, of {}{at}{place}.",
                per_cent(lost(&output.outcomes)),
                output.label(),
            ))
        }
        _ => "No trial was lost.".to_owned(),
    }
}

/// The command that replays the first failed trial of the cell and output with the largest share of failed trials, as
/// one line.
fn first_failed(study: &Study) -> Option<String> {
    let cells = study.summary.cells.iter();
    let all = cells.flat_map(|cell| cell.outputs.iter().map(move |output| (cell, output)));
    let listed = all.filter(|(_, output)| !output.outcomes.failed_trials.is_empty());
    let (cell, output) = listed.max_by(|a, b| a.1.failed.share.total_cmp(&b.1.failed.share))?;
    let trials = output.outcomes.failed_trials.values();
    let first = trials.flatten().min()?;
    let command = study.replay_command(cell.cell, *first);
    Some(visible(format!("To see a failed trial: {command}")) + "\n")
}

/// The content of a group of columns.
#[derive(Clone, Copy, PartialEq)]
enum Shown {
    Median(Measure),
    Lost,
}

impl Shown {
    fn heading(self) -> String {
        match self {
            Self::Median(measure) => format!("median {}", measure.name()),
            Self::Lost => "lost, %".to_owned(),
        }
    }

    fn number(self, study: &Study, cell: &CellSummary, label: &str) -> String {
        let output = study.output(cell, label);
        match (self, output) {
            (_, None) => "-".to_owned(),
            (Self::Lost, Some(output)) => per_cent(lost(&output.outcomes)),
            (Self::Median(measure), Some(output)) => {
                let median = output
                    .measures
                    .get(&measure)
                    .map_or(Quantile::UNDEFINED, |statistics| statistics.q50);
                quantile(median)
            }
        }
    }
}

/// The first measures, and the lost trials if there are any.
fn groups(cells: &[CellSummary], measures: &[Measure]) -> Vec<Shown> {
    let measures = measures.iter().take(AT_THE_END);
    let mut groups: Vec<Shown> = measures.map(|measure| Shown::Median(*measure)).collect();
    let mut outputs = cells.iter().flat_map(|cell| &cell.outputs);
    if outputs.any(|output| lost(&output.outcomes).count > 0) {
        groups.insert(groups.len().min(1), Shown::Lost);
    }
    groups
}

/// Names of rows or columns, short enough to fit beside numbers.
struct Names {
    heading: String,
    shown: Vec<String>,
    /// The complete names of those that are too long, wrapped; the others are empty.
    key: Vec<String>,
}

impl Names {
    /// Makes names; those of more than `most` characters are replaced by short ones.
    fn new(heading: &str, whole: Vec<String>, most: usize) -> Self {
        let taken = whole.clone();
        let mut free = letters().filter(|letter| !taken.contains(letter));
        let mut key = Vec::new();
        let mut short = |name: String| {
            if name.chars().count() <= most {
                key.push(String::new());
                return name;
            }
            let letter = free.next().unwrap_or_default();
            key.push(wrap(&format!("{letter}: {name}"), WIDTH, "   "));
            letter
        };
        let shown = whole.into_iter().map(&mut short).collect();
        let heading = heading.to_owned();
        Self {
            heading,
            shown,
            key,
        }
    }

    /// One column for every setting that varies, or the numbers of the cells if these are too wide.
    fn of_cells(study: &Study) -> Self {
        let keys = study.varying();
        let cells = &study.summary.cells;
        let mut columns = Vec::new();
        for key in &keys {
            let names = cells.iter().map(|cell| visible(cell.setting(*key)));
            let heading = key.name().replace('_', " ");
            columns.push(
                std::iter::once(heading)
                    .chain(names)
                    .collect::<Vec<String>>(),
            );
        }
        let widths: Vec<usize> = columns.iter().map(|column| widest(column)).collect();
        let row = |row: usize| {
            let texts = columns.iter().zip(&widths);
            let padded = texts.map(|(column, width)| format!("{:width$}", column[row]));
            padded.collect::<Vec<_>>().join("  ").trim_end().to_owned()
        };
        let rows: Vec<String> = (1..=cells.len()).map(row).collect();
        if widest(&rows).max(row(0).chars().count()) <= ROW_NAME {
            let key = vec![String::new(); rows.len()];
            let heading = row(0);
            return Self {
                heading,
                shown: rows,
                key,
            };
        }
        let whole = |cell: &CellSummary| {
            let words = visible(cell.place().words(&keys));
            wrap(&format!("cell {}: {words}", cell.cell), WIDTH, "    ")
        };
        Self {
            heading: "cell".to_owned(),
            shown: cells.iter().map(|cell| cell.cell.to_string()).collect(),
            key: cells.iter().map(whole).collect(),
        }
    }
}

/// "A", "B", ..., "Z", "A2", ...
fn letters() -> impl Iterator<Item = String> {
    let turn = |turn: usize| {
        let number = if turn == 1 {
            String::new()
        } else {
            turn.to_string()
        };
        ('A'..='Z').map(move |letter| format!("{letter}{number}"))
    };
    (1..).flat_map(turn)
}

fn widest(texts: &[String]) -> usize {
    let widths = texts.iter().map(|text| text.chars().count());
    widths.max().unwrap_or(0)
}

/// A column of numbers.
struct Column {
    /// Its group and its name, as indices.
    group: usize,
    name: usize,
    numbers: Vec<String>,
    width: usize,
}

/// The width of a block so far, and the heading of the last group.
#[derive(Clone, Copy, Default)]
struct Line {
    columns: usize,
    heading: usize,
    group: Option<usize>,
    /// Whether the last column is the first of its group.
    begins: bool,
}

impl Line {
    fn from(columns: usize) -> Self {
        Self {
            columns,
            ..Self::default()
        }
    }

    fn end(&self) -> usize {
        self.columns.max(self.heading)
    }

    /// Adds a column; returns where the gap before it begins.
    fn add(&mut self, column: &Column, heading: &str) -> usize {
        self.begins = self.group != Some(column.group);
        let start = if self.begins {
            self.end()
        } else {
            self.columns
        };
        if self.begins {
            self.heading = start + 2 + heading.chars().count();
        }
        self.group = Some(column.group);
        self.columns = start + 2 + column.width;
        start
    }
}

/// Cells as rows and outputs as columns, or the reverse if there are more outputs than cells.
struct Sheet {
    rows: Names,
    columns: Names,
    groups: Vec<Shown>,
    /// The blocks shown, one below the other, each with `count` rows.
    blocks: Vec<Vec<Column>>,
    count: usize,
    /// Numbers of cells, outputs and measures that are not shown.
    left: [usize; 3],
}

impl Sheet {
    /// Fills a sheet of at most `room` lines.
    fn new(study: &Study, room: usize) -> Self {
        let cells = &study.summary.cells;
        let (labels, all) = (outputs(study), measures(study));
        let turned = labels.len() > cells.len();
        let outputs = labels.iter().map(visible).collect();
        let (rows, columns) = if turned {
            let keys = study.varying();
            let places = cells.iter().map(|cell| visible(cell.place().words(&keys)));
            let places = Names::new("", places.collect(), COLUMN_NAME);
            (Names::new("output", outputs, ROW_NAME), places)
        } else {
            (Names::of_cells(study), Names::new("", outputs, COLUMN_NAME))
        };
        let mut sheet = Self {
            rows,
            columns,
            groups: groups(cells, &all),
            blocks: Vec::new(),
            count: 0,
            left: [0; 3],
        };
        let columns = sheet.fill(room, |group, row, column| {
            let (cell, label) = if turned { (column, row) } else { (row, column) };
            group.number(study, &cells[cell], &labels[label])
        });
        let mut shown = [sheet.count, columns];
        if turned {
            shown.reverse();
        }
        let measures = sheet.shown_groups().filter(|shown| *shown != Shown::Lost);
        sheet.left = [
            cells.len() - shown[0],
            study.labels().len() - shown[1],
            all.len() - measures.count(),
        ];
        sheet
    }

    /// Takes as many rows as fit, then as many blocks of columns. Returns how many columns of the first group are
    /// shown.
    fn fill(&mut self, room: usize, number: impl Fn(Shown, usize, usize) -> String) -> usize {
        let height = |text: &String| text.lines().count();
        let mut names = 0;
        let mut key = 0;
        while names < self.columns.shown.len() {
            key += height(&self.columns.key[names]);
            if names > 0 && key > KEY_LINES {
                break;
            }
            names += 1;
        }
        let key = self.columns.key[..names].iter().map(height).sum::<usize>();
        let mut room = room.saturating_sub(key + self.heads());
        while self.count < self.rows.shown.len() {
            let needed = 1 + height(&self.rows.key[self.count]);
            if self.count > 0 && needed > room {
                break;
            }
            room = room.saturating_sub(needed);
            self.count += 1;
        }
        let column = |group: usize, name: usize| {
            let rows = 0..self.count;
            let numbers: Vec<String> = rows
                .map(|row| number(self.groups[group], row, name))
                .collect();
            let width = widest(&numbers).max(self.columns.shown[name].chars().count());
            Column {
                group,
                name,
                numbers,
                width,
            }
        };
        let group = |group| (0..names).map(|name| column(group, name)).collect();
        let groups = (0..self.groups.len()).map(group).collect();
        self.arrange(groups, room);
        self.leave_parts(names)
    }

    /// Number of lines above the rows of a block.
    fn heads(&self) -> usize {
        let named = self.columns.shown.iter().any(|name| !name.is_empty());
        1 + usize::from(named)
    }

    fn row_width(&self) -> usize {
        let rows = widest(&self.rows.shown[..self.count]);
        rows.max(self.rows.heading.chars().count())
    }

    /// Puts columns side by side, and starts further blocks while there is room for their lines.
    fn arrange(&mut self, groups: Vec<Vec<Column>>, mut room: usize) {
        let height = 1 + self.heads() + self.count;
        let start = Line::from(self.row_width());
        let mut line = start;
        for group in groups {
            // A group that fits into one block is not divided.
            let end = |line: Line| {
                group
                    .iter()
                    .fold(line, |line, text| self.with(line, text))
                    .end()
            };
            let mut begin = self.blocks.is_empty() || end(line) > WIDTH && end(start) <= WIDTH;
            for column in group {
                begin |= self.with(line, &column).end() > WIDTH;
                if begin && !self.blocks.is_empty() {
                    if height > room {
                        return;
                    }
                    room -= height;
                }
                if std::mem::take(&mut begin) {
                    self.blocks.push(Vec::new());
                    line = start;
                }
                line = self.with(line, &column);
                if let Some(block) = self.blocks.last_mut() {
                    block.push(column);
                }
            }
        }
    }

    /// Keeps only whole groups, or a part of the first one; returns how many of its columns are left.
    fn leave_parts(&mut self, names: usize) -> usize {
        let whole = self.blocks.iter().flatten().count() / names.max(1);
        for block in &mut self.blocks {
            block.retain(|column| column.group < whole.max(1));
        }
        self.blocks.retain(|block| !block.is_empty());
        let all = self.blocks.iter().flatten();
        all.filter(|column| column.group == 0).count()
    }

    /// The line with one more column.
    fn with(&self, mut line: Line, column: &Column) -> Line {
        line.add(column, &self.groups[column.group].heading());
        line
    }

    fn shown_groups(&self) -> impl Iterator<Item = Shown> {
        let columns = self.blocks.iter().flatten();
        let last = columns.map(|column| column.group).max();
        let count = last.map_or(0, |last| last + 1);
        self.groups[..count].iter().copied()
    }

    fn text(&self) -> String {
        let blocks = self.blocks.iter().map(|block| self.block(block));
        let mut text = blocks.collect::<Vec<_>>().join("\n");
        let names = self.blocks.iter().flatten().map(|column| column.name + 1);
        let names = names.max().unwrap_or(0);
        let keys = self.columns.key[..names].iter();
        for key in keys.chain(&self.rows.key[..self.count]) {
            text.push_str(key);
        }
        text
    }

    fn block(&self, block: &[Column]) -> String {
        let width = self.row_width();
        let named = self.heads() == 2;
        let [first, second] = if named {
            ["", &self.rows.heading]
        } else {
            [&self.rows.heading, ""]
        };
        let mut headings = format!("{first:width$}");
        let mut names = format!("{second:width$}");
        let mut rows: Vec<String> = self.rows.shown[..self.count]
            .iter()
            .map(|name| format!("{name:width$}"))
            .collect();
        let mut line = Line::from(width);
        for column in block {
            let heading = self.groups[column.group].heading();
            let (start, width) = (line.add(column, &heading), column.width);
            if line.begins {
                headings = format!("{headings:start$}  {heading}");
            }
            let name = &self.columns.shown[column.name];
            names = format!("{names:start$}  {name:width$}");
            for (row, number) in rows.iter_mut().zip(&column.numbers) {
                *row = format!("{row:start$}  {number:width$}");
            }
        }
        let names = named.then_some(names);
        let lines = std::iter::once(headings).chain(names).chain(rows);
        lines
            .map(|line| line.trim_end().to_owned() + "\n")
            .collect()
    }

    /// "60 more cells, 2 more measures".
    fn left_out(&self) -> String {
        let words = ["cell", "output", "measure"].into_iter().zip(self.left);
        let counted = words.filter(|(_, count)| *count > 0).map(|(word, count)| {
            let s = if count == 1 { "" } else { "s" };
            format!("{count} more {word}{s}")
        });
        counted.collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests;
