//! Figures 1 to 3 of Nikolov et al.: e_x(k), e_a and e_b from k = N on, as distributions with median and 5-95 % band,
//! and of one realisation.

use super::plot::{Course, Plot, PlotAxis, Point, Series, Sharing, Style, extent, points, small_multiples};
use asobench_identification::metric::Statistics;
use asobench_study::study::{CellSummary, CurveQuantiles, Measure};

/// The errors of the first and the last output in one trial, each in both readings of Eq. (7): relative and as printed.
#[derive(Clone, Debug, Default)]
pub struct OneTrial {
    /// The seed.
    pub seed: u64,
    /// The trial's number.
    pub trial: u64,
    /// The outputs' errors.
    pub outputs: [[TrialErrors; 2]; 2],
}

/// Errors of one trial in one reading; NaN where undefined.
#[derive(Clone, Debug)]
pub struct TrialErrors {
    /// e_x(k), k = 0 ... K-1; empty if there is none.
    pub e_x: Vec<f64>,
    /// e_a.
    pub e_a: f64,
    /// e_b.
    pub e_b: f64,
}

impl Default for TrialErrors {
    fn default() -> Self {
        Self {
            e_x: Vec::new(),
            e_a: f64::NAN,
            e_b: f64::NAN,
        }
    }
}

/// One of the three errors.
struct Error {
    measure: Measure,
    /// The same as Eq. (7) prints it, where it is one number.
    as_printed: Option<Measure>,
    label: &'static str,
}

const ERRORS: [Error; 3] = [
    Error {
        measure: Measure::ExMax,
        as_printed: None,
        label: "e_x(k)",
    },
    Error {
        measure: Measure::Ea,
        as_printed: Some(Measure::EaPrinted),
        label: "e_a",
    },
    Error {
        measure: Measure::Eb,
        as_printed: Some(Measure::EbPrinted),
        label: "e_b",
    },
];

/// The quantiles of a curve over k; undefined where missing.
pub(super) fn curve(curve: &CurveQuantiles) -> Vec<Point> {
    let value = |quantiles: &[Option<f64>], k: usize| quantiles.get(k).copied().flatten().unwrap_or(f64::NAN);
    let point = |k: usize| {
        let [low, middle, high] = [&curve.q05, &curve.q50, &curve.q95].map(|quantiles| value(quantiles, k));
        Point::interval(k as f64, middle, low, high)
    };
    (0..curve.q50.len()).map(point).collect()
}

/// A constant from k = N to K - 1, because the estimate is made once.
fn constant(cell: &CellSummary, [low, middle, high]: [f64; 3]) -> Vec<Point> {
    [cell.window, cell.horizon.saturating_sub(1)]
        .map(|k| Point::interval(k as f64, middle, low, high))
        .to_vec()
}

/// The 5, 50 and 95 % quantiles; NaN if there are none.
fn quantiles(statistics: Option<&Statistics>) -> [f64; 3] {
    let defined = statistics.filter(|statistics| statistics.count > 0);
    defined.map_or([f64::NAN; 3], |of| [of.q05.value, of.q50.value, of.q95.value])
}

/// The distribution of an error: the first and the last output, and the paper's bound.
fn distribution(cell: &CellSummary, error: &Error) -> Plot {
    let mut plot = panel(cell, error, ": medians, 5-95 %");
    let outputs = [cell.outputs.first(), cell.outputs.last()];
    for (i, output) in outputs.into_iter().enumerate() {
        let Some(output) = output else { continue };
        let measured = |measure: &Measure| quantiles(output.measures.get(measure));
        let points = match (error.measure, &cell.curves) {
            (Measure::ExMax, curves) => curves.as_ref().map_or_else(Vec::new, |curves| {
                curve(&curves[i]).into_iter().skip(cell.window).collect()
            }),
            (measure, _) => constant(cell, measured(&measure)),
        };
        plot = plot.series(Series::new(output.label(), Style::Band, points).slot(i));
        if let Some(measure) = &error.as_printed {
            let [_, middle, _] = measured(measure);
            let points = constant(cell, [f64::NAN, middle, f64::NAN]);
            let name = format!("{}: median as printed", output.label());
            plot = plot.series(Series::new(name, Style::Line, points).slot(2 + i));
        }
    }
    plot
}

