//! A drawing backend for plotters that writes SVG with classes, and the style of these classes.
//!
//! plotters uses integer pixels, so a pixel here is a tenth of the figure's unit. A plotters colour encodes an ink and
//! a pattern of dashes; the page's style turns inks into colours, light or dark. The only rotation used for texts,
//! [`FontTransform::Rotate270`], is drawn at 45 degrees.

use super::metrics;
use crate::markup::escape;
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
pub(super) const NARROW: f64 = 440.0;
/// Size of a figure's title.
pub(super) const TITLE: f64 = 18.0;
/// Size of axis labels, legend and panel titles.
pub(super) const LABEL: f64 = 15.0;
/// Size of tick labels and notes below the axes.
pub(super) const TICK: f64 = 14.0;
/// Size of notes beside points.
pub(super) const NOTE: f64 = 12.0;

/// The inks: class, light colour, dark colour.
macro_rules! inks {
    ($($class:literal $light:literal $dark:literal)*) => {
        const INKS: &[&str] = &[$($class),*];

        /// The style element that every figure contains; a page with several inline figures needs it only once. A page
        /// may set the inks as properties of `.asoplot`, such as `--s0`. A program that does not support properties
        /// shows the light colours. The other classes: l line, f filled, e with an edge, a area with a faint edge, b
        /// bold.
        pub const STYLE: &str = concat!(
            "<style>.asoplot{color:#1b1f24;color:var(--ink,#1b1f24);max-width:100%;height:auto;",
            "font-family:Helvetica,Arial,'Liberation Sans',sans-serif}",
            ".asoplot text{fill:currentColor}.asoplot .b{font-weight:bold}",
            ".asoplot .l{fill:none;stroke:currentColor;stroke-linejoin:round}",
            ".asoplot .f,.asoplot .a{fill:currentColor}",
            ".asoplot .e{stroke:currentColor}",
            ".asoplot .a{stroke:currentColor;stroke-opacity:.4}",
            $(".asoplot .", $class, "{color:", $light, ";color:var(--", $class, ",", $light, ")}",)*
            "@media screen and (prefers-color-scheme:dark){.asoplot{",
            $("--", $class, ":", $dark, ";",)*
            "}}</style>",
        );
    };
}

inks! {
    "ink" "#1b1f24" "#e4e6ea"
    "paper" "#fff" "#16181d"
    "grid" "#e1e2e2" "#3f4146"
    "faint" "#f2f2f3" "#27292e"
    "s0" "#0072b2" "#4ba3e3"
    "s1" "#d55e00" "#f58a42"
    "s2" "#009e73" "#2fc79b"
    "s3" "#b8578e" "#e39ac6"
    "s4" "#c98a00" "#f0b93a"
    "s5" "#3a9bd6" "#9ad2f6"
    "s6" "#4d4d4d" "#b9bec6"
}

/// Number of inks for series.
pub(super) const COLOURS: usize = 7;
/// Dashes for series.
const DASHES: [&str; 7] = ["", "9 5", "3 4", "12 4 3 4", "18 5", "6 3 2 3 2 3", "1.5 3"];
/// Dashes for reference lines, in the ink of text.
const REFERENCES: [&str; 5] = ["2 5", "14 4 2 4", "6 6", "10 3 2 3 2 3", ""];

pub(super) const TEXT: RGBColor = RGBColor(0, 0, 0);
pub(super) const PAPER: RGBColor = RGBColor(1, 0, 0);
pub(super) const GRID: RGBColor = RGBColor(2, 0, 0);
pub(super) const FAINT: RGBColor = RGBColor(3, 0, 0);

/// The ink of series i with pattern number `dashes`; pattern 0 is solid.
pub(super) fn series_ink(i: usize, dashes: usize) -> RGBColor {
    RGBColor((4 + i % COLOURS) as u8, (dashes % DASHES.len()) as u8, 0)
}

/// The ink of reference line i.
pub(super) fn reference_ink(i: usize) -> RGBColor {
    RGBColor(0, (DASHES.len() + i % REFERENCES.len()) as u8, 0)
}

/// A length in plotters' pixels.
pub(super) fn px(length: f64) -> i32 {
    (10.0 * length).round() as i32
}

