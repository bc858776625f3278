//! Draws one plot, or several in a grid with one legend.

use super::axis::{self, Span};
use super::backend::{Canvas, Drawn, LABEL, NARROW, TICK, TITLE, WIDTH, bold, finish, plain};
use super::chart::{Chart, values};
use super::ends::Ends;
use super::legend::{EDGE, Legend};
use super::metrics::{LINE, wrap};
use super::{Drawing, Plot, Style};
use plotters::style::text_anchor::HPos;

/// The axes that all panels share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sharing {
    /// One range of x, labelled only below the lowest panels.
    pub x: bool,
    /// One range of y, labelled only at the left.
    pub y: bool,
}

/// Draws several plots in a grid of `columns` columns with one legend, for a page and for a narrow screen. A shared
/// axis has the label of the first plot, and should have the same scale in all.
pub fn small_multiples(title: &str, description: &str, panels: &[Plot], columns: usize, sharing: Sharing) -> Picture {
    let draw = |width| multiples_of_width([title, description], panels, columns, sharing, width);
    Picture {
        wide: draw(WIDTH),
        narrow: Some(draw(NARROW)),
    }
}

/// The same as a picture of a given width in its own units. Fewer columns are drawn where panels would be
/// narrower than `LEAST`.
pub fn multiples_of_width(
    [title, description]: [&str; 2],
    panels: &[Plot],
    columns: usize,
    sharing: Sharing,
    width: f64,
) -> Drawing {
    let fit = (width / LEAST).max(1.0) as usize;
    let columns = columns.clamp(1, panels.len().max(1)).min(fit);
    let form = Form {
        columns,
        sharing,
        titled: panels.len() > 1 || panels.iter().any(|plot| plot.title != title),
        whole: width,
    };
    finish(Sheet::fitting(panels, form).draw(title, description))
}

/// Least width of a panel with its axis.
const LEAST: f64 = 210.0;
/// Least length of an x axis beside another panel.
const LEAST_AXIS: f64 = 110.0;
/// Least length of an x axis beside names of lines.
const LEAST_NAMED: f64 = 200.0;

/// A figure: for a page, and where it can be drawn so, for a narrow screen.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// For a page, and as a file.
    pub wide: Drawing,
    /// The same figure with letters of the same size on less than half of the width.
    pub narrow: Option<Drawing>,
}

/// Space to the right of the axes, for half of the last label.
const RIGHT: f64 = 24.0;

/// The form of a sheet.
#[derive(Clone, Copy)]
struct Form {
    columns: usize,
    sharing: Sharing,
    /// Whether panels have titles.
    titled: bool,
    /// Width of the whole figure.
    whole: f64,
}

struct Sheet<'a> {
    panels: &'a [Plot],
    form: Form,
    /// The names at the ends of lines; all names are in the legend if there are none.
    ends: Option<Ends<'a>>,
    /// The axes of every panel.
    spans: Vec<[Span; 2]>,
    /// Left margins of the columns.
    margins: Vec<f64>,
    /// Width and height of the axes.
    width: f64,
    height: f64,
}

impl<'a> Sheet<'a> {
    /// The sheet with names at the ends of lines where they fit, and with fewer columns where panels would be too
    /// narrow.
    fn fitting(panels: &'a [Plot], mut form: Form) -> Self {
        let mut sheet = Self::new(panels, form, None);
        // Beside long names there may be no room for another column.
        while form.columns > 1 && sheet.width < LEAST_AXIS {
            form.columns -= 1;
            sheet = Self::new(panels, form, None);
        }
        let last: Vec<_> = sheet.last().map(|i| (&panels[i], &sheet.spans[i])).collect();
        let ends = Ends::new(panels, &last, form.whole);
        let Some(ends) = ends.filter(|ends| sheet.width - ends.room / form.columns as f64 >= LEAST_NAMED) else {
            return sheet;
        };
        let named = Self::new(panels, form, Some(ends.clone()));
        let fit = |i: usize| ends.fit(&panels[i], &named.spans[i], named.height);
        if named.last().all(fit) { named } else { sheet }
    }

    /// The last panel of each row.
    fn last(&self) -> impl Iterator<Item = usize> {
        let (count, columns) = (self.panels.len(), self.form.columns);
        (0..count.div_ceil(columns)).map(move |row| ((row + 1) * columns).min(count) - 1)
    }

