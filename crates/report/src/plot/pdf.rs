//! A picture as a PDF of one page, in its light colours. The page has the fonts that it uses in it (ISO 32000-1,
//! sections 9.7 and 9.9), as journals demand: Liberation Sans, which is as wide as Helvetica, cut down to Latin, Greek
//! and Cyrillic letters and common signs. Its licence (`pdf/OFL.txt`) asks for another name for a part of it.

use super::backend::LABEL;
use super::inks::{LIGHT, dashes};
use super::scene::{Anchor, Drawing, Form, Kind, Mark, Paint, Pixel, Text};
use pdf_writer::types::{CidFontType, FontFlags, LineJoinStyle, SystemInfo, UnicodeCmap};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, Str, TextStr};
use std::collections::HashMap;
use std::sync::LazyLock;

/// A figure's unit is a pixel of CSS: 1/96 inch in points.
const POINTS: f64 = 0.75;
/// The size of labels in print, in points.
const PRINT: f64 = 8.0;

/// A font: its name in the page, its PostScript name, and its TrueType file, compressed by zlib.
struct Font {
    page: &'static [u8],
    name: &'static [u8],
    file: &'static [u8],
    /// The length of the file before it was compressed.
    length: i32,
}

/// The fonts: for text, and for titles.
const FONTS: [Font; 2] = [
    Font {
        page: b"R",
        name: b"ASOBEN+AsobenchSans",
        file: include_bytes!("pdf/regular.ttf.z"),
        length: 33_176,
    },
    Font {
        page: b"B",
        name: b"ASOBEN+AsobenchSans-Bold",
        file: include_bytes!("pdf/bold.ttf.z"),
        length: 33_280,
    },
];

/// A character's number in each font, and its width there in thousandths of the size.
type Glyph = [(u16, u16); 2];

/// The characters of the fonts: of each a line "A 34 667 34 722".
static GLYPHS: LazyLock<HashMap<char, Glyph>> = LazyLock::new(|| {
    let glyph = |line: &str| {
        let mut letters = line.chars();
        let character = letters.next()?;
        let mut numbers = letters.as_str().split(' ').filter_map(|part| part.parse().ok());
        let mut pair = || Some((numbers.next()?, numbers.next()?));
        Some((character, [pair()?, pair()?]))
    };
    include_str!("pdf/glyphs.txt").lines().filter_map(glyph).collect()
});

impl Drawing {
    /// The picture as a PDF of one page; the same picture gives the same bytes.
    ///
    /// # Errors
    /// In words: a character that the fonts of PDF do not have.
    pub fn pdf(&self) -> Result<Vec<u8>, String> {
        let mut page = Page {
            content: Content::new(),
            opacities: Vec::new(),
            used: [false; FONTS.len()],
        };
        let points = self.points();
        let size = self.size.map(|length| (points * length) as f32);
        let unit = points as f32;
        page.content.transform([unit, 0.0, 0.0, -unit, 0.0, size[1]]);
        page.content.set_line_join(LineJoinStyle::RoundJoin);
        for mark in &self.marks {
            page.mark(mark)?;
        }
        Ok(page.document(size, &self.title))
    }

    /// The length of a unit in points.
    pub(super) fn points(&self) -> f64 {
        if self.for_print { PRINT / LABEL } else { POINTS }
    }

    /// The units of a width in millimetres, where labels have 8 points.
    pub fn units_of_print(millimetres: f64) -> f64 {
        millimetres * 72.0 / 25.4 * LABEL / PRINT
    }

    /// Returns the picture in the size of print: its labels have 8 points.
    #[must_use]
    pub fn for_print(mut self) -> Self {
        self.for_print = true;
        self
    }
}

/// The page so far.
struct Page {
    content: Content,
    /// The opacities of areas and lines that are used, in thousandths.
    opacities: Vec<[u16; 2]>,
    /// The fonts that are used.
    used: [bool; FONTS.len()],
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
            Mark::Group(..) | Mark::Ungroup | Mark::Hint(..) => {}
        }
        Ok(())
    }

    fn shape(&mut self, form: &Form, paint: &Paint) {
        let line = if paint.kind == Kind::Area { 400 } else { 1000 };
        let area = (1e3 * paint.alpha).round() as u16;
        let state = self.state([area, line]);
        let [red, green, blue] = ink(paint.ink);
        let width = if paint.kind == Kind::Area { 10 } else { paint.width };
        let lengths = dashes(paint.dashes).split(' ');
        let content = &mut self.content;
        content.save_state().set_parameters(Name(state.as_bytes()));
        content.set_fill_rgb(red, green, blue).set_stroke_rgb(red, green, blue);
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
        let font = usize::from(text.bold);
        let (mut codes, mut length) = (Vec::new(), 0.0);
        for character in text.words.chars() {
            let glyph = GLYPHS.get(&character).ok_or_else(|| {
                format!(
                    "'{}' has the character '{character}', which the fonts of the PDF do not have; an SVG can show it",
                    text.words
                )
            })?;
            let (code, width) = glyph[font];
            codes.extend(code.to_be_bytes());
            length += f64::from(width) / 1e3 * text.size;
        }
        self.used[font] = true;
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
        let (x, y) = (unit(text.at.0) - along * before, unit(text.at.1) + turn * before);
        let [red, green, blue] = ink(0);
        let content = &mut self.content;
        content.begin_text().set_fill_rgb(red, green, blue);
        // The page's y axis points downwards, letters do not.
        content.set_text_matrix([along, -turn, -turn, -along, x, y]);
        content
            .set_font(Name(FONTS[font].page), text.size as f32)
            .show(Str(&codes));
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
        let used = (0..FONTS.len()).filter(|font| self.used[*font]);
        let fonts: Vec<(usize, [Ref; 5])> = used.map(|font| (font, [(); 5].map(|()| new()))).collect();
        let states: Vec<(Ref, [u16; 2])> = self.opacities.iter().map(|state| (new(), *state)).collect();
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
            .pairs(fonts.iter().map(|(font, ids)| (Name(FONTS[*font].page), ids[0])));
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
        for (font, ids) in fonts {
            embed(&mut pdf, font, ids);
        }
        for (id, [area, line]) in states {
            let [area, line] = [area, line].map(|share| f32::from(share) / 1e3);
            pdf.ext_graphics(id).non_stroking_alpha(area).stroking_alpha(line);
        }
        pdf.stream(content, &self.content.finish());
        pdf.finish()
    }
}

