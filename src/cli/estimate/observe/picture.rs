//! The picture of an observer: y, its prediction, and the states.

use crate::cli::estimate::pictures::{over_time, points};
use crate::cli::estimate::report::Report;
use crate::report::plot::{Picture, Plot, Point, Series, Sharing, Style, small_multiples};
use crate::text::rounded;
use asobench_identification::{Fitted, Observation};

/// Standard deviations on each side of a band.
const WIDTH: f64 = 2.0;

/// Draws y with its prediction, and below each state with its band; y is advanced by the model's shift. Axes say what
/// was subtracted from y, and by which offset the first state differs from it.
pub(super) fn states(report: &Report, observer: &str, model: &Fitted, states: &Observation) -> Picture {
    let line = |label: &str, values: &[f64], slot: usize| {
        Series::new(label, Style::Line, points(report, 0, values)).slot(slot)
    };
    let of_output = report
        .subtracted()
        .map_or_else(|| "y".to_owned(), |[_, y]| format!("y less {y}"));
    let outputs = over_time(report, "output and its one-step prediction", &of_output)
        .series(line("measured", &report.record.y[model.shift..], 0))
        .series(line("predicted", &states.predictions, 1));
    let n = states.order;
    let panel =
        |i: usize| -> Plot {
            let points = states.states.iter().skip(i).step_by(n).enumerate().map(|(k, x)| {
                match states.deviations.get(k * n + i) {
                    Some(sd) => Point::interval(report.time(k), *x, x - WIDTH * sd, x + WIDTH * sd),
                    None => Point::new(report.time(k), *x),
                }
            });
            let (style, label) = if states.deviations.is_empty() {
                (Style::Line, "observed")
            } else {
                (Style::Band, "observed, +- 2 sd")
            };
            let series = Series::new(label, style, points.collect()).slot(2);
            let axis = match model.offset().filter(|_| i == 0) {
                Some(offset) => format!("x_1, of {of_output} less the offset {}", rounded(offset.value, 6)),
                None => format!("x_{}", i + 1),
            };
            over_time(report, &format!("state {}", i + 1), &axis).series(series)
        };
    let panels: Vec<Plot> = [outputs].into_iter().chain((0..n).map(panel)).collect();
    let title = format!("States of {}, observer {observer}", report.name());
    let description = "Above: the measured output and its prediction from the samples before. Below: the states.";
    let sharing = Sharing { x: true, y: false };
    small_multiples(&title, description, &panels, 1, sharing)
}
