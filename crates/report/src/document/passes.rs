//! Figures over the passes of an estimator: errors, and lost trials.

use super::figure::{Drawn, quantile_note, y_axis};
use super::layout::{Choice, Layout, panel_title, sheet, x_key};
use super::lead::{OUTPUTS, lead_figures, lead_outputs};
use crate::plot::{Plot, PlotAxis, Point, Series, Style};
use crate::results::Study;
use asobench_study::study::{CellSummary, OutputSummary};
use std::collections::HashMap;

/// Fewest passes for which the figure over passes is drawn.
const PASSES: usize = 5;
/// With more passes than this, the study is about passes, and shares are drawn over them.
const MANY: usize = 8;

/// Estimators with several passes, in order of appearance.
fn iterated(study: &Study) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let Some(cell) = study.summary.cells.first() else {
        return names;
    };
    let mut counts: HashMap<&str, usize> = HashMap::new();
    for output in &cell.outputs {
        let count = counts.entry(&output.estimator).or_default();
        *count += 1;
        if *count + 1 == PASSES && names.len() < OUTPUTS {
            names.push(output.estimator.clone());
        }
    }
    names
}

/// The passes of an estimator in a cell, beginning with iteration 0. If that has a name of its own, it is the output
/// before.
fn passes_of<'a>(cell: &'a CellSummary, name: &str) -> &'a [OutputSummary] {
    let mut runs = cell.outputs.chunk_by(|output, next| {
        output.estimator == next.estimator || output.pass == 0 && next.pass > 0
    });
    let run = runs.find(|run| run.iter().any(|output| output.estimator == name));
    run.unwrap_or_default()
}

/// One plot for each panel, over passes.
fn over_passes(
    study: &Study,
    layout: &Layout,
    y: &PlotAxis,
    style: Style,
    point: impl Fn(&OutputSummary) -> Option<Point>,
) -> Vec<Plot> {
    let names = iterated(study);
    let draw = |panel: &Choice| {
        let cells = layout.cells(study, panel);
        let mut plot = Plot::new(
            panel_title(panel, &cells),
            PlotAxis::linear("pass"),
            y.clone(),
        );
        let Some(cell) = cells.first() else {
            return plot;
        };
        for name in &names {
            let points = passes_of(cell, name).iter().filter_map(&point).collect();
            plot = plot.series(Series::new(name, style, points));
        }
        plot
    };
    layout.panels.iter().map(draw).collect()
}

/// The error over passes.
pub(super) fn passes(study: &Study) -> Option<Drawn> {
    let measure = lead_figures(study).first().copied()?;
    if iterated(study).is_empty() {
        return None;
    }
    let layout = Layout::new(study, None, &[]);
    let point = |output: &OutputSummary| {
        let statistics = output.measures.get(&measure)?;
        let point = Point::interval(
            output.pass as f64,
            statistics.q50.value,
            statistics.q05.value,
            statistics.q95.value,
        );
        statistics.q50.value.is_finite().then_some(point)
    };
    let plots = over_passes(study, &layout, &y_axis(measure), Style::Band, point);
    let name = measure.label();
    let what = "Medians over the passes, bands hold the middle 90 % of the trials; pass 0 is least \
        squares.";
    let (svg, note) = sheet(
        &format!("{}: {name} over the passes", study.title()),
        what,
        plots,
    )?;
    let caption = format!(
        "{what}{note}{} {}",
        layout.held_text(),
        quantile_note(study)
    );
    Some(Drawn {
        name: "passes".to_owned(),
        svg,
        caption,
    })
}

/// Smaller shares of lost trials, in per cent, are not drawn.
const LEAST: f64 = 0.5;

/// Shares of trials that fail or leave an unstable model, if they are large enough.
pub(super) fn lost(study: &Study) -> Option<Drawn> {
    let axis = PlotAxis::linear("failed or unstable, % of trials");
    let lost = |at: f64, output: &OutputSummary| {
        let (trials, (count, _)) = (output.outcomes.trials, output.outcomes.lost_trials());
        let share = asobench_identification::metric::Share::new(count, trials);
        let percent = 100.0 * share.share;
        // One trial, as of a cell without random numbers, is no sample.
        if trials == 1 {
            return Point::new(at, percent);
        }
        Point::interval(at, percent, 100.0 * share.low, 100.0 * share.high)
    };
    let last = study
        .summary
        .cells
        .iter()
        .flat_map(|cell| &cell.outputs)
        .map(|output| output.pass)
        .max();
    let (layout, plots) = if iterated(study).is_empty() || last <= Some(MANY) {
        let layout = Layout::new(study, x_key(study), &[]);
        let draw = |panel: &Choice| {
            let cells = layout.along(study, panel);
            let mut plot = Plot::new(panel_title(panel, &cells), layout.axis(study), axis.clone());
            for (slot, label) in lead_outputs(study) {
                let point = |cell: &&CellSummary| {
                    Some(lost(layout.at(study, cell), study.output(cell, &label)?))
                };
                let points = cells.iter().filter_map(point);
                plot =
                    plot.series(Series::new(&label, Style::ErrorBars, points.collect()).slot(slot));
            }
            plot
        };
        let plots = layout.panels.iter().map(draw).collect();
        (layout, plots)
    } else {
        let layout = Layout::new(study, None, &[]);
        let plots = over_passes(study, &layout, &axis, Style::ErrorBars, |output| {
            Some(lost(output.pass as f64, output))
        });
        (layout, plots)
    };
    let drawn = plots.iter().flat_map(|plot| &plot.series);
    let mut drawn = drawn.flat_map(|series| &series.points);
    if !drawn.any(|point| point.y >= LEAST) {
        return None;
    }
    let what = "Lost trials: the estimate fails, or the model has a pole on or outside the unit \
        circle, with Wilson's 95 % intervals.";
    let cells = study.summary.cells.iter();
    let mut outputs = cells.flat_map(|cell| &cell.outputs);
    let twice = if outputs.all(|output| output.outcomes.lost_trials().1) {
        ""
    } else {
        " These results are of a version that did not count lost trials: a trial that failed and is \
        unstable counts twice here."
    };
    let (svg, note) = sheet(
        &format!("{}: failed or unstable", study.title()),
        what,
        plots,
    )?;
    Some(Drawn {
        name: "lost".to_owned(),
        svg,
        caption: format!("{what}{twice}{note}{}", layout.held_text()),
    })
}

#[cfg(test)]
mod tests;
