//! A figure of a study: its specification, and the one way in which it is drawn.

use super::answer::at;
use super::layout::{Form, Layout, panel_title, sheet};
use crate::plot::{Course, Picture, Plot, PlotAxis, Point, Scale, Series, Style, points};
use crate::results::{self, Study};
use asobench_identification::metric::{Quantile, Share, Z};
use asobench_study::study::{CellSummary, Measure, measure};
use asobench_study::text::{grouped, rounded, visible};

/// A figure with its file name.
#[derive(Clone, Debug)]
pub(super) struct Drawn {
    /// The file name without folder and extension.
    pub name: String,
    /// The figure.
    pub picture: Picture,
    /// The caption.
    pub caption: String,
}

/// A figure with a panel for each choice of a layout, and in each panel the same series over its cells.
pub(super) struct Figure<'a> {
    /// The file name without folder and extension.
    pub name: &'a str,
    /// The title's words after that of the study.
    pub title: &'a str,
    /// The title that is asked for instead.
    pub whole_title: Option<&'a str>,
    /// The drawing in words: the description, and the beginning of the caption.
    pub what: &'a str,
    /// The words before it in the description.
    pub of: &'a str,
    /// The next words of the caption.
    pub about: &'a str,
    /// The caption's words on things that are not drawn.
    pub left_out: &'a str,
    /// The end of the caption.
    pub end: &'a str,
    /// The panels and their cells.
    pub layout: &'a Layout,
    /// The x axis; `None`: the setting along x.
    pub x: Option<PlotAxis>,
    /// The y axis.
    pub y: PlotAxis,
    /// The series, without points.
    pub series: Vec<Series>,
    /// The points of a series in a cell, from the number of the series, the cell and its place along x.
    pub points: &'a dyn Fn(usize, &CellSummary, f64) -> Vec<Point>,
    /// Adds what is not a series over cells to the panel of some cells.
    pub guides: &'a dyn Fn(&[&CellSummary], Plot) -> Plot,
    /// The note beside the points of a series in a cell, where there is room; left out where the point before has the
    /// same.
    pub notes: &'a dyn Fn(usize, &CellSummary) -> String,
    /// The value of a point in words; where they are empty, those of the y axis with the interval.
    pub value: &'a dyn Fn(usize, &CellSummary) -> String,
    /// The width and the columns.
    pub form: Form,
    /// Changes the panels together, and says whether they are worth drawing.
    pub finish: &'a dyn Fn(&mut Vec<Plot>) -> bool,
}

impl<'a> Figure<'a> {
    /// A figure without words, series and points.
    pub(super) fn new(layout: &'a Layout, y: PlotAxis) -> Self {
        Self {
            name: "",
            title: "",
            whole_title: None,
            what: "",
            of: "",
            about: "",
            left_out: "",
            end: "",
            layout,
            x: None,
            y,
            series: Vec::new(),
            points: &|_, _, _| Vec::new(),
            guides: &|_, plot| plot,
            notes: &|_, _| String::new(),
            value: &|_, _| String::new(),
            form: Form::default(),
            finish: &|_| true,
        }
    }

