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
