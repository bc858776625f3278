//! Figures 1 to 3 of the paper as distributions: e_x(k), e_a and e_b over k, median and 5-95 % band.
//!
//! Blue and vermilion of Okabe and Ito's palette, solid and dashed, so that the two estimators differ in
//! print and for a colour-blind reader.

use super::results::shown;
use crate::metric::Statistics;
use crate::study::{BoundSummary, CellSummary, CurveQuantiles, Figure};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::fmt::Display;
use std::ops::Range;

/// Why a figure could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("cannot draw a figure: {0}")]
pub struct FigureError(String);

fn refused(error: impl Display) -> FigureError {
    FigureError(error.to_string())
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

const SIZE: (u32, u32) = (900, 980);
const HEAD: u32 = 78;
const COLOURS: [RGBColor; 2] = [RGBColor(0, 114, 178), RGBColor(213, 94, 0)];
const FONT: &str = "sans-serif";

/// A quantity over k for one estimator: median and band, with a gap where undefined.
struct Trace {
    points: Vec<Point>,
}

#[derive(Clone, Copy)]
struct Point {
    k: f64,
    low: f64,
    middle: f64,
    high: f64,
}

impl Trace {
    fn empty() -> Self {
        Self { points: Vec::new() }
    }

    fn of_curve(curve: &CurveQuantiles) -> Self {
        let point = |k: usize| {
            Some(Point {
                k: k as f64,
                low: curve.q05[k]?,
                middle: curve.q50[k]?,
                high: curve.q95[k]?,
            })
        };
        Self {
            points: (0..curve.q50.len()).filter_map(point).collect(),
        }
    }

    /// A constant from k = N to K - 1: the estimate is made once.
    fn constant(quantiles: &Statistics, window: usize, horizon: usize) -> Self {
        let defined = quantiles.count > 0;
        let ends = [window as f64, horizon as f64 - 1.0];
        let point = |k| Point {
            k,
            low: quantiles.q05.value,
            middle: quantiles.q50.value,
            high: quantiles.q95.value,
        };
        Self {
            points: ends.into_iter().filter(|_| defined).map(point).collect(),
        }
    }
}

/// One of the three plots.
struct Panel<'a> {
    name: &'static str,
    label: &'static str,
    traces: [Trace; 2],
    bound: Option<&'a BoundSummary>,
    window: usize,
    horizon: usize,
}

impl Panel<'_> {
    /// The range of y: all bands and the bound, with room around.
    fn range(&self) -> Range<f64> {
        let bound = self.bound.and_then(|bound| bound.bound.below);
        let points = self.traces.iter().flat_map(|trace| &trace.points);
        let values = points.flat_map(|p| [p.low, p.high]).chain(bound);
        let (low, high) = values
            .filter(|value| *value > 0.0 && value.is_finite())
            .fold((f64::INFINITY, 0.0_f64), |(low, high), v| {
                (low.min(v), high.max(v))
            });
        if low > high {
            0.1..10.0
        } else {
            low / 2.0..high * 2.0
        }
    }

    fn draw(&self, area: &Area<'_>) -> Result<(), FigureError> {
        let range = self.range();
        let end = self.horizon as f64;
        let axis = range.clone().log_scale().with_key_points(ticks(&range));
        let mut chart = ChartBuilder::on(area)
            .margin_left(14)
            .margin_right(24)
            .margin_top(8)
            .x_label_area_size(46)
            .y_label_area_size(78)
            .build_cartesian_2d(0.0..end, axis)
            .map_err(refused)?;
        chart
            .configure_mesh()
            .x_desc("k, samples")
            .y_desc(self.label)
            .x_label_formatter(&|k| format!("{k:.0}"))
            .y_label_formatter(&|y| label(*y))
            .y_labels(7)
            .axis_desc_style((FONT, 16))
            .label_style((FONT, 14))
            .bold_line_style(BLACK.mix(0.15))
            .light_line_style(TRANSPARENT)
            .draw()
            .map_err(refused)?;
        let window = self.window as f64;
        let collecting = [(0.0, range.start), (window, range.end)];
        let shade = Rectangle::new(collecting, BLACK.mix(0.06).filled());
        chart.draw_series([shade]).map_err(refused)?;
        for (i, trace) in self.traces.iter().enumerate() {
            let points = &trace.points;
            let clamp = |k, y: f64| (k, y.clamp(range.start, range.end));
            let upper = points.iter().map(|p| clamp(p.k, p.high));
            let lower = points.iter().rev().map(|p| clamp(p.k, p.low));
            let outline: Vec<(f64, f64)> = upper.chain(lower).collect();
            let edge = PathElement::new(outline.clone(), COLOURS[i].mix(0.6));
            let band = Polygon::new(outline, COLOURS[i].mix(0.16));
            chart.draw_series([band]).map_err(refused)?;
            chart.draw_series([edge]).map_err(refused)?;
        }
        for (i, trace) in self.traces.iter().enumerate() {
            let line = trace.points.iter().map(|p| (p.k, p.middle));
            let style = COLOURS[i].stroke_width(2);
            if i == 0 {
                chart
                    .draw_series(LineSeries::new(line, style))
                    .map_err(refused)?;
            } else {
                let dashes = DashedLineSeries::new(line, 9, 5, style);
                chart.draw_series(dashes).map_err(refused)?;
            }
        }
        let Some(bound) = self.bound else {
            return Ok(());
        };
        if let Some(value) = bound.bound.below {
            let line = [(0.0, value), (end, value)];
            let dots = DashedLineSeries::new(line, 2, 4, BLACK.stroke_width(2));
            chart.draw_series(dots).map_err(refused)?;
        }
        let right = Pos::new(HPos::Right, VPos::Top);
        let style = (FONT, 14).into_font().color(&BLACK).pos(right);
        let dotted = if bound.bound.below.is_some() {
            "dotted: "
        } else {
            ""
        };
        let every = if self.name == "e_x" {
            " on every k >= N"
        } else {
            ""
        };
        let text = format!(
            "{dotted}the paper's bound{every}, {} {}",
            self.name,
            bound.bound.text()
        );
        let height = (range.end / range.start).powf(0.03);
        let label = Text::new(text, (end * 0.99, range.end / height), style);
        chart.draw_series([label]).map_err(refused)?;
        Ok(())
    }
}

