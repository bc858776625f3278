//! The figure with the bias of every coefficient.

use super::figure::Drawn;
use super::layout::{Choice, Layout, panel_title, sheet};
use super::lead::lead_outputs;
use crate::plot::{Course, Plot, PlotAxis, Point, Series, Style};
use crate::results::Study;
use asobench_identification::metric::Statistics;
use asobench_study::study::file::Key;

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
pub(super) fn coefficients(study: &Study) -> Option<Drawn> {
    let outputs = lead_outputs(study);
    // The bias of iteration 0 may be so large that it hides everything else.
    let pass = |label: &str| {
        let cell = study.summary.cells.first()?;
        study.output(cell, label).map(|output| output.pass)
    };
    let several = outputs.iter().any(|(_, label)| pass(label) > Some(0));
    let labels: Vec<(usize, String)> = outputs
        .into_iter()
        .filter(|(_, label)| !several || pass(label) > Some(0))
        .take(4)
        .collect();
    let largest = study
        .summary
        .cells
        .iter()
        .flat_map(|cell| &cell.outputs)
        .max_by_key(|output| output.parameters.len())?;
    let names: Vec<String> = largest
        .parameters
        .iter()
        .map(|(name, _)| name.clone())
        .collect();
    if names.is_empty() {
        return None;
    }
    let order = |key: Key| {
        usize::from(key != Key::Feedback) + usize::from(key != Key::Feedback && key != Key::Noise)
    };
    let layout = Layout::by(study, None, &[], order);
    let draw = |panel: &Choice| {
        let cells = layout.cells(study, panel);
        let axis = PlotAxis::linear("bias over standard deviation");
        let mut plot = Plot::new(
            panel_title(panel, &cells),
            PlotAxis::categories("coefficient", &names),
            axis,
        );
        let Some(cell) = cells.first() else {
            return plot;
        };
        for (slot, label) in &labels {
            let output = study.output(cell, label);
            let Some(output) = output.filter(|output| output.failed.low <= 0.5) else {
                continue;
            };
            let points = output
                .parameters
                .iter()
                .enumerate()
                .filter_map(|(i, (_, statistics))| {
                    let (bias, error, scatter) = bias_of(statistics);
                    let point = Point::uncertain(i as f64, bias / scatter, error / scatter);
                    point.y.is_finite().then_some(point)
                });
            plot = plot.series(Series::new(label, Style::ErrorBars, points.collect()).slot(*slot));
        }
        plot.reference("no bias", Course::Horizontal(0.0))
    };
    let plots: Vec<Plot> = layout.panels.iter().map(draw).collect();
    let what = "Mean signed error of each coefficient over its standard deviation, with 95 % \
        intervals. If one trial dominates the moments: the median over the interquartile range \
        / 1.349.";
    let (svg, note) = sheet(
        &format!("{}: bias of the coefficients", study.title()),
        what,
        plots,
    )?;
    Some(Drawn {
        name: "bias".to_owned(),
        svg,
        caption: format!("{what}{note}{}", layout.held_text()),
    })
}
