//! Widths of text without a font: for each character the larger of the widths in Helvetica and DejaVu Sans, so that no
//! text overlaps.

/// Size of notes beside points.
pub(super) const NOTE: f64 = 12.0;

/// Distance between two lines of text in units of the font size.
pub(super) const LINE: f64 = 1.28;

/// Widths of the printable ASCII characters in hundredths of the font size: the larger one of Helvetica (the same as
/// Arial and Liberation Sans) and DejaVu Sans.
const WIDTHS: [u8; 95] = [
    32, 41, 46, 84, 64, 95, 78, 28, 39, 39, 50, 84, 32, 37, 32, 34, 64, 64, 64, 64, 64, 64, 64, 64, 64, 64, 34, 34, 84,
    84, 84, 56, 102, 69, 69, 73, 77, 67, 62, 78, 76, 30, 50, 67, 56, 87, 75, 79, 67, 79, 73, 67, 62, 74, 69, 99, 69,
    67, 69, 39, 34, 39, 84, 56, 50, 62, 64, 55, 64, 62, 36, 64, 64, 28, 28, 58, 28, 98, 64, 62, 64, 64, 42, 53, 40, 64,
    60, 82, 60, 60, 53, 64, 34, 64, 84,
];

/// Width of a text.
pub(super) fn width(text: &str, size: f64) -> f64 {
    size * text.chars().map(advance).sum::<f64>()
}

/// The largest width of several texts.
pub(super) fn widest<'a>(texts: impl IntoIterator<Item = &'a str>, size: f64) -> f64 {
    texts.into_iter().map(|text| width(text, size)).fold(0.0, f64::max)
}

/// The largest width of notes beside points, with a space.
pub fn widest_note(texts: &[String]) -> f64 {
    widest(texts.iter().map(String::as_str), NOTE) + NOTE
}

/// Width of one character in units of the font size.
fn advance(character: char) -> f64 {
    let code = character as usize;
    let known = code.checked_sub(32).and_then(|place| WIDTHS.get(place));
    known.map_or(if code >= 0x2e80 { 1.05 } else { 0.8 }, |width| {
        f64::from(*width) / 100.0
    })
}

/// Breaks a text into lines of at most the given width; a word that is wider is broken.
pub(super) fn wrap(text: &str, size: f64, limit: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        if let Some(last) = lines.last_mut()
            && width(last, size) + size * advance(' ') + width(word, size) <= limit
        {
            last.push(' ');
            last.push_str(word);
            continue;
        }
        let (mut line, mut room) = (String::new(), limit);
        for character in word.chars() {
            room -= size * advance(character);
            if room < 0.0 && !line.is_empty() {
                lines.push(std::mem::take(&mut line));
                room = limit - size * advance(character);
            }
            line.push(character);
        }
        lines.push(line);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_fit_and_lose_no_character() {
        let text = "median of the relative error e_a over ten thousand trials Donaudampfschifffahrt";
        for limit in [30.0, 80.0, 300.0, 3000.0] {
            let lines = wrap(text, 15.0, limit);
            assert!(lines.iter().all(|line| width(line, 15.0) <= limit + 1e-9));
            let letters = |text: &str| text.replace(' ', "");
            assert_eq!(letters(&lines.concat()), letters(text));
        }
        assert_eq!(wrap(text, 15.0, 3000.0), [text]);
        assert!(wrap("", 15.0, 10.0).is_empty());
    }
}
