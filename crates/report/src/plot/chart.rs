//! Draws one plot: plotters' chart and mesh, with series and reference lines.

use super::axis::Span;
use super::backend::{Canvas, Drawn, Marks, TICK, plain, px};
use super::inks::{FAINT, GRID, TEXT};
use super::legend::{Legend, Look};
use super::metrics::{self, NOTE};
use super::scene::Part;
use super::thin::{envelope, thin};
use super::{Course, Plot, Point, Series, Style};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

type Place = (i32, i32);

/// Width of the steps that are drawn first.
const WIDEST_STEP: usize = 44;
/// The ink of a shaded range.
const SHADE: usize = 2;

/// A plot with the position of its axes.
pub(super) struct Chart<'a> {
    plot: &'a Plot,
    canvas: &'a Canvas,
    context: ChartContext<'static, Marks, Cartesian2d<Span, Span>>,
    x: Span,
    y: Span,
    /// Left, top, right, bottom.
    area: [f64; 4],
}

impl<'a> Chart<'a> {
    /// Draws the axes of a plot, with labels on those that are to have them.
    pub(super) fn new(
        plot: &'a Plot,
        canvas: &'a Canvas,
        [x, y]: [Span; 2],
        area: [f64; 4],
        labelled: [bool; 2],
    ) -> Drawn<Self> {
        let [left, top, right, bottom] = area;
        let panel = canvas.part([left - y.room, top, right, bottom + x.room]);
        let mut context = ChartBuilder::on(&panel)
            .y_label_area_size(px(y.room))
            .x_label_area_size(px(x.room))
            .build_cartesian_2d(x.clone(), y.clone())?;
        let blank = |_: &f64| String::new();
        let mut mesh = context.configure_mesh();
        mesh.set_all_tick_mark_size(50).label_style(plain(TICK));
        mesh.bold_line_style(GRID.stroke_width(10))
            .light_line_style(FAINT.stroke_width(10));
        mesh.axis_style(TEXT.stroke_width(10));
        if x.overhang > 0.0 {
            mesh.x_label_style(plain(TICK).transform(FontTransform::Rotate270));
        }
        if x.names {
            mesh.disable_x_mesh();
        }
        if !labelled[0] {
            mesh.x_label_formatter(&blank);
        }
        if !labelled[1] {
            mesh.y_label_formatter(&blank);
        }
        mesh.draw()?;
        Ok(Self {
            plot,
            canvas,
            context,
            x,
            y,
            area,
        })
    }

    /// Draws everything inside the axes. Lines are clipped at the edge; markers are drawn whole or not at all.
    pub(super) fn draw(&self, legend: &Legend<'_>) -> Drawn {
        // Space for half of a line's width.
        let [left, top, right, bottom] = self.area;
        let cut = [left - 1.5, top - 1.5, right + 1.5, bottom + 1.5];
        self.shade()?;
        let (offsets, half) = self.berths();
        let last = self.plot.series.len().saturating_sub(1).max(1);
        let number = |series: &Series| legend.number(&series.label);
        for (i, (series, offset)) in self.plot.series.iter().zip(offsets.iter().copied()).enumerate() {
            let look = legend.look(&series.label);
            let pen = Pen {
                chart: self,
                look,
                solid: self.plot.has_one_line(),
                step: (WIDEST_STEP - (WIDEST_STEP - 12) * i / last) as u32,
                offset,
                half,
            };
            self.canvas.part_of(Part::Points, number(series), || {
                self.canvas.clipped(cut, || pen.lines(series))?;
                if beside(series) || series.style == Style::Marks {
                    pen.markers(&series.points)?;
                }
                pen.hints(series);
                Ok(())
            })?;
        }
        // On top, so that a wide band does not hide them.
        self.canvas.clipped(cut, || {
            self.plot.references.iter().try_for_each(|reference| {
                let style = legend.reference(&reference.label);
                let ends = self.reference(reference.course);
                ends.map_or(Ok(()), |ends| self.canvas.line(ends, style))
            })
        })?;
        self.notes(&offsets, number)
    }

