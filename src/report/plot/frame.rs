//! Axes, grid and labels of one plot.

use super::canvas::{Anchor, Canvas, TICK};
use super::metrics::{width, wrap};
use super::scale::{Map, Tick, minor_ticks, ticks};
use super::{Axis, Plot, Scale};

/// The labels of an x axis and how they are set.
pub(super) struct XLabels {
    ticks: Vec<Tick>,
    lines: Vec<Vec<String>>,
    turned: bool,
    /// Height below the axis.
    pub(super) height: f64,
    /// Room that they need left of the plot.
    pub(super) overhang: f64,
}

const LINE: f64 = 17.0;
/// Labels that do not fit side by side are turned by this.
const TURN: f64 = -45.0;

impl XLabels {
    /// The labels of an axis that is `length` long.
    pub(super) fn new(axis: &Axis, range: (f64, f64), length: f64) -> Self {
        let map = Map::new(&axis.scale, range, (0.0, length));
        let apart = |ticks: &[Tick]| {
            let mut end = f64::NEG_INFINITY;
            ticks.iter().all(|(value, label)| {
                let (place, half) = (map.at(*value).unwrap_or(0.0), width(label, TICK) / 2.0);
                let free = place - half > end + 10.0;
                end = place + half;
                free
            })
        };
        let ticks = ticks(&axis.scale, range, apart);
        if let Scale::Categories(_) = axis.scale {
            return Self::names(ticks, map.unit());
        }
        let lines = ticks.iter().map(|(_, label)| vec![label.clone()]).collect();
        Self {
            ticks,
            lines,
            turned: false,
            height: LINE + 6.0,
            overhang: 0.0,
        }
    }

    /// Names in up to three lines where their words fit, turned otherwise, and only some of them where even that
    /// would be too dense.
    fn names(mut ticks: Vec<Tick>, room: f64) -> Self {
        let words = ticks.iter().flat_map(|(_, label)| label.split_whitespace());
        let widest = words.map(|word| width(word, TICK)).fold(0.0, f64::max);
        let wrapped = |(_, label): &Tick| wrap(label, TICK, room - 8.0);
        let lines: Vec<Vec<String>> = ticks.iter().map(wrapped).collect();
        let most = lines.iter().map(Vec::len).max().unwrap_or(0);
        if widest <= room - 8.0 && most <= 3 {
            return Self {
                ticks,
                lines,
                turned: false,
                height: LINE * most as f64 + 6.0,
                overhang: 0.0,
            };
        }
        let every = (22.0 / room.max(1e-3)).ceil().clamp(1.0, 1e6) as usize;
        ticks = ticks.into_iter().step_by(every).collect();
        let place = |(value, label): &Tick| width(label, TICK) * 0.71 - (value + 0.5) * room;
        let overhang = ticks.iter().map(place).fold(0.0, f64::max) + 10.0;
        let longest = ticks.iter().map(|(_, label)| width(label, TICK));
        Self {
            height: longest.fold(0.0, f64::max) * 0.71 + 22.0,
            lines: ticks.iter().map(|(_, label)| vec![label.clone()]).collect(),
            turned: true,
            overhang,
            ticks,
        }
    }
}

/// The labels of a y axis and how they are set.
pub(super) struct YLabels {
    ticks: Vec<Tick>,
    lines: Vec<Vec<String>>,
    /// Width left of the axis.
    pub(super) width: f64,
}

impl YLabels {
    /// The labels of an axis that is `length` high.
    pub(super) fn new(axis: &Axis, range: (f64, f64), length: f64) -> Self {
        const WIDEST_NAME: f64 = 230.0;
        let map = Map::new(&axis.scale, range, (0.0, length));
        let apart = |ticks: &[Tick]| {
            let places: Vec<f64> = ticks.iter().filter_map(|(v, _)| map.at(*v)).collect();
            places.windows(2).all(|pair| pair[1] - pair[0] > 1.7 * TICK)
        };
        let ticks = ticks(&axis.scale, range, apart);
        let lines: Vec<Vec<String>> = ticks
            .iter()
            .map(|(_, label)| wrap(label, TICK, WIDEST_NAME))
            .collect();
        let widths = lines.iter().flatten().map(|line| width(line, TICK));
        Self {
            width: widths.fold(0.0, f64::max) + 10.0,
            ticks,
            lines,
        }
    }

    /// The height that names need at least.
    pub(super) fn least_height(axis: &Axis) -> f64 {
        match &axis.scale {
            Scale::Categories(names) => 34.0 * names.len() as f64,
            _ => 0.0,
        }
    }
}

