//! One plot, or several in a grid with one legend.

use super::canvas::{Anchor, Canvas, LABEL, TICK, TITLE, WIDTH};
use super::frame::{Frame, XLabels, YLabels};
use super::legend::{EDGE, Legend};
use super::metrics::wrap;
use super::{Plot, Style, marks, scale};

/// Which axes all panels have in common.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sharing {
    /// One range of x, labelled below the lowest panels only.
    pub x: bool,
    /// One range of y, labelled at the left only.
    pub y: bool,
}

/// Several plots in a grid of so many columns with one legend, as an SVG document. A shared axis is labelled as in
/// the first plot, and should have the same scale in all.
pub fn small_multiples(
    title: &str,
    description: &str,
    panels: &[Plot],
    columns: usize,
    sharing: Sharing,
) -> String {
    let columns = columns.clamp(1, panels.len().max(1));
    let sheet = Sheet::new(panels, columns, sharing, true);
    sheet.draw(title, description)
}

/// One plot as an SVG document.
pub(super) fn single(plot: &Plot) -> String {
    let panels = std::slice::from_ref(plot);
    let sheet = Sheet::new(panels, 1, Sharing::default(), false);
    sheet.draw(&plot.title, &plot.description)
}

const TITLE_LINE: f64 = 24.0;
const LABEL_LINE: f64 = 20.0;

struct Sheet<'a> {
    panels: &'a [Plot],
    columns: usize,
    sharing: Sharing,
    titled: bool,
    ranges: Vec<[(f64, f64); 2]>,
    y_labels: Vec<YLabels>,
    height: f64,
    /// Left margins of the columns.
    margins: Vec<f64>,
    /// Width of the axes.
    width: f64,
}

impl<'a> Sheet<'a> {
    fn new(panels: &'a [Plot], columns: usize, sharing: Sharing, titled: bool) -> Self {
        let ranges = ranges(panels, sharing);
        let names = panels.iter().map(|plot| YLabels::least_height(&plot.y));
        let usual = [380.0, 270.0, 210.0][columns.clamp(1, 3) - 1];
        let height = names.fold(usual, f64::max);
        let labels =
            |(plot, range): (&Plot, &[(f64, f64); 2])| YLabels::new(&plot.y, range[1], height);
        let y_labels = panels.iter().zip(&ranges).map(labels).collect();
        let mut sheet = Self {
            panels,
            columns,
            sharing,
            titled,
            ranges,
            y_labels,
            height,
            margins: Vec::new(),
            width: 0.0,
        };
        sheet.margins = (0..columns).map(|column| sheet.margin(column)).collect();
        // Turned labels may need more room at the left, which depends on the width that is left.
        for _ in 0..2 {
            sheet.width = (WIDTH - sheet.margins.iter().sum::<f64>()) / columns as f64 - RIGHT;
            for i in 0..panels.len() {
                let margin = &mut sheet.margins[i % columns];
                let overhang = XLabels::new(&panels[i].x, sheet.ranges[i][0], sheet.width).overhang;
                *margin = margin.max(overhang);
            }
        }
        sheet.width = (WIDTH - sheet.margins.iter().sum::<f64>()) / columns as f64 - RIGHT;
        sheet
    }

    /// Room for the labels of y in a column.
    fn margin(&self, column: usize) -> f64 {
        let labels = self.y_labels.iter().skip(column).step_by(self.columns);
        let widest = labels.map(|labels| labels.width).fold(0.0, f64::max);
        let shown = column == 0 || !self.sharing.y;
        EDGE + if shown { widest.max(28.0) } else { 4.0 }
    }

    fn draw(&self, title: &str, description: &str) -> String {
        let mut canvas = Canvas::default();
        let legend = Legend::of(self.panels);
        let mut y = 14.0;
        for line in wrap(title, TITLE * 1.06, WIDTH - 2.0 * EDGE) {
            canvas.text("t", Anchor::Start, (EDGE, y + 15.0), &line);
            y += TITLE_LINE;
        }
        y += 6.0;
        y += legend.draw(&mut canvas, y) + 8.0;
        for row in 0..self.panels.len().div_ceil(self.columns) {
            y = self.draw_row(&mut canvas, &legend, row, y);
        }
        canvas.document(WIDTH, y + 6.0, title, description)
    }

    /// Draws a row of panels below `top` and gives its end.
    fn draw_row(&self, canvas: &mut Canvas, legend: &Legend, row: usize, top: f64) -> f64 {
        let first = row * self.columns;
        let panels = first..self.panels.len().min(first + self.columns);
        let heads: Vec<[Vec<String>; 2]> = panels.clone().map(|i| self.head(i)).collect();
        let title_lines = heads.iter().map(|head| head[0].len()).max().unwrap_or(0);
        let label_lines = heads.iter().map(|head| head[1].len()).max().unwrap_or(0);
        let labels_top = top + LABEL_LINE * title_lines as f64;
        let axes_top = labels_top + LABEL_LINE * label_lines as f64 + 6.0;
        let mut end: f64 = top;
        for (i, [title, label]) in panels.zip(heads) {
            let column = i - first;
            let start =
                self.margins[..column].iter().sum::<f64>() + column as f64 * (self.width + RIGHT);
            let left = start + self.margins[column];
            for (class, lines, top) in [("p", title, top), ("", label, labels_top)] {
                for (j, line) in lines.iter().enumerate() {
                    let x = if self.columns == 1 {
                        EDGE
                    } else {
                        start + EDGE
                    };
                    let place = (x, top + 15.0 + LABEL_LINE * j as f64);
                    canvas.text(class, Anchor::Start, place, line);
                }
            }
            let area = [left, axes_top, left + self.width, axes_top + self.height];
            end = end.max(self.draw_panel(canvas, legend, i, area));
        }
        end + 12.0
    }

