//! Nested-loop plots: every cell of a study with several settings side by side, and below which settings it has
//! (Ruecker and Schwarzer, BMC Medical Research Methodology 14, 2014).

use super::figure::{Drawn, Figure, is_shown, left_out, quantile_note, series_of, subject, y_axis};
use super::layout::{Form, Layout, x_of};
use super::lead::lead_outputs;
use crate::plot::{NARROW, Plot, PlotAxis, Point, Series, Style, widest_note};
use crate::results::{Study, value_name};
use asobench_study::study::file::Key;
use asobench_study::study::{CellSummary, Measure};
use std::collections::HashMap;

/// Cells that can be told apart.
const MOST_CELLS: usize = 400;
/// Values of a setting that its name lists.
const VALUES: usize = 5;
/// The share of a picture's width that the axis of cells has at least.
const AXES: f64 = 0.55;
/// The place in the palette of the lines of settings.
const SETTING_SLOT: usize = 6;

/// The settings from the outermost loop to the innermost, which is the one along x of other figures.
fn loops(study: &Study, measure: Measure) -> Vec<Key> {
    let inner = x_of(study, measure);
    let mut keys = study.varying();
    keys.retain(|key| Some(*key) != inner);
    keys.sort_by_key(|key| key.entry().held);
    keys.extend(inner);
    keys
}

/// Whether a study has so many settings and so few cells that the plot shows what others do not.
pub(super) fn fits(study: &Study) -> bool {
    study.varying().len() >= 3 && study.summary.cells.len() <= MOST_CELLS
}

/// Medians of a measure in every cell.
pub(super) fn nested_loop(
    study: &Study,
    measure: Measure,
    outputs: Option<Vec<(usize, String)>>,
    (title, width): (Option<&str>, Option<f64>),
) -> Option<Drawn> {
    let keys = loops(study, measure);
    let cells = &study.summary.cells;
    if keys.is_empty() || cells.len() > MOST_CELLS {
        return None;
    }
    let outputs = outputs.unwrap_or_else(|| lead_outputs(study));
    let mut order: Vec<&CellSummary> = cells.iter().filter(|cell| !study.is_quiet(cell)).collect();
    order.sort_by_key(|cell| keys.iter().map(|key| study.place(cell, *key)).collect::<Vec<_>>());
    let at: HashMap<usize, f64> = (1..)
        .map(f64::from)
        .zip(&order)
        .map(|(at, cell)| (cell.cell, at))
        .collect();
    let layout = Layout {
        x: None,
        panels: vec![Vec::new()],
        held: Vec::new(),
        has_names: false,
    };
    let x = PlotAxis::linear(format!(
        "the {} cells, in nested loops over their settings",
        order.len()
    ));
    let below = settings(study, &keys, &order, x.clone(), width);
    let what = "Medians in every cell as steps; where several are equal, those behind are wider. Below are the \
                settings of the cells: from the outermost loop at the top to the innermost, the smallest value of \
                each at the bottom of its row; values stand on their steps where \
                there is room.";
    Figure {
        name: "nested-loop",
        title: &format!("median {} in every cell", subject(measure)),
        whole_title: title,
        what,
        left_out: &left_out(study, &outputs),
        end: &format!(" {}", quantile_note(study)),
        x: Some(x),
        series: series_of(&outputs, Style::Steps),
        points: &|i, cell, _| {
            let label = &outputs[i].1;
            let Some(at) = at.get(&cell.cell) else {
                return Vec::new();
            };
            let statistics = study.statistics(cell, label, measure);
            let shown = statistics.filter(|_| is_shown(study, cell, label));
            let median = shown.map_or(f64::NAN, |statistics| statistics.q50.value);
            // A step begins just after the one before ends.
            [at - 0.499_999, at + 0.5].map(|x| Point::new(x, median)).to_vec()
        },
        form: Form {
            width,
            columns: Some(1),
        },
        finish: &|plots| {
            for series in plots.iter_mut().flat_map(|plot| &mut plot.series) {
                series.points.sort_by(|a, b| a.x.total_cmp(&b.x));
            }
            plots.push(below.clone());
            true
        },
        ..Figure::new(&layout, y_axis(measure))
    }
    .draw(study)
}

/// A row for each setting: a line whose height is the place of the cell's value among the values. The values of a row
/// stand on their steps if they fit there, otherwise beside its name.
fn settings(study: &Study, keys: &[Key], order: &[&CellSummary], x: PlotAxis, width: Option<f64>) -> Plot {
    let values_of = |key: Key| -> Vec<String> {
        let values = study.values(key).iter();
        values.map(|of| value_name(key, of)).collect()
    };
    let mut steps = 1;
    let mut named = Vec::new();
    for key in keys {
        let values = values_of(*key);
        steps *= values.len();
        named.push(steps as f64 * widest_note(&values) < AXES * width.unwrap_or(NARROW));
    }
    let name = |(key, named): (&Key, &bool)| {
        if *named {
            return key.title();
        }
        let values = values_of(*key);
        let listed = match values.as_slice() {
            [first, .., last] if values.len() > VALUES => format!("{first} ... {last}"),
            _ => values.join(", "),
        };
        format!("{}: {listed}", key.title())
    };
    let names: Vec<String> = keys.iter().zip(&named).map(name).collect();
    let mut points = Vec::new();
    let (mut middles, mut notes) = (Vec::new(), Vec::new());
    for (row, key) in keys.iter().enumerate() {
        let last = study.values(*key).len().saturating_sub(1).max(1) as f64;
        let value = |i: usize| order.get(i).map(|cell| study.place(cell, *key));
        let mut from = 0;
        for to in 1..=order.len() {
            if value(to) == value(from) {
                continue;
            }
            let height = value(from).unwrap_or_default() as f64 / last;
            let y = row as f64 + 0.32 - 0.64 * height;
            points.extend([from, to].map(|end| Point::new(end as f64 + 0.5, y)));
            points.push(Point::new(f64::NAN, f64::NAN));
            if let (true, Some(value)) = (named[row], value(from)) {
                middles.push(Point::new(f64::midpoint(from as f64, to as f64) + 0.5, y));
                notes.extend(values_of(*key).get(value).cloned());
            }
            from = to;
        }
    }
    let lines = Series::new("", Style::Region, points).slot(SETTING_SLOT);
    let mut on_steps = Series::new("", Style::Notes, middles);
    on_steps.notes = notes;
    let plot = Plot::new("", x, PlotAxis::categories("", &names));
    plot.series(lines).series(on_steps)
}
