//! SVG elements and the style that all figures share.

use crate::report::markup::escape;

/// Width of every figure in its own units.
pub(super) const WIDTH: f64 = 900.0;
/// Size of a figure's title.
pub(super) const TITLE: f64 = 18.0;
/// Size of axis labels, legend and panel titles.
pub(super) const LABEL: f64 = 15.0;
/// Size of tick labels and notes.
pub(super) const TICK: f64 = 14.0;
/// Colours in the palette.
pub(super) const COLOURS: usize = 7;

/// The style element that every figure contains; a page with several inline figures needs it once only.
pub const STYLE: &str = concat!(
    "<style>",
    ".asoplot{color:#1b1f24;max-width:100%;height:auto;",
    "font-family:Helvetica,Arial,'Liberation Sans',sans-serif;font-size:15px}",
    ".asoplot .bg{fill:#fff}",
    ".asoplot text{fill:currentColor;stroke:none}",
    ".asoplot .t{font-size:18px;font-weight:bold}",
    ".asoplot .p{font-weight:bold}",
    ".asoplot .k{font-size:14px}",
    ".asoplot .axis{stroke:currentColor;fill:none}",
    ".asoplot .grid{stroke:currentColor;stroke-opacity:.13}",
    ".asoplot .ref{stroke:currentColor;stroke-width:1.6;fill:none}",
    ".asoplot .line{stroke:currentColor;stroke-width:2;fill:none;stroke-linejoin:round}",
    ".asoplot .thin{stroke:currentColor;stroke-width:1.2;fill:none}",
    ".asoplot .trace{stroke:currentColor;stroke-width:1;stroke-opacity:.35;fill:none}",
    ".asoplot .band{fill:currentColor;fill-opacity:.16;stroke:currentColor;stroke-opacity:.4;stroke-linejoin:round}",
    ".asoplot .dot{fill:currentColor}",
    ".asoplot .open{fill:#fff;stroke:currentColor;stroke-width:1.8}",
    ".asoplot .box{fill:currentColor;fill-opacity:.22;stroke:currentColor;stroke-width:1.5}",
    ".asoplot .cell{fill:currentColor}",
    ".asoplot .s0{color:#0072b2}",
    ".asoplot .s1{color:#d55e00}",
    ".asoplot .s2{color:#009e73}",
    ".asoplot .s3{color:#b8578e}",
    ".asoplot .s4{color:#c98a00}",
    ".asoplot .s5{color:#3a9bd6}",
    ".asoplot .s6{color:#4d4d4d}",
    "@media screen and (prefers-color-scheme:dark){",
    ".asoplot{color:#e4e6ea}",
    ".asoplot .bg,.asoplot .open{fill:#16181d}",
    ".asoplot .grid{stroke-opacity:.2}",
    ".asoplot .s0{color:#4ba3e3}",
    ".asoplot .s1{color:#f58a42}",
    ".asoplot .s2{color:#2fc79b}",
    ".asoplot .s3{color:#e39ac6}",
    ".asoplot .s4{color:#f0b93a}",
    ".asoplot .s5{color:#9ad2f6}",
    ".asoplot .s6{color:#b9bec6}",
    "}",
    "</style>",
);

/// A length in at most one decimal.
pub(super) fn px(length: f64) -> String {
    let tenths = (length * 10.0).round();
    if tenths == 0.0 || !tenths.is_finite() {
        return "0".to_owned();
    }
    (tenths / 10.0).to_string()
}

/// Which end of a text stands at its place.
#[derive(Clone, Copy)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

impl Anchor {
    fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Middle => "middle",
            Self::End => "end",
        }
    }
}

/// The elements of a figure.
#[derive(Default)]
pub(super) struct Canvas {
    body: String,
}

