//! The figure of the times of the methods.

use super::figure::Drawn;
use super::layout::{Choice, Layout, panel_title, sheet, x_key};
use super::lead::OUTPUTS;
use crate::plot::{Plot, PlotAxis, Point, Series, Style};
use crate::results::{Study, Time};
use std::collections::HashMap;

/// Times of the methods.
pub(super) fn times(study: &Study) -> Option<Drawn> {
    if study.times.is_empty() {
        return None;
    }
    let layout = Layout::new(study, x_key(study), &[]);
    let mut methods: Vec<&str> = Vec::new();
    let mut found: HashMap<(usize, &str), &Time> = HashMap::new();
    for time in &study.times {
        if methods.len() < OUTPUTS && !methods.contains(&time.method.as_str()) {
            methods.push(&time.method);
        }
        found.entry((time.cell, &time.method)).or_insert(time);
    }
    let draw = |panel: &Choice| {
        let cells = layout.along(study, panel);
        let mut plot = Plot::new(
            panel_title(panel, &cells),
            layout.axis(study),
            PlotAxis::log("time of all passes, s"),
        );
        for (slot, method) in methods.iter().enumerate() {
            let points = cells.iter().filter_map(|cell| {
                let time = found.get(&(cell.cell, *method))?;
                Some(Point::interval(
                    layout.at(study, cell),
                    time.median_seconds,
                    time.q25_seconds,
                    time.q75_seconds,
                ))
            });
            plot = plot.series(Series::new(*method, Style::ErrorBars, points.collect()).slot(slot));
        }
        plot
    };
    let plots: Vec<Plot> = layout.panels.iter().map(draw).collect();
    let what = "Median times on one thread; bars are quartiles. Only the times on this page depend on the machine \
        that ran the study.";
    let (svg, note) = sheet(&format!("{}: times", study.title()), what, plots)?;
    Some(Drawn {
        name: "times".to_owned(),
        svg,
        caption: format!("{what}{note}{}", layout.held_text()),
    })
}
