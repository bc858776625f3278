//! A picture as an SVG document.

use super::inks::{INKS, STYLE, dashes};
use super::scene::{Anchor, Drawing, Form, Kind, Mark, Paint, Part, Pixel, Text};
use crate::markup::escape;
use std::fmt::Write as _;

impl Drawing {
    /// The picture as an SVG document whose colours are classes, with a title and a description for assistive software.
    pub fn svg(&self) -> String {
        let body = body(self.marks.iter().filter(|mark| !mark.is_for_pages()));
        self.document(&format!("{STYLE}\n"), &body)
    }

    /// The same for a page, which has the style once: values with words, and series that its script can hide.
    pub(crate) fn inline_svg(&self) -> String {
        self.document("", &body(self.marks.iter()))
    }

    fn document(&self, style: &str, body: &str) -> String {
        let [width, height] = self.size;
        let [wide, high] = self.size.map(|length| {
            if self.for_print {
                format!("{:.2}pt", self.points() * length)
            } else {
                length.to_string()
            }
        });
        let [title, description] = [&self.title, &self.description].map(|text| escape(text));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"asoplot\" role=\"img\" \
             aria-label=\"{title}\" width=\"{wide}\" height=\"{high}\" viewBox=\"0 0 {width} \
             {height}\">\n\
             <title>{title}</title>\n<desc>{description}</desc>\n{style}\
             <rect class=\"f paper\" width=\"{width}\" height=\"{height}\"/>\n{body}</svg>\n",
        )
    }
}

/// The elements of all marks. Lines that follow each other and look the same are one path.
fn body<'a>(marks: impl Iterator<Item = &'a Mark>) -> String {
    const END: &str = "\"/>\n";
    let mut body = String::new();
    let mut pen = String::new();
    for mark in marks {
        if let Mark::Shape(Form::Line(places), paint) = mark {
            let (next, course) = (attributes(paint), course(places));
            if next == pen {
                body.truncate(body.len() - END.len());
            } else {
                let _ = write!(body, "<path{next} d=\"");
                pen = next;
            }
            body += &course;
            body += END;
            continue;
        }
        pen.clear();
        let element = match mark {
            Mark::Shape(form, paint) => shape(form, paint),
            Mark::Text(text) => label(text),
            Mark::Clip(area) => {
                let [x, y, width, height] = area.map(tenths);
                // A nested viewport clips without an id.
                format!(
                    "<svg x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" viewBox=\"{x} {y} \
                     {width} {height}\">"
                )
            }
            Mark::Unclip => "</svg>".to_owned(),
            Mark::Group(Part::Name, number) => format!("<g data-name=\"{number}\">"),
            Mark::Group(Part::Points, number) => format!("<g data-of=\"{number}\">"),
            Mark::Ungroup => "</g>".to_owned(),
            Mark::Hint((x, y), words) => {
                let ([x, y], words) = ([*x, *y].map(tenths), escape(words));
                format!("<circle class=\"p\" cx=\"{x}\" cy=\"{y}\" r=\"8\"><title>{words}</title></circle>")
            }
        };
        body += &element;
        body.push('\n');
    }
    body
}

fn shape(form: &Form, paint: &Paint) -> String {
    let paint = attributes(paint);
    match form {
        Form::Line(places) => format!("<path{paint} d=\"{}\"/>", course(places)),
        Form::Area(places) => format!("<path{paint} d=\"{}Z\"/>", course(places)),
        Form::Rectangle(area) => {
            let [x, y, width, height] = area.map(tenths);
            format!("<rect{paint} x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/>")
        }
        Form::Circle((x, y), radius) => {
            let [x, y, radius] = [*x, *y, *radius].map(tenths);
            format!("<circle{paint} cx=\"{x}\" cy=\"{y}\" r=\"{radius}\"/>")
        }
    }
}

fn label(text: &Text) -> String {
    let [x, y] = [text.at.0, text.at.1].map(tenths);
    let anchor = match text.anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    };
    let class = if text.bold { " class=\"b\"" } else { "" };
    let turn = if text.turned {
        format!(" transform=\"rotate(-45 {x} {y})\"")
    } else {
        String::new()
    };
    let (size, words) = (text.size, escape(&text.words));
    format!("<text{class} x=\"{x}\" y=\"{y}\" font-size=\"{size}\" text-anchor=\"{anchor}\"{turn}>{words}</text>")
}

/// The attributes of a paint: a class for its kind, one for the ink, and values that differ from the default.
fn attributes(paint: &Paint) -> String {
    let kind = match paint.kind {
        Kind::Line => "l",
        Kind::Filled => "f",
        Kind::Edged => "f e",
        Kind::Area => "a",
    };
    let ink = match INKS.get(paint.ink) {
        Some(ink) if paint.ink > 0 => format!(" {ink}"),
        _ => String::new(),
    };
    let opacity = match paint.alpha {
        alpha if paint.kind != Kind::Line && alpha < 1.0 => {
            format!(" fill-opacity=\"{}\"", (1e3 * alpha).round() / 1e3)
        }
        _ => String::new(),
    };
    let width = match paint.width {
        width if matches!(paint.kind, Kind::Line | Kind::Edged) && width != 10 => {
            format!(" stroke-width=\"{}\"", tenths(width as i32))
        }
        _ => String::new(),
    };
    let dashes = match dashes(paint.dashes) {
        "" => String::new(),
        dashes => format!(" stroke-dasharray=\"{dashes}\""),
    };
    format!(" class=\"{kind}{ink}\"{opacity}{width}{dashes}")
}

fn tenths(pixels: i32) -> String {
    (f64::from(pixels) / 10.0).to_string()
}

/// The course of a polyline.
fn course(places: &[Pixel]) -> String {
    let mut course = String::new();
    let mut before = None;
    for &(x, y) in places {
        let [left, top] = [x, y].map(tenths);
        let _ = match before {
            None => write!(course, "M{left} {top}"),
            Some((_, above)) if above == y => write!(course, "H{left}"),
            Some((beside, _)) if beside == x => write!(course, "V{top}"),
            Some(_) => write!(course, "L{left} {top}"),
        };
        before = Some((x, y));
    }
    course
}
