//! One figure of a study, with the measure, statistic, setting along x and outputs that are asked for.

use super::figure::{Figure, quantile_note, series_of, y_axis};
use super::figures::{BANDS, at_one_place, estimate, is_shown, left_out, quantiles};
use super::layout::{Layout, x_of};
use super::lead::{OUTPUTS, lead_figures, lead_outputs};
use crate::plot::{Point, Scale, Style};
use crate::results::Study;
use asobench_identification::metric::Statistic;
use asobench_identification::names::UnknownName;
use asobench_study::study::file::Key;
use asobench_study::study::{CellSummary, Measure, measure};
use asobench_study::text::folded;

/// What a figure is to show. By default what the report shows first.
#[derive(Clone, Debug, Default)]
pub struct Chosen {
    /// The measure.
    pub measure: Option<Measure>,
    /// The statistic; by default medians, with the spread of the trials if there are few outputs.
    pub statistic: Option<Statistic>,
    /// The setting along x.
    pub over: Option<Key>,
    /// Labels of outputs, or names of methods; all of them if empty.
    pub outputs: Vec<String>,
    /// The title.
    pub title: Option<String>,
    /// Whether the y axis is linear or logarithmic; by default as its measure is.
    pub logarithmic: Option<bool>,
}

/// Draws a figure of a study; returns its name without extension, the SVG document and its caption.
///
/// # Errors
/// In words: a measure, a setting or an output that the study does not have, or nothing to draw.
pub fn chosen_figure(study: &Study, chosen: &Chosen) -> Result<[String; 3], String> {
    let lead = lead_figures(study).into_iter().next();
    let measure = chosen
        .measure
        .or(lead)
        .ok_or("the study has no measure with results")?;
    if !study.file.measures.contains(&measure) {
        let known: Vec<&str> = study.file.measures.iter().map(|of| of.name()).collect();
        return Err(UnknownName::new("measure", measure.name(), &known).to_string());
    }
    let varying = study.varying();
    if let Some(key) = chosen.over.filter(|key| !varying.contains(key)) {
        let known: Vec<&str> = varying.iter().map(|key| key.name()).collect();
        return Err(UnknownName::new("setting that varies", key.name(), &known).to_string());
    }
    let outputs = outputs(study, &chosen.outputs)?;
    let layout = Layout::new(study, chosen.over.or_else(|| x_of(study, measure)), &[]);
    let mut y = y_axis(measure);
    match chosen.logarithmic {
        Some(true) => y.scale = Scale::Log,
        Some(false) => y.scale = Scale::Linear,
        None => {}
    }
    let style = match (chosen.statistic, layout.has_names, outputs.len()) {
        (None, true, ..=4) => Style::Boxes,
        (None, false, ..=BANDS) if measure.scale() != measure::Scale::Percent => Style::Band,
        _ => Style::ErrorBars,
    };
    let what = match (chosen.statistic, style) {
        (Some(statistic), _) => format!("{} over trials with 95 % intervals.", statistic.title()),
        (None, Style::Band) => {
            "Lines are medians, bands hold the middle 90 % of the trials.".to_owned()
        }
        (None, Style::Boxes) => {
            "Boxes hold the middle half of the trials, whiskers the middle 90 %, the line is the \
            median."
                .to_owned()
        }
        (None, _) => "Medians with their 95 % intervals.".to_owned(),
    };
    let end = match chosen.statistic {
        Some(statistic) if !statistic.is_quantile() => String::new(),
        _ => format!(" {}", quantile_note(study)),
    };
    let title = match chosen.statistic {
        Some(statistic) => format!("{} of {}", statistic.title(), measure.label()),
        None => measure.label().to_owned(),
    };
    let name = match chosen.statistic {
        Some(statistic) => format!("{}-{measure}-{statistic}", study.name),
        None => format!("{}-{measure}", study.name),
    };
    let point = |i: usize, cell: &CellSummary, at: f64| {
        let label = &outputs[i].1;
        let statistics = study.statistics(cell, label, measure)?;
        let point = match chosen.statistic {
            Some(statistic) => {
                let found = statistic.of(statistics);
                Point::uncertain(at, found.value, found.mcse)
            }
            None if style == Style::ErrorBars => estimate(at, statistics.q50, &y.scale),
            None => quantiles(at, statistics),
        };
        Some(point).filter(|point| point.y.is_finite() && is_shown(study, cell, label))
    };
    let drawn = Figure {
        name: &name,
        title: &title,
        of: &format!("{} by output. ", measure.label()),
        what: &what,
        left_out: &left_out(study, &outputs),
        end: &end,
        series: series_of(&outputs, style),
        points: &|i, cell, at| point(i, cell, at).into_iter().collect(),
        finish: &|plots| layout.x.is_none() || !at_one_place(plots),
        whole_title: chosen.title.as_deref(),
        ..Figure::new(&layout, y.clone())
    }
    .draw(study);
    let drawn = drawn
        .ok_or_else(|| format!("nothing to draw: no output has {measure} in two cells or more"))?;
    Ok([drawn.name, drawn.svg, drawn.caption])
}

/// The outputs with these names, with their places in the palette.
fn outputs(study: &Study, names: &[String]) -> Result<Vec<(usize, String)>, String> {
    if names.is_empty() {
        return Ok(lead_outputs(study));
    }
    let labels = study.labels();
    let mut found: Vec<String> = Vec::new();
    for name in names {
        let method = |label: &String| {
            label
                .split_once('(')
                .map_or(&label[..], |(method, _)| method)
                .to_owned()
        };
        let is = |label: &&String| {
            folded(label) == folded(name) || folded(&method(label)) == folded(name)
        };
        let of_name: Vec<&String> = labels.iter().filter(is).collect();
        if of_name.is_empty() {
            let known: Vec<&str> = labels.iter().map(String::as_str).collect();
            return Err(UnknownName::new("output", name, &known).to_string());
        }
        found.extend(of_name.into_iter().cloned());
    }
    found.dedup();
    if found.len() > OUTPUTS {
        return Err(format!(
            "{} outputs; expected at most {OUTPUTS} in a figure",
            found.len()
        ));
    }
    Ok(found.into_iter().enumerate().collect())
}