    /// Writes the notes of points where they hide no marker and no other note.
    fn notes(&self, offsets: &[i32], number: impl Fn(&Series) -> Option<usize>) -> Drawn {
        let middle = |point: &Point, offset: i32| {
            self.x.coordinate(point.x).and(self.y.coordinate(point.y))?;
            let (x, y) = self.context.backend_coord(&(point.x, point.y));
            Some((f64::from(x + offset) / 10.0, f64::from(y) / 10.0))
        };
        let all = || self.plot.series.iter().zip(offsets);
        let places = all().flat_map(|(series, offset)| {
            let points = series.points.iter();
            points.filter_map(move |point| middle(point, *offset))
        });
        let mut taken: Vec<[f64; 4]> = places.map(|(x, y)| [x - 6.0, y - 6.0, x + 6.0, y + 6.0]).collect();
        let [left, top, right, bottom] = self.area;
        for (series, offset) in all() {
            for (point, note) in series.points.iter().zip(&series.notes) {
                let Some((x, y)) = middle(point, *offset).filter(|_| !note.is_empty()) else {
                    continue;
                };
                let half = metrics::width(note, NOTE) / 2.0;
                let sides = [
                    (x, y - 20.0),
                    (x, y + 9.0),
                    (x + half + 9.0, y - 5.0),
                    (x - half - 9.0, y - 5.0),
                    (x + half + 9.0, y - 14.0),
                    (x - half - 9.0, y - 14.0),
                ];
                let free = sides.into_iter().find_map(|(x, y)| {
                    let [x0, y0, x1, y1] = [x - half, y, x + half, y + NOTE];
                    let inside = x0 > left && x1 < right && y0 > top && y1 < bottom;
                    let apart = |b: &[f64; 4]| x1 < b[0] || b[2] < x0 || y1 < b[1] || b[3] < y0;
                    (inside && taken.iter().all(apart)).then_some([x0, y0, x1, y1])
                });
                if let Some(place) = free {
                    taken.push(place);
                    let at = (f64::midpoint(place[0], place[2]), place[1] + 1.0);
                    let text = std::slice::from_ref(note);
                    let draw = || self.canvas.text(text, &plain(NOTE), HPos::Center, at).map(drop);
                    self.canvas.part_of(Part::Points, number(series), draw)?;
                }
            }
        }
        Ok(())
    }

    /// Shades a range of values, as far as the axis reaches.
    fn shade(&self) -> Drawn {
        let (x, y) = (self.x.range(), self.y.range());
        let across = if self.y.names { &x } else { &y };
        let Some([low, high]) = self.plot.shaded else {
            return Ok(());
        };
        let [low, high] = [low, high].map(|end| end.clamp(across.start, across.end));
        let corners = if self.y.names {
            [(low, y.start), (high, y.end)]
        } else {
            [(x.start, high), (x.end, low)]
        };
        let corners = corners.map(|place| self.context.backend_coord(&place));
        let ink = Look(SHADE).ink().mix(0.13).filled();
        self.canvas.draw(Rectangle::new(corners, ink))
    }

    fn reference(&self, course: Course) -> Option<[Place; 2]> {
        let (x, y) = (self.x.range(), self.y.range());
        let ends = match course {
            Course::Horizontal(at) => [(x.start, at), (x.end, at)],
            Course::Vertical(at) => [(at, y.start), (at, y.end)],
            Course::Sloped { slope, through } => {
                let from = (self.x.coordinate(through.0)?, self.y.coordinate(through.1)?);
                [x.start, x.end].map(|end| {
                    let run = self.x.coordinate(end).unwrap_or(f64::NAN) - from.0;
                    (end, self.y.value(from.1 + slope * run))
                })
            }
        };
        let known = |(x, y)| self.x.coordinate(x).is_some() && self.y.coordinate(y).is_some();
        let known = ends.into_iter().all(known);
        known.then(|| ends.map(|place| self.context.backend_coord(&place)))
    }

    /// The offset of each series' marks, and half the space for a box. Several series at one place are drawn side by
    /// side: over names they use all the space, otherwise just enough to see both bars.
    fn berths(&self) -> (Vec<i32>, i32) {
        let series = &self.plot.series;
        let moved = |series: &&Series| beside(series) && !series.points.is_empty();
        let count = series.iter().filter(moved).count().max(1) as f64;
        let [left, top, right, bottom] = self.area;
        let unit = match &self.y {
            y if y.names => (bottom - top) / y.length(),
            _ => (right - left) / self.x.length(),
        };
        // Less in the narrow panels of a grid.
        let size = ((right - left) / 800.0).clamp(0.5, 1.0);
        let pitch = match series.iter().any(|series| series.style == Style::Boxes) {
            _ if self.x.names || self.y.names => (0.78 * unit / count).min(60.0),
            true => 26.0 * size,
            false => 7.0 * size,
        };
        let mut places = (0..).map(|i| px(pitch * (f64::from(i) - (count - 1.0) / 2.0)));
        let offset = |series| moved(&series).then(|| places.next()).flatten().unwrap_or(0);
        (series.iter().map(offset).collect(), px(0.39 * pitch))
    }

