//! A picture as a PDF of one page, in its light colours, with the fonts that every reader of PDF has (ISO 32000-1,
//! section
//! 9.6.2.2): Helvetica, and Symbol for Greek.

use super::inks::{LIGHT, dashes};
use super::scene::{Anchor, Drawing, Form, Kind, Mark, Paint, Pixel, Text};
use pdf_writer::types::LineJoinStyle;
use pdf_writer::{Content, Finish, Name, Pdf, Rect, Ref, Str, TextStr};

/// A figure's unit is a pixel of CSS: 1/96 inch in points.
const POINTS: f32 = 0.75;

/// Widths of Helvetica's characters from 32 to 126, in thousandths of the size (Adobe's font metrics).
const ASCII: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556,
    556, 556, 556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667,
    611, 778, 722, 278, 500, 667, 556, 833, 722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667,
    667, 611, 278, 278, 278, 469, 556, 333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500,
    222, 833, 556, 556, 556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584,
];
/// The same from 160 to 255.
const LATIN: [u16; 96] = [
    278, 333, 556, 556, 556, 556, 260, 556, 333, 737, 370, 556, 584, 333, 737, 333, 400, 584, 333,
    333, 333, 556, 537, 278, 333, 333, 365, 556, 834, 834, 834, 611, 667, 667, 667, 667, 667, 667,
    1000, 722, 667, 667, 667, 667, 278, 278, 278, 278, 722, 722, 778, 778, 778, 778, 778, 584, 778,
    722, 722, 722, 722, 667, 667, 611, 556, 556, 556, 556, 556, 556, 889, 500, 556, 556, 556, 556,
    278, 278, 278, 278, 556, 556, 556, 556, 556, 556, 556, 584, 611, 556, 556, 556, 556, 500, 556,
    500,
];
/// Characters of the encoding WinAnsi that have other numbers in Unicode: the number there, and the width.
const WINDOWS: [(char, u8, u16); 11] = [
    ('\u{20ac}', 0x80, 556),
    ('\u{201e}', 0x84, 333),
    ('\u{2026}', 0x85, 1000),
    ('\u{2030}', 0x89, 1000),
    ('\u{2018}', 0x91, 222),
    ('\u{2019}', 0x92, 222),
    ('\u{201c}', 0x93, 333),
    ('\u{201d}', 0x94, 333),
    ('\u{2022}', 0x95, 350),
    ('\u{2013}', 0x96, 556),
    ('\u{2014}', 0x97, 1000),
];
/// Characters of the font Symbol: where Latin letters are, from A and from a, and some signs; each with its width.
const SYMBOL: [(u8, &str, &[u16]); 3] = [
    (
        b'A',
        "ΑΒΧΔΕΦΓΗΙϑΚΛΜΝΟΠΘΡΣΤΥςΩΞΨΖ",
        &[
            722, 667, 722, 612, 611, 763, 603, 722, 333, 631, 722, 686, 889, 722, 722, 768, 741,
            556, 592, 611, 690, 439, 768, 645, 795, 611,
        ],
    ),
    (
        b'a',
        "αβχδεφγηιϕκλμνοπθρστυϖωξψζ",
        &[
            631, 549, 549, 494, 439, 521, 411, 603, 329, 603, 549, 549, 576, 521, 549, 549, 521,
            549, 603, 439, 576, 713, 686, 493, 686, 494,
        ],
    ),
    (0xb3, "≥", &[549]),
];

/// The fonts by their names in the page, in the order of `Font`.
const FONTS: [(&[u8], &[u8]); 3] = [
    (b"H", b"Helvetica"),
    (b"B", b"Helvetica-Bold"),
    (b"S", b"Symbol"),
];
/// The place of Symbol among the fonts.
const GREEK: usize = 2;

/// A character's font (0 for Helvetica), its code there, and its width in thousandths of the size.
fn glyph(character: char) -> Option<(usize, u8, u16)> {
    let code = u32::from(character);
    let width = |table: &[u16], first: u32| {
        let place = code.checked_sub(first)? as usize;
        Some((0, code as u8, *table.get(place)?))
    };
    let windows = || {
        let found = WINDOWS.iter().find(|(known, ..)| *known == character);
        found.map(|(_, code, width)| (0, *code, *width))
    };
    let symbol = || {
        SYMBOL.iter().find_map(|(first, characters, widths)| {
            let place = characters.chars().position(|known| known == character)?;
            Some((GREEK, first + place as u8, widths[place]))
        })
    };
    width(&ASCII, 32)
        .or_else(|| width(&LATIN, 160))
        .or_else(windows)
        .or_else(symbol)
}

