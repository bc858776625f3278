//! Series and reference lines inside the axes of one plot.

use super::canvas::{Canvas, course};
use super::frame::Frame;
use super::legend::{Legend, Look};
use super::thin::{envelope, thin};
use super::{Course, Plot, Point, Scale, Series, Style};

type Place = (f64, f64);

/// Where the marks of one series stand beside those of the others.
#[derive(Clone, Copy)]
struct Berth {
    offset: f64,
    /// Room across for a box.
    width: f64,
}

/// Draws everything that a plot shows inside its axes.
pub(super) fn draw(canvas: &mut Canvas, frame: &Frame<'_>, legend: &Legend) {
    let berths = berths(frame);
    let cut = frame.cut();
    for (series, berth) in frame.plot.series.iter().zip(berths) {
        let look = legend.look(&series.label);
        let pen = Pen { frame, look, berth };
        canvas.group(&look.class(), |canvas| {
            canvas.clipped(cut, |canvas| pen.lines(canvas, series));
            pen.markers(canvas, series);
        });
    }
    // On top, where a wide band does not hide them.
    canvas.clipped(cut, |canvas| {
        for reference in &frame.plot.references {
            let dashes = legend.reference_dashes(&reference.label);
            reference_line(canvas, frame, reference.course, dashes);
        }
    });
}

/// How many of the values a logarithmic axis cannot show, and how many lie outside given ends.
pub(super) fn unseen(frame: &Frame<'_>) -> (usize, usize) {
    let (mut not_positive, mut outside) = (0, 0);
    let points = frame.plot.series.iter().flat_map(|series| &series.points);
    for point in points.filter(|point| point.x.is_finite() && point.y.is_finite()) {
        let (x, y) = (
            frame.x.coordinate(point.x).is_some(),
            frame.y.coordinate(point.y).is_some(),
        );
        if !x || !y {
            not_positive += 1;
        } else if !frame.x.holds(point.x) || !frame.y.holds(point.y) {
            outside += 1;
        }
    }
    (not_positive, outside)
}

fn side_by_side(series: &Series) -> bool {
    matches!(
        series.style,
        Style::Boxes | Style::ErrorBars | Style::Markers
    )
}

/// Marks of several series at one place stand side by side: over names with all the room between them, otherwise
/// just far enough to see both bars.
fn berths(frame: &Frame<'_>) -> Vec<Berth> {
    let series = &frame.plot.series;
    let axis = if frame.upright() { &frame.x } else { &frame.y };
    let names = frame.has_names();
    let moved = |series: &&Series| {
        side_by_side(series)
            && (names || series.style != Style::Markers)
            && !series.points.is_empty()
    };
    let count = series.iter().filter(moved).count().max(1) as f64;
    let boxes = series.iter().any(|series| series.style == Style::Boxes);
    // Less in the narrow panels of a grid.
    let size = ((frame.area[2] - frame.area[0]) / 800.0).clamp(0.5, 1.0);
    let pitch = match (names, boxes) {
        (true, _) => (0.78 * axis.unit() / count).min(60.0),
        (false, true) => 26.0 * size,
        (false, false) => 7.0 * size,
    };
    let mut index = 0.0;
    let mut berth = |series: &Series| {
        let mut offset = 0.0;
        if moved(&series) {
            offset = (index - (count - 1.0) / 2.0) * pitch;
            index += 1.0;
        }
        let width = 0.78 * pitch;
        Berth { offset, width }
    };
    series.iter().map(&mut berth).collect()
}

fn reference_line(canvas: &mut Canvas, frame: &Frame<'_>, course: Course, dashes: &str) {
    let [left, top, right, bottom] = frame.area;
    let ends = match course {
        Course::Horizontal(y) => frame.y.at(y).map(|y| ((left, y), (right, y))),
        Course::Vertical(x) => frame.x.at(x).map(|x| ((x, bottom), (x, top))),
        Course::Sloped { slope, through } => sloped(frame, slope, through),
    };
    if let Some((from, to)) = ends {
        canvas.line("ref", dashes, from, to);
    }
}

