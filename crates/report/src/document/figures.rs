//! The figures of a study, chosen by its content.

use super::figure::{Drawn, quantile_note, y_axis};
use super::layout::{Layout, panel_title, sheet, x_of};
use super::lead::{lead_figures, lead_outputs};
use crate::plot::{Course, Plot, PlotAxis, Point, Scale, Series, Style};
use crate::results::Study;
use asobench_identification::metric::{Quantile, Statistics, Z};
use asobench_study::study::file::Key;
use asobench_study::study::{Better, CellSummary, Measure, TheoryReference, measure};
use asobench_study::text::number;

/// Largest number of outputs for which marks of theory can still be distinguished.
const MOST_MARKS: usize = 4;

/// With fewer trials than this, quartiles are drawn, because the interval of a median says little.
const FEW: u64 = 100;

/// Largest number of figures of a study.
const FIGURES: usize = 6;

/// The figures of a study, the most informative ones if there are too many.
pub(super) fn figures(study: &Study) -> Vec<Drawn> {
    let lead = lead_figures(study);
    let first = lead.first().copied();
    let map = super::bound_grid::bound_grid(study);
    let all = [
        map.clone(),
        first.and_then(|measure| medians(study, measure)),
        super::passes::passes(study),
        super::passes::lost(study),
        super::method_times::times(study),
        map.is_none()
            .then(|| super::bound_shares::shares(study))
            .flatten(),
        first.and_then(|measure| ratios(study, measure)),
        super::coefficient_coverage::coverage(study),
        super::coefficient_bias::coefficients(study),
        super::state_error::curves(study),
    ];
    let rest = lead
        .iter()
        .skip(1)
        .filter_map(|measure| medians(study, *measure));
    let courses = super::courses::courses(&study.summary).into_iter();
    let mut drawn: Vec<Drawn> = courses
        .chain(all.into_iter().flatten())
        .chain(rest)
        .collect();
    drawn.truncate(FIGURES);
    drawn
}

fn quantiles(at: f64, statistics: &Statistics) -> Point {
    let values = [
        statistics.q05,
        statistics.q25,
        statistics.q50,
        statistics.q75,
        statistics.q95,
    ]
    .map(|q| q.value);
    Point::quantiles(at, values)
}

/// A value with its 95 % interval. On a logarithmic axis, it is the interval of the logarithm.
fn estimate(at: f64, quantile: Quantile, scale: &Scale) -> Point {
    if *scale == Scale::Log && quantile.value > 0.0 {
        let factor = (Z * quantile.mcse / quantile.value).exp();
        Point::interval(
            at,
            quantile.value,
            quantile.value / factor,
            quantile.value * factor,
        )
    } else {
        Point::uncertain(at, quantile.value, quantile.mcse)
    }
}

/// Whether a figure shows an output of a cell. It does not if most trials fail, because the median is then that of a
/// few. It also does not if the cell has no noise and other cells have, because every axis would then reach down to
/// rounding errors.
pub(super) fn is_shown(study: &Study, cell: &CellSummary, label: &str) -> bool {
    let output = study.output(cell, label);
    !study.is_quiet(cell) && output.is_some_and(|output| output.failed.low <= 0.5)
}

/// The part of a caption that says what is left out.
fn left_out(study: &Study, outputs: &[(usize, String)]) -> String {
    let cells = || study.summary.cells.iter();
    let failing = |cell: &&CellSummary| {
        let mut labels = outputs.iter().map(|(_, label)| label);
        labels.any(|label| {
            study
                .output(cell, label)
                .is_some_and(|output| output.failed.low > 0.5)
        })
    };
    let mut text = String::new();
    if cells().any(|cell| study.is_quiet(cell)) {
        text.push_str(
            " Cells without noise are in the table only: their errors are rounding errors.",
        );
    }
    if cells()
        .filter(|cell| !study.is_quiet(cell))
        .any(|cell| failing(&cell))
    {
        text.push_str(" Left out: outputs that fail in more than half of the trials.");
    }
    text
}