    /// Draws the figure; `None` if it has no points, or is not worth it.
    pub(super) fn draw(&self, study: &Study) -> Option<Drawn> {
        let layout = self.layout;
        let panel = |panel| {
            let cells = layout.along(study, panel);
            let x = self.x.clone().unwrap_or_else(|| layout.axis(study));
            let mut plot = Plot::new(panel_title(panel, &cells), x, self.y.clone());
            plot.series.clone_from(&self.series);
            for (i, series) in plot.series.iter_mut().enumerate() {
                for cell in &cells {
                    let mut points = (self.points)(i, cell, layout.at(study, cell));
                    // A step has two points and no marker.
                    for point in points.iter_mut().filter(|_| series.style != Style::Steps) {
                        point.hint = Some(series.hints.len());
                        series.hints.push(self.hint(study, (i, &series.label), cell, point));
                    }
                    let note = (self.notes)(i, cell);
                    series.notes.extend(points.iter().map(|_| note.clone()));
                    series.points.extend(points);
                }
                only_changes(&mut series.notes);
            }
            (self.guides)(&cells, plot)
        };
        let mut plots: Vec<Plot> = layout.panels.iter().map(panel).collect();
        if points(&plots).count() > HINTS {
            let series = plots.iter_mut().flat_map(|plot| &mut plot.series);
            series.for_each(|series| series.hints.clear());
        }
        if !(self.finish)(&mut plots) {
            return None;
        }
        let Self {
            what,
            of,
            about,
            left_out,
            end,
            ..
        } = self;
        let title = match self.whole_title {
            Some(title) => title.to_owned(),
            None => format!("{}: {}", study.title(), self.title),
        };
        let form = Form {
            columns: self.form.columns.or_else(|| layout.columns()),
            ..self.form
        };
        let (picture, note) = sheet(&title, &format!("{of}{what}"), plots, form)?;
        Some(Drawn {
            name: self.name.to_owned(),
            picture,
            caption: format!("{what}{about}{note}{left_out}{}{end}", layout.held_text()),
        })
    }
}

impl Figure<'_> {
    /// The method and the cell of a point, its value, its trials, and in a second line the command that replays one.
    fn hint(&self, study: &Study, (i, label): (usize, &str), cell: &CellSummary, point: &Point) -> String {
        let along = self.x.as_ref().map_or_else(String::new, |axis| match &axis.scale {
            Scale::Categories(names) => names
                .get(point.x as usize)
                .map_or_else(String::new, |name| format!(", {name}")),
            _ => format!(", {} {}", axis.label, rounded(point.x, 4)),
        });
        let at = at(cell, &study.varying());
        let value = match (self.value)(i, cell) {
            words if words.is_empty() => {
                let [y, low, high] = [point.y, point.low, point.high].map(|value| rounded(value, 3));
                let interval = if point.low.is_nan() {
                    String::new()
                } else {
                    format!(" [{low}, {high}]")
                };
                format!("{} {y}{interval}", self.y.label)
            }
            words => words,
        };
        let output = study.output(cell, label);
        let lost = match output.map_or(0, |output| output.outcomes.lost_trials().0) {
            0 => String::new(),
            lost => format!(", {} lost", grouped(lost)),
        };
        let words = format!("{label} {at}{along}: {value}; {} trials{lost}", grouped(cell.trials));
        format!("{}\n{}", visible(words), visible(study.replay_of(cell, output)))
    }
}

/// Empties each text that is the same as the one before.
fn only_changes(notes: &mut [String]) {
    for i in (1..notes.len()).rev() {
        if notes[i] == notes[i - 1] {
            notes[i].clear();
        }
    }
}

/// A figure with more points has no words on them: they would make most of a page.
const HINTS: usize = 300;

/// Whose coefficients a table or figure has: in the state space `a` is not that of A(q).
pub(super) const WHOSE: &str = "a_i is the paper's, in the last row of the companion matrix: minus the coefficient of \
    q^-(n+1-i) in A(q). h_i is the coefficient of q^-i in B(q).";

/// A measure as the subject of a sentence: "error of a". Its symbol stands on the axis.
pub(super) fn subject(measure: Measure) -> &'static str {
    match measure {
        Measure::Ea => "error of a",
        Measure::Eb => "error of b",
        Measure::Eh => "error of h",
        Measure::Ex0 => "error of x0",
        Measure::ExMax => "largest error of the state",
        Measure::ExRms => "rms error of the state",
        Measure::ImpulseResponse => "error of the impulse response",
        Measure::Theta => "error of theta at the end",
        Measure::ThetaRms => "rms error of theta",
        Measure::SpectralRadius => "spectral radius of the model",
        measure => measure.label(),
    }
}

/// "over N" for the setting along x; empty if nothing varies.
pub(super) fn over(layout: &Layout) -> String {
    let Some(key) = layout.x else {
        return String::new();
    };
    let axis = key.axis_label();
    let name = axis.split(',').next().unwrap_or_default();
    format!(" over {name}")
}

