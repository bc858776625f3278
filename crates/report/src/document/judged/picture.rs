//! The figure for a verdict: the number of every cell with its error, and the condition on it.

use super::words::{heading, levels, numbers, place, unit};
use crate::document::figure::Drawn;
use crate::document::layout::{BEYOND, Choice, Form, Layout, panel_title, sheet};
use crate::plot::{Course, Plot, PlotAxis, Point, Series, Style, distinct, extent};
use crate::results::Study;
use asobench_study::claim::{Judged, JudgedCell, JudgedNumber, JudgedTest, Scale as Compared};
use asobench_study::study::CellSummary;
use asobench_study::study::file::Key;

/// Largest number of tests of a claim that get a figure.
const PICTURES: usize = 3;
/// Largest number of cells, or numbers of cells, that get a row each.
const ROWS: usize = 14;
/// Largest number of panels, each over the setting with most values.
const PANELS: usize = 12;
/// Largest number of cells drawn one after the other.
const SORTED: usize = 200;

/// The outcome of a cell, its words in the legend, and its place in the palette. Outcomes differ by marker and colour.
const SAYS: [(&str, &str, usize); 4] = [
    ("pass", "certainly passes", 2),
    ("fail", "certainly fails", 1),
    ("open", "open", 5),
    ("left out", "left out", 6),
];

/// A number to draw.
#[derive(Clone)]
struct Mark<'a> {
    cell: &'a JudgedCell,
    number: &'a JudgedNumber,
    /// The answer of the number by itself: "pass", "fail" or "open".
    says: &'static str,
    value: f64,
    /// At the level of the cell, so that it excludes the limit where the cell is certain. Ends may be infinite.
    interval: [f64; 2],
}

/// A figure for each condition of a claim, at most `PICTURES`, those that fail or are open first. Tests with the same
/// condition share one.
pub(super) fn pictures(study: &Study, claim: &Judged) -> Vec<Drawn> {
    let groups = groups(claim).into_iter().take(PICTURES);
    groups
        .filter_map(|tests| Picture::new(claim, &tests).draw(study))
        .collect()
}

/// The tests by picture.
fn groups(claim: &Judged) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (i, test) in claim.tests.iter().enumerate() {
        let alike = |group: &&mut Vec<usize>| {
            let first = &claim.tests[group[0]];
            first.scale == test.scale && first.limits == test.limits && !common(claim, &[group[0], i]).is_empty()
        };
        match groups.iter_mut().find(alike) {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    groups.sort_by_key(|group| {
        let here = numbers(claim).filter(|(_, number)| group.contains(&number.test));
        here.map(|(cell, number)| rank(says(claim, cell, number))).min()
    });
    groups
}

/// The answer of one number to the claim in its cell: "pass" or "fail" where its interval lies on one side of every
/// limit, else "open".
fn says(claim: &Judged, cell: &JudgedCell, number: &JudgedNumber) -> &'static str {
    if cell.numbers.len() == 1 || !["pass", "fail", "open"].contains(&cell.says) {
        return cell.says;
    }
    let [low, high] = number.interval;
    match claim.tests.get(number.test).map(|test| test.limits) {
        Some([least, most]) if low >= least && high <= most => "pass",
        Some([least, most]) if high < least || low > most => "fail",
        _ => "open",
    }
}

/// The order in which numbers decide a cell: one that fails before one that is open.
fn rank(says: &str) -> usize {
    ["fail", "open"].iter().position(|of| *of == says).unwrap_or(2)
}

/// Of each cell the number that decides it: the first by `rank`, and of these the one that is deepest on the failing
/// side, or nearest to it.
fn deciding<'a>(marks: &[Mark<'a>], limits: [f64; 2], unit: f64) -> Vec<Mark<'a>> {
    let [least, most] = limits.map(|limit| unit * limit);
    let room = |mark: &Mark<'_>| f64::min(mark.value - least, most - mark.value);
    let first = |cell: &[Mark<'a>]| {
        let compared = |a: &&Mark<'a>, b: &&Mark<'a>| rank(a.says).cmp(&rank(b.says)).then(room(a).total_cmp(&room(b)));
        cell.iter().min_by(compared).cloned()
    };
    let cells = marks.chunk_by(|a, b| std::ptr::eq(a.cell, b.cell));
    cells.filter_map(first).collect()
}