/// A plot with the place of its axes.
pub(super) struct Frame<'a> {
    pub(super) plot: &'a Plot,
    pub(super) x: Map,
    pub(super) y: Map,
    /// Left, top, right, bottom.
    pub(super) area: [f64; 4],
    ranges: [(f64, f64); 2],
}

impl<'a> Frame<'a> {
    pub(super) fn new(plot: &'a Plot, ranges: [(f64, f64); 2], area: [f64; 4]) -> Self {
        let [left, top, right, bottom] = area;
        let up = if matches!(plot.y.scale, Scale::Categories(_)) {
            (top, bottom)
        } else {
            (bottom, top)
        };
        Self {
            plot,
            x: Map::new(&plot.x.scale, ranges[0], (left, right)),
            y: Map::new(&plot.y.scale, ranges[1], up),
            area,
            ranges,
        }
    }

    /// Whether intervals lie along y.
    pub(super) fn upright(&self) -> bool {
        !matches!(self.plot.y.scale, Scale::Categories(_))
    }

    /// Whether an axis has names.
    pub(super) fn has_names(&self) -> bool {
        !self.upright() || matches!(self.plot.x.scale, Scale::Categories(_))
    }

    /// Where lines are cut: the axes with room for half a line's width.
    pub(super) fn cut(&self) -> [f64; 4] {
        let [left, top, right, bottom] = self.area;
        [
            left - 1.5,
            top - 1.5,
            right - left + 3.0,
            bottom - top + 3.0,
        ]
    }

    /// Draws grid, ticks and those labels that are given.
    pub(super) fn draw(
        &self,
        canvas: &mut Canvas,
        x_labels: &XLabels,
        labelled: [bool; 2],
        y_labels: &YLabels,
    ) {
        let [left, top, right, bottom] = self.area;
        let (mut grid, mut ticks) = (Vec::new(), Vec::new());
        for x in places(&self.x, &x_labels.ticks) {
            if !matches!(self.plot.x.scale, Scale::Categories(_)) {
                grid.push([(x, top), (x, bottom)]);
            }
            ticks.push([(x, bottom), (x, bottom + 5.0)]);
        }
        for y in places(&self.y, &y_labels.ticks) {
            grid.push([(left, y), (right, y)]);
            ticks.push([(left - 5.0, y), (left, y)]);
        }
        let [x_minor, y_minor] = [
            minor_ticks(&self.plot.x.scale, self.ranges[0]),
            minor_ticks(&self.plot.y.scale, self.ranges[1]),
        ];
        let minor = x_minor.into_iter().filter_map(|value| self.x.at(value));
        ticks.extend(minor.map(|x| [(x, bottom), (x, bottom + 3.0)]));
        let minor = y_minor.into_iter().filter_map(|value| self.y.at(value));
        ticks.extend(minor.map(|y| [(left - 3.0, y), (left, y)]));
        ticks.extend([
            [(left, top), (left, bottom)],
            [(left, bottom), (right, bottom)],
        ]);
        canvas.lines("grid", &grid);
        canvas.lines("axis", &ticks);
        if labelled[0] {
            self.draw_x_labels(canvas, x_labels);
        }
        if labelled[1] {
            self.draw_y_labels(canvas, y_labels);
        }
    }

    fn draw_x_labels(&self, canvas: &mut Canvas, labels: &XLabels) {
        let bottom = self.area[3];
        for ((value, _), lines) in labels.ticks.iter().zip(&labels.lines) {
            let Some(x) = self.x.at(*value) else { continue };
            for (i, line) in lines.iter().enumerate() {
                if labels.turned {
                    canvas.turned("k", Anchor::End, (x + 4.0, bottom + 17.0), TURN, line);
                } else {
                    let y = bottom + 20.0 + LINE * i as f64;
                    canvas.text("k", Anchor::Middle, (x, y), line);
                }
            }
        }
    }

    fn draw_y_labels(&self, canvas: &mut Canvas, labels: &YLabels) {
        let left = self.area[0];
        for ((value, _), lines) in labels.ticks.iter().zip(&labels.lines) {
            let Some(y) = self.y.at(*value) else { continue };
            let first = y + 5.0 - LINE * (lines.len() as f64 - 1.0) / 2.0;
            for (i, line) in lines.iter().enumerate() {
                let place = (left - 9.0, first + LINE * i as f64);
                canvas.text("k", Anchor::End, place, line);
            }
        }
    }
}

/// The places of those ticks that have one.
fn places(map: &Map, ticks: &[Tick]) -> Vec<f64> {
    ticks
        .iter()
        .filter_map(|(value, _)| map.at(*value))
        .collect()
}
