//! Figures over passes, time, coefficients and bounds.

use super::figures::{Drawn, quantile_note, y_axis};
use super::layout::{Choice, Layout, panel_title, sheet, x_key};
use super::{OUTPUTS, lead_figures, lead_outputs};
use crate::metric::Statistics;
use crate::report::figures::curve;
use crate::report::plot::{Axis, Course, Plot, Point, Series, Style};
use crate::report::results::{Study, Time, words};
use crate::report::table::share;
use crate::study::file::Key;
use crate::study::{CellSummary, OutputSummary};
use std::collections::HashMap;

/// Estimators with so many passes show them.
const PASSES: usize = 5;
/// With more passes than this the study is about them, and shares are drawn over them.
const MANY: usize = 8;

/// Estimators with several passes, first appearance first.
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

/// The passes of an estimator in a cell, iteration 0 first: where that has a name of its own it is the output in front.
fn passes_of<'a>(cell: &'a CellSummary, name: &str) -> &'a [OutputSummary] {
    let mut runs = cell
        .outputs
        .chunk_by(|one, next| one.estimator == next.estimator || one.pass == 0 && next.pass > 0);
    let run = runs.find(|run| run.iter().any(|output| output.estimator == name));
    run.unwrap_or_default()
}

/// One plot per panel over passes.
fn over_passes(
    study: &Study,
    layout: &Layout,
    y: &Axis,
    style: Style,
    point: impl Fn(&OutputSummary) -> Option<Point>,
) -> Vec<Plot> {
    let names = iterated(study);
    let draw = |panel: &Choice| {
        let cells = layout.cells(study, panel);
        let mut plot = Plot::new(panel_title(panel, &cells), Axis::linear("pass"), y.clone());
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
        let of = output.measures.get(&measure)?;
        let point = Point::interval(output.pass as f64, of.q50.value, of.q05.value, of.q95.value);
        of.q50.value.is_finite().then_some(point)
    };
    let plots = over_passes(study, &layout, &y_axis(measure), Style::Band, point);
    let name = measure.label();
    let what = "Medians over the passes, bands hold the middle 90 % of the trials; pass 0 is least squares.";
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

/// Shares of lost trials below this, in per cent, are not worth a picture.
const LEAST: f64 = 0.5;

/// Shares of trials that fail or leave an unstable model, where there are any to speak of.
pub(super) fn lost(study: &Study) -> Option<Drawn> {
    let axis = Axis::linear("failed or unstable, % of trials");
    let lost = |at: f64, of: &OutputSummary| {
        let (trials, count) = (
            of.outcomes.trials,
            of.outcomes.failed() + of.outcomes.unstable,
        );
        let share = crate::metric::Share::new(count.min(trials), trials);
        Point::interval(
            at,
            100.0 * share.share,
            100.0 * share.low,
            100.0 * share.high,
        )
    };
    let last = study
        .summary
        .cells
        .iter()
        .flat_map(|cell| &cell.outputs)
        .map(|of| of.pass)
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
        let plots = over_passes(study, &layout, &axis, Style::ErrorBars, |of| {
            Some(lost(of.pass as f64, of))
        });
        (layout, plots)
    };
    let drawn = plots.iter().flat_map(|plot| &plot.series);
    let mut drawn = drawn.flat_map(|series| &series.points);
    if !drawn.any(|point| point.y >= LEAST) {
        return None;
    }
    let what = "Trials whose estimate fails, or whose model has a pole on or outside the unit circle, with Wilson's 95 % intervals.";
    let (svg, note) = sheet(
        &format!("{}: failed or unstable", study.title()),
        what,
        plots,
    )?;
    Some(Drawn {
        name: "lost".to_owned(),
        svg,
        caption: format!("{what}{note}{}", layout.held_text()),
    })
}

