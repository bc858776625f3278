//! A drawing backend for plotters that collects the marks of a picture.
//!
//! plotters uses integer pixels, so a pixel here is a tenth of the figure's unit. The only rotation used for texts,
//! [`FontTransform::Rotate270`], is drawn at 45 degrees.

use super::metrics;
use super::scene::{Anchor, Drawing, Form, Kind, Mark, Paint, Part, Pixel, Text as Label};
use plotters::coord::Shift;
use plotters::element::{Drawable, PointCollection};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters_backend::{BackendColor, BackendStyle, BackendTextStyle, DrawingErrorKind};
use std::cell::RefCell;
use std::convert::Infallible;
use std::ops::Add;
use std::rc::Rc;

/// Width of a figure in its own units, unless another is asked for.
pub const WIDTH: f64 = 900.0;
/// Width of a figure for a screen of 400 px, where one of [`WIDTH`] would have letters of 6 px.
pub const NARROW: f64 = 440.0;
/// Size of a figure's title.
pub(super) const TITLE: f64 = 18.0;
/// Size of axis labels, legend and panel titles.
pub(super) const LABEL: f64 = 15.0;
/// Size of tick labels and notes below the axes.
pub(super) const TICK: f64 = 14.0;

/// A length in plotters' pixels.
pub(super) fn px(length: f64) -> i32 {
    (10.0 * length).round() as i32
}

/// A place in plotters' pixels.
pub(super) fn at((x, y): (f64, f64)) -> (i32, i32) {
    (px(x), px(y))
}

type Refused = DrawingErrorKind<Infallible>;
/// The result of a drawing function of plotters.
pub(super) type Drawn<T = ()> = DrawResult<T, Marks>;

/// The backend: the marks so far; its clones add to the same picture.
#[derive(Clone, Default)]
pub(super) struct Marks(Rc<RefCell<Vec<Mark>>>);

impl Marks {
    fn add(&self, mark: Mark) {
        self.0.borrow_mut().push(mark);
    }

    /// Adds a line that is not invisible.
    fn stroke(&self, places: impl IntoIterator<Item = Pixel>, style: &impl BackendStyle) {
        let places: Vec<Pixel> = places.into_iter().collect();
        if !places.is_empty() && style.color().alpha > 0.0 {
            self.add(Mark::Shape(Form::Line(places), paint(Kind::Line, style)));
        }
    }

    /// Adds a shape: its outline, or filled; a filled one gets an edge if its stroke width is not 1.
    fn shape(&self, form: Form, fill: bool, style: &impl BackendStyle) {
        let kind = match style.stroke_width() {
            _ if !fill => Kind::Line,
            1 => Kind::Filled,
            _ => Kind::Edged,
        };
        self.add(Mark::Shape(form, paint(kind, style)));
    }
}

fn paint(kind: Kind, style: &impl BackendStyle) -> Paint {
    let BackendColor { alpha, rgb } = style.color();
    Paint {
        kind,
        ink: usize::from(rgb.0),
        dashes: usize::from(rgb.1),
        alpha,
        width: style.stroke_width(),
    }
}

impl DrawingBackend for Marks {
    type ErrorType = Infallible;

    /// Larger than any figure.
    fn get_size(&self) -> (u32, u32) {
        (1_000_000, 1_000_000)
    }

    fn ensure_prepared(&mut self) -> Result<(), Refused> {
        Ok(())
    }

    fn present(&mut self) -> Result<(), Refused> {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): Pixel, color: BackendColor) -> Result<(), Refused> {
        self.draw_rect((x, y), (x + 1, y + 1), &color, true)
    }

    fn draw_line<S: BackendStyle>(&mut self, a: Pixel, b: Pixel, style: &S) -> Result<(), Refused> {
        self.draw_path([a, b], style)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = Pixel>>(&mut self, path: I, style: &S) -> Result<(), Refused> {
        self.stroke(path, style);
        Ok(())
    }

    fn draw_rect<S: BackendStyle>(&mut self, a: Pixel, b: Pixel, style: &S, fill: bool) -> Result<(), Refused> {
        let place = Form::Rectangle([a.0, a.1, b.0 - a.0, b.1 - a.1]);
        self.shape(place, fill, style);
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        centre: Pixel,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Result<(), Refused> {
        self.shape(Form::Circle(centre, radius as i32), fill, style);
        Ok(())
    }

    /// Fills an area; a translucent one has an edge.
    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = Pixel>>(
        &mut self,
        corners: I,
        style: &S,
    ) -> Result<(), Refused> {
        let kind = match style.color().alpha {
            alpha if alpha < 1.0 => Kind::Area,
            _ => Kind::Filled,
        };
        let form = Form::Area(corners.into_iter().collect());
        self.add(Mark::Shape(form, paint(kind, style)));
        Ok(())
    }

    /// Draws a text of one or more lines. The place is the cap height of the first line, the middle, or the base of the
    /// last line.
    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, (x, y): Pixel) -> Result<(), Refused> {
        let size = style.size() / 10.0;
        let line = metrics::LINE * size;
        let below = line * text.matches('\n').count() as f64;
        let raised = match style.anchor().v_pos {
            VPos::Top => 0.72 * size,
            VPos::Center => 0.36 * size - below / 2.0,
            VPos::Bottom => -below,
        };
        let turned = matches!(style.transform(), FontTransform::Rotate270);
        let anchor = match style.anchor().h_pos {
            HPos::Center if !turned => Anchor::Middle,
            HPos::Left => Anchor::Start,
            _ => Anchor::End,
        };
        let lines = text.split('\n').enumerate();
        for (i, text) in lines.filter(|(_, text)| !text.is_empty()) {
            self.add(Mark::Text(Label {
                at: (x, y + px(raised + line * i as f64)),
                size,
                anchor,
                bold: matches!(style.style(), FontStyle::Bold),
                turned,
                words: text.to_owned(),
            }));
        }
        Ok(())
    }
}

