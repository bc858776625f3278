//! The figure of the times of the methods.

use super::figure::{Drawn, Figure, series_of};
use super::layout::{Layout, x_key};
use super::lead::OUTPUTS;
use crate::plot::{PlotAxis, Point, Style};
use crate::results::{Study, Time};
use std::collections::HashMap;

/// Times of the methods.
pub(super) fn times(study: &Study) -> Option<Drawn> {
    let mut methods: Vec<(usize, String)> = Vec::new();
    let mut found: HashMap<(usize, &str), &Time> = HashMap::new();
    for time in &study.times {
        let is_known = methods.iter().any(|(_, method)| *method == time.method);
        if methods.len() < OUTPUTS && !is_known {
            methods.push((methods.len(), time.method.clone()));
        }
        found.entry((time.cell, &time.method)).or_insert(time);
    }
    Figure {
        name: "times",
        title: "time of each method on one thread",
        what: "Median times on one thread; bars are quartiles. Only the times on this page depend on the machine that \
               ran the study.",
        series: series_of(&methods, Style::ErrorBars),
        points: &|i, cell, at| {
            let time = found.get(&(cell.cell, methods[i].1.as_str()));
            let point = |time: &&Time| {
                Point::interval(at, time.median_seconds, time.q25_seconds, time.q75_seconds)
            };
            time.map(point).into_iter().collect()
        },
        ..Figure::new(&Layout::new(study, x_key(study), &[]), PlotAxis::log("time of all passes, s"))
    }
    .draw(study)
}
