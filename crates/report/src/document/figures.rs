//! The figures of a study, chosen by its content.

use super::figure::{
    Drawn, Figure, estimate, is_shown, left_out, level, over, quantile_note, series_of, subject,
    y_axis,
};
use super::layout::{BEYOND, Layout, x_of};
use super::lead::{lead_figures, lead_outputs};
use super::zip_plot::{Zipped, zip_plot};
use crate::plot::{Course, Plot, PlotAxis, Point, Scale, Series, Style};
use crate::results::Study;
use asobench_identification::metric::{Quantile, Statistics};
use asobench_study::study::file::Key;
use asobench_study::study::{
    Better, CellSummary, ComparisonSummary, Measure, TheoryReference, measure,
};
use asobench_study::text::number;

/// Largest number of outputs for which marks of theory can still be distinguished.
const MOST_MARKS: usize = 4;

/// Largest number of outputs whose bands can be told apart.
const BANDS: usize = 3;

/// Largest number of outputs whose boxes have room side by side.
const BOXES: usize = 4;

/// With fewer trials than this, quartiles are drawn, because the interval of a median says little.
const FEW: u64 = 100;

/// Largest number of pairs in a figure.
const PAIRS: usize = 6;

/// Largest number of figures of a study.
const FIGURES: usize = 7;

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
        super::method_times::errors_and_times(study),
        super::method_times::times(study),
        map.is_none()
            .then(|| super::bound_shares::shares(study))
            .flatten(),
        first.and_then(|measure| ratios(study, measure)),
        super::coefficient_coverage::coverage(study),
        zipped(study),
        first.and_then(|measure| nested(study, measure)),
        super::coefficient_bias::bias(study),
        super::state_error::curves(study),
    ];
    let rest = lead
        .iter()
        .skip(1)
        .filter_map(|measure| medians(study, *measure));
    let courses = super::courses::courses(&study.summary).into_iter();
    let mut drawn: Vec<Drawn> = courses
        .chain(super::along::along(study))
        .chain(all.into_iter().flatten())
        .chain(rest)
        .collect();
    drawn.truncate(FIGURES);
    drawn
}

/// The zip plot of a study that kept its trials and their intervals.
fn zipped(study: &Study) -> Option<Drawn> {
    let drawn = || zip_plot(study, &Zipped::default()).ok();
    study.keeps_intervals().then(drawn).flatten()
}

/// The nested-loop plot of a study with more settings than other figures can show.
fn nested(study: &Study, measure: Measure) -> Option<Drawn> {
    let is_held = !Layout::new(study, x_of(study, measure), &[])
        .held
        .is_empty();
    let fits = is_held && super::nested_loop::fits(study);
    fits.then(|| super::nested_loop::nested_loop(study, measure, None, (None, None)))
        .flatten()
}

/// The quantiles of a measure. One that falls among trials without the measure lies beyond the axis.
pub(super) fn quantiles(at: f64, statistics: &Statistics, measure: Measure) -> Point {
    let worst = match (measure.better(), measure.scale()) {
        (Better::Smaller, measure::Scale::Log) => BEYOND,
        _ => f64::NAN,
    };
    let value = |q: Quantile| if q.lost { worst } else { q.value };
    let q50 = statistics.q50.value;
    let [q05, q25, q75, q95] = [
        statistics.q05,
        statistics.q25,
        statistics.q75,
        statistics.q95,
    ]
    .map(value);
    Point::quantiles(at, [q05, q25, q50, q75, q95])
}

/// The part of a caption that explains a band or a box that is open at the top.
pub(super) fn open_end(
    study: &Study,
    outputs: &[(usize, String)],
    measure: Measure,
) -> &'static str {
    let mut cells = study.summary.cells.iter();
    let is_open = cells.any(|cell| {
        outputs.iter().any(|(_, label)| {
            let statistics = study.statistics(cell, label, measure);
            let found = statistics.filter(|_| is_shown(study, cell, label));
            found.is_some_and(|of| of.q95.lost && !of.q50.lost)
        })
    });
    if is_open && measure.better() == Better::Smaller && measure.scale() == measure::Scale::Log {
        " Where it runs off the top, more than 5 % of the trials failed and rank as the worst."
    } else {
        ""
    }
}