/// The subject of a picture's tests: the words that all begin with, without prepositions at their end.
fn common(claim: &Judged, tests: &[usize]) -> String {
    let all = tests.iter().filter_map(|i| claim.tests.get(*i));
    let all: Vec<&str> = all.map(|test| test.what.trim_end_matches(',')).collect();
    let first: Vec<&str> = all.first().map_or(Vec::new(), |what| what.split(' ').collect());
    let same = |i: &usize| all.iter().all(|what| what.split(' ').nth(*i) == first.get(*i).copied());
    let count = (0..first.len()).take_while(same).count();
    let mut words = first[..count].to_vec();
    while let Some("with" | "of" | "to" | "the" | "than" | "over") = words.last().copied() {
        words.pop();
    }
    words.join(" ")
}

struct Picture<'a> {
    claim: &'a Judged,
    test: &'a JudgedTest,
    /// The subject of its tests.
    what: String,
    marks: Vec<Mark<'a>>,
    /// Number of cells without a number that can be drawn.
    left: usize,
    /// Whether the axis of the numbers is logarithmic.
    log: bool,
    /// Whether of several numbers of a cell only the one that decides is drawn.
    only_deciding: bool,
}

impl<'a> Picture<'a> {
    fn new(claim: &'a Judged, tests: &[usize]) -> Self {
        let test = &claim.tests[tests[0]];
        let unit = unit(test);
        let here = || numbers(claim).filter(|(_, number)| tests.contains(&number.test));
        let limits = test.limits.iter().filter(|limit| limit.is_finite());
        let log = test.scale == Compared::Ratio
            && limits.copied().all(|limit| limit > 0.0)
            && here().all(|(_, number)| number.value >= 0.0);
        let drawn = |value: f64| value.is_finite() && (!log || value > 0.0);
        let all = here().map(|(cell, number)| Mark {
            cell,
            number,
            says: says(claim, cell, number),
            value: unit * number.value,
            interval: number.interval.map(|end| unit * end),
        });
        let mut marks: Vec<Mark<'a>> = all.collect();
        let count = marks.len();
        if count > ROWS {
            marks = deciding(&marks, test.limits, unit);
        }
        let only_deciding = marks.len() < count;
        marks.retain(|mark| drawn(mark.number.value));
        let seen = |cell: &&JudgedCell| !marks.iter().any(|mark| std::ptr::eq(mark.cell, *cell));
        let left = claim.cells.iter().filter(seen).count();
        let mut picture = Self {
            claim,
            what: common(claim, tests),
            test,
            marks,
            left,
            log,
            only_deciding,
        };
        picture.log &= !picture.is_narrow();
        picture
    }

    /// The finite limits of the test.
    fn limits(&self) -> Vec<f64> {
        let unit = unit(self.test);
        let limits = self.test.limits.iter().filter(|limit| limit.is_finite());
        limits.map(|limit| unit * limit).collect()
    }

    /// The smallest and the largest of the values and limits.
    fn core(&self) -> (f64, f64) {
        let values = self.marks.iter().map(|mark| mark.value);
        extent(values.chain(self.limits()))
    }

    /// The smallest and the largest number drawn. The levels of many cells are so small that bars can be very long: a
    /// bar is cut where it is farther from the values and limits than these are from each other.
    fn ends(&self) -> (f64, f64) {
        let place = |x: f64| if self.log { x.ln() } else { x };
        let back = |x: f64| if self.log { x.exp() } else { x };
        let (low, high) = self.core();
        let room = place(high) - place(low);
        let (least, most) = extent(self.marks.iter().flat_map(|mark| mark.interval));
        if room > 0.0 && self.test.scale != Compared::Share {
            let edges = [place(low) - room, place(high) + room].map(back);
            (least.clamp(edges[0], low), most.clamp(high, edges[1]))
        } else {
            let kept = |x: f64, other: f64| if x.is_finite() { x } else { other };
            (kept(least, low).min(low), kept(most, high).max(high))
        }
    }

    /// Whether a bar goes on beyond the picture.
    fn is_cut(&self) -> bool {
        let (low, high) = self.ends();
        let mut marks = self.marks.iter();
        marks.any(|mark| mark.interval[0] < low || mark.interval[1] > high)
    }

    /// A bar for the picture: ends that no axis can place run off its edge.
    fn bar(&self, mark: &Mark<'_>) -> [f64; 2] {
        let [low, high] = mark.interval;
        let least = if self.log { 1.0 / BEYOND } else { -BEYOND };
        [low.max(least), high.min(BEYOND)]
    }

    /// Whether the numbers are so close together that a logarithmic axis would have no ticks.
    fn is_narrow(&self) -> bool {
        let (low, high) = self.ends();
        high < 2.0 * low
    }