/// The error in one trial, in one reading.
fn realisation(cell: &CellSummary, error: &Error, one: &OneTrial, as_printed: bool) -> Plot {
    let reading = if as_printed { " as printed" } else { "" };
    let mut plot = panel(cell, error, &format!("{reading}, trial {}", one.trial));
    let outputs = [cell.outputs.first(), cell.outputs.last()];
    for (i, (output, readings)) in outputs.into_iter().zip(&one.outputs).enumerate() {
        let Some(output) = output else { continue };
        let errors = &readings[usize::from(as_printed)];
        let points = match error.measure {
            Measure::ExMax => (0..cell.horizon)
                .zip(&errors.e_x)
                .skip(cell.window)
                .map(|(k, e_x)| Point::new(k as f64, *e_x))
                .collect(),
            Measure::Ea => constant(cell, [f64::NAN, errors.e_a, f64::NAN]),
            _ => constant(cell, [f64::NAN, errors.e_b, f64::NAN]),
        };
        plot = plot.series(Series::new(output.label(), Style::Line, points).slot(i));
    }
    plot
}

/// An empty plot of an error, with the paper's bound.
fn panel(cell: &CellSummary, error: &Error, what: &str) -> Plot {
    let x = PlotAxis::linear("k, samples").range(0.0, cell.horizon as f64);
    let mut plot = Plot::new("", x, PlotAxis::log(format!("{}{what}", error.label)));
    let mut bounds = cell.bounds.iter().map(|bound| &bound.bound);
    if let Some(bound) = bounds.find(|bound| bound.measure == error.measure) {
        let every = if error.measure == Measure::ExMax {
            ", every k"
        } else {
            ""
        };
        let name = error.label.trim_end_matches("(k)");
        plot.title = format!("Bound: {name} {}{every}", bound.text());
        if let (Some(value), None) = (bound.below, bound.rounding) {
            plot = plot.reference("the paper's bound", Course::Horizontal(value));
        }
    }
    plot.reference("k = N: the first estimate", Course::Vertical(cell.window as f64))
}

/// Gives the plots of a row the range of their values.
fn same_range(plots: &mut [Plot]) {
    let values = points(plots).flat_map(|point| [point.low, point.y, point.high]);
    let references = plots.iter().flat_map(|plot| &plot.references);
    let bounds = references.filter_map(|of| of.course.level());
    let positive = values.chain(bounds).filter(|y| *y > 0.0 && y.is_finite());
    let (least, most) = extent(positive);
    if least < most {
        for plot in plots {
            plot.y.range = Some((least / 1.1, most * 1.1));
        }
    }
}

/// Draws one cell as an SVG document: e_x(k) above, e_a and e_b below, each with the paper's bound; medians over all
/// trials, and one trial in both readings of Eq. (7).
pub fn draw(cell: &CellSummary, one: &OneTrial) -> String {
    let noise = if cell.eta == 0.0 {
        "noise-free".to_owned()
    } else {
        format!("noise level {} %", cell.eta)
    };
    let (claim, window, trials) = (&cell.claim, cell.window, cell.trials);
    let title = format!(
        "{claim}: {noise}, N = {window}, {trials} trials, and trial {} of seed {}",
        one.trial, one.seed
    );
    let rows = ERRORS.iter().map(|error| {
        let mut row = [
            distribution(cell, error),
            realisation(cell, error, one, false),
            realisation(cell, error, one, true),
        ];
        same_range(&mut row);
        row
    });
    let panels: Vec<Plot> = rows.flatten().collect();
    let what = "Left: medians of e_x(k), e_a and e_b over k, bands hold the middle 90 % of the trials; quantiles of \
        e_x(k) come from bins of 6 %. Middle: trial 0, whatever it is. Right: the same trial, by Eq. (7) as printed, \
        undefined where a sum of states is not above 0. Before k = N there is no estimate.";
    small_multiples(&title, what, &panels, 3, Sharing { x: true, y: false })
        .wide
        .svg()
}
