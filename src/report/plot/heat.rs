//! A two-way grid of numbers, shaded by size.

use super::canvas::{Anchor, Canvas, LABEL, TICK, TITLE, WIDTH};
use super::legend::EDGE;
use super::metrics::{width, wrap};

/// A number of the grid.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatCell {
    /// What decides the shade; undefined where not finite (and, by logarithm, where not above zero).
    pub value: f64,
    /// What is printed, each line of its own.
    pub text: String,
}

/// How a value becomes a shade.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shading {
    /// From the least (faint) to the greatest (strong) in proportion.
    Linear,
    /// The same by logarithm.
    Log,
    /// By the distance from a centre, blue below and orange above.
    About(f64),
    /// The same by the logarithm of the ratio to a positive centre.
    Ratio(f64),
}

/// A two-way grid of numbers. Shade only supports the printed number.
#[derive(Clone, Debug, PartialEq)]
pub struct Heat {
    /// What it shows.
    pub title: String,
    /// The same in a sentence or two for readers who do not see it.
    pub description: String,
    /// What the rows differ in.
    pub row_label: String,
    /// What the columns differ in.
    pub column_label: String,
    /// Names of the rows.
    pub rows: Vec<String>,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Headings over that many columns each, from the left, for nested factors; empty without.
    pub groups: Vec<(String, usize)>,
    /// The numbers by rows; `None` is printed as a dash.
    pub cells: Vec<Vec<Option<HeatCell>>>,
    /// How values become shades.
    pub shading: Shading,
}

const LINE: f64 = 18.0;

impl Heat {
    /// The grid as an SVG document, wider than usual where its columns need it.
    pub fn svg(&self) -> String {
        let layout = Layout::of(self);
        let mut canvas = Canvas::default();
        let mut y = 14.0;
        for line in wrap(&self.title, TITLE * 1.06, WIDTH - 2.0 * EDGE) {
            canvas.text("t", Anchor::Start, (EDGE, y + 15.0), &line);
            y += 24.0;
        }
        y = self.draw_head(&mut canvas, &layout, y + 6.0);
        for (i, name) in self.rows.iter().enumerate() {
            let row = self.cells.get(i).map_or(&[][..], Vec::as_slice);
            y = self.draw_row(&mut canvas, &layout, y, name, row);
        }
        for line in wrap(&self.key(), TICK, layout.width - 2.0 * EDGE) {
            canvas.text("k", Anchor::Start, (EDGE, y + 22.0), &line);
            y += LINE;
        }
        canvas.document(layout.width, y + 18.0, &self.title, &self.description)
    }

    /// Labels, groups and names of the columns; gives the top of the cells.
    fn draw_head(&self, canvas: &mut Canvas, layout: &Layout, top: f64) -> f64 {
        let mut y = top;
        let middle = |from: usize, to: usize| {
            layout.left + layout.cell * f64::midpoint(from as f64, to as f64)
        };
        let whole = layout.cell * self.columns.len().max(1) as f64;
        for line in wrap(&self.column_label, LABEL, whole) {
            let x = layout.left + whole / 2.0;
            canvas.text("", Anchor::Middle, (x, y + 14.0), &line);
            y += 20.0;
        }
        let mut start = 0;
        let groups: Vec<(f64, Vec<String>)> = self
            .groups
            .iter()
            .map(|(name, span)| {
                let end = start + span;
                let lines = wrap(name, TICK, layout.cell * *span as f64 - 8.0);
                let place = middle(start, end);
                start = end;
                (place, lines)
            })
            .collect();
        y = stack(canvas, &groups, y);
        let mut start = 0;
        for (_, span) in &self.groups {
            let (from, to) = (start as f64, (start + span) as f64);
            let x = |column: f64| layout.left + layout.cell * column;
            canvas.line("axis", "", (x(from) + 4.0, y + 3.0), (x(to) - 4.0, y + 3.0));
            start += span;
        }
        let names = self.columns.iter().enumerate();
        let names: Vec<(f64, Vec<String>)> = names
            .map(|(i, name)| (middle(i, i + 1), wrap(name, TICK, layout.cell - 8.0)))
            .collect();
        let end = stack(canvas, &names, y + 6.0);
        for (i, line) in wrap(&self.row_label, LABEL, layout.left - EDGE - 8.0)
            .iter()
            .rev()
            .enumerate()
        {
            let place = (EDGE, end - 4.0 - LINE * i as f64);
            canvas.text("", Anchor::Start, place, line);
        }
        end + 6.0
    }