    fn axis(&self) -> PlotAxis {
        let what = heading(self.what.trim_start_matches("the "));
        let (low, high) = self.ends();
        if self.log {
            let axis = PlotAxis::log(what);
            return if self.is_cut() { axis.range(low, high) } else { axis };
        }
        let percent = if self.test.scale == Compared::Share { ", %" } else { "" };
        let axis = PlotAxis::linear(format!("{what}{percent}"));
        if self.test.scale == Compared::Ratio && self.is_narrow() || self.is_cut() {
            let room = 0.06 * (high - low).max(1e-3 * high.abs());
            return axis.range(low - room, high + room);
        }
        axis
    }

    /// Whether the outcome of a cell depends on more numbers than the one that is drawn.
    fn is_part(&self) -> bool {
        let mut cells = self.claim.cells.iter();
        cells.any(|cell| cell.numbers.len() > 1)
    }

    /// Adds the marks as one series per outcome; `at` places a mark.
    fn series(&self, mut plot: Plot, marks: &[Mark<'_>], at: impl Fn(usize, &Mark<'_>) -> Point) -> Plot {
        for (says, label, slot) in SAYS {
            let chosen = marks.iter().enumerate().filter(|(_, mark)| mark.says == says);
            let points = chosen.map(|(i, mark)| at(i, mark)).collect();
            plot = plot.series(Series::new(label, Style::Marks, points).slot(slot));
        }
        let names = plot.y.has_names();
        for limit in self.limits() {
            let course = if names {
                Course::Vertical(limit)
            } else {
                Course::Horizontal(limit)
            };
            plot = plot.reference(format!("must be {} (shaded)", self.test.must), course);
        }
        let unit = unit(self.test);
        plot.shaded = Some(self.test.limits.map(|limit| unit * limit));
        plot
    }

    fn draw(&self, study: &Study) -> Option<Drawn> {
        // The requirement stands once: on the axis, and beside the limit.
        let title = format!("{} {}\n{}", self.claim.id, self.claim.verdict, self.claim.text);
        let (plots, how) = if self.marks.len() <= ROWS {
            (vec![self.rows()], "Every cell".to_owned())
        } else if let Some(found) = self.panels(study) {
            found
        } else {
            self.sorted()
        };
        let what = format!(
            "{how} with the interval by which it is judged. Each end is wrong with a chance of at most {}. \
            Numbers in the shaded range pass: {}.{}{}",
            levels(self.claim),
            self.test.must,
            match (self.only_deciding, self.is_part()) {
                (true, _) => {
                    " Of the numbers of a cell the one that decides is drawn: one that fails, else the nearest to \
                    failing. Where a cell fails or is open, the chance is divided by their number."
                }
                (false, true) => {
                    " The colour is the verdict on the number itself: a cell passes if all its numbers do. Where it \
                    fails or is open, the chance is divided by their number."
                }
                (false, false) => "",
            },
            if self.is_cut() {
                " A bar to the edge of the picture goes on beyond it."
            } else {
                ""
            },
        );
        let (picture, note) = sheet(title.trim_end(), &what, plots, Form::default())?;
        let left = match self.left {
            0 => "",
            1 => " Not drawn: one cell",
            left => &format!(" Not drawn: {left} cells"),
        };
        let why = " whose number falls on a trial without a value, is 0, or is missing.";
        let why = if left.is_empty() { "" } else { why };
        Some(Drawn {
            name: self.claim.id.clone(),
            picture,
            caption: format!("{what}{left}{why}{note}"),
        })
    }

