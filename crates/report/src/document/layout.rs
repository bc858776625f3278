//! Chooses which setting is the axis, which make panels, and which are held.

use super::extremes::{crowded, extremes};
use crate::plot::{
    Drawing, Picture, Plot, PlotAxis, Point, Scale, Sharing, Style, extent, multiples_of_width, points, small_multiples,
};
use crate::results::{Study, axis_label, place, value_name, words};
use asobench_study::study::file::Key;
use asobench_study::study::{CellSummary, Measure};

/// Settings of a panel, or held settings.
pub(super) type Choice = Vec<(Key, String)>;

/// How the cells of a study are arranged in a figure.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    /// The setting along x; `None` if nothing varies, or if x is something else.
    pub x: Option<Key>,
    /// The panels, each with its values of the settings that vary between panels.
    pub panels: Vec<Choice>,
    /// Settings that vary in the study but are held in the figure.
    pub held: Choice,
    /// Whether the x axis shows names, not numbers.
    pub has_names: bool,
}

/// Largest number of panels in a figure.
const PANELS: usize = 6;

/// The setting along x: the one with the most values; if there are several, the one that readers look at first.
pub(super) fn x_key(study: &Study) -> Option<Key> {
    let varying = study.varying();
    let count = |key: &Key| study.values(*key).len();
    let most = varying.iter().map(count).max()?;
    let candidates = varying.into_iter().filter(|key| count(key) == most);
    candidates.min_by_key(|key| key.entry().along)
}

/// The setting along x for a measure. Settings of the observer do not affect measures of parameters.
pub(super) fn x_of(study: &Study, measure: Measure) -> Option<Key> {
    let usual = x_key(study);
    if measure.entry().of_state || usual.is_none_or(|key| !key.entry().of_observer) {
        return usual;
    }
    let mut others = study.varying();
    others.retain(|key| !key.entry().of_observer && *key != Key::Claim);
    let most = others.iter().rev().max_by_key(|key| study.values(**key).len());
    most.copied().or(usual)
}

impl Layout {
    /// The layout with a given x; `used` are settings shown in another way, such as by colour.
    pub(super) fn new(study: &Study, x: Option<Key>, used: &[Key]) -> Self {
        Self::by(study, x, used, |key| key.entry().held)
    }

    /// The layout with a given order in which settings get panels.
    pub(super) fn by(study: &Study, x: Option<Key>, used: &[Key], weight: impl Fn(Key) -> usize) -> Self {
        let mut keys: Vec<Key> = study.varying();
        keys.retain(|key| Some(*key) != x && !used.contains(key));
        keys.sort_by_key(|key| weight(*key));
        let mut panels: Vec<Choice> = vec![Vec::new()];
        let mut held = Vec::new();
        for key in keys {
            let values = study.values(key);
            if panels.len() * values.len() > PANELS {
                held.push((key, held_value(study, key)));
                continue;
            }
            let with = |panel: &Choice| -> Vec<Choice> {
                let choice = |value: &String| [panel.clone(), vec![(key, value.clone())]].concat();
                values.iter().map(choice).collect()
            };
            panels = panels.iter().flat_map(with).collect();
        }
        let has_names = x.is_none_or(|key| has_names(study, key));
        Self {
            x,
            panels,
            held,
            has_names,
        }
    }

    /// The columns of panels that two settings make: the first setting down, the second across.
    pub(super) fn columns(&self) -> Option<usize> {
        let first = self.panels.first()?;
        let [(key, value), _] = first.as_slice() else {
            return None;
        };
        let across = |panel: &&Choice| panel.first() == Some(&(*key, value.clone()));
        Some(self.panels.iter().filter(across).count())
    }