    fn draw_row(
        &self,
        canvas: &mut Canvas,
        layout: &Layout,
        top: f64,
        name: &str,
        row: &[Option<HeatCell>],
    ) -> f64 {
        let name = wrap(name, TICK, layout.left - EDGE - 8.0);
        let texts: Vec<Vec<String>> = (0..self.columns.len())
            .map(|j| match row.get(j) {
                Some(Some(cell)) => cell.text.lines().map(str::to_owned).collect(),
                _ => vec!["-".to_owned()],
            })
            .collect();
        let lines = texts.iter().map(Vec::len).chain([name.len(), 1]);
        let height = 14.0 + LINE * lines.max().unwrap_or(1) as f64;
        let first = |lines: usize| top + height / 2.0 + 5.0 - LINE * (lines as f64 - 1.0) / 2.0;
        for (i, line) in name.iter().enumerate() {
            let place = (layout.left - 8.0, first(name.len()) + LINE * i as f64);
            canvas.text("k", Anchor::End, place, line);
        }
        for (j, lines) in texts.iter().enumerate() {
            let left = layout.left + layout.cell * j as f64;
            let corners = (
                (left + 1.0, top + 1.0),
                (left + layout.cell - 1.0, top + height - 1.0),
            );
            if let Some(Some(cell)) = row.get(j)
                && let Some((class, shade)) = layout.shade(cell.value)
            {
                canvas.group(class, |canvas| {
                    canvas.shaded("cell", Some(shade), corners.0, corners.1);
                });
            }
            for (i, line) in lines.iter().enumerate() {
                let place = (
                    left + layout.cell / 2.0,
                    first(lines.len()) + LINE * i as f64,
                );
                canvas.text("k", Anchor::Middle, place, line);
            }
        }
        top + height
    }

    /// What the shades mean.
    fn key(&self) -> String {
        match self.shading {
            Shading::Linear => "Stronger shade: greater.".to_owned(),
            Shading::Log => "Stronger shade: greater, by logarithm.".to_owned(),
            Shading::About(centre) | Shading::Ratio(centre) => {
                format!("Blue: below {centre}; orange: above {centre}; the stronger the farther.")
            }
        }
    }
}

/// Texts of several lines beside each other, standing on one line, which is returned.
fn stack(canvas: &mut Canvas, texts: &[(f64, Vec<String>)], top: f64) -> f64 {
    let most = texts
        .iter()
        .map(|(_, lines)| lines.len())
        .max()
        .unwrap_or(0);
    for (x, lines) in texts {
        for (i, line) in lines.iter().enumerate() {
            let row = most - lines.len() + i;
            canvas.text(
                "k",
                Anchor::Middle,
                (*x, top + 14.0 + LINE * row as f64),
                line,
            );
        }
    }
    top + LINE * most as f64
}

/// Where the cells are, and the range of their values.
struct Layout {
    left: f64,
    cell: f64,
    width: f64,
    shading: Shading,
    low: f64,
    high: f64,
}

impl Layout {
    fn of(heat: &Heat) -> Self {
        let widest = |texts: &mut dyn Iterator<Item = &str>| {
            texts.map(|text| width(text, TICK)).fold(0.0, f64::max)
        };
        let names = widest(&mut heat.rows.iter().map(String::as_str)).clamp(60.0, 230.0);
        let left = names.max(width(&heat.row_label, LABEL).min(150.0)) + EDGE + 12.0;
        let cells = || heat.cells.iter().flatten().flatten();
        let texts = widest(&mut cells().flat_map(|cell| cell.text.lines()));
        let words = heat.columns.iter().flat_map(|name| name.split_whitespace());
        let needed = texts.max(widest(&mut words.into_iter())) + 12.0;
        let count = heat.columns.len().max(1) as f64;
        let cell = needed.max(((WIDTH - left - EDGE) / count).min(150.0));
        let mut layout = Self {
            left,
            cell,
            width: WIDTH.max(left + cell * count + EDGE),
            shading: heat.shading,
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
        };
        for value in cells()
            .filter_map(|cell| layout.place(cell.value))
            .collect::<Vec<_>>()
        {
            layout.low = layout.low.min(value);
            layout.high = layout.high.max(value);
        }
        layout
    }

    fn place(&self, value: f64) -> Option<f64> {
        let place = match self.shading {
            Shading::Linear => value,
            Shading::Log => value.log10(),
            Shading::About(centre) => value - centre,
            Shading::Ratio(centre) => (value / centre).log10(),
        };
        place.is_finite().then_some(place)
    }

    /// Class of the colour and opacity.
    fn shade(&self, value: f64) -> Option<(&'static str, f64)> {
        const STRONGEST: f64 = 0.55;
        let place = self.place(value)?;
        Some(match self.shading {
            Shading::Linear | Shading::Log => {
                let span = self.high - self.low;
                let share = if span > 0.0 {
                    (place - self.low) / span
                } else {
                    0.0
                };
                ("s0", 0.04 + (STRONGEST - 0.04) * share)
            }
            Shading::About(_) | Shading::Ratio(_) => {
                let reach = self.high.max(-self.low);
                let share = if reach > 0.0 {
                    place.abs() / reach
                } else {
                    0.0
                };
                (if place < 0.0 { "s0" } else { "s1" }, STRONGEST * share)
            }
        })
    }
}