fn sloped(frame: &Frame<'_>, slope: f64, through: Place) -> Option<(Place, Place)> {
    let (x, y) = (
        frame.x.coordinate(through.0)?,
        frame.y.coordinate(through.1)?,
    );
    let (first, last) = frame.x.ends();
    let at = |end: f64| (frame.x.length(end), frame.y.length(y + slope * (end - x)));
    slope.is_finite().then(|| (at(first), at(last)))
}

/// Draws one series.
struct Pen<'a> {
    frame: &'a Frame<'a>,
    look: Look,
    berth: Berth,
}

impl Pen<'_> {
    /// The place of (x, y), shifted across where series stand side by side.
    fn place(&self, x: f64, y: f64) -> Option<Place> {
        let (x, y) = (self.frame.x.at(x)?, self.frame.y.at(y)?);
        Some(if self.frame.upright() {
            (x + self.berth.offset, y)
        } else {
            (x, y + self.berth.offset)
        })
    }

    /// The place at a value along the interval of a point.
    fn along(&self, point: &Point, value: f64) -> Option<Place> {
        let frame = self.frame;
        Some(if frame.upright() {
            (
                frame.x.at(point.x)? + self.berth.offset,
                frame.y.end(value)?,
            )
        } else {
            (
                frame.x.end(value)?,
                frame.y.at(point.y)? + self.berth.offset,
            )
        })
    }

    /// A place moved across the interval.
    fn across(&self, (x, y): Place, by: f64) -> Place {
        if self.frame.upright() {
            (x + by, y)
        } else {
            (x, y + by)
        }
    }

    /// What the edge of the plot cuts.
    fn lines(&self, canvas: &mut Canvas, series: &Series) {
        let points = &series.points;
        match series.style {
            Style::Markers => {}
            Style::Line => self.polyline(canvas, "line", self.look.dashes(), points),
            Style::Traces => self.polyline(canvas, "trace", "", points),
            Style::Steps => self.steps(canvas, points),
            Style::Band => self.band(canvas, points),
            Style::ErrorBars => self.error_bars(canvas, points),
            Style::Boxes => points.iter().for_each(|point| self.draw_box(canvas, point)),
        }
    }

    fn polyline(&self, canvas: &mut Canvas, class: &str, dashes: &str, points: &[Point]) {
        for part in parts(points, |point| self.place(point.x, point.y)) {
            stroke(canvas, class, dashes, &part);
        }
    }

    fn steps(&self, canvas: &mut Canvas, points: &[Point]) {
        for part in parts(points, |point| self.place(point.x, point.y)) {
            let corners = part.windows(2).map(|pair| (pair[1].0, pair[0].1));
            let mut stairs: Vec<Place> = Vec::with_capacity(2 * part.len());
            for (place, corner) in part.iter().zip(corners.map(Some).chain([None])) {
                stairs.push(*place);
                stairs.extend(corner);
            }
            stroke(canvas, "line", self.look.dashes(), &stairs);
        }
    }

    fn band(&self, canvas: &mut Canvas, points: &[Point]) {
        let ends = |point: &Point| {
            Some((
                self.along(point, point.low)?,
                self.along(point, point.high)?,
            ))
        };
        for part in parts(points, ends) {
            let low = envelope(part.iter().map(|(low, _)| *low), f64::max);
            let high = envelope(part.iter().map(|(_, high)| *high), f64::min);
            if let ([low], [high]) = (low.as_slice(), high.as_slice()) {
                canvas.line("thin", "", *low, *high);
                continue;
            }
            let outline: Vec<Place> = high.iter().chain(low.iter().rev()).copied().collect();
            canvas.path("band", "", &format!("{}Z", course(&outline)));
        }
        self.polyline(canvas, "line", self.look.dashes(), points);
    }

    fn error_bars(&self, canvas: &mut Canvas, points: &[Point]) {
        if !self.frame.has_names() {
            for part in parts(points, |point| self.place(point.x, point.y)) {
                canvas.path("thin", self.look.dashes(), &course(&part));
            }
        }
        // A bar that the marker hides is not drawn.
        let hidden = |point: &Point| {
            let ends = (self.along(point, point.low), self.along(point, point.high));
            matches!(ends, (Some(a), Some(b)) if (a.0 - b.0).hypot(a.1 - b.1) < 3.0)
        };
        for point in points.iter().filter(|point| !hidden(point)) {
            self.whisker(canvas, point, point.low, point.high, 4.0);
        }
    }

    /// A bar between two values with caps.
    fn whisker(&self, canvas: &mut Canvas, point: &Point, from: f64, to: f64, cap: f64) {
        let (Some(from), Some(to)) = (self.along(point, from), self.along(point, to)) else {
            return;
        };
        let cap = |end| [self.across(end, -cap), self.across(end, cap)];
        canvas.lines("thin", &[[from, to], cap(from), cap(to)]);
    }

    fn draw_box(&self, canvas: &mut Canvas, point: &Point) {
        let half = self.berth.width / 2.0;
        let [first, third] = point.quartiles;
        self.whisker(canvas, point, point.low, first, half / 2.0);
        self.whisker(canvas, point, third, point.high, half / 2.0);
        if let (Some(a), Some(b)) = (self.along(point, first), self.along(point, third)) {
            canvas.rectangle("box", self.across(a, -half), self.across(b, half));
        }
        let median = if self.frame.upright() {
            point.y
        } else {
            point.x
        };
        if let Some(median) = self.along(point, median) {
            let (a, b) = (self.across(median, -half), self.across(median, half));
            canvas.line("line", "", a, b);
        }
    }

    /// Markers are whole or not there.
    fn markers(&self, canvas: &mut Canvas, series: &Series) {
        if !side_by_side(series) {
            return;
        }
        let frame = self.frame;
        for point in &series.points {
            if !(frame.x.holds(point.x) && frame.y.holds(point.y)) {
                continue;
            }
            if let Some(place) = self.place(point.x, point.y) {
                self.look.marker(canvas, place);
            }
        }
    }
}