    /// A note on what is not visible.
    pub(super) fn note(&self) -> String {
        let series = self.plot.series.iter();
        let series = series.filter(|series| !matches!(series.style, Style::Region | Style::Notes));
        if series.clone().next().is_none() && !self.plot.series.is_empty() {
            return String::new();
        }
        // A step has two points.
        let each = |series: &Series| if series.style == Style::Steps { 2 } else { 1 };
        let points = series.flat_map(|series| series.points.iter().step_by(each(series)));
        let finite = |point: &&Point| point.x.is_finite() && point.y.is_finite();
        let points: Vec<&Point> = points.filter(finite).collect();
        if points.is_empty() {
            return "No defined value.".to_owned();
        }
        let (x, y) = (&self.x, &self.y);
        let on = |point: &&&Point| x.coordinate(point.x).and(y.coordinate(point.y)).is_some();
        let inside = |point: &&&Point| x.holds(point.x) && y.holds(point.y);
        let shown = points.iter().filter(on).count();
        let outside = shown - points.iter().filter(inside).count();
        let count = |count: usize| format!("{count} point{}", if count == 1 { "" } else { "s" });
        let mut notes = Vec::new();
        if shown < points.len() {
            let hidden = count(points.len() - shown);
            notes.push(format!("Not shown: {hidden} not above 0 on a logarithmic axis."));
        }
        if outside > 0 {
            notes.push(format!("Outside the axes: {}.", count(outside)));
        }
        notes.join(" ")
    }
}

/// Whether the markers of a series are drawn side by side with those of others.
fn beside(series: &Series) -> bool {
    matches!(series.style, Style::Boxes | Style::ErrorBars)
}

/// Draws one series.
struct Pen<'a> {
    chart: &'a Chart<'a>,
    look: Look,
    /// Whether lines are not dashed.
    solid: bool,
    /// Width of steps.
    step: u32,
    /// Offset of the marks, and half the space for a box.
    offset: i32,
    half: i32,
}

