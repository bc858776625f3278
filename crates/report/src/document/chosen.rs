//! One figure of a study, with the measure, statistic, setting along x and outputs that are asked for.

use super::answer::with_unit;
use super::figure::{Drawn, Figure, estimate, is_shown, left_out, quantile_note, series_of, y_axis};
use super::layout::{Form, Layout, x_of};
use super::lead::{OUTPUTS, lead_figures, lead_outputs};
use super::medians::{at_one_place, how, limits, open_end, quantiles, references, style, theory, title};
use super::nested_loop::nested_loop;
use super::zip_plot::{Zipped, zip_plot};
use crate::plot::{Drawing, Plot, Point, Scale, Series, Style};
use crate::results::Study;
use asobench_identification::metric::Statistic;
use asobench_identification::names::UnknownName;
use asobench_identification::number::uncertain;
use asobench_study::study::file::Key;
use asobench_study::study::{CellSummary, Measure};
use asobench_study::text::folded;

/// The kind of a figure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// A measure over a setting.
    #[default]
    Over,
    /// A measure in every cell, with the settings of the cells below.
    NestedLoop,
    /// The intervals of single trials.
    Zip,
}

/// The choices for a figure; by default those of the report's first figure.
#[derive(Clone, Debug, Default)]
pub struct Chosen {
    /// The kind.
    pub kind: Kind,
    /// The measure.
    pub measure: Option<Measure>,
    /// The statistic; by default medians, with the spread of the trials if there are few outputs.
    pub statistic: Option<Statistic>,
    /// Whether medians are drawn with the spread of the trials; by default as the file or the number of outputs says.
    pub spread: Option<bool>,
    /// The setting along x.
    pub over: Option<Key>,
    /// Settings that are held, each at a value.
    pub held: Vec<(Key, String)>,
    /// Points from elsewhere.
    pub marks: Vec<Mark>,
    /// Lines that are left out, by their names in the legend.
    pub without: Vec<String>,
    /// The coefficient of a zip plot, such as `a_1`.
    pub coefficient: Option<String>,
    /// Labels of outputs, or names of methods; all of them if empty.
    pub outputs: Vec<String>,
    /// The title.
    pub title: Option<String>,
    /// The width in units of which a label is 15 high.
    pub width: Option<f64>,
    /// Whether the y axis is linear or logarithmic; by default as its measure is.
    pub logarithmic: Option<bool>,
}

/// A value that is not of the study, such as one that a paper prints.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Its name in the legend.
    pub label: String,
    /// The settings that it was found with: the one along x, and those of the panel.
    pub at: Vec<(Key, String)>,
    /// The value.
    pub value: f64,
}

impl std::str::FromStr for Mark {
    type Err = String;

    /// "as printed: window=98, noise=ar: 0.033".
    fn from_str(text: &str) -> Result<Self, String> {
        const FORM: &str = "expected NAME: SETTING=VALUE, ...: NUMBER";
        let parts: Vec<&str> = text.split(':').map(str::trim).collect();
        let [label, at, value] = parts[..] else {
            return Err(FORM.to_owned());
        };
        let at: Result<Vec<_>, String> = at.split(',').map(|pair| held(pair.trim())).collect();
        Ok(Self {
            label: label.to_owned(),
            at: at?,
            value: value.parse().map_err(|_| FORM.to_owned())?,
        })
    }
}

/// A setting and its value, from "noise=ar".
///
/// # Errors
/// In words: no setting of this name, or no value.
pub fn held(text: &str) -> Result<(Key, String), String> {
    let (key, value) = text
        .split_once('=')
        .ok_or("expected SETTING=VALUE, such as noise=white")?;
    let key = key.trim().parse::<Key>().map_err(|error| error.to_string())?;
    Ok((key, value.trim().to_owned()))
}

/// Draws a figure of a study; returns its name without extension, the picture and its caption.
///
/// # Errors
/// In words: a measure, a setting or an output that the study does not have, or nothing to draw.
pub fn chosen_figure(study: &Study, chosen: &Chosen) -> Result<(String, Drawing, String), String> {
    let drawn = match chosen.kind {
        Kind::Zip => zip(study, chosen)?,
        Kind::NestedLoop => {
            let measure = measure_of(study, chosen)?;
            let outputs = outputs(study, &chosen.outputs)?;
            let words = (chosen.title.as_deref(), chosen.width);
            nested_loop(study, measure, Some(outputs), words).ok_or(
                "nothing to draw: a nested-loop plot needs at least one setting that varies and at most 400 cells",
            )?
        }
        Kind::Over => over_setting(study, chosen, 0)?,
    };
    let name = format!("{}-{}", study.name, drawn.name);
    Ok((name, drawn.picture.wide, drawn.caption))
}