/// A figure under construction.
pub(super) struct Canvas {
    /// Width of the figure.
    pub width: f64,
    marks: Marks,
    area: DrawingArea<Marks, Shift>,
}

impl Canvas {
    pub(super) fn new(width: f64) -> Self {
        let marks = Marks::default();
        let area = marks.clone().into_drawing_area();
        Self { width, marks, area }
    }

    /// The area between two corners.
    pub(super) fn part(&self, [left, top, right, bottom]: [f64; 4]) -> DrawingArea<Marks, Shift> {
        let size = at((right - left, bottom - top));
        self.area.clone().shrink(at((left, top)), size)
    }

    /// Draws an element that may reach outside the area. plotters moves a place to the area's edge, but not a place
    /// relative to another element.
    pub(super) fn draw<E, P>(&self, element: E) -> Drawn
    where
        EmptyElement<Pixel, Marks>: Add<E, Output = P>,
        P: Drawable<Marks>,
        for<'a> &'a P: PointCollection<'a, Pixel>,
    {
        self.area.draw(&(EmptyElement::at((0, 0)) + element))
    }

    /// A line through places.
    pub(super) fn line(&self, places: impl Into<Vec<Pixel>>, style: ShapeStyle) -> Drawn {
        self.draw(PathElement::new(places, style))
    }

    /// Draws lines of text below a place, which is the cap height of the first line. Returns the height.
    pub(super) fn text(
        &self,
        lines: &[String],
        font: &TextStyle<'static>,
        across: HPos,
        place: (f64, f64),
    ) -> Drawn<f64> {
        let style = font.pos(Pos::new(across, VPos::Top));
        self.draw(Text::new(lines.join("\n"), at(place), style))?;
        Ok(metrics::LINE * font.font.get_size() / 10.0 * lines.len() as f64)
    }

    /// Draws with `draw`, clipped at a rectangle.
    pub(super) fn clipped(&self, area: [f64; 4], draw: impl FnOnce() -> Drawn) -> Drawn {
        let [left, top, right, bottom] = area;
        let area = [left, top, right - left, bottom - top].map(px);
        self.between(Mark::Clip(area), Mark::Unclip, draw)
    }

    /// Draws with `draw` a part of the series with this number in the legend, or what is of none.
    pub(super) fn part_of(&self, part: Part, number: Option<usize>, draw: impl FnOnce() -> Drawn) -> Drawn {
        match number {
            Some(number) => self.between(Mark::Group(part, number), Mark::Ungroup, draw),
            None => draw(),
        }
    }

    fn between(&self, first: Mark, last: Mark, draw: impl FnOnce() -> Drawn) -> Drawn {
        self.marks.add(first);
        draw()?;
        self.marks.add(last);
        Ok(())
    }

    /// Gives a place its words.
    pub(super) fn hint(&self, at: Pixel, words: &str) {
        self.marks.add(Mark::Hint(at, words.to_owned()));
    }

    /// The finished picture. Without a description, the title is one.
    pub(super) fn document(self, width: f64, height: f64, [title, description]: [&str; 2]) -> Drawing {
        let description = [description, title][usize::from(description.is_empty())];
        Drawing {
            size: [width.ceil(), height.ceil()],
            for_print: false,
            title: title.to_owned(),
            description: description.to_owned(),
            marks: self.marks.0.take(),
        }
    }
}

/// The font of labels.
pub(super) fn plain(size: f64) -> TextStyle<'static> {
    FontDesc::new(FontFamily::SansSerif, 10.0 * size, FontStyle::Normal).into()
}

/// The font of titles.
pub(super) fn bold(size: f64) -> TextStyle<'static> {
    FontDesc::new(FontFamily::SansSerif, 10.0 * size, FontStyle::Bold).into()
}

/// The figure, or instead of it a figure with the reason why it could not be drawn.
pub(super) fn finish(drawn: Drawn<Drawing>) -> Drawing {
    drawn.unwrap_or_else(|error| {
        let (canvas, reason) = (Canvas::new(WIDTH), format!("Not drawn: {error}"));
        canvas.marks.add(Mark::Text(Label {
            at: (120, 300),
            size: LABEL,
            anchor: Anchor::Start,
            bold: false,
            turned: false,
            words: reason.clone(),
        }));
        canvas.document(WIDTH, 48.0, [&reason, ""])
    })
}
