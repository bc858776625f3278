//! The figures of errors over the samples seen, `[course]`.

use super::figure::{Drawn, Figure, series_of};
use super::layout::Layout;
use super::lead::lead_outputs;
use crate::plot::{Course, PlotAxis, Point, Style};
use crate::results::Study;
use asobench_study::study::{CourseQuantiles, CourseSummary};

/// An error of a course: its name, and where it stands.
type Error = (&'static str, fn(&CourseSummary) -> &CourseQuantiles);

const ERRORS: [Error; 3] = [
    ("e_a", |course| &course.e_a),
    ("e_x", |course| &course.e_x),
    ("e_b", |course| &course.e_b),
];

/// Medians of e_a(k), e_x(k) and e_b(k) over k.
pub(super) fn along(study: &Study) -> Vec<Drawn> {
    let Some(table) = &study.file.course else {
        return Vec::new();
    };
    let outputs = lead_outputs(study);
    let layout = Layout::new(study, None, &[]);
    let draw = |(name, of): Error| {
        Figure {
            name: &format!("along-{}", name.replace('_', "-")),
            title: &format!("{name}(k) over the samples seen"),
            what: &format!("Medians of {name}(k) of each method that has seen k samples."),
            about: " A trial without a model counts as worst; nothing is drawn where most have none.",
            x: Some(PlotAxis::linear("k, samples seen")),
            series: series_of(&outputs, Style::Line),
            points: &|i, cell, _| {
                let course = study.output(cell, &outputs[i].1).and_then(|of| of.course.as_ref());
                let Some(course) = course else {
                    return Vec::new();
                };
                let medians = course.k.iter().zip(&of(course).quantiles.q50);
                let medians = medians.filter_map(|(k, y)| Some(Point::new(*k as f64, (*y)?)));
                medians.collect()
            },
            guides: &|cells, plot| {
                let mut changes = cells.iter().filter_map(|cell| {
                    let name = cell.setting(asobench_study::study::file::Key::Change);
                    study.file.changes.get(&name)
                });
                let mut plot = plot.reference("bound", Course::Horizontal(table.bound));
                if let Some(change) = changes.next_back() {
                    plot = plot.reference("change", Course::Vertical(change.at as f64));
                }
                plot
            },
            ..Figure::new(&layout, PlotAxis::log(format!("{name}(k), relative")))
        }
        .draw(study)
    };
    ERRORS.into_iter().filter_map(draw).collect()
}