    /// The cells of a panel.
    pub(super) fn cells<'a>(&self, study: &'a Study, panel: &Choice) -> Vec<&'a CellSummary> {
        let all = panel.iter().chain(&self.held);
        let wanted: Vec<(Key, &str)> = all.map(|(key, value)| (*key, value.as_str())).collect();
        study.cells(&wanted)
    }

    /// The held settings, as the end of a caption.
    pub(super) fn held_text(&self) -> String {
        if self.held.is_empty() {
            return String::new();
        }
        let texts: Vec<String> = self.held.iter().map(|(key, value)| words(*key, value)).collect();
        format!(" Held: {}; the table has the rest.", texts.join(", "))
    }

    /// The x axis.
    pub(super) fn axis(&self, study: &Study) -> PlotAxis {
        let Some(key) = self.x else {
            return PlotAxis::categories("", &["all trials"]);
        };
        let label = axis_label(key);
        if self.has_names {
            let names = study.values(key).iter();
            let names = names.map(|value| value_name(key, value));
            PlotAxis::categories(label, &names.collect::<Vec<_>>())
        } else if study.numbers(key).is_some_and(is_wide) {
            PlotAxis::log(label)
        } else {
            PlotAxis::linear(label)
        }
    }

    /// The place of a cell on the x axis.
    pub(super) fn at(&self, study: &Study, cell: &CellSummary) -> f64 {
        let Some(key) = self.x else {
            return 0.0;
        };
        let place = study.place(cell, key);
        match study.numbers(key) {
            Some(numbers) if !self.has_names => numbers.get(place).copied().unwrap_or(f64::NAN),
            _ => place as f64,
        }
    }

    /// The cells of a panel, sorted along x.
    pub(super) fn along<'a>(&self, study: &'a Study, panel: &Choice) -> Vec<&'a CellSummary> {
        let mut cells = self.cells(study, panel);
        cells.sort_by(|a, b| self.at(study, a).total_cmp(&self.at(study, b)));
        cells
    }
}

/// Beyond every axis, but a number that it can place.
pub(super) const BEYOND: f64 = 1e305;

/// A logarithmic axis reaches at most this many decades above the median value. Values beyond it are noted.
const DECADES: f64 = 12.0;
/// Intervals that reach beyond all values by more than this factor are cut.
const WIDE: f64 = 1e3;

/// Cuts logarithmic y axes that the intervals of a few estimates would stretch. The axis holds every value up
/// to `DECADES` decades above the median value, and about a decade more.
fn cut(plots: &mut [Plot]) {
    // Names below a figure have no values.
    let plots: Vec<&mut Plot> = plots.iter_mut().filter(|plot| !plot.y.has_names()).collect();
    let logarithmic = plots
        .iter()
        .all(|plot| plot.y.scale == Scale::Log && plot.y.range.is_none());
    let all = || plots.iter().flat_map(|plot| &plot.series);
    let points = || all().flat_map(|series| &series.points);
    let (values, middle) = positive_values(points());
    let Some(middle) = middle.filter(|_| logarithmic) else {
        return;
    };
    let references = plots.iter().flat_map(|plot| &plot.references);
    let references: Vec<f64> = references.filter_map(|of| of.course.level()).collect();
    let bounds = 10_f64.powf(DECADES) * middle;
    let kept = values.iter().chain(&references).copied();
    let (low, high) = extent(kept.filter(|y| *y <= bounds));
    let barred = all().filter(|series| series.style != Style::Line);
    let ends = barred
        .flat_map(|series| &series.points)
        .flat_map(|point| [point.low, point.high])
        .filter(|y| *y > 0.0 && *y < BEYOND);
    let (least, most) = extent(ends.chain(values.iter().copied()).chain([low, high]));
    let (above, below) = (most > WIDE * high, least * WIDE < low);
    let open = points().any(|point| point.high >= BEYOND || point.quartiles[1] >= BEYOND);
    if above || below || open {
        let top = if above {
            10_f64.powf((10.0 * high).log10().round())
        } else {
            1.1 * most
        };
        let bottom = if below { 0.1 * low } else { 0.8 * least };
        for plot in plots {
            plot.y.range = Some((bottom, top));
        }
    }
}

/// The values above 0 in order, and their median.
fn positive_values<'a>(points: impl Iterator<Item = &'a Point>) -> (Vec<f64>, Option<f64>) {
    let values = points.map(|point| point.y);
    let mut values: Vec<f64> = values.filter(|y| y.is_finite() && *y > 0.0).collect();
    values.sort_by(f64::total_cmp);
    let middle = values.get(values.len() / 2).copied();
    (values, middle)
}

/// Whether the values of the panels differ so much that a common y axis would flatten them all.
fn apart(plots: &[Plot]) -> bool {
    let middle = |plot: &Plot| positive_values(points(std::slice::from_ref(plot))).1;
    let (least, most) = extent(plots.iter().filter_map(middle));
    plots
        .iter()
        .all(|plot| plot.y.scale == Scale::Log && plot.y.range.is_none())
        && most > 1e5 * least
}

