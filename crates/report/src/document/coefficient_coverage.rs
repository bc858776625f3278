//! The figure of the coverage of the 95 % intervals of the coefficients.

use super::figure::Drawn;
use super::layout::{Choice, Layout, panel_title, sheet, x_key};
use super::lead::lead_outputs;
use crate::plot::{Course, Plot, PlotAxis, Point, Series, Style};
use crate::results::Study;
use asobench_identification::metric::Coverage;
use asobench_study::study::CellSummary;

/// The nominal coverage of the intervals.
const NOMINAL: f64 = 0.95;

/// Largest number of outputs that can be distinguished.
const MOST: usize = 6;

/// The coverage for the worst coefficient of each output, along the setting with the most values. If nothing varies,
/// the coverage for every coefficient.
pub(super) fn coverage(study: &Study) -> Option<Drawn> {
    let outputs = lead_outputs(study);
    let has = |cell: &CellSummary, label: &str| {
        let output = study.output(cell, label);
        output.is_some_and(|output| !output.coverage.is_empty())
    };
    let mut labels = outputs;
    labels.retain(|(_, label)| study.summary.cells.iter().any(|cell| has(cell, label)));
    labels.truncate(MOST);
    let first = study.summary.cells.first()?;
    let along = x_key(study);
    let names: Vec<String> = labels
        .iter()
        .filter_map(|(_, label)| study.output(first, label))
        .map(|output| {
            output
                .coverage
                .iter()
                .map(|(name, _)| name.clone())
                .collect::<Vec<_>>()
        })
        .max_by_key(Vec::len)?;
    let layout = Layout::new(study, along, &[]);
    let draw = |panel: &Choice| {
        let cells = layout.along(study, panel);
        let x = match along {
            Some(_) => layout.axis(study),
            None => PlotAxis::categories("coefficient", &names),
        };
        let y = PlotAxis::linear("intervals that hold the truth, %");
        let mut plot = Plot::new(panel_title(panel, &cells), x, y);
        for (slot, label) in &labels {
            let point = |x: f64, coverage: &Coverage| {
                let [value, low, high] = [
                    coverage.covered.share,
                    coverage.covered.low,
                    coverage.covered.high,
                ]
                .map(|share| 100.0 * share);
                Point::interval(x, value, low, high)
            };
            let mut points = Vec::new();
            for cell in &cells {
                let Some(output) = study.output(cell, label) else {
                    continue;
                };
                if along.is_none() {
                    let all = output.coverage.iter().filter_map(|(name, coverage)| {
                        let at = names.iter().position(|other| other == name)?;
                        Some(point(at as f64, coverage))
                    });
                    points.extend(all);
                } else {
                    let of = |of: &&(String, Coverage)| (of.1.covered.share - NOMINAL).abs();
                    let worst = output
                        .coverage
                        .iter()
                        .max_by(|a, b| of(a).total_cmp(&of(b)));
                    points.extend(worst.map(|(_, worst)| point(layout.at(study, cell), worst)));
                }
            }
            plot = plot.series(Series::new(label, Style::ErrorBars, points).slot(*slot));
        }
        plot.reference("95 %", Course::Horizontal(100.0 * NOMINAL))
    };
    let plots: Vec<Plot> = layout.panels.iter().map(draw).collect();
    let of = if along.is_some() {
        "the coefficient whose coverage is farthest from 95 %"
    } else {
        "each coefficient"
    };
    let what = format!(
        "How often the 95 % interval of a method holds the truth, for {of}, with Wilson's intervals; trials without a \
        standard error are left out."
    );
    let title = format!("{}: coverage", study.title());
    let (svg, note) = sheet(&title, &what, plots)?;
    Some(Drawn {
        name: "coverage".to_owned(),
        svg,
        caption: format!("{what}{note}{}", layout.held_text()),
    })
}
