//! A figure of a study.

use crate::plot::PlotAxis;
use crate::results::Study;
use asobench_study::study::{Measure, measure};

/// A figure with its file name.
#[derive(Clone, Debug)]
pub(super) struct Drawn {
    /// The file name without folder and extension.
    pub name: String,
    /// The SVG document.
    pub svg: String,
    /// The caption.
    pub caption: String,
}

/// Explains the quantiles and their accuracy.
pub(super) fn quantile_note(study: &Study) -> String {
    let percent = 100.0 * study.summary.quantile_relative_error;
    format!(
        "Quantiles are over all trials, failed ones counted as worst and unstable models as estimated; they come from bins with a relative error below \
        {percent:.2} %."
    )
}

/// The y axis of a measure.
pub(super) fn y_axis(measure: Measure) -> PlotAxis {
    let label = measure.axis_label();
    match measure.scale() {
        measure::Scale::Log => PlotAxis::log(label),
        measure::Scale::Linear => PlotAxis::linear(label),
        measure::Scale::Percent => PlotAxis::linear(label).range(-20.0, 100.0),
    }
}