    fn new(panels: &'a [Plot], form: Form, ends: Option<Ends<'a>>) -> Self {
        let Form {
            columns,
            sharing,
            whole,
            ..
        } = form;
        let room = ends.as_ref().map_or(0.0, |ends| ends.room);
        let wanted = ranges(panels, sharing);
        let names = panels.iter().map(|plot| Span::least_height(&plot.y));
        let usual = match (panels.len(), columns) {
            // A few rows need less than the usual height.
            (1, _) if names.clone().all(|height| height > 0.0) => 100.0,
            (0 | 1, _) if whole < WIDTH => 300.0,
            (0 | 1, _) => 380.0,
            (_, 1 | 2) => 270.0,
            _ => 210.0,
        };
        let height = names.fold(usual, f64::max);
        let mut overhangs = vec![0.0_f64; columns];
        let (mut margins, mut x, mut y) = (Vec::new(), Vec::new(), Vec::new());
        let widest_name = f64::min(axis::WIDEST_NAME, axis::NAME_SHARE * whole);
        let mut width = whole / columns as f64;
        // Repeated, because turned labels may need more space at the left, which depends on the remaining width. The
        // same holds for equal units.
        for _ in 0..3 {
            let ranges = panels.iter().zip(&wanted);
            let ranges: Vec<[(f64, f64); 2]> = ranges
                .map(|(plot, range)| {
                    if plot.equal_units {
                        of_equal_units(*range, [width, height])
                    } else {
                        *range
                    }
                })
                .collect();
            let pairs = || panels.iter().zip(&ranges);
            y = pairs()
                .map(|(plot, range)| Span::y(&plot.y, range[1], height, widest_name))
                .collect::<Vec<Span>>();
            // Space for the y labels of a column.
            let margin = |column: usize| {
                let rooms = y.iter().skip(column).step_by(columns).map(|span| span.room);
                let shown = column == 0 || !sharing.y;
                let room = if shown { rooms.fold(28.0, f64::max) } else { 4.0 };
                f64::max(EDGE + room, overhangs[column])
            };
            margins = (0..columns).map(margin).collect();
            let axes = whole - room - margins.iter().sum::<f64>();
            width = axes / columns as f64 - RIGHT;
            x = pairs()
                .map(|(plot, range)| Span::x(&plot.x, range[0], width))
                .collect::<Vec<Span>>();
            for (i, span) in x.iter().enumerate() {
                let overhang = &mut overhangs[i % columns];
                *overhang = overhang.max(span.overhang);
                margins[i % columns] = margins[i % columns].max(span.overhang);
            }
        }
        let spans = x.into_iter().zip(y).map(|(x, y)| [x, y]).collect();
        Self {
            panels,
            form,
            ends,
            spans,
            margins,
            width,
            height,
        }
    }

    fn draw(&self, title: &str, description: &str) -> Drawn<Drawing> {
        let canvas = Canvas::new(self.form.whole);
        let legend = Legend::new(self.panels);
        let room = self.form.whole - 2.0 * EDGE;
        let (head, below) = title.split_once('\n').unwrap_or((title, ""));
        let lines = wrap(head, 1.1 * TITLE, room);
        let mut y = 20.0 + canvas.text(&lines, &bold(TITLE), HPos::Left, (EDGE, 16.0))?;
        y += canvas.text(&wrap(below, LABEL, room), &plain(LABEL), HPos::Left, (EDGE, y))?;
        let is_named = |name: &str| self.ends.as_ref().is_some_and(|ends| ends.has(name));
        y = 8.0 + legend.draw(&canvas, y, is_named)?;
        for row in 0..self.panels.len().div_ceil(self.form.columns) {
            y = self.draw_row(&canvas, &legend, row * self.form.columns, y)?;
        }
        Ok(canvas.document(self.form.whole, y + 6.0, [&title.replace('\n', ": "), description]))
    }

    /// Draws the row that begins with panel `first` below `top`; returns its lower end.
    fn draw_row(&self, canvas: &Canvas, legend: &Legend<'_>, first: usize, top: f64) -> Drawn<f64> {
        let panels = first..self.panels.len().min(first + self.form.columns);
        let heads: Vec<[Vec<String>; 2]> = panels.clone().map(|i| self.head(i)).collect();
        let most = |part: usize| heads.iter().map(|head| head[part].len()).max().unwrap_or(0);
        let labels_top = top + LINE * LABEL * most(0) as f64;
        let axes_top = labels_top + LINE * LABEL * most(1) as f64 + 6.0;
        let (mut end, mut start) = (top, 0.0);
        for (i, [title, label]) in panels.zip(&heads) {
            let left = start + self.margins[i - first];
            canvas.text(title, &bold(LABEL), HPos::Left, (start + EDGE, top + 4.0))?;
            let place = (start + EDGE, labels_top + 4.0);
            canvas.text(label, &plain(LABEL), HPos::Left, place)?;
            let area = [left, axes_top, left + self.width, axes_top + self.height];
            end = self.draw_panel(canvas, legend, i, area)?.max(end);
            if let Some(ends) = self.ends.as_ref().filter(|_| self.last().any(|last| last == i)) {
                ends.draw(canvas, legend, (&self.panels[i], &self.spans[i]), area)?;
            }
            start = left + self.width + RIGHT;
        }
        Ok(end + 12.0)
    }

