//! The figure of the bias of the coefficients.

use super::figure::{Drawn, Figure, WHOSE, level, series_of};
use super::layout::Layout;
use super::lead::lead_outputs;
use crate::plot::{PlotAxis, Point, Style};
use crate::results::Study;
use asobench_identification::metric::Statistics;
use asobench_study::study::file::Key;

/// Largest number of outputs that can be distinguished.
const OUTPUTS: usize = 4;

/// Bias, its error and the scatter of one coefficient; from quantiles if one trial dominates the moments.
fn bias_of(error: &Statistics) -> (f64, f64, f64) {
    if error.dominated || !error.mean.value.is_finite() {
        let scatter = (error.q75.value - error.q25.value) / 1.349;
        (error.q50.value, error.q50.mcse, scatter)
    } else {
        (error.mean.value, error.mean.mcse, error.sd.value)
    }
}

/// The bias of every coefficient in units of its standard deviation.
pub(super) fn bias(study: &Study) -> Option<Drawn> {
    let mut outputs = lead_outputs(study);
    // The bias of iteration 0 may be so large that it hides everything else.
    let is_later = |label: &str| {
        let cell = study.summary.cells.first();
        let output = cell.and_then(|cell| study.output(cell, label));
        output.is_some_and(|output| output.pass > 0)
    };
    if outputs.iter().any(|(_, label)| is_later(label)) {
        outputs.retain(|(_, label)| is_later(label));
    }
    outputs.truncate(OUTPUTS);
    let all = study.summary.cells.iter().flat_map(|cell| &cell.outputs);
    let largest = all.max_by_key(|output| output.parameters.len())?;
    let names: Vec<&String> = largest.parameters.iter().map(|(name, _)| name).collect();
    let order = |key: Key| match key {
        Key::Feedback => 0,
        Key::Noise => 1,
        _ => 2,
    };
    Figure {
        name: "bias",
        title: "bias of each coefficient",
        what: "Mean signed error of each coefficient over its standard deviation, with 95 % intervals. If one trial \
               dominates the moments: the median over the interquartile range / 1.349.",
        end: &format!(" {WHOSE}"),
        x: Some(PlotAxis::categories("coefficient of the state space", &names)),
        series: series_of(&outputs, Style::ErrorBars),
        points: &|i, cell, _| {
            let output = study.output(cell, &outputs[i].1);
            let known = output.filter(|output| output.failed.low <= 0.5);
            let parameters = known.iter().flat_map(|output| &output.parameters);
            let point = |(i, (_, statistics)): (usize, &(String, Statistics))| {
                let (bias, error, scatter) = bias_of(statistics);
                Point::uncertain(i as f64, bias / scatter, error / scatter)
            };
            let points = parameters.enumerate().map(point);
            points.filter(|point| point.y.is_finite()).collect()
        },
        guides: &level("no bias", 0.0),
        ..Figure::new(
            &Layout::by(study, None, &[], order),
            PlotAxis::linear("bias over standard deviation"),
        )
    }
    .draw(study)
}