/// Whether all points have the same x on an axis with room for more.
fn at_one_place(plots: &[Plot]) -> bool {
    let series = plots.iter().flat_map(|plot| &plot.series);
    let mut places: Vec<f64> = series
        .flat_map(|series| series.points.iter().map(|point| point.x))
        .collect();
    places.sort_by(f64::total_cmp);
    places.dedup();
    let names = |plot: &Plot| matches!(&plot.x.scale, Scale::Categories(names) if names.len() < 2);
    places.len() < 2 && !plots.iter().any(names)
}

/// Medians of a measure over the axis, with the spread of the trials if there are few outputs.
pub(super) fn medians(study: &Study, measure: Measure) -> Option<Drawn> {
    let layout = Layout::new(study, x_of(study, measure), &[]);
    let outputs = lead_outputs(study);
    let style = match (layout.has_names, outputs.len()) {
        (true, ..=4) => Style::Boxes,
        (false, ..=3) if measure.scale() != measure::Scale::Percent => Style::Band,
        _ => Style::ErrorBars,
    };
    let few = study.summary.cells.iter().all(|cell| cell.trials < FEW);
    let point = |cell: &CellSummary, statistics: &Statistics| {
        let at = layout.at(study, cell);
        if style == Style::ErrorBars && few {
            Point::interval(
                at,
                statistics.q50.value,
                statistics.q25.value,
                statistics.q75.value,
            )
        } else if style == Style::ErrorBars {
            estimate(at, statistics.q50, &y_axis(measure).scale)
        } else {
            quantiles(at, statistics)
        }
    };
    let draw = |panel: &super::layout::Choice| {
        let cells = layout.along(study, panel);
        let mut plot = Plot::new(
            panel_title(panel, &cells),
            layout.axis(study),
            y_axis(measure),
        );
        for (slot, label) in &outputs {
            let points = cells
                .iter()
                .filter(|cell| is_shown(study, cell, label))
                .filter_map(|cell| Some(point(cell, study.statistics(cell, label, measure)?)));
            let points: Vec<Point> = points.filter(|point| point.y.is_finite()).collect();
            plot = plot.series(Series::new(label, style, points).slot(*slot));
        }
        let plot = theory(study, &layout, measure, &cells, plot);
        references(study, &layout, measure, &cells, plot)
    };
    let plots: Vec<Plot> = layout.panels.iter().map(draw).collect();
    if layout.x.is_some() && at_one_place(&plots) {
        return None;
    }
    let name = measure.label();
    let what = match style {
        Style::Band => "Lines are medians, bands hold the middle 90 % of the trials.",
        Style::Boxes => {
            "Boxes hold the middle half of the trials, whiskers the middle 90 %, the line is the \
            median."
        }
        _ if few => "Medians with the middle half of the trials.",
        _ => "Medians with their 95 % intervals.",
    };
    let title = format!("{}: {name}", study.title());
    let (svg, note) = sheet(&title, &format!("{name} by output. {what}"), plots)?;
    let caption = format!(
        "{what}{note}{}{}{} {}",
        limits(study, &layout, measure),
        left_out(study, &outputs),
        layout.held_text(),
        quantile_note(study)
    );
    Some(Drawn {
        name: measure.name().to_owned(),
        svg,
        caption,
    })
}

/// The part of a caption that explains the lines of theory.
fn limits(study: &Study, layout: &Layout, measure: Measure) -> &'static str {
    if is_crowded(study, layout) {
        return "";
    }
    let outputs = study.summary.cells.iter().flat_map(|cell| &cell.outputs);
    let mut known = outputs.filter(|output| output.theory.contains_key(&measure));
    match known.next() {
        Some(_) => " Lines of theory and Cramer-Rao bounds are the medians expected for large N.",
        None => "",
    }
}

/// Whether marks of theory would be lost among those of many outputs. An axis of names has marks instead of lines.
fn is_crowded(study: &Study, layout: &Layout) -> bool {
    layout.has_names && lead_outputs(study).len() > MOST_MARKS
}