    /// Lines of a panel's title and of its y axis.
    fn head(&self, i: usize) -> [Vec<String>; 2] {
        let plot = &self.panels[i];
        let room = self.width + self.margins[i % self.columns] - EDGE;
        let title = if self.titled { plot.title.as_str() } else { "" };
        let shown = !self.sharing.y || i.is_multiple_of(self.columns);
        let label = if shown { plot.y.label.as_str() } else { "" };
        [wrap(title, LABEL * 1.06, room), wrap(label, LABEL, room)]
    }

    /// Draws one panel and gives its end.
    fn draw_panel(&self, canvas: &mut Canvas, legend: &Legend, i: usize, area: [f64; 4]) -> f64 {
        let plot = &self.panels[i];
        let lowest = i + self.columns >= self.panels.len();
        let labelled = [
            !self.sharing.x || lowest,
            !self.sharing.y || i.is_multiple_of(self.columns),
        ];
        let frame = Frame::new(plot, self.ranges[i], area);
        let x_labels = XLabels::new(&plot.x, self.ranges[i][0], self.width);
        frame.draw(canvas, &x_labels, labelled, &self.y_labels[i]);
        marks::draw(canvas, &frame, legend);
        let [left, _, right, bottom] = area;
        let mut y = bottom + 8.0;
        if labelled[0] {
            y = bottom + x_labels.height;
            let middle = f64::midpoint(left, right);
            for line in wrap(&plot.x.label, LABEL, self.width) {
                canvas.text("", Anchor::Middle, (middle, y + 16.0), &line);
                y += LABEL_LINE;
            }
        }
        for line in wrap(&note(&frame), TICK, self.width) {
            canvas.text("k", Anchor::Start, (left, y + 16.0), &line);
            y += LABEL_LINE;
        }
        y
    }
}

/// Room right of the axes, for half of the last label.
const RIGHT: f64 = 24.0;

/// What is not seen, in words.
fn note(frame: &Frame<'_>) -> String {
    let (not_positive, outside) = marks::unseen(frame);
    let points = |count: usize| if count == 1 { "point" } else { "points" };
    let mut notes = Vec::new();
    if frame.plot.series.iter().all(|series| {
        let defined = |point: &super::Point| point.x.is_finite() && point.y.is_finite();
        !series.points.iter().any(defined)
    }) {
        notes.push("No defined value.".to_owned());
    }
    if not_positive > 0 {
        let points = points(not_positive);
        notes.push(format!(
            "Not shown: {not_positive} {points} not above 0 on a logarithmic axis."
        ));
    }
    if outside > 0 {
        notes.push(format!(
            "Outside of the axes: {outside} {}.",
            points(outside)
        ));
    }
    notes.join(" ")
}

/// The ranges of x and y of every panel.
fn ranges(panels: &[Plot], sharing: Sharing) -> Vec<[(f64, f64); 2]> {
    let values: Vec<(Vec<f64>, Vec<f64>)> = panels.iter().map(marks::values).collect();
    let all_x: Vec<f64> = values.iter().flat_map(|(x, _)| x).copied().collect();
    let all_y: Vec<f64> = values.iter().flat_map(|(_, y)| y).copied().collect();
    let rooms: Vec<f64> = panels.iter().map(room_of_x).collect();
    let widest = rooms.iter().copied().fold(0.0, f64::max);
    let mut ranges = Vec::with_capacity(panels.len());
    for (i, plot) in panels.iter().enumerate() {
        let (x_axis, x, room) = if sharing.x {
            (&panels[0].x, &all_x, widest)
        } else {
            (&plot.x, &values[i].0, rooms[i])
        };
        let (y_axis, y) = if sharing.y {
            (&panels[0].y, &all_y)
        } else {
            (&plot.y, &values[i].1)
        };
        ranges.push([
            scale::range(x_axis, x.iter().copied(), room),
            scale::range(y_axis, y.iter().copied(), 0.05),
        ]);
    }
    ranges
}

/// Room beside the values of x: none for lines, some for markers.
fn room_of_x(plot: &Plot) -> f64 {
    let bare = |style: Style| {
        matches!(
            style,
            Style::Line | Style::Band | Style::Steps | Style::Traces
        )
    };
    let boxes = plot
        .series
        .iter()
        .any(|series| series.style == Style::Boxes);
    match (plot.series.iter().all(|series| bare(series.style)), boxes) {
        (true, _) => 0.0,
        (_, true) => 0.12,
        _ => 0.06,
    }
}
