//! The figures of the times of the methods, alone and below their errors.

use super::figure::{Drawn, Figure, estimate, over, series_of, subject, y_axis};
use super::layout::{Layout, panel_title, x_key};
use super::lead::{OUTPUTS, lead_figures};
use crate::plot::{Plot, PlotAxis, Point, Scale, Sharing, Style, distinct, small_multiples};
use crate::results::{Study, Time};
use asobench_study::study::CellSummary;

/// Largest number of panels side by side.
const ABREAST: usize = 3;

/// The methods that were timed, as many as a figure shows, with their places in the palette.
fn timed(study: &Study) -> Vec<(usize, String)> {
    let methods = distinct(study.times.iter().map(|time| &time.method));
    methods.into_iter().take(OUTPUTS).cloned().enumerate().collect()
}

/// The time of a method in a cell.
fn time_of(study: &Study, cell: &CellSummary, method: &str, at: f64) -> Option<Point> {
    let is_it = |time: &&Time| time.cell == cell.cell && time.method == method;
    let time = study.times.iter().find(is_it)?;
    Some(Point::interval(
        at,
        time.median_seconds,
        time.q25_seconds,
        time.q75_seconds,
    ))
}

fn time_axis() -> PlotAxis {
    PlotAxis::log("time of all passes, s")
}

/// Times of the methods.
pub(super) fn times(study: &Study) -> Option<Drawn> {
    let methods = timed(study);
    Figure {
        name: "times",
        title: "time of each method on one thread",
        what: "Median times on one thread; bars are quartiles. Only the times on this page depend on the machine that \
               ran the study.",
        series: series_of(&methods, Style::ErrorBars),
        points: &|i, cell, at| {
            let point = time_of(study, cell, &methods[i].1, at);
            point.into_iter().collect()
        },
        ..Figure::new(&Layout::new(study, x_key(study), &[]), time_axis())
    }
    .draw(study)
}

/// The errors of the methods above their times, a column for each panel; `None` where nothing varies along x, or
/// more than three panels would stand abreast.
pub(super) fn errors_and_times(study: &Study) -> Option<Drawn> {
    let methods = timed(study);
    let layout = Layout::new(study, x_key(study), &[]);
    let columns = layout.panels.len();
    let measure = lead_figures(study).first().copied()?;
    if methods.is_empty() || layout.has_names || columns > ABREAST || !layout.held.is_empty() {
        return None;
    }
    let row = |y: PlotAxis, point: &dyn Fn(&CellSummary, &str, f64) -> Option<Point>| {
        let panel = |panel| {
            let cells = layout.along(study, panel);
            let title = panel_title(panel, &cells);
            let mut plot = Plot::new(title, layout.axis(study), y.clone());
            plot.series = series_of(&methods, Style::ErrorBars);
            for (series, (_, method)) in plot.series.iter_mut().zip(&methods) {
                let points = cells.iter();
                let points = points.filter_map(|cell| point(cell, method, layout.at(study, cell)));
                series.points = points.collect();
            }
            plot
        };
        layout.panels.iter().map(panel).collect::<Vec<Plot>>()
    };
    // The last pass of a method is its result.
    let mut plots = row(y_axis(measure), &|cell, method, at| {
        let is_of = |output: &&asobench_study::study::OutputSummary| output.estimator == method;
        let label = cell.outputs.iter().rfind(is_of)?.label();
        let median = study.statistics(cell, &label, measure)?.q50;
        let point = estimate(at, median, &Scale::Log);
        (median.value.is_finite() && median.value > 0.0).then_some(point)
    });
    plots.extend(row(time_axis(), &|cell, method, at| time_of(study, cell, method, at)));
    let what = "Above the median errors of each method at its last pass, with 95 % intervals; below its median times \
                on one thread, with quartiles. Times depend on the machine that ran the study.";
    let (subject, over) = (subject(measure), over(&layout));
    let title = format!("{}: {subject} and time{over}", study.title());
    let sharing = Sharing { x: true, y: false };
    Some(Drawn {
        name: "errors-and-times".to_owned(),
        picture: small_multiples(&title, what, &plots, columns, sharing),
        caption: what.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::study;
    use super::*;

    /// A row has room for three levels, not for four.
    #[test]
    fn errors_stand_above_times_where_there_is_room() {
        let drawn = |eta: &str| {
            let settings = format!("eta = {eta}\nwindow = [98, 218, 418, 998, 1998]");
            let mut study = study(&format!("measures = [\"e_a\"]\n[settings]\n{settings}\n"));
            let time = |cell| Time {
                cell,
                method: "iv".to_owned(),
                median_seconds: 1e-4,
                q25_seconds: 0.9e-4,
                q75_seconds: 1.1e-4,
                rounds: Vec::new(),
            };
            study.times = (0..study.summary.cells.len()).map(time).collect();
            errors_and_times(&study)
        };
        let svg = drawn("[1, 2, 3]").expect("a figure").picture.wide.svg();
        let above = svg.find("e_a").expect("the errors");
        assert!(svg.rfind("time of all passes, s").expect("the times") > above);
        assert!(drawn("[1, 2, 3, 4]").is_none());
    }
}
