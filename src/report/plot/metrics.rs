//! Widths of text without a font: estimates on the large side, so that nothing is cut.

/// Estimated width of a text.
pub(super) fn width(text: &str, size: f64) -> f64 {
    size * text.chars().map(advance).sum::<f64>()
}

/// Width of one character in units of the font's size.
fn advance(character: char) -> f64 {
    match character {
        'i' | 'j' | 'l' | '|' | '\'' | '.' | ',' | ':' | ';' | '!' | ' ' => 0.31,
        'f' | 't' | 'r' | 'I' | '(' | ')' | '[' | ']' | '/' | '-' | '`' => 0.38,
        'm' | 'M' | 'w' | 'W' | '%' | '@' => 0.94,
        'A'..='Z' | '&' | '<' | '>' | '=' | '+' | '~' => 0.72,
        c if u32::from(c) >= 0x2e80 => 1.05,
        c if !c.is_ascii() => 0.7,
        _ => 0.6,
    }
}

/// A text in lines of at most the given width; a word that is wider is broken.
pub(super) fn wrap(text: &str, size: f64, limit: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        if let Some(last) = lines.last_mut() {
            let joined = format!("{last} {word}");
            if width(&joined, size) <= limit {
                *last = joined;
                continue;
            }
        }
        lines.push(String::new());
        for character in word.chars() {
            let full = lines.last().is_some_and(|line| {
                !line.is_empty() && width(line, size) + size * advance(character) > limit
            });
            if full {
                lines.push(String::new());
            }
            if let Some(line) = lines.last_mut() {
                line.push(character);
            }
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_fit_and_lose_no_character() {
        let text =
            "median of the relative error e_a over ten thousand trials Donaudampfschifffahrt";
        for limit in [30.0, 80.0, 300.0, 3000.0] {
            let lines = wrap(text, 15.0, limit);
            assert!(lines.iter().all(|line| width(line, 15.0) <= limit));
            let letters = |text: &str| text.replace(' ', "");
            assert_eq!(letters(&lines.concat()), letters(text));
        }
        assert_eq!(wrap(text, 15.0, 3000.0), [text]);
        assert!(wrap("", 15.0, 10.0).is_empty());
    }
}
