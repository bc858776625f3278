//! Figures 1 to 3 of Nikolov et al. as distributions: e_x(k), e_a and e_b over k, with median and 5-95 % band.

use super::plot::{Course, Plot, PlotAxis, Point, Series, Sharing, Style, small_multiples};
use crate::metric::Statistics;
use crate::study::{CellSummary, CurveQuantiles, Measure};

/// The quantiles of a curve over k; undefined where missing.
pub(super) fn curve(curve: &CurveQuantiles) -> Vec<Point> {
    let value = |quantiles: &[Option<f64>], k: usize| {
        quantiles.get(k).copied().flatten().unwrap_or(f64::NAN)
    };
    let point = |k: usize| {
        let [low, middle, high] =
            [&curve.q05, &curve.q50, &curve.q95].map(|quantiles| value(quantiles, k));
        Point::interval(k as f64, middle, low, high)
    };
    (0..curve.q50.len()).map(point).collect()
}

/// A constant from k = N to K - 1, because the estimate is made once.
fn constant(statistics: &Statistics, cell: &CellSummary) -> Vec<Point> {
    let point = |k: usize| {
        Point::interval(
            k as f64,
            statistics.q50.value,
            statistics.q05.value,
            statistics.q95.value,
        )
    };
    let ends = [cell.window, cell.horizon.saturating_sub(1)]
        .into_iter()
        .filter(|_| statistics.count > 0);
    ends.map(point).collect()
}

/// One of the three plots: the first and the last output, and the paper's bound.
fn panel(cell: &CellSummary, measure: Measure, name: &str, label: &str) -> Plot {
    let x = PlotAxis::linear("k, samples").range(0.0, cell.horizon as f64);
    let mut plot = Plot::new("", x, PlotAxis::log(label));
    let outputs = [cell.outputs.first(), cell.outputs.last()];
    for (i, output) in outputs.into_iter().enumerate() {
        let Some(output) = output else { continue };
        let points = match (measure, &cell.curves) {
            (Measure::ExMax, curves) => curves.as_ref().map(|curves| curve(&curves[i])),
            _ => output
                .measures
                .get(&measure)
                .map(|statistics| constant(statistics, cell)),
        };
        let label = format!("{}: median, 5-95 %", output.label());
        plot = plot.series(Series::new(label, Style::Band, points.unwrap_or_default()).slot(i));
    }
    let bound = cell
        .bounds
        .iter()
        .find(|bound| bound.bound.measure == measure);
    if let Some(bound) = bound.map(|bound| &bound.bound) {
        let every = if measure == Measure::ExMax {
            " on every k >= N"
        } else {
            ""
        };
        plot.title = format!("The paper's bound{every}: {name} {}", bound.text());
        if let (Some(value), None) = (bound.below, bound.rounding) {
            plot = plot.reference("the paper's bound", Course::Horizontal(value));
        }
    }
    plot.reference("k = N", Course::Vertical(cell.window as f64))
}

/// Draws one cell as an SVG document: e_x(k) above, e_a and e_b below, each with the paper's bound.
pub fn draw(cell: &CellSummary) -> String {
    let noise = if cell.eta == 0.0 {
        "noise-free".to_owned()
    } else {
        format!("noise level {} %", cell.eta)
    };
    let (claim, window, trials) = (&cell.claim, cell.window, cell.trials);
    let title = format!("{claim}: {noise}, N = {window}, {trials} trials");
    let panels = [
        panel(
            cell,
            Measure::ExMax,
            "e_x",
            "e_x(k), relative (bins of 6 %)",
        ),
        panel(cell, Measure::Ea, "e_a", "e_a, relative"),
        panel(cell, Measure::Eb, "e_b", "e_b, relative"),
    ];
    let what = "Medians of e_x(k), e_a and e_b over k, bands hold the middle 90 % of the trials.";
    small_multiples(&title, what, &panels, 1, Sharing { x: true, y: false })
}