impl Drawing {
    /// The picture as a PDF of one page; the same picture gives the same bytes.
    ///
    /// # Errors
    /// In words: a character that the fonts of PDF do not have.
    pub fn pdf(&self) -> Result<Vec<u8>, String> {
        let mut page = Page {
            content: Content::new(),
            opacities: Vec::new(),
        };
        let [width, height] = self.size.map(|length| length as f32);
        page.content
            .transform([POINTS, 0.0, 0.0, -POINTS, 0.0, POINTS * height]);
        page.content.set_line_join(LineJoinStyle::RoundJoin);
        for mark in &self.marks {
            page.mark(mark)?;
        }
        Ok(page.document([POINTS * width, POINTS * height], &self.title))
    }
}

/// The page so far.
struct Page {
    content: Content,
    /// The opacities of areas and lines that are used, in thousandths.
    opacities: Vec<[u16; 2]>,
}

impl Page {
    fn mark(&mut self, mark: &Mark) -> Result<(), String> {
        match mark {
            Mark::Shape(form, paint) => self.shape(form, paint),
            Mark::Text(text) => return self.text(text),
            Mark::Clip(area) => {
                let [left, top, width, height] = area.map(unit);
                self.content.save_state().rect(left, top, width, height);
                self.content.clip_nonzero().end_path();
            }
            Mark::Unclip => {
                self.content.restore_state();
            }
        }
        Ok(())
    }

    fn shape(&mut self, form: &Form, paint: &Paint) {
        let line = if paint.kind == Kind::Area { 400 } else { 1000 };
        let area = (1e3 * paint.alpha).round() as u16;
        let state = self.state([area, line]);
        let [red, green, blue] = ink(paint.ink);
        let width = if paint.kind == Kind::Area {
            10
        } else {
            paint.width
        };
        let lengths = dashes(paint.dashes).split(' ');
        let content = &mut self.content;
        content.save_state().set_parameters(Name(state.as_bytes()));
        content
            .set_fill_rgb(red, green, blue)
            .set_stroke_rgb(red, green, blue);
        content.set_line_width(unit(width as i32));
        content.set_dash_pattern(lengths.filter_map(|length| length.parse().ok()), 0.0);
        match form {
            Form::Line(places) => path(content, places),
            Form::Area(places) => {
                path(content, places);
                content.close_path();
            }
            Form::Rectangle(area) => {
                let [left, top, width, height] = area.map(unit);
                content.rect(left, top, width, height);
            }
            Form::Circle(centre, radius) => circle(content, *centre, *radius),
        }
        match paint.kind {
            Kind::Line => content.stroke(),
            Kind::Filled => content.fill_nonzero(),
            Kind::Edged | Kind::Area => content.fill_nonzero_and_stroke(),
        };
        content.restore_state();
    }

    /// The name of the opacities of areas and of lines.
    fn state(&mut self, opacities: [u16; 2]) -> String {
        let known = self.opacities.iter().position(|known| *known == opacities);
        let place = known.unwrap_or_else(|| {
            self.opacities.push(opacities);
            self.opacities.len() - 1
        });
        format!("G{place}")
    }