/// Whether all points have the same x on an axis with room for more.
pub(super) fn at_one_place(plots: &[Plot]) -> bool {
    let series = plots.iter().flat_map(|plot| &plot.series);
    let mut places: Vec<f64> = series
        .flat_map(|series| series.points.iter().map(|point| point.x))
        .collect();
    places.sort_by(f64::total_cmp);
    places.dedup();
    let names = |plot: &Plot| matches!(&plot.x.scale, Scale::Categories(names) if names.len() < 2);
    places.len() < 2 && !plots.iter().any(names)
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
pub(super) fn style(
    study: &Study,
    measure: Measure,
    layout: &Layout,
    outputs: usize,
    spread: Option<bool>,
) -> Style {
    let most = if layout.has_names { BOXES } else { BANDS };
    let is_wanted = spread.or(study.file.spread).unwrap_or(outputs <= most);
    match (is_wanted, layout.has_names) {
        (true, true) => Style::Boxes,
        (true, false) if measure.scale() != measure::Scale::Percent => Style::Band,
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

/// Medians of a measure over the axis, with the spread of the trials if there are few outputs.
pub(super) fn medians(study: &Study, measure: Measure) -> Option<Drawn> {
    let layout = Layout::new(study, x_of(study, measure), &[]);
    let outputs = lead_outputs(study);
    let style = style(study, measure, &layout, outputs.len(), None);
    let few = study.summary.cells.iter().all(|cell| cell.trials < FEW);
    let y = y_axis(measure);
    let point = |at: f64, statistics: &Statistics| match style {
        Style::ErrorBars if few => {
            let [low, middle, high] =
                [statistics.q25, statistics.q50, statistics.q75].map(|quantile| quantile.value);
            Point::interval(at, middle, low, high)
        }
        Style::ErrorBars => estimate(at, statistics.q50, &y.scale),
        _ => quantiles(at, statistics, measure),
    };
    let name = measure.label();
    let what = match style {
        Style::ErrorBars if few => "Medians with the middle half of the trials.",
        _ => how(style, &layout, outputs.len()),
    };
    let limits = limits(study, &layout, measure);
    let open = match style {
        Style::ErrorBars => "",
        _ => open_end(study, &outputs, measure),
    };
    Figure {
        name: measure.name(),
        title: &title(measure, style, &layout),
        of: &format!("{name} by output. "),
        what,
        left_out: &format!("{open}{limits}{}", left_out(study, &outputs)),
        end: &format!(" {}", quantile_note(study)),
        series: series_of(&outputs, style),
        points: &|i, cell, at| {
            let label = &outputs[i].1;
            let statistics = study.statistics(cell, label, measure);
            let shown = statistics.filter(|_| is_shown(study, cell, label));
            let point = shown.map(|statistics| point(at, statistics));
            point
                .filter(|point| point.y.is_finite())
                .into_iter()
                .collect()
        },
        guides: &|cells, plot| {
            let plot = theory(study, &layout, measure, cells, plot);
            references(study, &layout, measure, cells, plot)
        },
        finish: &|plots| layout.x.is_none() || !at_one_place(plots),
        ..Figure::new(&layout, y.clone())
    }
    .draw(study)
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
pub(super) fn theory(
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
    let layout = Layout::new(study, x_of(study, measure), &[]);
    let pairs = &study.file.compare[..study.file.compare.len().min(PAIRS)];
    let series = |[first, second]: &[String; 2]| {
        Series::new(
            format!("{first} over {second}"),
            Style::ErrorBars,
            Vec::new(),
        )
    };
    let name = measure.label();
    let better = match measure.better() {
        Better::Smaller => "; below 1 the first is better",
        Better::Larger => "; above 1 the first is better",
        Better::Neither => "",
    };
    Figure {
        name: &format!("ratio-{}", measure.name()),
        title: &format!("ratio of the {} on the same records{}", subject(measure), over(&layout)),
        what: &format!(
            "Medians over the trials of the ratio of two outputs on the same record, with 95 % intervals{better}."
        ),
        about: " A trial in which one output failed counts as its loss, and one in which both failed as a tie. Pairs \
                of which one output fails in more than half of the trials are left out.",
        series: pairs.iter().map(series).collect(),
        points: &|i, cell, at| {
            let of = |pair: &&ComparisonSummary| [&pair.first, &pair.second] == pairs[i].each_ref();
            let pair = cell.comparisons.iter().find(of);
            let ratio = pair.and_then(|pair| Some(pair.measures.get(&measure)?.median_ratio));
            let is_shown = || pairs[i].iter().all(|label| is_shown(study, cell, label));
            let shown = ratio.filter(|ratio| ratio.value > 0.0 && is_shown());
            shown.map(|ratio| estimate(at, ratio, &Scale::Log)).into_iter().collect()
        },
        guides: &level("equal", 1.0),
        finish: &|plots| {
            near_one(plots);
            true
        },
        ..Figure::new(&layout, PlotAxis::log(format!("median ratio of {name}")))
    }
    .draw(study)
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