/// Times of the methods.
pub(super) fn times(study: &Study) -> Option<Drawn> {
    if study.times.is_empty() {
        return None;
    }
    let layout = Layout::new(study, x_key(study), &[]);
    let mut methods: Vec<&str> = Vec::new();
    let mut found: HashMap<(usize, &str), &Time> = HashMap::new();
    for time in &study.times {
        if methods.len() < OUTPUTS && !methods.contains(&time.method.as_str()) {
            methods.push(&time.method);
        }
        found.entry((time.cell, &time.method)).or_insert(time);
    }
    let draw = |panel: &Choice| {
        let cells = layout.along(study, panel);
        let mut plot = Plot::new(
            panel_title(panel, &cells),
            layout.axis(study),
            Axis::log("time of all passes, s"),
        );
        for (slot, method) in methods.iter().enumerate() {
            let points = cells.iter().filter_map(|cell| {
                let time = found.get(&(cell.cell, *method))?;
                Some(Point::interval(
                    layout.at(study, cell),
                    time.median_seconds,
                    time.q25_seconds,
                    time.q75_seconds,
                ))
            });
            plot = plot.series(Series::new(*method, Style::ErrorBars, points.collect()).slot(slot));
        }
        plot
    };
    let plots: Vec<Plot> = layout.panels.iter().map(draw).collect();
    let what = "Median times on one thread, bars are quartiles. Times are of the machine that ran the study; everything else here is not.";
    let (svg, note) = sheet(&format!("{}: times", study.title()), what, plots)?;
    Some(Drawn {
        name: "times".to_owned(),
        svg,
        caption: format!("{what}{note}{}", layout.held_text()),
    })
}

/// The share of realisations that meet each bound: of the last output, or over all combinations of a large grid.
pub(super) fn shares(study: &Study) -> Option<Drawn> {
    const FEW: usize = 4;
    let mut names: Vec<String> = Vec::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    let mut found: Vec<Vec<(&str, crate::metric::Share)>> = Vec::new();
    for cell in &study.summary.cells {
        for bound in &cell.bounds {
            let name = format!(
                "{}: {} {}",
                cell.claim,
                bound.bound.measure.label(),
                bound.bound.text()
            );
            let name = name.trim_start_matches(": ").to_owned();
            let at = *places.entry(name).or_insert_with_key(|name| {
                names.push(name.clone());
                found.push(Vec::new());
                names.len() - 1
            });
            let outputs = bound.outputs.iter();
            found[at].extend(outputs.map(|of| (of.output.as_str(), of.met)));
        }
    }
    let most = found.iter().map(Vec::len).max()?;
    let outputs = lead_outputs(study);
    let single = most <= study.labels().len();
    let x = Axis::linear("share of realisations that meet the bound, %").range(0.0, 100.0);
    let mut plot = Plot::new("", x, Axis::categories("", &names));
    let what = if single {
        for (slot, label) in outputs.iter().take(FEW) {
            let points = found.iter().enumerate().filter_map(|(i, of)| {
                let met = of.iter().find(|(output, _)| output == label)?.1;
                Some(Point::interval(
                    100.0 * met.share,
                    i as f64,
                    100.0 * met.low,
                    100.0 * met.high,
                ))
            });
            plot = plot.series(Series::new(label, Style::ErrorBars, points.collect()).slot(*slot));
        }
        "Shares of all trials with Wilson's 95 % intervals; a failed trial meets no bound."
    } else {
        let points = found.iter().enumerate().filter_map(|(i, of)| {
            let mut shares: Vec<f64> = of.iter().map(|(_, met)| 100.0 * met.share).collect();
            shares.sort_by(f64::total_cmp);
            let at = |q: f64| {
                shares
                    .get(((shares.len() - 1) as f64 * q) as usize)
                    .copied()
            };
            let mut point = Point::interval(at(0.5)?, i as f64, at(0.0)?, at(1.0)?);
            point.quartiles = [at(0.25)?, at(0.75)?];
            Some(point)
        });
        plot = plot.series(Series::new(
            "all cells and outputs",
            Style::Boxes,
            points.collect(),
        ));
        "For each bound the shares of realisations over all cells and outputs: boxes hold the middle half of the combinations, whiskers reach the worst and the best."
    };
    plot = plot.reference("typical: half", Course::Vertical(50.0));
    let (svg, note) = sheet(&format!("{}: bounds", study.title()), what, vec![plot])?;
    let best = found
        .iter()
        .flatten()
        .map(|(_, met)| *met)
        .max_by(|a, b| a.share.total_cmp(&b.share))?;
    Some(Drawn {
        name: "bounds".to_owned(),
        svg,
        caption: format!("{what}{note} The largest share of all is {}.", share(best)),
    })
}

