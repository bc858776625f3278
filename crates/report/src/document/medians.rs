//! The parts of figures of medians over a setting: points, theory, bounds, and the words of their captions.

use super::figure::{is_shown, over, subject};
use super::layout::{BEYOND, Layout};
use super::lead::lead_outputs;
use crate::plot::{Course, Plot, Point, Scale, Series, Style, extent, points};
use crate::results::Study;
use asobench_identification::metric::{Quantile, Statistics};
use asobench_study::study::file::Key;
use asobench_study::study::{Better, CellSummary, Measure, TheoryReference, measure};
use asobench_study::text::number;

/// Largest number of outputs for which marks of theory can still be distinguished.
const MOST_MARKS: usize = 4;

/// Largest number of outputs whose bands can be told apart.
const BANDS: usize = 3;

/// Largest number of outputs whose boxes have room side by side.
const BOXES: usize = 4;

/// The quantiles of a measure. One that falls among trials without the measure lies beyond the axis.
pub(super) fn quantiles(at: f64, statistics: &Statistics, measure: Measure) -> Point {
    let worst = match (measure.entry().better, measure.entry().scale) {
        (Better::Smaller, measure::Scale::Log) => BEYOND,
        _ => f64::NAN,
    };
    let value = |q: Quantile| if q.lost { worst } else { q.value };
    let q50 = statistics.q50.value;
    let [q05, q25, q75, q95] = [statistics.q05, statistics.q25, statistics.q75, statistics.q95].map(value);
    Point::quantiles(at, [q05, q25, q50, q75, q95])
}

/// The part of a caption that explains a band or a box that is open at the top.
pub(super) fn open_end(study: &Study, outputs: &[(usize, String)], measure: Measure) -> &'static str {
    let mut cells = study.summary.cells.iter();
    let is_open = cells.any(|cell| {
        outputs.iter().any(|(_, label)| {
            let statistics = study.statistics(cell, label, measure);
            let found = statistics.filter(|_| is_shown(study, cell, label));
            found.is_some_and(|of| of.q95.lost && !of.q50.lost)
        })
    });
    if is_open && measure.entry().better == Better::Smaller && measure.entry().scale == measure::Scale::Log {
        " Where it runs off the top, more than 5 % of the trials failed and rank as the worst."
    } else {
        ""
    }
}

/// Whether all points have the same x on an axis with room for more.
pub(super) fn at_one_place(plots: &[Plot]) -> bool {
    let (first, last) = extent(points(plots).map(|point| point.x));
    let names = |plot: &Plot| matches!(&plot.x.scale, Scale::Categories(names) if names.len() < 2);
    first >= last && !plots.iter().any(names)
}

/// "Error of a over N: median and middle 90 % of the trials".
pub(super) fn title(measure: Measure, style: Style, layout: &Layout) -> String {
    let (subject, over) = (subject(measure), over(layout));
    match style {
        Style::Band | Style::Boxes => {
            format!("{subject}{over}, median and middle 90 % of the trials")
        }
        _ => format!("median {subject}{over}"),
    }
}

/// How medians are drawn: with the spread of the trials if there are few outputs, or if the file says so.
pub(super) fn style(study: &Study, measure: Measure, layout: &Layout, outputs: usize, spread: Option<bool>) -> Style {
    let most = if layout.has_names { BOXES } else { BANDS };
    let is_wanted = spread.or(study.file.spread).unwrap_or(outputs <= most);
    match (is_wanted, layout.has_names) {
        (true, true) => Style::Boxes,
        (true, false) if measure.entry().scale != measure::Scale::Percent => Style::Band,
        _ => Style::ErrorBars,
    }
}

/// The words of a caption on medians that are drawn so.
pub(super) fn how(style: Style, layout: &Layout, outputs: usize) -> &'static str {
    match style {
        Style::Band => "Lines are medians, bands hold the middle 90 % of the trials.",
        Style::Boxes => {
            "Boxes hold the middle half of the trials, whiskers the middle 90 %, the line is the \
            median."
        }
        _ if layout.has_names && outputs > BOXES => {
            "Medians with their 95 % intervals. With more than four outputs there are no boxes \
            (`spread = true` in the file draws them)."
        }
        _ if !layout.has_names && outputs > BANDS => {
            "Medians with their 95 % intervals. With more than three outputs there are no bands, which would hide \
            each other (`spread = true` in the file draws them)."
        }
        _ => "Medians with their 95 % intervals.",
    }
}