/// Whether a figure shows an output of a cell. It does not if most trials fail, because the median is then that of a
/// few. It also does not if the cell has no noise and other cells have, because every axis would then reach down to
/// rounding errors.
pub(super) fn is_shown(study: &Study, cell: &CellSummary, label: &str) -> bool {
    let output = study.output(cell, label);
    !study.is_quiet(cell) && output.is_some_and(|output| output.failed.low <= 0.5)
}

/// The part of a caption that says what is left out.
pub(super) fn left_out(study: &Study, outputs: &[(usize, String)]) -> String {
    let cells = || study.summary.cells.iter();
    let failing = |cell| {
        let fails = move |label: &&String| {
            let output = study.output(cell, label);
            output.is_some_and(|output| output.failed.low > 0.5)
        };
        outputs.iter().map(|(_, label)| label).filter(fails)
    };
    let mut text = String::new();
    if cells().any(|cell| study.is_quiet(cell)) {
        text.push_str(" Cells without noise are in the table only: their errors are rounding errors.");
    }
    let keys = study.varying();
    let noisy = cells().filter(|cell| !study.is_quiet(cell));
    let places = noisy.flat_map(|cell| failing(cell).map(move |label| (label, cell)));
    let places: Vec<(&String, &CellSummary)> = places.collect();
    let named = |(label, cell): &(&String, &CellSummary)| format!("{label}{}", results::at(cell, &keys));
    let shown: Vec<String> = places.iter().take(PLACES).map(named).collect();
    if !shown.is_empty() {
        let more = match places.len() - shown.len() {
            0 => String::new(),
            more => format!("; and {more} more"),
        };
        text.push_str(&format!(
            " Gaps are where more than half of the trials fail: {}{more}.",
            shown.join("; ")
        ));
    }
    text
}

/// Largest number of gaps that a caption names.
const PLACES: usize = 4;

/// Series for outputs, each with its place in the palette.
pub(super) fn series_of(outputs: &[(usize, String)], style: Style) -> Vec<Series> {
    let series = |(slot, label): &(usize, String)| Series::new(label, style, Vec::new()).slot(*slot);
    outputs.iter().map(series).collect()
}

/// Adds a horizontal line to each panel.
pub(super) fn level(label: &'static str, y: f64) -> impl Fn(&[&CellSummary], Plot) -> Plot {
    move |_, plot| plot.reference(label, Course::Horizontal(y))
}

/// A share in per cent with its 95 % interval.
pub(super) fn share_point(at: f64, share: Share) -> Point {
    let [y, low, high] = [share.share, share.low, share.high].map(|share| 100.0 * share);
    Point::interval(at, y, low, high)
}

/// A value with its 95 % interval. On a logarithmic axis, it is the interval of the logarithm.
pub(super) fn estimate(at: f64, quantile: Quantile, scale: &Scale) -> Point {
    if *scale == Scale::Log && quantile.value > 0.0 {
        let factor = (Z * quantile.mcse / quantile.value).exp();
        Point::interval(at, quantile.value, quantile.value / factor, quantile.value * factor)
    } else {
        Point::uncertain(at, quantile.value, quantile.mcse)
    }
}

/// Explains the quantiles and their accuracy.
pub(super) fn quantile_note(study: &Study) -> String {
    let percent = 100.0 * study.summary.quantile_relative_error;
    format!(
        "Quantiles are over all trials, failed ones counted as worst and unstable models as estimated; they come from \
         bins with a relative error below {percent:.2} %."
    )
}

/// The y axis of a measure.
pub(super) fn y_axis(measure: Measure) -> PlotAxis {
    let label = measure.axis_label();
    match measure.entry().scale {
        measure::Scale::Log => PlotAxis::log(label),
        measure::Scale::Linear => PlotAxis::linear(label),
        measure::Scale::Percent => PlotAxis::linear(label).range(-20.0, 100.0),
    }
}