/// Bias, its error and the scatter of one coefficient, by quantiles where one trial dominates the moments.
fn bias_of(of: &Statistics) -> (f64, f64, f64) {
    if of.dominated || !of.mean.value.is_finite() {
        let scatter = (of.q75.value - of.q25.value) / 1.349;
        (of.q50.value, of.q50.mcse, scatter)
    } else {
        (of.mean.value, of.mean.mcse, of.sd.value)
    }
}

/// Bias of every coefficient in units of its standard deviation.
pub(super) fn coefficients(study: &Study) -> Option<Drawn> {
    let outputs = lead_outputs(study);
    // Iteration 0 may be biased by so much that nothing else is seen.
    let pass = |label: &str| {
        let cell = study.summary.cells.first()?;
        study.output(cell, label).map(|of| of.pass)
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
        .max_by_key(|of| of.parameters.len())?;
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
        let axis = Axis::linear("bias over standard deviation");
        let mut plot = Plot::new(
            panel_title(panel, &cells),
            Axis::categories("coefficient", &names),
            axis,
        );
        let Some(cell) = cells.first() else {
            return plot;
        };
        for (slot, label) in &labels {
            let output = study.output(cell, label);
            let Some(output) = output.filter(|of| of.failed.low <= 0.5) else {
                continue;
            };
            let points = output
                .parameters
                .iter()
                .enumerate()
                .filter_map(|(i, (_, of))| {
                    let (bias, error, scatter) = bias_of(of);
                    let point = Point::uncertain(i as f64, bias / scatter, error / scatter);
                    point.y.is_finite().then_some(point)
                });
            plot = plot.series(Series::new(label, Style::ErrorBars, points.collect()).slot(*slot));
        }
        plot.reference("no bias", Course::Horizontal(0.0))
    };
    let plots: Vec<Plot> = layout.panels.iter().map(draw).collect();
    let what = "Mean signed error of each coefficient over its standard deviation, with 95 % intervals; where one trial dominates the moments, the median over the interquartile range / 1.349.";
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

/// e_x(k) over k.
pub(super) fn curves(study: &Study) -> Option<Drawn> {
    let axes = || (Axis::linear("k, samples"), Axis::log("e_x(k), relative"));
    let several = study.values(Key::Gain).len() > 1;
    let used: &[Key] = if several { &[Key::Gain] } else { &[] };
    let layout = Layout::new(study, None, used);
    let labels = study.labels();
    let ends = [labels.first(), labels.last()].map(|label| label.cloned().unwrap_or_default());
    let draw = |panel: &Choice| {
        let cells = layout.cells(study, panel);
        let (x, y) = axes();
        let mut plot = Plot::new(panel_title(panel, &cells), x, y);
        for cell in cells.iter().take(OUTPUTS) {
            let Some([first, last]) = &cell.curves else {
                continue;
            };
            if several {
                let gain = words(Key::Gain, &cell.setting(Key::Gain));
                let medians = curve(last).into_iter().map(|of| Point::new(of.x, of.y));
                plot = plot.series(Series::new(gain, Style::Line, medians.collect()));
            } else {
                plot = plot.series(Series::new(ends[0].clone(), Style::Band, curve(first)).slot(0));
                plot = plot.series(Series::new(ends[1].clone(), Style::Band, curve(last)).slot(1));
            }
            plot = plot.reference("k = N", Course::Vertical(cell.window as f64));
        }
        plot.references.dedup();
        plot
    };
    let plots: Vec<Plot> = layout.panels.iter().map(draw).collect();
    let what = if several {
        format!("Medians of e_x(k) with {} for each gain.", ends[1])
    } else {
        "Medians of e_x(k), bands hold the middle 90 % of the trials.".to_owned()
    };
    let (svg, note) = sheet(
        &format!("{}: error of the state over time", study.title()),
        &what,
        plots,
    )?;
    let percent = 100.0 * study.summary.curve_relative_error;
    Some(Drawn {
        name: "curves".to_owned(),
        svg,
        caption: format!(
            "{what} Quantiles of curves are from bins of relative error below {percent:.1} %.{note}{}",
            layout.held_text()
        ),
    })
}