/// A line through places; a single one is a dot, so that it is seen.
fn stroke(canvas: &mut Canvas, class: &str, dashes: &str, places: &[Place]) {
    match places {
        [(x, y)] => canvas.rectangle("dot", (x - 2.5, y - 2.5), (x + 2.5, y + 2.5)),
        _ => canvas.path(class, dashes, &course(&thin(places))),
    }
}

/// The defined places in parts without a gap.
fn parts<T>(points: &[Point], place: impl Fn(&Point) -> Option<T>) -> Vec<Vec<T>> {
    let mut parts = vec![Vec::new()];
    for point in points {
        match (place(point), parts.last_mut()) {
            (Some(place), Some(part)) => part.push(place),
            _ => parts.push(Vec::new()),
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}

/// Every number of a plot along x and along y, references included: what its axes must hold.
pub(super) fn values(plot: &Plot) -> (Vec<f64>, Vec<f64>) {
    let (mut xs, mut ys) = (Vec::new(), Vec::new());
    let sideways = matches!(plot.y.scale, Scale::Categories(_));
    for point in plot.series.iter().flat_map(|series| &series.points) {
        xs.push(point.x);
        ys.push(point.y);
        let along = if sideways { &mut xs } else { &mut ys };
        along.extend([point.low, point.high]);
        along.extend(point.quartiles);
    }
    for reference in &plot.references {
        match reference.course {
            Course::Horizontal(y) => ys.push(y),
            Course::Vertical(x) => xs.push(x),
            Course::Sloped { .. } => {}
        }
    }
    (xs, ys)
}