/// The part of a caption that explains the lines of theory.
pub(super) fn limits(study: &Study, layout: &Layout, measure: Measure) -> &'static str {
    if is_crowded(study, layout) {
        return "";
    }
    let outputs = study.summary.cells.iter().flat_map(|cell| &cell.outputs);
    let mut known = outputs.filter(|output| output.theory.contains_key(&measure));
    match known.next() {
        Some(_) => {
            " Theory and Cramer-Rao bounds are medians expected for large N; a bound is for noise with the poles of A \
             or with poles of its own."
        }
        None => "",
    }
}

/// Whether marks of theory would be lost among those of many outputs. An axis of names has marks instead of lines.
fn is_crowded(study: &Study, layout: &Layout) -> bool {
    layout.has_names && lead_outputs(study).len() > MOST_MARKS
}

/// Adds theory as N grows: the medians under the bounds, as one line if they agree, and the median of the last output.
pub(super) fn theory(study: &Study, layout: &Layout, measure: Measure, cells: &[&CellSummary], mut plot: Plot) -> Plot {
    let outputs = lead_outputs(study);
    let Some((_, label)) = outputs.last().filter(|_| !is_crowded(study, layout)) else {
        return plot;
    };
    let points = |reference: TheoryReference| -> Vec<Point> {
        let point = |cell: &&CellSummary| {
            let theory = study.output(cell, label)?.theory.get(&measure)?;
            let error = theory.reference(reference)?;
            Some(Point::new(layout.at(study, cell), error.median))
        };
        cells.iter().filter_map(point).collect()
    };
    let style = if layout.has_names { Style::Marks } else { Style::Line };
    let [own, shared, separate] =
        [TheoryReference::Own, TheoryReference::Shared, TheoryReference::Separate].map(points);
    let agree = |a: &[Point], b: &[Point]| {
        let close = |(a, b): (&Point, &Point)| (a.y / b.y - 1.0).abs() < 1e-6;
        a.len() == b.len() && a.iter().zip(b).all(close)
    };
    let mut lines = vec![("Cramer-Rao bound, own poles".to_owned(), separate)];
    if !agree(&shared, &lines[0].1) {
        lines.insert(0, ("Cramer-Rao bound, poles of A".to_owned(), shared));
    }
    let is_new = lines.iter().all(|(_, points)| !agree(points, &own));
    let own = is_new.then(|| (format!("theory of {label}"), own));
    for (name, points) in lines.into_iter().chain(own) {
        if !points.is_empty() {
            plot = plot.series(Series::new(name, style, points));
        }
    }
    plot
}

/// Adds the bounds of the measure, and a slope of -1/2 if the file asks for slopes over this axis.
pub(super) fn references(
    study: &Study,
    layout: &Layout,
    measure: Measure,
    cells: &[&CellSummary],
    mut plot: Plot,
) -> Plot {
    if layout.x != Some(Key::Claim) {
        let bounds = cells
            .iter()
            .flat_map(|cell| &cell.bounds)
            .filter(|bound| bound.bound.measure == measure);
        let mut limits: Vec<(f64, String)> = bounds
            .filter_map(|bound| {
                let claim = bound.bound.claim.as_deref().unwrap_or_default();
                let limit = bound.bound.below?;
                Some((limit, format!("bound {claim}").trim().to_owned()))
            })
            .collect();
        limits.sort_by(|a, b| a.0.total_cmp(&b.0));
        limits.dedup();
        for (limit, name) in limits.into_iter().take(3) {
            let name = format!("{name}, {}", number(limit));
            plot = plot.reference(name, Course::Horizontal(limit));
        }
    }
    let sloped = study
        .file
        .slopes
        .iter()
        .any(|slope| Some(slope.over) == layout.x && slope.measure == measure);
    let output = lead_outputs(study).pop();
    if let (true, Some((_, label))) = (sloped, output) {
        let mut points = cells.iter().map(|cell| {
            let statistics = study.statistics(cell, &label, measure);
            let median = statistics.map_or(f64::NAN, |statistics| statistics.q50.value);
            (layout.at(study, cell), median)
        });
        let through = points.rfind(|(_, y)| y.is_finite());
        if let Some(through) = through {
            plot = plot.reference("slope -1/2", Course::Sloped { slope: -0.5, through });
        }
    }
    plot
}
