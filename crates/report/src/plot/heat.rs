//! A two-way grid of numbers, shaded by size: a chart of names by names. The shades are our own, because they must
//! follow the page's colours.

use super::axis::{Span, WIDEST_NAME};
use super::backend::{Canvas, Drawn, LABEL, TICK, TITLE, WIDTH, bold, finish, plain, px};
use super::legend::{EDGE, Look};
use super::metrics::{LINE, widest, wrap};
use super::{Drawing, PlotAxis, Scale, extent};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// A number in the grid.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatCell {
    /// The number that decides the shade; undefined if not finite.
    pub value: f64,
    /// The text printed; it may have several lines.
    pub text: String,
}

/// A two-way grid of numbers. The shade, from the smallest (faint) to the largest (strong), only supports the printed
/// numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Heat {
    /// The title.
    pub title: String,
    /// A description in a sentence or two, for readers who cannot see the grid.
    pub description: String,
    /// The setting in which columns differ.
    pub column_label: String,
    /// Names of the rows.
    pub rows: Vec<String>,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// The numbers by rows; `None` is printed as a dash.
    pub cells: Vec<Vec<Option<HeatCell>>>,
}

impl Heat {
    /// The grid as a picture, wider than usual if its columns need it.
    pub fn drawing(&self) -> Drawing {
        finish(self.draw())
    }

    fn cells(&self) -> impl Iterator<Item = &HeatCell> {
        self.cells.iter().flatten().flatten()
    }

    fn draw(&self) -> Drawn<Drawing> {
        let canvas = Canvas::new(WIDTH);
        let title = wrap(&self.title, 1.1 * TITLE, WIDTH - 2.0 * EDGE);
        let mut top = 24.0 + canvas.text(&title, &bold(TITLE), HPos::Left, (EDGE, 16.0))?;
        // Rows are as high as the tallest text, columns as wide as the widest.
        let (count, rows) = (self.columns.len().max(1) as f64, self.rows.len().max(1) as f64);
        let names = |names: &[String]| PlotAxis::new("", Scale::Categories(names.to_vec()));
        let y = Span::y(&names(&self.rows), (-0.5, rows - 0.5), 0.0, WIDEST_NAME);
        let lines = self.cells().map(|cell| cell.text.lines().count());
        let height = (14.0 + LINE * TICK * lines.fold(y.most_lines(), usize::max) as f64) * rows;
        let left = EDGE + y.room.max(60.0);
        let texts = self.cells().flat_map(|cell| cell.text.lines());
        let words = self.columns.iter().flat_map(|name| name.split_whitespace());
        let least = widest(texts.chain(words), TICK) + 12.0;
        let width = f64::max(((WIDTH - left - EDGE) / count).min(150.0), least) * count;
        let x = Span::x(&names(&self.columns), (-0.5, count - 0.5), width);
        let label = wrap(&self.column_label, LABEL, width);
        let middle = (left + width / 2.0, top);
        top += 4.0 + x.room + canvas.text(&label, &plain(LABEL), HPos::Center, middle)?;
        let (right, bottom) = (left + width, top + height);
        let mut chart = ChartBuilder::on(&canvas.part([left - y.room, top - x.room, right, bottom]))
            .top_x_label_area_size(px(x.room))
            .y_label_area_size(px(y.room))
            .build_cartesian_2d(x, y)?;
        let mut mesh = chart.configure_mesh();
        mesh.disable_mesh().axis_style(TRANSPARENT).set_all_tick_mark_size(40);
        mesh.label_style(plain(TICK)).draw()?;
        chart.draw_series(self.shades())?;
        let style = plain(TICK).pos(Pos::new(HPos::Center, VPos::Center));
        let text = |cell: Option<&HeatCell>| cell.map_or("-".to_owned(), |cell| cell.text.clone());
        let texts = self
            .places()
            .map(|(place, cell)| Text::new(text(cell), place, style.clone()));
        chart.draw_series(texts)?;
        let key = ["Stronger shade: greater.".to_owned()];
        canvas.text(&key, &plain(TICK), HPos::Left, (EDGE, bottom + 12.0))?;
        let width = WIDTH.max(right + EDGE);
        Ok(canvas.document(width, bottom + 40.0, [&self.title, &self.description]))
    }

    /// Every place of the grid with its cell.
    fn places(&self) -> impl Iterator<Item = ((f64, f64), Option<&HeatCell>)> {
        let all = (0..self.rows.len()).flat_map(|i| (0..self.columns.len()).map(move |j| (i, j)));
        all.map(|(i, j)| {
            let cell = self.cells.get(i).and_then(|row| row.get(j));
            ((j as f64, i as f64), cell.and_then(Option::as_ref))
        })
    }

    fn shades(&self) -> impl Iterator<Item = Rectangle<(f64, f64)>> {
        const FAINTEST: f64 = 0.04;
        const STRONGEST: f64 = 0.55;
        let values = self.cells().map(|cell| cell.value);
        let (low, high) = extent(values.filter(|value| value.is_finite()));
        let span = high - low;
        let known = self.places().filter_map(|(place, cell)| Some((place, cell?.value)));
        known
            .filter(|(_, value)| value.is_finite())
            .map(move |((x, y), value)| {
                let share = if span > 0.0 { (value - low) / span } else { 0.0 };
                let ink = Look(0).ink().mix(FAINTEST + (STRONGEST - FAINTEST) * share);
                let mut cell = Rectangle::new([(x - 0.5, y - 0.5), (x + 0.5, y + 0.5)], ink.filled());
                cell.set_margin(10, 10, 10, 10);
                cell
            })
    }
}
