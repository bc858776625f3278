//! The course of the first trial in continuous time: theta_hat(t) and the state errors, Figs. 1 to 4 of Bobtsov et al.

use super::figure::Drawn;
use crate::folder::Files;
use crate::plot::{Course, Plot, PlotAxis, Point, Series, Sharing, Style, small_multiples};
use asobench_study::study::{CellSummary, OutputTrace, Summary, Traces};
use asobench_study::text::number;

/// The second figure of the state errors begins at this share of the time.
const LATE: f64 = 0.2;

/// The figures of the last cell with a stored course, if there is one.
pub(super) fn courses(summary: &Summary) -> Vec<Drawn> {
    let with = |cell: &&CellSummary| cell.traces.is_some();
    let Some(cell) = summary.cells.iter().rfind(with) else {
        return Vec::new();
    };
    let Some(traces) = &cell.traces else {
        return Vec::new();
    };
    let places = 0..traces.theta.len();
    let late = LATE * traces.times.last().copied().unwrap_or_default();
    let theta = places.clone().map(|i| of_theta(cell, traces, i)).collect();
    let state = |from: f64| -> Vec<Plot> {
        let places = places.clone();
        places.map(|i| of_state(cell, traces, i, from)).collect()
    };
    [
        (
            "theta",
            "estimates of theta over time",
            "theta_hat(t) of the first trial; dashed: the true theta = x(0) - xi(0).".to_owned(),
            theta,
        ),
        (
            "state-errors",
            "errors of the state over time",
            "x_i - xhat_i of the first trial.".to_owned(),
            state(0.0),
        ),
        (
            "state-errors-late",
            "errors of the state after the transients",
            format!(
                "x_i - xhat_i of the first trial from {} s on.",
                number(late)
            ),
            state(late),
        ),
    ]
    .into_iter()
    .map(
        |(name, title, caption, plots): (&str, &str, String, Vec<Plot>)| {
            let title = format!("{}: {title}", summary.title);
            let sharing = Sharing { x: true, y: false };
            Drawn {
                name: name.to_owned(),
                svg: small_multiples(&title, &caption, &plots, 2, sharing),
                caption,
            }
        },
    )
    .collect()
}

/// The figures as files.
pub fn course_figures(summary: &Summary) -> Files {
    let drawn = courses(summary).into_iter();
    drawn
        .map(|drawn| (format!("{}.svg", drawn.name), drawn.svg))
        .collect()
}

/// The points of a course.
fn points(times: &[f64], values: impl Iterator<Item = f64>) -> Vec<Point> {
    times
        .iter()
        .zip(values)
        .map(|(t, value)| Point::new(*t, value))
        .collect()
}

/// The series of every output that has component i.
fn series<'a>(
    cell: &'a CellSummary,
    traces: &'a Traces,
    values: impl Fn(&'a OutputTrace) -> Option<Vec<f64>>,
) -> Vec<Series> {
    let outputs = cell.outputs.iter().zip(&traces.outputs).enumerate();
    outputs
        .filter_map(|(slot, (output, trace))| {
            let points = points(&traces.times, values(trace)?.into_iter());
            Some(Series::new(output.label(), Style::Line, points).slot(slot))
        })
        .collect()
}

fn of_theta(cell: &CellSummary, traces: &Traces, i: usize) -> Plot {
    let mut plot = Plot::new(
        "",
        PlotAxis::linear("t, s"),
        PlotAxis::linear(format!("theta_hat_{}", i + 1)),
    );
    plot.series = series(cell, traces, |trace| trace.theta_hat.get(i).cloned());
    plot.reference("true theta_i", Course::Horizontal(traces.theta[i]))
}

/// The errors of x_i from a time on.
fn of_state(cell: &CellSummary, traces: &Traces, i: usize, from: f64) -> Plot {
    let x = &traces.x[i];
    let error = |trace: &OutputTrace| -> Option<Vec<f64>> {
        let x_hat = trace.x_hat.get(i)?;
        Some(x.iter().zip(x_hat).map(|(x, x_hat)| x - x_hat).collect())
    };
    let y = PlotAxis::linear(format!("x_{0} - xhat_{0}", i + 1));
    let mut plot = Plot::new("", PlotAxis::linear("t, s"), y);
    plot.series = series(cell, traces, error);
    for series in &mut plot.series {
        series.points.retain(|point| point.x >= from);
    }
    plot
}