/// The measure that is asked for, or the one with which the report begins.
fn measure_of(study: &Study, chosen: &Chosen) -> Result<Measure, String> {
    let lead = lead_figures(study).into_iter().next();
    let measure = chosen.measure.or(lead).ok_or("the study has no measure with results")?;
    if !study.file.measures.contains(&measure) {
        return Err(UnknownName::new("measure", measure, &study.file.measures).to_string());
    }
    Ok(measure)
}

/// Checks that the study has the held values.
fn check_held(study: &Study, held: &[(Key, String)]) -> Result<(), String> {
    for (key, value) in held {
        let known = study.values(*key);
        if !known.contains(value) {
            return Err(UnknownName::new(format!("value of {key}"), value, known).to_string());
        }
    }
    Ok(())
}

fn zip(study: &Study, chosen: &Chosen) -> Result<Drawn, String> {
    check_held(study, &chosen.held)?;
    let wanted: Vec<(Key, &str)> = chosen.held.iter().map(|(key, value)| (*key, value.as_str())).collect();
    let cells = study.cells(&wanted);
    let cell = match cells.as_slice() {
        _ if wanted.is_empty() => None,
        [] => return Err("no cell has these settings".to_owned()),
        [cell, ..] => Some(*cell),
    };
    let outputs = match chosen.outputs.as_slice() {
        [] => Vec::new(),
        names => outputs(study, names)?,
    };
    let wanted = Zipped {
        cell,
        coefficient: chosen.coefficient.as_deref(),
        outputs,
        title: chosen.title.as_deref(),
        form: Form {
            width: chosen.width,
            columns: None,
        },
    };
    zip_plot(study, &wanted)
}

/// A measure over a setting. Where bars have less than `few` trials, they are the quartiles, because the interval of a
/// median says little there.
pub(super) fn over_setting(study: &Study, chosen: &Chosen, few: u64) -> Result<Drawn, String> {
    let measure = measure_of(study, chosen)?;
    let varying = study.varying();
    if let Some(key) = chosen.over.filter(|key| !varying.contains(key)) {
        return Err(UnknownName::new("setting that varies", key, &varying).to_string());
    }
    check_held(study, &chosen.held)?;
    let outputs = outputs(study, &chosen.outputs)?;
    let used: Vec<Key> = chosen.held.iter().map(|(key, _)| *key).collect();
    let mut layout = Layout::new(study, chosen.over.or_else(|| x_of(study, measure)), &used);
    layout.held.extend(chosen.held.iter().cloned());
    let mut y = y_axis(measure);
    match chosen.logarithmic {
        Some(true) => y.scale = Scale::Log,
        Some(false) => y.scale = Scale::Linear,
        None => {}
    }
    let style = match chosen.statistic {
        Some(_) => Style::ErrorBars,
        None => style(study, measure, &layout, outputs.len(), chosen.spread),
    };
    let are_few = study.summary.cells.iter().all(|cell| cell.trials < few);
    let what = match chosen.statistic {
        Some(statistic) => format!("{} over trials with 95 % intervals.", statistic.title()),
        None if style == Style::ErrorBars && are_few => "Medians with the middle half of the trials.".to_owned(),
        None => how(style, &layout, outputs.len()).to_owned(),
    };
    let of_medians = chosen.statistic.is_none_or(|of| of == Statistic::Q50);
    let (words, name, end) = match chosen.statistic {
        Some(statistic) => (
            format!("{} of {}", statistic.title(), measure.label()),
            format!("{measure}-{statistic}"),
            statistic.is_quantile(),
        ),
        None => (title(measure, style, &layout), measure.to_string(), true),
    };
    let end = end.then(|| format!(" {}", quantile_note(study)));
    let point = |i: usize, cell: &CellSummary, at: f64| {
        let label = &outputs[i].1;
        let statistics = study.statistics(cell, label, measure)?;
        let point = match chosen.statistic {
            Some(statistic) => {
                let found = statistic.of(statistics);
                Point::uncertain(at, found.value, found.mcse)
            }
            None if style == Style::ErrorBars && are_few => {
                let [low, middle, high] =
                    [statistics.q25, statistics.q50, statistics.q75].map(|quantile| quantile.value);
                Point::interval(at, middle, low, high)
            }
            None if style == Style::ErrorBars => estimate(at, statistics.q50, &y.scale),
            None => quantiles(at, statistics, measure),
        };
        Some(point).filter(|point| point.y.is_finite() && is_shown(study, cell, label))
    };
    let [open, limits] = match style {
        _ if !of_medians => ["", ""],
        Style::ErrorBars => ["", limits(study, &layout, measure)],
        _ => [open_end(study, &outputs, measure), limits(study, &layout, measure)],
    };
    let drawn = Figure {
        name: &name,
        title: &words,
        of: &format!("{} by output. ", measure.label()),
        what: &what,
        left_out: &format!("{open}{limits}{}", left_out(study, &outputs)),
        end: end.as_deref().unwrap_or_default(),
        series: series_of(&outputs, style),
        points: &|i, cell, at| point(i, cell, at).into_iter().collect(),
        value: &|i, cell| value(study, cell, &outputs[i].1, (measure, chosen.statistic)),
        guides: &|cells, plot| {
            let plot = if of_medians {
                let plot = theory(study, &layout, measure, cells, plot);
                references(study, &layout, measure, cells, plot)
            } else {
                plot
            };
            let mut plot = marked(study, &layout, &chosen.marks, cells, plot);
            let wanted = |label: &String| !chosen.without.contains(label);
            plot.series.retain(|series| wanted(&series.label));
            plot.references.retain(|line| wanted(&line.label));
            plot
        },
        finish: &|plots| layout.x.is_none() || !at_one_place(plots),
        whole_title: chosen.title.as_deref(),
        form: Form {
            width: chosen.width,
            columns: None,
        },
        ..Figure::new(&layout, y.clone())
    }
    .draw(study);
    drawn.ok_or_else(|| format!("nothing to draw: no output has {measure} in two cells or more"))
}

