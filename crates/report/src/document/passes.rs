//! Figures over the passes of an estimator: errors, and lost trials.

use super::figure::{Drawn, Figure, over, quantile_note, series_of, share_point, subject, y_axis};
use super::layout::{Layout, x_key};
use super::lead::{OUTPUTS, lead_figures, lead_outputs};
use crate::plot::{PlotAxis, Point, Series, Style, points};
use crate::results::{self, Study};
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
    let mut runs = cell
        .outputs
        .chunk_by(|output, next| output.estimator == next.estimator || output.pass == 0 && next.pass > 0);
    let run = runs.find(|run| run.iter().any(|output| output.estimator == name));
    run.unwrap_or_default()
}

/// A series for each estimator with several passes.
fn series(estimators: &[String], style: Style) -> Vec<Series> {
    let series = |name: &String| Series::new(name, style, Vec::new());
    estimators.iter().map(series).collect()
}

/// The error over passes.
pub(super) fn passes(study: &Study) -> Option<Drawn> {
    let measure = lead_figures(study).first().copied()?;
    let estimators = iterated(study);
    let point = |output: &OutputSummary| {
        let statistics = output.measures.get(&measure)?;
        let [low, middle, high] = [statistics.q05, statistics.q50, statistics.q95].map(|quantile| quantile.value);
        let point = Point::interval(output.pass as f64, middle, low, high);
        middle.is_finite().then_some(point)
    };
    Figure {
        name: "passes",
        title: &format!("{} over the passes", subject(measure)),
        what: "Medians over the passes, bands hold the middle 90 % of the trials; pass 0 is least squares.",
        end: &format!(" {}", quantile_note(study)),
        x: Some(PlotAxis::linear("pass")),
        series: series(&estimators, Style::Band),
        points: &|i, cell, _| {
            let passes = passes_of(cell, &estimators[i]).iter();
            passes.filter_map(point).collect()
        },
        ..Figure::new(&Layout::new(study, None, &[]), y_axis(measure))
    }
    .draw(study)
}

/// Smaller shares of lost trials, in per cent, are not drawn.
const LEAST: f64 = 0.5;

/// Shares of trials that fail or leave an unstable model, if they are large enough.
pub(super) fn lost(study: &Study) -> Option<Drawn> {
    let lost = |at: f64, output: &OutputSummary| {
        let share = results::lost(output);
        let point = share_point(at, share);
        // One trial, as of a cell without random numbers, is no sample.
        if share.total == 1 {
            Point::new(at, point.y)
        } else {
            point
        }
    };
    let all = || study.summary.cells.iter().flat_map(|cell| &cell.outputs);
    let twice = if all().all(|output| output.outcomes.lost_trials().1) {
        ""
    } else {
        " These results are of a version that did not count lost trials: a trial that failed and is unstable counts \
         twice here."
    };
    let (estimators, outputs) = (iterated(study), lead_outputs(study));
    let last = all().map(|output| output.pass).max();
    let over_passes = !estimators.is_empty() && last > Some(MANY);
    let x = x_key(study).filter(|_| !over_passes);
    let style = Style::ErrorBars;
    let series = if over_passes {
        series(&estimators, style)
    } else {
        series_of(&outputs, style)
    };
    let layout = Layout::new(study, x, &[]);
    Figure {
        name: "lost",
        title: &format!("share of lost trials{}", over(&layout)),
        what: "Lost trials: the estimate fails, or the model has a pole on or outside the unit circle, with Wilson's \
               95 % intervals.",
        about: twice,
        x: over_passes.then(|| PlotAxis::linear("pass")),
        series,
        points: &|i, cell, at| {
            if over_passes {
                let passes = passes_of(cell, &estimators[i]).iter();
                passes.map(|output| lost(output.pass as f64, output)).collect()
            } else {
                let output = study.output(cell, &outputs[i].1);
                output.map(|output| lost(at, output)).into_iter().collect()
            }
        },
        finish: &|plots| points(plots).any(|point| point.y >= LEAST),
        ..Figure::new(&layout, PlotAxis::linear("lost (failed or unstable), % of trials"))
    }
    .draw(study)
}

#[cfg(test)]
mod tests;
