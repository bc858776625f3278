//! The marks of a picture in the order in which they are drawn, which SVG and PDF are written from.

/// A place in tenths of the figure's unit, x to the right and y downwards.
pub(super) type Pixel = (i32, i32);

/// A finished picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// Width and height in the figure's units.
    pub(super) size: [f64; 2],
    /// Whether it has the size of print, not of a screen.
    pub(super) for_print: bool,
    /// The title, for assistive software and for lists of files.
    pub(super) title: String,
    /// The picture in a sentence or two.
    pub(super) description: String,
    /// The marks; those after others lie above them.
    pub(super) marks: Vec<Mark>,
}

/// A mark.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Mark {
    /// A shape.
    Shape(Form, Paint),
    /// A line of text.
    Text(Text),
    /// The marks up to `Unclip` are cut at this rectangle: left, top, width, height.
    Clip([i32; 4]),
    /// The end of a clip.
    Unclip,
    /// The marks up to `Ungroup` are of a series, which a page can hide.
    Group(Part, usize),
    /// The end of a group.
    Ungroup,
    /// A place that has words on a page.
    Hint(Pixel, String),
}

impl Mark {
    /// Whether it is for the script of a page alone.
    pub(super) fn is_for_pages(&self) -> bool {
        matches!(self, Self::Group(..) | Self::Ungroup | Self::Hint(..))
    }
}

/// A part of a series, known by its number in the legend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// Its name, with the sample beside it.
    Name,
    /// The parts of its points that are drawn.
    Points,
}

/// The form of a shape.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Form {
    /// A line through places.
    Line(Vec<Pixel>),
    /// The area that places enclose.
    Area(Vec<Pixel>),
    /// A rectangle: left, top, width, height.
    Rectangle([i32; 4]),
    /// A circle: centre and radius.
    Circle(Pixel, i32),
}

/// How a shape is painted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// Its line.
    Line,
    /// Its area.
    Filled,
    /// Its area, and its line.
    Edged,
    /// Its area, and a faint line.
    Area,
}

/// The look of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Paint {
    pub kind: Kind,
    /// The place of the ink in the list of inks; 0 is that of text.
    pub ink: usize,
    /// The pattern of dashes.
    pub dashes: usize,
    /// The opacity of the area.
    pub alpha: f64,
    /// The width of the line, in tenths.
    pub width: u32,
}

/// Which part of a text is at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// A line of text.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Text {
    /// The base line at the anchor.
    pub at: Pixel,
    /// The size in the figure's units.
    pub size: f64,
    pub anchor: Anchor,
    pub bold: bool,
    /// Whether it rises at 45 degrees.
    pub turned: bool,
    pub words: String,
}
