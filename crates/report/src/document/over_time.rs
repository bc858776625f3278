//! Figures over time: e_x(k), the errors over the samples seen (`[course]`), and in continuous time the course of the
//! first trial, theta_hat(t) and the state errors, Figs. 1 to 4 of Bobtsov et al.

use super::figure::{Drawn, Figure, series_of};
use super::layout::Layout;
use super::lead::{OUTPUTS, lead_outputs};
use crate::figures::curve;
use crate::folder::Files;
use crate::plot::{Course, Plot, PlotAxis, Point, Series, Sharing, Style, small_multiples};
use crate::results::{Study, words};
use asobench_study::study::file::Key;
use asobench_study::study::{CURVE_TRIALS, CellSummary, CourseQuantiles, CourseSummary, OutputTrace, Summary, Traces};
use asobench_study::text::number;

/// e_x(k) over k.
pub(super) fn curves(study: &Study) -> Option<Drawn> {
    let gains = study.values(Key::Gain);
    let several = gains.len() > 1;
    let labels = study.labels();
    let ends = [labels.first(), labels.last()].map(|label| label.cloned().unwrap_or_default());
    let what = if several {
        format!("Medians of e_x(k) with {} for each gain.", ends[1])
    } else {
        "Medians of e_x(k), bands hold the middle 90 % of the trials.".to_owned()
    };
    let of_gain = |gain| Series::new(words(Key::Gain, gain), Style::Line, Vec::new());
    let (used, series): (&[Key], _) = if several {
        let series = gains.iter().take(OUTPUTS).map(|gain| of_gain(gain));
        (&[Key::Gain], series.collect())
    } else {
        let ends = ends.into_iter().enumerate().collect::<Vec<_>>();
        (&[], series_of(&ends, Style::Band))
    };
    let cells = study.summary.cells.iter();
    let first = match cells.map(|cell| cell.trials).max() {
        Some(trials) if trials > CURVE_TRIALS => {
            format!(" They are over the first {CURVE_TRIALS} trials of a cell.")
        }
        _ => String::new(),
    };
    let percent = 100.0 * study.summary.curve_relative_error;
    Figure {
        name: "curves",
        title: "error of the state over time",
        what: &what,
        about: &format!(
            " Before k = N it is the error of an observer run over the window once the estimate is made. Quantiles of \
             curves come from bins with a relative error below {percent:.1} %.{first}"
        ),
        x: Some(PlotAxis::linear("k, samples")),
        series,
        points: &|i, cell, _| match &cell.curves {
            Some([_, last]) if several && cell.setting(Key::Gain) == gains[i] => {
                let medians = curve(last).into_iter();
                medians.map(|point| Point::new(point.x, point.y)).collect()
            }
            Some(curves) if !several => curve(&curves[i]),
            _ => Vec::new(),
        },
        guides: &|cells, mut plot| {
            for cell in cells.iter().filter(|cell| cell.curves.is_some()) {
                plot = plot.reference("k = N", Course::Vertical(cell.window as f64));
            }
            plot.references.dedup();
            plot
        },
        ..Figure::new(&Layout::new(study, None, used), PlotAxis::log("e_x(k), relative"))
    }
    .draw(study)
}

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
                    let name = cell.setting(Key::Change);
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

/// The second figure of the state errors begins at this share of the time.
const LATE: f64 = 0.2;

/// The figures of the last cell with a stored course, if there is one.
pub(super) fn courses(summary: &Summary) -> Vec<Drawn> {
    let mut cells = summary.cells.iter().rev();
    let with = cells.find_map(|cell| Some((cell, cell.traces.as_ref()?)));
    let Some((cell, traces)) = with else {
        return Vec::new();
    };
    let late = LATE * traces.times.last().copied().unwrap_or_default();
    let theta = |i: usize| {
        let y = format!("theta_hat_{}", i + 1);
        let plot = panel(cell, traces, y, f64::NEG_INFINITY, |trace| {
            trace.theta_hat.get(i).cloned()
        });
        plot.reference("true theta_i", Course::Horizontal(traces.theta[i]))
    };
    let state = |i: usize, from: f64| {
        let y = format!("x_{0} - xhat_{0}", i + 1);
        panel(cell, traces, y, from, |trace| {
            let both = traces.x[i].iter().zip(trace.x_hat.get(i)?);
            Some(both.map(|(x, x_hat)| x - x_hat).collect())
        })
    };
    let draw = |name: &str, title: &str, caption: &str, panel: &dyn Fn(usize) -> Plot| {
        let plots: Vec<Plot> = (0..traces.theta.len()).map(panel).collect();
        let title = format!("{}: {title}", summary.title);
        let sharing = Sharing { x: true, y: false };
        Drawn {
            name: name.to_owned(),
            picture: small_multiples(&title, caption, &plots, 2, sharing),
            caption: caption.to_owned(),
        }
    };
    vec![
        draw(
            "theta",
            "estimates of theta over time",
            "theta_hat(t) of the first trial; dashed: the true theta = x(0) - xi(0).",
            &theta,
        ),
        draw(
            "state-errors",
            "errors of the state over time",
            "x_i - xhat_i of the first trial.",
            &|i| state(i, 0.0),
        ),
        draw(
            "state-errors-late",
            "errors of the state after the transients",
            &format!("x_i - xhat_i of the first trial from {} s on.", number(late)),
            &|i| state(i, late),
        ),
    ]
}

/// The figures as files.
pub fn course_figures(summary: &Summary) -> Files {
    let drawn = courses(summary).into_iter();
    drawn
        .map(|drawn| (format!("{}.svg", drawn.name), drawn.picture.wide.svg()))
        .collect()
}

/// A line for every output that has the values, from a time on.
fn panel(
    cell: &CellSummary,
    traces: &Traces,
    y: String,
    from: f64,
    values: impl Fn(&OutputTrace) -> Option<Vec<f64>>,
) -> Plot {
    let mut plot = Plot::new("", PlotAxis::linear("t, s"), PlotAxis::linear(y));
    let outputs = cell.outputs.iter().zip(&traces.outputs).enumerate();
    for (slot, (output, trace)) in outputs {
        let points = traces.times.iter().zip(values(trace).unwrap_or_default());
        let points = points.filter(|(t, _)| **t >= from);
        let points: Vec<Point> = points.map(|(t, value)| Point::new(*t, value)).collect();
        if !points.is_empty() {
            plot = plot.series(Series::new(output.label(), Style::Line, points).slot(slot));
        }
    }
    plot
}