/// A place in plotters' pixels.
pub(super) fn at((x, y): (f64, f64)) -> (i32, i32) {
    (px(x), px(y))
}

type Pixel = (i32, i32);
type Refused = DrawingErrorKind<Infallible>;
/// The result of a drawing function of plotters.
pub(super) type Drawn<T = ()> = DrawResult<T, Svg>;

/// The elements written so far, and the attributes of the last one if it is a path that further lines may join.
#[derive(Default)]
struct Written {
    body: String,
    pen: String,
}

/// The backend; its clones write to the same document.
#[derive(Clone, Default)]
pub(super) struct Svg(Rc<RefCell<Written>>);

impl Svg {
    fn add(&self, element: &str) {
        let mut written = self.0.borrow_mut();
        written.pen.clear();
        written.body += element;
        written.body.push('\n');
    }

    /// Adds a line; it joins the previous path if both look the same.
    fn stroke(&self, places: impl IntoIterator<Item = Pixel>, style: &impl BackendStyle) {
        const END: &str = "\"/>\n";
        let (pen, course) = (paint("l", style), course(places));
        let written = &mut *self.0.borrow_mut();
        if course.is_empty() || style.color().alpha == 0.0 {
            return;
        }
        if written.pen == pen {
            written.body.truncate(written.body.len() - END.len());
        } else {
            written.body += &format!("<path{pen} d=\"");
            written.pen = pen;
        }
        written.body += &course;
        written.body += END;
    }

    /// Adds a shape: its outline, or filled; a filled one gets an edge if its stroke width is not 1.
    fn shape(&self, tag: &str, fill: bool, style: &impl BackendStyle, place: &str) {
        let kind = match style.stroke_width() {
            _ if !fill => "l",
            1 => "f",
            _ => "f e",
        };
        self.add(&format!("<{tag}{} {place}/>", paint(kind, style)));
    }
}

/// The attributes of a style: a class for the kind of shape, one for the ink, and values that differ from the default.
fn paint(kind: &str, style: &impl BackendStyle) -> String {
    let (BackendColor { alpha, rgb }, width) = (style.color(), style.stroke_width());
    let mut paint = format!(" class=\"{kind}");
    if let Some(ink) = INKS.get(usize::from(rgb.0)).filter(|_| rgb.0 > 0) {
        paint += &format!(" {ink}");
    }
    paint.push('"');
    if kind != "l" && alpha < 1.0 {
        paint += &format!(" fill-opacity=\"{}\"", (1e3 * alpha).round() / 1e3);
    }
    if !["f", "a"].contains(&kind) && width != 10 {
        paint += &format!(" stroke-width=\"{}\"", tenths(width as i32));
    }
    let dashes = DASHES.iter().chain(&REFERENCES).nth(usize::from(rgb.1));
    if let Some(dashes) = dashes.filter(|dashes| !dashes.is_empty()) {
        paint += &format!(" stroke-dasharray=\"{dashes}\"");
    }
    paint
}

fn tenths(pixels: i32) -> String {
    (f64::from(pixels) / 10.0).to_string()
}

/// The course of a polyline.
fn course(places: impl IntoIterator<Item = (i32, i32)>) -> String {
    let mut course = String::new();
    let mut before = None;
    for (x, y) in places {
        let [left, top] = [x, y].map(tenths);
        course += &match before {
            None => format!("M{left} {top}"),
            Some((_, above)) if above == y => format!("H{left}"),
            Some((beside, _)) if beside == x => format!("V{top}"),
            Some(_) => format!("L{left} {top}"),
        };
        before = Some((x, y));
    }
    course
}

