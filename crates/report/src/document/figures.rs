//! The figures of a study, chosen by its content.

use super::chosen::{Chosen, over_setting};
use super::figure::{Drawn, Figure, estimate, is_shown, level, over, subject};
use super::layout::{Layout, x_of};
use super::lead::lead_figures;
use super::zip_plot::{Zipped, zip_plot};
use super::{coefficients, over_time};
use crate::plot::{Plot, PlotAxis, Scale, Series, Style, extent, points};
use crate::results::Study;
use asobench_study::study::{Better, ComparisonSummary, Measure};

/// With fewer trials than this, quartiles are drawn, because the interval of a median says little.
const FEW: u64 = 100;

/// Largest number of pairs in a figure.
const PAIRS: usize = 6;

/// Largest number of figures of a study.
const FIGURES: usize = 7;

/// The figures of a study, the most informative ones if there are too many.
pub(super) fn figures(study: &Study) -> Vec<Drawn> {
    let lead = lead_figures(study);
    let first = lead.first().copied();
    let map = super::bound_grid::bound_grid(study);
    let all = [
        map.clone(),
        first.and_then(|measure| medians(study, measure)),
        super::passes::passes(study),
        super::passes::lost(study),
        super::method_times::errors_and_times(study),
        super::method_times::times(study),
        map.is_none().then(|| super::bound_shares::shares(study)).flatten(),
        first.and_then(|measure| ratios(study, measure)),
        coefficients::coverage(study),
        zipped(study),
        first.and_then(|measure| nested(study, measure)),
        coefficients::bias(study),
        over_time::curves(study),
    ];
    let rest = lead.iter().skip(1).filter_map(|measure| medians(study, *measure));
    let courses = over_time::courses(&study.summary).into_iter();
    let mut drawn: Vec<Drawn> = courses
        .chain(over_time::along(study))
        .chain(all.into_iter().flatten())
        .chain(rest)
        .collect();
    drawn.truncate(FIGURES);
    drawn
}

/// The zip plot of a study that kept its trials and their intervals.
fn zipped(study: &Study) -> Option<Drawn> {
    let drawn = || zip_plot(study, &Zipped::default()).ok();
    study.keeps_intervals().then(drawn).flatten()
}

/// The nested-loop plot of a study with more settings than other figures can show.
fn nested(study: &Study, measure: Measure) -> Option<Drawn> {
    let is_held = !Layout::new(study, x_of(study, measure), &[]).held.is_empty();
    let fits = is_held && super::nested_loop::fits(study);
    fits.then(|| super::nested_loop::nested_loop(study, measure, None, (None, None)))
        .flatten()
}

/// Medians of a measure over the axis, with the spread of the trials if there are few outputs.
pub(super) fn medians(study: &Study, measure: Measure) -> Option<Drawn> {
    let chosen = Chosen {
        measure: Some(measure),
        ..Chosen::default()
    };
    over_setting(study, &chosen, FEW).ok()
}

/// Ratios on the same trials, for the pairs that the file compares.
fn ratios(study: &Study, measure: Measure) -> Option<Drawn> {
    let layout = Layout::new(study, x_of(study, measure), &[]);
    let pairs = &study.file.compare[..study.file.compare.len().min(PAIRS)];
    let series =
        |[first, second]: &[String; 2]| Series::new(format!("{first} over {second}"), Style::ErrorBars, Vec::new());
    let name = measure.label();
    let better = match measure.entry().better {
        Better::Smaller => "; below 1 the first is better",
        Better::Larger => "; above 1 the first is better",
        Better::Neither => "",
    };
    Figure {
        name: &format!("ratio-{}", measure.name()),
        title: &format!("ratio of the {} on the same records{}", subject(measure), over(&layout)),
        what: &format!(
            "Medians over the trials of the ratio of two outputs on the same record, with 95 % intervals{better}."
        ),
        about: " A trial in which one output failed counts as its loss, and one in which both failed as a tie. Pairs \
                of which one output fails in more than half of the trials are left out.",
        series: pairs.iter().map(series).collect(),
        points: &|i, cell, at| {
            let of = |pair: &&ComparisonSummary| [&pair.first, &pair.second] == pairs[i].each_ref();
            let pair = cell.comparisons.iter().find(of);
            let ratio = pair.and_then(|pair| Some(pair.measures.get(&measure)?.median_ratio));
            let is_shown = || pairs[i].iter().all(|label| is_shown(study, cell, label));
            let shown = ratio.filter(|ratio| ratio.value > 0.0 && is_shown());
            shown
                .map(|ratio| estimate(at, ratio, &Scale::Log))
                .into_iter()
                .collect()
        },
        guides: &level("equal", 1.0),
        finish: &|plots| {
            near_one(plots);
            true
        },
        ..Figure::new(&layout, PlotAxis::log(format!("median ratio of {name}")))
    }
    .draw(study)
}

/// If all ratios are close to 1, makes the axis linear, with at least 5 % to either side.
fn near_one(plots: &mut [Plot]) {
    let ends = points(plots).flat_map(|point| [point.low, point.high]);
    let (least, most) = extent(ends.chain([0.95, 1.05]));
    if least > 0.8 && most < 1.25 {
        for plot in plots {
            plot.y.scale = Scale::Linear;
            plot.y.range = Some((least - 0.005, most + 0.005));
        }
    }
}