    /// The lines of a panel's title and of its y label.
    fn head(&self, i: usize) -> [Vec<String>; 2] {
        let (plot, shown) = (&self.panels[i], self.labelled(i)[1]);
        let room = self.width + self.margins[i % self.form.columns] - EDGE;
        let title = if self.form.titled { &plot.title } else { "" };
        let label = if shown { &plot.y.label } else { "" };
        [wrap(title, 1.1 * LABEL, room), wrap(label, LABEL, room)]
    }

    /// Which axes of a panel are labelled.
    fn labelled(&self, i: usize) -> [bool; 2] {
        let lowest = i + self.form.columns >= self.panels.len();
        let first = i.is_multiple_of(self.form.columns);
        [!self.form.sharing.x || lowest, !self.form.sharing.y || first]
    }

    /// Draws one panel; returns its lower end.
    fn draw_panel(&self, canvas: &Canvas, legend: &Legend<'_>, i: usize, area: [f64; 4]) -> Drawn<f64> {
        let (plot, labelled) = (&self.panels[i], self.labelled(i));
        let chart = Chart::new(plot, canvas, self.spans[i].clone(), area, labelled)?;
        chart.draw(legend)?;
        let [left, _, right, bottom] = area;
        let mut y = bottom + 8.0;
        if labelled[0] {
            y = bottom + self.spans[i][0].room;
            let label = wrap(&plot.x.label, LABEL, self.width);
            let place = (f64::midpoint(left, right), y + 5.0);
            y += canvas.text(&label, &plain(LABEL), HPos::Center, place)?;
        }
        let note = wrap(&chart.note(), TICK, self.width);
        Ok(y + canvas.text(&note, &plain(TICK), HPos::Left, (left, y + 6.0))?)
    }
}

/// Widens the ranges of x and y so that they are in proportion to the lengths of the axes.
fn of_equal_units(ranges: [(f64, f64); 2], lengths: [f64; 2]) -> [(f64, f64); 2] {
    let pairs = ranges.iter().zip(lengths);
    let units = pairs.map(|((low, high), length)| (high - low) / length);
    let unit = units.fold(0.0, f64::max);
    [0, 1].map(|k| {
        let (low, high) = ranges[k];
        let (middle, half) = (f64::midpoint(low, high), unit * lengths[k] / 2.0);
        (middle - half, middle + half)
    })
}

/// The ranges of x and y for every panel.
fn ranges(panels: &[Plot], sharing: Sharing) -> Vec<[(f64, f64); 2]> {
    let values: Vec<[Vec<f64>; 2]> = panels.iter().map(values).collect();
    let rooms: Vec<f64> = panels.iter().map(room_of_x).collect();
    let widest = rooms.iter().copied().fold(0.0, f64::max);
    let range = |i: usize, k: usize| {
        let shared = [sharing.x, sharing.y][k];
        let room = [if shared { widest } else { rooms[i] }, 0.05][k];
        let own = if shared { 0..panels.len() } else { i..i + 1 };
        let plot = &panels[own.start];
        let values = values[own].iter().flat_map(|values| &values[k]).copied();
        axis::range([&plot.x, &plot.y][k], values, room)
    };
    (0..panels.len()).map(|i| [range(i, 0), range(i, 1)]).collect()
}

/// Space beside the values of x: none for lines, some for markers, more for boxes.
fn room_of_x(plot: &Plot) -> f64 {
    let rooms = plot.series.iter().map(|series| match series.style {
        Style::Line | Style::Steps | Style::Band | Style::Region | Style::Notes | Style::Spans => 0.0,
        Style::ErrorBars | Style::Marks => 0.06,
        Style::Boxes => 0.12,
    });
    rooms.fold(0.0, f64::max)
}

impl Plot {
    /// The plot as a picture of a given width in its own units, of which a letter of its labels has 15.
    pub fn of_width(&self, width: f64) -> Drawing {
        let words = [self.title.as_str(), &self.description];
        multiples_of_width(words, std::slice::from_ref(self), 1, Sharing::default(), width)
    }

    /// The plot as an SVG document.
    pub fn svg(&self) -> String {
        self.of_width(WIDTH).svg()
    }

    /// The plot for a page and for a narrow screen.
    pub fn picture(&self) -> Picture {
        let panel = std::slice::from_ref(self);
        small_multiples(&self.title, &self.description, panel, 1, Sharing::default())
    }
}
