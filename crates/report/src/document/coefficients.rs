//! The figures of the coefficients: their bias, and the coverage of their 95 % intervals.

use super::figure::{Drawn, Figure, WHOSE, level, over, series_of, share_point};
use super::layout::{Layout, x_key};
use super::lead::lead_outputs;
use crate::plot::{Plot, PlotAxis, Point, Series, Style};
use crate::results::Study;
use asobench_identification::metric::{Coverage, Statistics};
use asobench_study::study::file::Key;

/// Largest number of outputs whose bias can be told apart.
const BIASED: usize = 4;

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
    outputs.truncate(BIASED);
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

/// The nominal coverage of the intervals.
const NOMINAL: f64 = 0.95;

/// More outputs than these have a panel each, if the panels would otherwise be fewer.
const CROWD: usize = 3;
/// Largest number of outputs whose coverage can be told apart.
const COVERED: usize = 6;

/// The same points with a panel for each series, and in it a series for each panel.
fn by_series(plots: &[Plot]) -> Vec<Plot> {
    let first = plots
        .first()
        .into_iter()
        .flat_map(|plot| plot.series.iter().enumerate());
    let panel = |(i, of): (usize, &Series)| {
        let mut panel = plots[0].clone();
        panel.title.clone_from(&of.label);
        let all = plots.iter().enumerate();
        panel.series = all
            .map(|(slot, plot)| Series {
                label: plot.title.clone(),
                slot: Some(slot),
                ..plot.series[i].clone()
            })
            .collect();
        panel
    };
    first.map(panel).collect()
}

/// The coverage for the worst coefficient of each output, along the setting with the most values. If nothing varies,
/// the coverage for every coefficient.
pub(super) fn coverage(study: &Study) -> Option<Drawn> {
    let mut outputs = lead_outputs(study);
    outputs.retain(|(_, label)| {
        let mut cells = study.summary.cells.iter();
        cells.any(|cell| {
            study
                .output(cell, label)
                .is_some_and(|output| !output.coverage.is_empty())
        })
    });
    outputs.truncate(COVERED);
    let first = study.summary.cells.first()?;
    let known = outputs.iter().filter_map(|(_, label)| study.output(first, label));
    let largest = known.max_by_key(|output| output.coverage.len())?;
    let names: Vec<&String> = largest.coverage.iter().map(|(name, _)| name).collect();
    let along = x_key(study);
    let of = if along.is_some() {
        "the coefficient whose coverage is farthest from 95 %, whose name stands beside its point (h_1 is the first of \
         B(q)) where it certainly is not 95 % and where the point before has another name"
    } else {
        "each coefficient"
    };
    let what = format!(
        "How often the 95 % interval of a method holds the truth, for {of}, with Wilson's intervals; trials without a \
        standard error are left out."
    );
    let layout = Layout::new(study, along, &[]);
    let distance = |coverage: &Coverage| (coverage.covered.share - NOMINAL).abs();
    Figure {
        name: "coverage",
        title: &format!("share of 95 % intervals that hold the truth{}", over(&layout)),
        what: &what,
        end: &format!(" {WHOSE}"),
        x: along
            .is_none()
            .then(|| PlotAxis::categories("coefficient of the state space", &names)),
        notes: &|i, cell| {
            let output = study.output(cell, &outputs[i].1);
            let all = output.iter().flat_map(|output| &output.coverage);
            let worst = all.max_by(|a, b| distance(&a.1).total_cmp(&distance(&b.1)));
            let certain = |of: &&(String, Coverage)| {
                let covered = of.1.covered;
                !(covered.low..=covered.high).contains(&NOMINAL)
            };
            let named = worst.filter(|of| along.is_some() && certain(of));
            named.map_or_else(String::new, |(name, _)| name.clone())
        },
        series: series_of(&outputs, Style::ErrorBars),
        points: &|i, cell, at| {
            let output = study.output(cell, &outputs[i].1);
            let all = output.iter().flat_map(|output| &output.coverage);
            if along.is_some() {
                let worst = all.max_by(|a, b| distance(&a.1).total_cmp(&distance(&b.1)));
                return worst
                    .map(|(_, worst)| share_point(at, worst.covered))
                    .into_iter()
                    .collect();
            }
            let point = |(name, coverage): &(String, Coverage)| {
                let at = names.iter().position(|other| *other == name)?;
                Some(share_point(at as f64, coverage.covered))
            };
            all.filter_map(point).collect()
        },
        guides: &level("95 %", 100.0 * NOMINAL),
        finish: &|plots| {
            if along.is_some() && outputs.len() > CROWD.max(plots.len()) {
                *plots = by_series(plots);
            }
            true
        },
        ..Figure::new(&layout, PlotAxis::linear("intervals that hold the truth, %"))
    }
    .draw(study)
}