impl DrawingBackend for Svg {
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

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = Pixel>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Result<(), Refused> {
        self.stroke(path, style);
        Ok(())
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        a: Pixel,
        b: Pixel,
        style: &S,
        fill: bool,
    ) -> Result<(), Refused> {
        let [x, y, width, height] = [a.0, a.1, b.0 - a.0, b.1 - a.1].map(tenths);
        let place = format!("x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"");
        self.shape("rect", fill, style, &place);
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        (x, y): Pixel,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Result<(), Refused> {
        let [x, y, radius] = [x, y, radius as i32].map(tenths);
        let place = format!("cx=\"{x}\" cy=\"{y}\" r=\"{radius}\"");
        self.shape("circle", fill, style, &place);
        Ok(())
    }

    /// Fills an area; a translucent one has an edge.
    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = Pixel>>(
        &mut self,
        corners: I,
        style: &S,
    ) -> Result<(), Refused> {
        let kind = if style.color().alpha < 1.0 { "a" } else { "f" };
        let (paint, course) = (paint(kind, style), course(corners));
        self.add(&format!("<path{paint} d=\"{course}Z\"/>"));
        Ok(())
    }

    /// Draws a text of one or more lines. The place is the cap height of the first line, the middle, or the base of the
    /// last line.
    fn draw_text<S: BackendTextStyle>(
        &mut self,
        text: &str,
        style: &S,
        (x, y): Pixel,
    ) -> Result<(), Refused> {
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
            HPos::Center if !turned => "middle",
            HPos::Left => "start",
            _ => "end",
        };
        let bold = matches!(style.style(), FontStyle::Bold);
        let class = if bold { " class=\"b\"" } else { "" };
        let lines = text.split('\n').enumerate();
        for (i, text) in lines.filter(|(_, text)| !text.is_empty()) {
            let [x, y] = [x, y + px(raised + line * i as f64)].map(tenths);
            let mut place =
                format!("x=\"{x}\" y=\"{y}\" font-size=\"{size}\" text-anchor=\"{anchor}\"");
            if turned {
                place += &format!(" transform=\"rotate(-45 {x} {y})\"");
            }
            self.add(&format!("<text{class} {place}>{}</text>", escape(text)));
        }
        Ok(())
    }
}

/// A figure under construction.
pub(super) struct Canvas {
    /// Width of the figure.
    pub width: f64,
    svg: Svg,
    area: DrawingArea<Svg, Shift>,
}

impl Canvas {
    pub(super) fn new(width: f64) -> Self {
        let svg = Svg::default();
        let area = svg.clone().into_drawing_area();
        Self { width, svg, area }
    }

    /// The area between two corners.
    pub(super) fn part(&self, [left, top, right, bottom]: [f64; 4]) -> DrawingArea<Svg, Shift> {
        let size = at((right - left, bottom - top));
        self.area.clone().shrink(at((left, top)), size)
    }

    /// Draws an element that may reach outside the area. plotters moves a place to the area's edge, but not a place
    /// relative to another element.
    pub(super) fn draw<E, P>(&self, element: E) -> Drawn
    where
        EmptyElement<Pixel, Svg>: Add<E, Output = P>,
        P: Drawable<Svg>,
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

    /// Draws with `draw`, clipped at a rectangle. (A nested viewport clips without an id.)
    pub(super) fn clipped(&self, area: [f64; 4], draw: impl FnOnce() -> Drawn) -> Drawn {
        let [left, top, right, bottom] = area;
        let [x, y, width, height] =
            [left, top, right - left, bottom - top].map(|length| tenths(px(length)));
        self.svg.add(&format!(
            "<svg x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" viewBox=\"{x} {y} \
            {width} {height}\">"
        ));
        draw()?;
        self.svg.add("</svg>");
        Ok(())
    }

    /// The finished document, with a title and a description for assistive software.
    pub(super) fn document(
        self,
        width: f64,
        height: f64,
        [title, description]: [&str; 2],
    ) -> String {
        let (width, height) = (width.ceil(), height.ceil());
        let description = [description, title][usize::from(description.is_empty())];
        let [title, description] = [title, description].map(escape);
        let body = &self.svg.0.borrow().body;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"asoplot\" role=\"img\" \
             aria-label=\"{title}\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} \
             {height}\">\n\
             <title>{title}</title>\n<desc>{description}</desc>\n{STYLE}\n\
             <rect class=\"f paper\" width=\"{width}\" height=\"{height}\"/>\n{body}</svg>\n",
        )
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
pub(super) fn finish(drawn: Drawn<String>) -> String {
    drawn.unwrap_or_else(|error| {
        let (canvas, reason) = (Canvas::new(WIDTH), format!("Not drawn: {error}"));
        let text = escape(&reason);
        canvas
            .svg
            .add(&format!("<text x=\"12\" y=\"30\">{text}</text>"));
        canvas.document(WIDTH, 48.0, [&reason, ""])
    })
}