/// Adds theory as N grows: the medians under the bounds, as one line if they agree, and the median of the last output.
fn theory(
    study: &Study,
    layout: &Layout,
    measure: Measure,
    cells: &[&CellSummary],
    mut plot: Plot,
) -> Plot {
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
    let style = if layout.has_names {
        Style::Marks
    } else {
        Style::Line
    };
    let [own, shared, separate] = [
        TheoryReference::Own,
        TheoryReference::Shared,
        TheoryReference::Separate,
    ]
    .map(points);
    let agree = |a: &[Point], b: &[Point]| {
        let close = |(a, b): (&Point, &Point)| (a.y / b.y - 1.0).abs() < 1e-6;
        a.len() == b.len() && a.iter().zip(b).all(close)
    };
    let mut lines = vec![("bound, separate".to_owned(), separate)];
    if !agree(&shared, &lines[0].1) {
        lines.insert(0, ("bound, shared".to_owned(), shared));
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
fn references(
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
            plot = plot.reference(
                "slope -1/2",
                Course::Sloped {
                    slope: -0.5,
                    through,
                },
            );
        }
    }
    plot
}

/// Ratios on the same trials, for the pairs that the file compares.
fn ratios(study: &Study, measure: Measure) -> Option<Drawn> {
    let pairs: Vec<(String, String)> = study
        .file
        .compare
        .iter()
        .take(6)
        .map(|[a, b]| (a.clone(), b.clone()))
        .collect();
    let layout = Layout::new(study, x_of(study, measure), &[]);
    let name = measure.label();
    let is_shown = |cell: &CellSummary, label: &str| is_shown(study, cell, label);
    let draw = |panel: &super::layout::Choice| {
        let mut cells = layout.along(study, panel);
        let axis = PlotAxis::log(format!("median ratio of {name}"));
        let mut plot = Plot::new(panel_title(panel, &cells), layout.axis(study), axis);
        cells.retain(|cell| {
            pairs
                .iter()
                .any(|(a, b)| is_shown(cell, a) && is_shown(cell, b))
        });
        for (first, second) in &pairs {
            let point = |cell: &&CellSummary| {
                let pair = cell
                    .comparisons
                    .iter()
                    .find(|pair| pair.first == *first && pair.second == *second)?;
                let ratio = pair.measures.get(&measure)?.median_ratio;
                let shown = ratio.value > 0.0 && is_shown(cell, first) && is_shown(cell, second);
                shown.then(|| estimate(layout.at(study, cell), ratio, &Scale::Log))
            };
            let points: Vec<Point> = cells.iter().filter_map(point).collect();
            let label = format!("{first} over {second}");
            plot = plot.series(Series::new(label, Style::ErrorBars, points));
        }
        plot.reference("equal", Course::Horizontal(1.0))
    };
    let mut plots: Vec<Plot> = layout.panels.iter().map(draw).collect();
    near_one(&mut plots);
    let title = format!("{}: {name} on the same trials", study.title());
    let better = match measure.better() {
        Better::Smaller => "; below 1 the first is better",
        Better::Larger => "; above 1 the first is better",
        Better::Neither => "",
    };
    let what = format!(
        "Medians over the trials of the ratio of two outputs on the same record, with 95 % \
        intervals{better}."
    );
    let (svg, note) = sheet(&title, &what, plots)?;
    Some(Drawn {
        name: format!("ratio-{}", measure.name()),
        svg,
        caption: format!(
            "{what} A trial in which one output failed counts as its loss, and one in which both failed as a tie. Pairs of which \
             one output fails in more than half of the trials are left out.{note}{}",
            layout.held_text()
        ),
    })
}

/// If all ratios are close to 1, makes the axis linear, with at least 5 % to either side.
fn near_one(plots: &mut [Plot]) {
    let series = plots.iter().flat_map(|plot| &plot.series);
    let ends = series.flat_map(|series| {
        series
            .points
            .iter()
            .flat_map(|point| [point.low, point.high])
    });
    let (least, most) = ends.fold((0.95_f64, 1.05_f64), |(least, most), y| {
        (least.min(y), most.max(y))
    });
    if least > 0.8 && most < 1.25 {
        for plot in plots {
            plot.y.scale = Scale::Linear;
            plot.y.range = Some((least - 0.005, most + 0.005));
        }
    }
}