/// Writes a font: its characters by their numbers, the widths, the letters that the numbers stand for, and the file.
fn embed(pdf: &mut Pdf, place: usize, [id, descendant, descriptor, map, file]: [Ref; 5]) {
    const SYSTEM: SystemInfo<'_> = SystemInfo {
        registry: Str(b"Adobe"),
        ordering: Str(b"Identity"),
        supplement: 0,
    };
    let font = &FONTS[place];
    let name = Name(font.name);
    let mut glyphs: Vec<(u16, u16, char)> = GLYPHS
        .iter()
        .map(|(letter, of)| (of[place].0, of[place].1, *letter))
        .collect();
    glyphs.sort_unstable();
    // Two characters may share a letter.
    glyphs.dedup_by_key(|of| of.0);
    pdf.type0_font(id)
        .base_font(name)
        .encoding_predefined(Name(b"Identity-H"))
        .descendant_font(descendant)
        .to_unicode(map);
    let mut cid = pdf.cid_font(descendant);
    cid.subtype(CidFontType::Type2)
        .base_font(name)
        .system_info(SYSTEM)
        .font_descriptor(descriptor)
        .cid_to_gid_map_predefined(Name(b"Identity"));
    let mut widths = cid.widths();
    for (code, width, _) in &glyphs {
        widths.same(*code, *code, f32::from(*width));
    }
    widths.finish();
    cid.finish();
    // Ends of both fonts' letters, from their files.
    pdf.font_descriptor(descriptor)
        .name(name)
        .flags(FontFlags::NON_SYMBOLIC)
        .bbox(Rect::new(-204.0, -304.0, 1059.0, 966.0))
        .italic_angle(0.0)
        .ascent(905.0)
        .descent(-212.0)
        .cap_height(729.0)
        .stem_v([80.0, 140.0][place])
        .font_file2(file);
    let mut letters = UnicodeCmap::new(Name(b"Custom"), SYSTEM);
    for (code, _, letter) in glyphs {
        letters.pair(code, letter);
    }
    pdf.cmap(map, &letters.finish());
    pdf.stream(file, font.file)
        .filter(Filter::FlateDecode)
        .pair(Name(b"Length1"), font.length);
}

/// A length in the figure's units.
fn unit(pixels: i32) -> f32 {
    pixels as f32 / 10.0
}

/// The light colour of an ink.
fn ink(place: usize) -> [f32; 3] {
    let digits = LIGHT.get(place).and_then(|colour| colour.get(1..)).unwrap_or_default();
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
        // Liberation Sans is as wide as Adobe's Helvetica.afm and Helvetica-Bold.afm.
        for (character, regular, bold) in [
            (' ', 278, 278),
            ('A', 667, 722),
            ('W', 944, 944),
            ('~', 584, 584),
            ('\u{b0}', 400, 400),
            ('\u{e4}', 556, 556),
            ('\u{ff}', 500, 556),
            ('\u{2013}', 556, 556),
        ] {
            let glyph = GLYPHS.get(&character).expect("a glyph");
            assert_eq!(glyph.map(|of| of.1), [regular, bold], "{character}");
        }
        for missing in ['\u{7f}', '\u{80}', '\u{4e2d}'] {
            assert!(!GLYPHS.contains_key(&missing));
        }
        for known in "αβχδεφγηικλμνοπθρστυωξψζΩ≥≤−√Жя".chars() {
            assert!(GLYPHS.contains_key(&known), "{known}");
        }
        assert_eq!(include_str!("pdf/glyphs.txt").lines().count(), GLYPHS.len());
        // Every number is of one letter.
        for font in [0, 1] {
            let mut codes: Vec<u16> = GLYPHS.values().map(|of| of[font].0).collect();
            codes.sort_unstable();
            codes.dedup();
            assert!(codes.len() + 8 > GLYPHS.len() && codes.last() < Some(&548));
        }
    }

    #[test]
    fn colours_are_those_of_svg() {
        assert_eq!(ink(1), [1.0; 3]);
        let blue = ink(4).map(|part| (255.0 * part).round() as u8);
        assert_eq!(blue, [0x00, 0x72, 0xb2]);
    }
}