/// The value at which a setting is held: the first that a claim names; otherwise the default, if the study has it;
/// otherwise the last value.
fn held_value(study: &Study, key: Key) -> String {
    let values = study.values(key);
    let claims = study.file.claims.iter();
    let claimed = claims.filter_map(|claim| claim.cells.get(&key));
    let claimed = claimed.flat_map(|axis| axis.values(false));
    let mut wanted = claimed.chain(key.default()).map(|value| value.to_string());
    let found = wanted.find(|value| values.contains(value));
    found.or_else(|| values.last().cloned()).unwrap_or_default()
}

/// Whether numbers are positive and spread so far that their axis is logarithmic.
fn is_wide(numbers: &[f64]) -> bool {
    let (least, most) = positive_ends(numbers);
    numbers.iter().all(|x| *x > 0.0) && most / least > 8.0
}

/// The smallest and the largest positive number.
fn positive_ends(numbers: &[f64]) -> (f64, f64) {
    extent(numbers.iter().copied().filter(|x| *x > 0.0))
}

/// Whether an axis shows values as names: texts, one or two numbers, and numbers including zero if a linear axis would
/// hide the small ones.
fn has_names(study: &Study, key: Key) -> bool {
    let Some(numbers) = study.numbers(key) else {
        return true;
    };
    let (least, most) = positive_ends(numbers);
    !is_wide(numbers) && (numbers.len() < 3 || most / least > 25.0)
}

/// The title of a panel.
pub(super) fn panel_title(panel: &Choice, cells: &[&CellSummary]) -> String {
    let keys: Vec<Key> = panel.iter().map(|(key, _)| *key).collect();
    cells.first().map_or_else(String::new, |cell| place(cell, &keys))
}

/// The form of a sheet where it is not the usual one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Form {
    /// Its width in its own units.
    pub width: Option<f64>,
    /// The columns of its panels.
    pub columns: Option<usize>,
}

/// A picture that is drawn in one way.
pub(super) fn only(wide: Drawing) -> Picture {
    Picture { wide, narrow: None }
}

/// One plot, or several with a common legend, and a note for the caption on what is not drawn.
pub(super) fn sheet(title: &str, description: &str, mut plots: Vec<Plot>, form: Form) -> Option<(Picture, String)> {
    let shown: Vec<String> = plots
        .iter()
        .flat_map(|plot| &plot.series)
        .filter(|series| !series.points.is_empty())
        .map(|series| series.label.clone())
        .collect();
    for plot in &mut plots {
        plot.series.retain(|series| shown.contains(&series.label));
    }
    plots.retain(|plot| plot.series.iter().any(|series| !series.points.is_empty()));
    let note = extremes(&mut plots).unwrap_or_default();
    drop_unused_names(&mut plots);
    crowded(&mut plots);
    let apart = apart(&plots);
    if apart {
        for plot in &mut plots {
            cut(std::slice::from_mut(plot));
        }
    } else {
        cut(&mut plots);
    }
    match plots.as_mut_slice() {
        [] => return None,
        // The title stands once.
        [plot] => title.clone_into(&mut plot.title),
        _ => {}
    }
    let usual = if matches!(plots.len(), 3 | 5..) { 3 } else { 2 };
    let columns = form.columns.unwrap_or(usual);
    let alike = plots.windows(2).all(|pair| pair[0].y.scale == pair[1].y.scale);
    let one_range = plots.windows(2).all(|pair| pair[0].x.range == pair[1].x.range);
    let sharing = Sharing {
        x: one_range,
        y: !apart && alike,
    };
    let picture = match form.width {
        Some(width) => only(multiples_of_width(
            [title, description],
            &plots,
            columns,
            sharing,
            width,
        )),
        None => small_multiples(title, description, &plots, columns, sharing),
    };
    Some((picture, note))
}

/// Removes names from the x axes at which no panel has a point.
fn drop_unused_names(plots: &mut [Plot]) {
    let mut used: Vec<usize> = points(plots).map(|point| point.x as usize).collect();
    used.sort_unstable();
    used.dedup();
    for plot in plots {
        let Scale::Categories(names) = &mut plot.x.scale else {
            continue;
        };
        let kept = used.iter().filter_map(|i| names.get(*i).cloned());
        *names = kept.collect();
        for point in plot.series.iter_mut().flat_map(|series| &mut series.points) {
            let place = used.binary_search(&(point.x as usize));
            point.x = place.map_or(f64::NAN, |place| place as f64);
        }
    }
}