impl Canvas {
    /// The document of these elements, with the title and the description that assistive software reads.
    pub(super) fn document(
        &self,
        width: f64,
        height: f64,
        title: &str,
        description: &str,
    ) -> String {
        let (width, height) = (px(width.ceil()), px(height.ceil()));
        let label = escape(title);
        let description = escape(if description.is_empty() {
            title
        } else {
            description
        });
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"asoplot\" role=\"img\" aria-label=\"{label}\" \
             width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\n\
             <title>{label}</title>\n<desc>{description}</desc>\n{STYLE}\n\
             <rect class=\"bg\" width=\"{width}\" height=\"{height}\"/>\n{}</svg>\n",
            self.body
        )
    }

    fn add(&mut self, element: &str) {
        self.body.push_str(element);
    }

    /// The elements that `draw` makes, of one class.
    pub(super) fn group(&mut self, class: &str, draw: impl FnOnce(&mut Self)) {
        self.wrap(&format!("<g class=\"{class}\">\n"), "</g>\n", draw);
    }

    /// What `draw` makes between two tags, which are left out where that is nothing.
    fn wrap(&mut self, open: &str, close: &str, draw: impl FnOnce(&mut Self)) {
        self.add(open);
        let empty = self.body.len();
        draw(self);
        if self.body.len() == empty {
            self.body.truncate(empty - open.len());
        } else {
            self.add(close);
        }
    }

    /// The elements that `draw` makes, cut at a rectangle. (A nested viewport cuts without an id.)
    pub(super) fn clipped(
        &mut self,
        [x, y, width, height]: [f64; 4],
        draw: impl FnOnce(&mut Self),
    ) {
        let [x, y, width, height] = [x, y, width, height].map(px);
        let open = format!(
            "<svg x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" viewBox=\"{x} {y} {width} {height}\">\n"
        );
        self.wrap(&open, "</svg>\n", draw);
    }

    pub(super) fn line(&mut self, class: &str, dashes: &str, from: (f64, f64), to: (f64, f64)) {
        let [x1, y1, x2, y2] = [from.0, from.1, to.0, to.1].map(px);
        let dashes = dash_attribute(dashes);
        self.add(&format!(
            "<line class=\"{class}\"{dashes} x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"/>\n"
        ));
    }

    /// Several lines as one element.
    pub(super) fn lines(&mut self, class: &str, lines: &[[(f64, f64); 2]]) {
        if !lines.is_empty() {
            let all: String = lines.iter().map(|line| course(line)).collect();
            self.path(class, "", &all);
        }
    }

    /// A rectangle between two opposite corners.
    pub(super) fn rectangle(&mut self, class: &str, a: (f64, f64), b: (f64, f64)) {
        self.shaded(class, None, a, b);
    }

    /// A rectangle between two opposite corners, of a given opacity.
    pub(super) fn shaded(
        &mut self,
        class: &str,
        opacity: Option<f64>,
        a: (f64, f64),
        b: (f64, f64),
    ) {
        let [x, y] = [a.0.min(b.0), a.1.min(b.1)].map(px);
        let [width, height] = [(a.0 - b.0).abs(), (a.1 - b.1).abs()].map(px);
        let opacity =
            opacity.map_or_else(String::new, |value| format!(" fill-opacity=\"{value:.2}\""));
        self.add(&format!(
            "<rect class=\"{class}\"{opacity} x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/>\n"
        ));
    }

    pub(super) fn path(&mut self, class: &str, dashes: &str, course: &str) {
        let dashes = dash_attribute(dashes);
        self.add(&format!(
            "<path class=\"{class}\"{dashes} d=\"{course}\"/>\n"
        ));
    }

    pub(super) fn text(&mut self, class: &str, anchor: Anchor, (x, y): (f64, f64), text: &str) {
        self.turned(class, anchor, (x, y), 0.0, text);
    }

    /// A text turned by `degrees` about its place.
    pub(super) fn turned(
        &mut self,
        class: &str,
        anchor: Anchor,
        (x, y): (f64, f64),
        degrees: f64,
        text: &str,
    ) {
        let [x, y] = [x, y].map(px);
        let turn = if degrees == 0.0 {
            String::new()
        } else {
            format!(" transform=\"rotate({} {x} {y})\"", px(degrees))
        };
        let class = if class.is_empty() {
            String::new()
        } else {
            format!(" class=\"{class}\"")
        };
        self.add(&format!(
            "<text{class} x=\"{x}\" y=\"{y}\" text-anchor=\"{}\"{turn}>{}</text>\n",
            anchor.name(),
            escape(text)
        ));
    }
}

fn dash_attribute(dashes: &str) -> String {
    if dashes.is_empty() {
        String::new()
    } else {
        format!(" stroke-dasharray=\"{dashes}\"")
    }
}

/// The course of a polyline.
pub(super) fn course(points: &[(f64, f64)]) -> String {
    let mut course = String::new();
    let mut before: Option<[String; 2]> = None;
    for (x, y) in points {
        let place = [px(*x), px(*y)];
        let [x, y] = &place;
        let parts = match &before {
            None => ["M", x, " ", y],
            Some([_, above]) if above == y => ["H", x, "", ""],
            Some([left, _]) if left == x => ["V", y, "", ""],
            Some(_) => ["L", x, " ", y],
        };
        course.push_str(&parts.concat());
        before = Some(place);
    }
    course
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_one_decimal_at_most() {
        for (length, text) in [
            (1.0, "1"),
            (-0.04, "0"),
            (12.345, "12.3"),
            (0.06, "0.1"),
            (f64::NAN, "0"),
        ] {
            assert_eq!(px(length), text);
        }
    }
}