    fn text(&mut self, text: &Text) -> Result<(), String> {
        let mut runs: Vec<(usize, Vec<u8>)> = Vec::new();
        let mut length = 0.0;
        for character in text.words.chars() {
            let (font, code, width) = glyph(character).ok_or_else(|| {
                format!(
                    "'{}' has the character '{character}', which the fonts of PDF do not have; an SVG can show it",
                    text.words
                )
            })?;
            let font = if font == 0 {
                usize::from(text.bold)
            } else {
                font
            };
            length += f64::from(width) / 1e3 * text.size;
            match runs.last_mut() {
                Some((last, codes)) if *last == font => codes.push(code),
                _ => runs.push((font, vec![code])),
            }
        }
        let before = match text.anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => length / 2.0,
            Anchor::End => length,
        } as f32;
        let turn = if text.turned {
            std::f32::consts::FRAC_1_SQRT_2
        } else {
            0.0
        };
        let along = if text.turned { turn } else { 1.0 };
        let (x, y) = (
            unit(text.at.0) - along * before,
            unit(text.at.1) + turn * before,
        );
        let [red, green, blue] = ink(0);
        let content = &mut self.content;
        content.begin_text().set_fill_rgb(red, green, blue);
        // The page's y axis points downwards, letters do not.
        content.set_text_matrix([along, -turn, -turn, -along, x, y]);
        for (font, codes) in runs {
            content
                .set_font(Name(FONTS[font].0), text.size as f32)
                .show(Str(&codes));
        }
        content.end_text();
        Ok(())
    }

    fn document(self, [width, height]: [f32; 2], title: &str) -> Vec<u8> {
        let mut next = 1;
        let mut new = || {
            next += 1;
            Ref::new(next - 1)
        };
        let [catalog, tree, leaf, content, info] = [(); 5].map(|()| new());
        let fonts = FONTS.map(|font| (new(), font));
        let states: Vec<(Ref, [u16; 2])> =
            self.opacities.iter().map(|state| (new(), *state)).collect();
        let mut pdf = Pdf::new();
        pdf.catalog(catalog).pages(tree);
        pdf.pages(tree).kids([leaf]).count(1);
        let mut page = pdf.page(leaf);
        page.media_box(Rect::new(0.0, 0.0, width, height))
            .parent(tree)
            .contents(content);
        let mut resources = page.resources();
        resources
            .fonts()
            .pairs(fonts.map(|(id, (name, _))| (Name(name), id)));
        let names: Vec<String> = (0..states.len()).map(|place| format!("G{place}")).collect();
        let named = names.iter().zip(&states);
        resources
            .ext_g_states()
            .pairs(named.map(|(name, (id, _))| (Name(name.as_bytes()), *id)));
        resources.finish();
        page.finish();
        pdf.document_info(info)
            .title(TextStr(title))
            .creator(TextStr("asobench"));
        for (id, (_, font)) in fonts {
            let mut font_of = pdf.type1_font(id);
            font_of.base_font(Name(font));
            if font != FONTS[GREEK].1 {
                font_of.encoding_predefined(Name(b"WinAnsiEncoding"));
            }
        }
        for (id, [area, line]) in states {
            let [area, line] = [area, line].map(|share| f32::from(share) / 1e3);
            pdf.ext_graphics(id)
                .non_stroking_alpha(area)
                .stroking_alpha(line);
        }
        pdf.stream(content, &self.content.finish());
        pdf.finish()
    }
}

/// A length in the figure's units.
fn unit(pixels: i32) -> f32 {
    pixels as f32 / 10.0
}

/// The light colour of an ink.
fn ink(place: usize) -> [f32; 3] {
    let digits = LIGHT
        .get(place)
        .and_then(|colour| colour.get(1..))
        .unwrap_or_default();
    [0, 2, 4].map(|from| {
        let part = digits.get(from..from + 2).unwrap_or_default();
        f32::from(u8::from_str_radix(part, 16).unwrap_or_default()) / 255.0
    })
}

fn path(content: &mut Content, places: &[Pixel]) {
    for (i, (x, y)) in places.iter().enumerate() {
        let (x, y) = (unit(*x), unit(*y));
        if i == 0 {
            content.move_to(x, y);
        } else {
            content.line_to(x, y);
        }
    }
}

/// A circle as four Bezier curves, whose radius is right within 0.03 %.
fn circle(content: &mut Content, (x, y): Pixel, radius: i32) {
    const HANDLE: f32 = 0.552_285;
    let (x, y, r) = (unit(x), unit(y), unit(radius));
    let h = HANDLE * r;
    content.move_to(x + r, y);
    content.cubic_to(x + r, y + h, x + h, y + r, x, y + r);
    content.cubic_to(x - h, y + r, x - r, y + h, x - r, y);
    content.cubic_to(x - r, y - h, x - h, y - r, x, y - r);
    content.cubic_to(x + h, y - r, x + r, y - h, x + r, y);
    content.close_path();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_character_has_its_width() {
        for (first, characters, widths) in SYMBOL {
            assert_eq!(characters.chars().count(), widths.len(), "{first}");
        }
        // Of Adobe's Helvetica.afm and Symbol.afm.
        for (character, expected) in [
            (' ', (0, 32, 278)),
            ('W', (0, 87, 944)),
            ('~', (0, 126, 584)),
            ('\u{b0}', (0, 0xb0, 400)),
            ('\u{e4}', (0, 0xe4, 556)),
            ('\u{ff}', (0, 255, 500)),
            ('\u{2013}', (0, 0x96, 556)),
            ('\u{3a9}', (GREEK, b'W', 768)),
            ('\u{3b7}', (GREEK, b'h', 603)),
        ] {
            assert_eq!(glyph(character), Some(expected), "{character}");
        }
        for missing in ['\u{7f}', '\u{80}', '\u{416}', '\u{4e2d}'] {
            assert_eq!(glyph(missing), None);
        }
    }

    #[test]
    fn colours_are_those_of_svg() {
        assert_eq!(ink(1), [1.0; 3]);
        let blue = ink(4).map(|part| (255.0 * part).round() as u8);
        assert_eq!(blue, [0x00, 0x72, 0xb2]);
    }
}