impl Pen<'_> {
    /// The place of (x, y), moved sideways if series are drawn side by side.
    fn place(&self, x: f64, y: f64) -> Option<Place> {
        let chart = self.chart;
        chart.x.coordinate(x).and(chart.y.coordinate(y))?;
        Some(self.across(chart.context.backend_coord(&(x, y)), self.offset))
    }

    /// The place of a value along the interval of a point. An end that the axis cannot show is beyond its edge.
    fn along(&self, point: &Point, value: f64) -> Option<Place> {
        let chart = self.chart;
        let (span, beside, place) = if chart.y.names {
            (&chart.y, point.y, (value, point.y))
        } else {
            (&chart.x, point.x, (point.x, value))
        };
        span.coordinate(beside).filter(|_| !value.is_nan())?;
        Some(self.across(chart.context.backend_coord(&place), self.offset))
    }

    /// A place moved at right angles to the interval.
    fn across(&self, (x, y): Place, by: i32) -> Place {
        let down = i32::from(self.chart.y.names);
        (x + by * (1 - down), y + by * down)
    }

    /// Draws the part of a series that is clipped at the edge of the plot.
    fn lines(&self, series: &Series) -> Drawn {
        let points = &series.points;
        match series.style {
            Style::Line => self.polyline(points, 20),
            Style::Steps => self.steps(points),
            Style::Band => self.band(points).and_then(|()| self.polyline(points, 20)),
            Style::Region => self.regions(points),
            Style::Notes => Ok(()),
            Style::ErrorBars | Style::Marks => self.error_bars(series),
            Style::Spans => points.iter().try_for_each(|point| self.span(point)),
            Style::Boxes => points.iter().try_for_each(|point| self.quartiles(point)),
        }
    }

    /// Draws a line through the defined places; a single place becomes a dot, so that it is visible.
    fn polyline(&self, points: &[Point], width: u32) -> Drawn {
        let canvas = self.chart.canvas;
        let parts = parts(points, |point| self.place(point.x, point.y));
        parts.iter().try_for_each(|part| match part[..] {
            [place] => canvas.draw(Circle::new(place, 25, self.look.ink().filled())),
            _ if self.solid => canvas.line(thin(part), self.look.ink().stroke_width(width)),
            _ => canvas.line(thin(part), self.look.line(width)),
        })
    }

    fn steps(&self, points: &[Point]) -> Drawn {
        let canvas = self.chart.canvas;
        let parts = parts(points, |point| self.place(point.x, point.y));
        for part in &parts {
            canvas.line(part.as_slice(), self.look.ink().stroke_width(7))?;
        }
        let steps = parts.iter().flat_map(|part| part.chunks(2));
        let mut steps = steps.map(|step| canvas.line(step, self.look.step(self.step)));
        steps.try_for_each(|drawn| drawn)
    }

    fn band(&self, points: &[Point]) -> Drawn {
        let canvas = self.chart.canvas;
        let ends = |point: &Point| self.along(point, point.low).zip(self.along(point, point.high));
        for part in parts(points, ends) {
            let (low, high): (Vec<Place>, Vec<Place>) = part.into_iter().unzip();
            let mut outline = envelope(&high, i32::min);
            outline.extend(envelope(&low, i32::max).iter().rev());
            match outline.len() {
                2 => canvas.line(outline, self.thin())?,
                _ => canvas.draw(Polygon::new(outline, self.look.ink().mix(0.16)))?,
            }
        }
        Ok(())
    }

    fn span(&self, point: &Point) -> Drawn {
        let ends = [point.low, point.high].map(|x| self.place(x, point.y));
        let [Some(from), Some(to)] = ends else {
            return Ok(());
        };
        let style = self.look.ink().stroke_width(10);
        self.chart.canvas.line([from, to], style)
    }

    fn regions(&self, points: &[Point]) -> Drawn {
        let canvas = self.chart.canvas;
        let parts = parts(points, |point| self.place(point.x, point.y));
        parts.into_iter().try_for_each(|part| match part.len() {
            2 => canvas.line(part, self.look.ink().stroke_width(30)),
            _ => canvas.draw(Polygon::new(part, self.look.ink().mix(0.16))),
        })
    }

    /// The style of bars and whiskers.
    fn thin(&self) -> ShapeStyle {
        self.look.ink().stroke_width(12)
    }

    fn error_bars(&self, series: &Series) -> Drawn {
        let points = &series.points;
        let names = self.chart.x.names || self.chart.y.names;
        if !names && series.style == Style::ErrorBars {
            self.polyline(points, 12)?;
        }
        // A bar hidden by its marker is not drawn.
        let hidden = |point: &&Point| {
            let ends = self.along(point, point.low).zip(self.along(point, point.high));
            ends.is_some_and(|(a, b)| (a.0 - b.0).abs() + (a.1 - b.1).abs() < 30)
        };
        let mut seen = points.iter().filter(|point| !hidden(point));
        seen.try_for_each(|point| self.whisker(point, point.low, point.high, 40))
    }

    /// Draws a line across a place, at right angles to the interval.
    fn cross(&self, middle: Place, half: i32, style: ShapeStyle) -> Drawn {
        let ends = [self.across(middle, -half), self.across(middle, half)];
        self.chart.canvas.line(ends, style)
    }

    /// Draws a bar between two values, with caps.
    fn whisker(&self, point: &Point, from: f64, to: f64, cap: i32) -> Drawn {
        let Some((from, to)) = self.along(point, from).zip(self.along(point, to)) else {
            return Ok(());
        };
        self.chart.canvas.line([from, to], self.thin())?;
        self.cross(from, cap, self.thin())?;
        self.cross(to, cap, self.thin())
    }

    /// Draws a box between the quartiles with the median, and whiskers.
    fn quartiles(&self, point: &Point) -> Drawn {
        let ([first, third], half) = (point.quartiles, self.half);
        self.whisker(point, point.low, first, half / 2)?;
        self.whisker(point, third, point.high, half / 2)?;
        if let Some((a, b)) = self.along(point, first).zip(self.along(point, third)) {
            let corners = [self.across(a, -half), self.across(b, half)];
            self.look.draw_box(self.chart.canvas, corners)?;
        }
        let median = self.place(point.x, point.y);
        let style = self.look.ink().stroke_width(20);
        median.map_or(Ok(()), |median| self.cross(median, half, style))
    }

    /// The points inside the axes, with their places.
    fn inside<'p>(&self, points: &'p [Point]) -> impl Iterator<Item = (&'p Point, Place)> {
        let (x, y) = (&self.chart.x, &self.chart.y);
        let inside = points.iter().filter(move |point| x.holds(point.x) && y.holds(point.y));
        inside.filter_map(move |point| Some((point, self.place(point.x, point.y)?)))
    }

    fn markers(&self, points: &[Point]) -> Drawn {
        let mut inside = self.inside(points);
        inside.try_for_each(|(_, place)| self.look.marker(self.chart.canvas, place))
    }

    fn hints(&self, series: &Series) {
        for (point, place) in self.inside(&series.points) {
            if let Some(words) = point.hint.and_then(|hint| series.hints.get(hint)) {
                self.chart.canvas.hint(place, words);
            }
        }
    }
}

/// Splits the defined places at gaps.
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

/// All numbers of a plot along x and along y, including references, which its axes must hold.
pub(super) fn values(plot: &Plot) -> [Vec<f64>; 2] {
    let (mut xs, mut ys) = (Vec::new(), Vec::new());
    let sideways = plot.y.has_names();
    for series in &plot.series {
        let sideways = sideways || series.style == Style::Spans;
        for point in &series.points {
            xs.push(point.x);
            ys.push(point.y);
            let along = if sideways { &mut xs } else { &mut ys };
            along.extend([point.low, point.high]);
            along.extend(point.quartiles);
        }
    }
    for reference in &plot.references {
        match reference.course {
            Course::Horizontal(y) => ys.push(y),
            Course::Vertical(x) => xs.push(x),
            Course::Sloped { .. } => {}
        }
    }
    [xs, ys]
}