/// Ticks of a logarithmic axis: 1, 2 and 5 in every decade, only 1 where there are many decades.
fn ticks(range: &Range<f64>) -> Vec<f64> {
    let decades = range.start.log10().floor() as i32..=range.end.log10().ceil() as i32;
    let steps: &[i32] = if (range.end / range.start) < 1e3 {
        &[1, 2, 5]
    } else {
        &[1]
    };
    decades
        .flat_map(|decade| steps.iter().map(move |step| (decade, step)))
        // Through text, so that a tick is the number nearest to its label.
        .filter_map(|(decade, step)| format!("{step}e{decade}").parse().ok())
        .filter(|tick| range.contains(tick))
        .collect()
}

/// The label of a tick.
fn label(tick: f64) -> String {
    if (0.001..10_000.0).contains(&tick) {
        format!("{tick}")
    } else {
        format!("{tick:e}")
    }
}

/// Draws one cell as an SVG document: e_x(k) above, e_a and e_b below, each with the paper's bound.
///
/// # Errors
/// If the drawing library refuses.
pub fn draw(cell: &CellSummary) -> Result<String, FigureError> {
    let mut svg = String::new();
    let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
    root.fill(&WHITE).map_err(refused)?;
    let (head, body) = root.split_vertically(HEAD);
    draw_head(&head, cell)?;
    let (state, parameters) = body.split_vertically((SIZE.1 - HEAD) * 2 / 5);
    let (a, b) = parameters.split_vertically((SIZE.1 - HEAD) * 3 / 10);
    let bound = |figure: Figure| {
        cell.bounds
            .iter()
            .find(|bound| bound.bound.figure == figure)
    };
    let constant = |figure: Figure| {
        [cell.outputs.first(), cell.outputs.last()].map(|output| {
            let quantiles = output.and_then(|output| output.figures.get(&figure));
            let trace = quantiles.map(|q| Trace::constant(q, cell.window, cell.horizon));
            trace.unwrap_or_else(Trace::empty)
        })
    };
    let curves = match &cell.curves {
        Some([first, last]) => [Trace::of_curve(first), Trace::of_curve(last)],
        None => [Trace::empty(), Trace::empty()],
    };
    for (area, name, label, traces, figure) in [
        (
            &state,
            "e_x",
            "e_x(k), relative (bins of 6 %)",
            curves,
            Figure::ExMax,
        ),
        (&a, "e_a", "e_a, relative", constant(Figure::Ea), Figure::Ea),
        (&b, "e_b", "e_b, relative", constant(Figure::Eb), Figure::Eb),
    ] {
        let panel = Panel {
            name,
            label,
            traces,
            bound: bound(figure),
            window: cell.window,
            horizon: cell.horizon,
        };
        panel.draw(area)?;
    }
    root.present().map_err(refused)?;
    drop((root, head, body, state, parameters, a, b));
    Ok(svg)
}

/// Title and key.
fn draw_head(area: &Area<'_>, cell: &CellSummary) -> Result<(), FigureError> {
    let trials = cell.trials;
    let noise = if cell.eta == 0.0 {
        "noise-free".to_owned()
    } else {
        format!("noise level {} %", cell.eta)
    };
    let title = format!(
        "{}: {noise}, N = {}, {trials} trials",
        cell.claim, cell.window
    );
    let text = |text: String, x: i32, y: i32, size: i32| Text::new(text, (x, y), (FONT, size));
    area.draw(&text(title, 92, 14, 20)).map_err(refused)?;
    let names = [cell.outputs.first(), cell.outputs.last()];
    let mut x = 92;
    for (i, output) in names.into_iter().enumerate() {
        let band = Rectangle::new([(x, 44), (x + 44, 64)], COLOURS[i].mix(0.18).filled());
        area.draw(&band).map_err(refused)?;
        let dashes: &[(i32, i32)] = if i == 0 {
            &[(0, 44)]
        } else {
            &[(0, 9), (14, 23), (28, 37)]
        };
        for (from, to) in dashes {
            let line = PathElement::new([(x + from, 54), (x + to, 54)], COLOURS[i].stroke_width(2));
            area.draw(&line).map_err(refused)?;
        }
        let label = output.map_or_else(String::new, |output| shown(&output.label()));
        let label = format!("{label}: median, 5-95 %");
        area.draw(&text(label, x + 54, 46, 15)).map_err(refused)?;
        x += 240;
    }
    let shade = Rectangle::new([(x, 44), (x + 44, 64)], BLACK.mix(0.06).filled());
    area.draw(&shade).map_err(refused)?;
    let label = "window, k < N".to_owned();
    area.draw(&text(label, x + 54, 46, 15)).map_err(refused)
}