    /// One row for each number.
    fn rows(&self) -> Plot {
        let name = |mark: &Mark<'_>| {
            let here = self.marks.iter();
            let here = here.filter(|other| place(other.cell) == place(mark.cell));
            let all: Vec<&str> = here.map(|other| other.number.what.as_str()).collect();
            let what = mark.number.what.trim_end_matches(',');
            let what = match all.len() {
                1 if mark.cell.case.is_some() || mark.number.what == self.test.what => String::new(),
                1 => what.to_owned(),
                _ => different(what, &all),
            };
            match (what.as_str(), mark.cell.place.as_str()) {
                ("", _) => place(mark.cell).to_owned(),
                (what, "") => what.to_owned(),
                (what, place) => format!("{place}: {what}"),
            }
        };
        let names: Vec<String> = self.marks.iter().map(name).collect();
        let plot = Plot::new("", self.axis(), PlotAxis::categories("", &names));
        self.series(plot, &self.marks, |i, mark| {
            let [low, high] = self.bar(mark);
            Point::interval(mark.value, i as f64, low, high)
        })
    }

    /// Panels over the setting with most values, if there are not too many.
    fn panels(&self, study: &Study) -> Option<(Vec<Plot>, String)> {
        let cell = |mark: &Mark<'_>| match mark.cell.cells.as_slice() {
            [cell] | [_, cell] => study.summary.cells.get(*cell),
            _ => None,
        };
        let cells: Option<Vec<&CellSummary>> = self.marks.iter().map(cell).collect();
        let cells = cells?;
        let values = |key: Key| {
            let mut values: Vec<usize> = cells.iter().map(|cell| study.place(cell, key)).collect();
            values.sort_unstable();
            values.dedup();
            values.len()
        };
        let mut keys = study.varying();
        keys.retain(|key| values(*key) > 1);
        let numeric = |key: &Key| study.is_numeric(*key);
        let x = keys
            .iter()
            .copied()
            .rev()
            .max_by_key(|key| (values(*key), numeric(key)))?;
        keys.retain(|key| *key != x);
        // If a claim lists outputs, each has its own panels.
        let choice = |cell: &CellSummary, mark: &Mark<'a>| -> (&'a Option<String>, Choice) {
            let settings = keys.iter().map(|key| (*key, cell.setting(*key)));
            (&mark.cell.case, settings.collect())
        };
        let all = cells.iter().zip(&self.marks);
        let panels = distinct(all.map(|(cell, mark)| choice(cell, mark)));
        if panels.len() > PANELS || values(x) < 3 {
            return None;
        }
        let layout = Layout::new(study, Some(x), &keys);
        let draw = |panel: &(&Option<String>, Choice)| {
            let drawn = cells.iter().zip(&self.marks);
            let (here, marks): (Vec<&CellSummary>, Vec<Mark<'_>>) = drawn
                .filter(|(cell, mark)| choice(cell, mark) == *panel)
                .map(|(cell, mark)| (*cell, mark.clone()))
                .unzip();
            let (case, settings) = panel;
            let title = [(*case).clone().unwrap_or_default(), panel_title(settings, &here)];
            let title: Vec<String> = title.into_iter().filter(|part| !part.is_empty()).collect();
            let plot = Plot::new(title.join(", "), layout.axis(study), self.axis());
            self.series(plot, &marks, |i, mark| {
                let [low, high] = self.bar(mark);
                Point::interval(layout.at(study, here[i]), mark.value, low, high)
            })
        };
        Some((panels.iter().map(draw).collect(), "Every cell".to_owned()))
    }

    /// All numbers by size, evenly thinned if there are many.
    fn sorted(&self) -> (Vec<Plot>, String) {
        let mut marks = self.marks.clone();
        marks.sort_by(|a, b| a.value.total_cmp(&b.value));
        let count = marks.len();
        let mut how = format!("Each of {count} cells, by size,");
        if count > SORTED {
            how = format!("{SORTED} of {count} cells, evenly by size, each");
            let last = (count - 1) as f64;
            let kept = (0..SORTED).map(|i| (i as f64 * last / (SORTED - 1) as f64).round() as usize);
            marks = kept.map(|i| marks[i].clone()).collect();
        }
        let plot = Plot::new("", PlotAxis::linear("cells, by the size of their numbers"), self.axis());
        let plot = self.series(plot, &marks, |i, mark| {
            let [low, high] = self.bar(mark);
            Point::interval((i + 1) as f64, mark.value, low, high)
        });
        (vec![plot], how)
    }
}

/// The words of a text in which it differs from others: without those that all begin or end with.
pub(super) fn different(text: &str, all: &[&str]) -> String {
    let words = |text: &str| -> Vec<String> {
        let words = text.trim_end_matches(',').split(' ');
        words.map(str::to_owned).collect()
    };
    let mine = words(text);
    let all: Vec<Vec<String>> = all.iter().map(|other| words(other)).collect();
    let shared = |at: &dyn Fn(&[String], usize) -> Option<String>| {
        let same = |i: &usize| all.iter().all(|other| at(other, *i) == at(&mine, *i));
        (0..mine.len()).take_while(same).count()
    };
    let first = shared(&|words, i| words.get(i).cloned());
    let last = shared(&|words, i| words.iter().rev().nth(i).cloned());
    let end = mine.len().saturating_sub(last).max(first);
    mine[first..end].join(" ")
}