/// "median e_a 0.0889(6)"; a median where no statistic is asked for.
fn value(study: &Study, cell: &CellSummary, label: &str, (of, asked): (Measure, Option<Statistic>)) -> String {
    let statistic = asked.unwrap_or(Statistic::Q50);
    let found = study.statistics(cell, label, of).map(|all| statistic.of(all));
    let number = found.map_or_else(String::new, |found| uncertain(found.value, found.mcse));
    let number = with_unit(&number, of.entry().unit);
    format!("{} {} {number}", statistic.title(), of.label())
}

/// Adds the points from elsewhere to the panel of some cells.
fn marked(study: &Study, layout: &Layout, marks: &[Mark], cells: &[&CellSummary], mut plot: Plot) -> Plot {
    for mark in marks {
        let (along, others): (Vec<_>, Vec<_>) = mark.at.iter().partition(|(key, _)| Some(*key) == layout.x);
        let here = cells
            .first()
            .is_some_and(|cell| others.iter().all(|(key, value)| cell.setting(*key) == *value));
        let Some((key, value)) = along.first().filter(|_| here) else {
            continue;
        };
        let at = if layout.has_names {
            study.values(*key).iter().position(|of| of == value).map(|i| i as f64)
        } else {
            value.parse().ok()
        };
        let Some(at) = at else { continue };
        let point = Point::new(at, mark.value);
        match plot.series.iter_mut().find(|series| series.label == mark.label) {
            Some(series) => series.points.push(point),
            None => plot = plot.series(Series::new(&mark.label, Style::Marks, vec![point])),
        }
    }
    plot
}

/// The outputs with these names, with their places in the palette.
fn outputs(study: &Study, names: &[String]) -> Result<Vec<(usize, String)>, String> {
    if names.is_empty() {
        return Ok(lead_outputs(study));
    }
    let labels = study.labels();
    let of_name = |name: &str| -> Vec<&String> {
        let is = |label: &&String| {
            let method = label.split_once('(').map_or(&label[..], |(method, _)| method);
            folded(label) == folded(name) || folded(method) == folded(name)
        };
        labels.iter().filter(is).collect()
    };
    let mut found: Vec<String> = Vec::new();
    for name in names {
        // Names may have commas too.
        let parts: Vec<&str> = if of_name(name).is_empty() {
            name.split(',').map(str::trim).collect()
        } else {
            vec![name]
        };
        for part in parts {
            let of_part = of_name(part);
            if of_part.is_empty() {
                return Err(UnknownName::new("output", part, labels).to_string());
            }
            found.extend(of_part.into_iter().cloned());
        }
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
