//! Texts of others made safe to show, and numbers that read back to the same bits.

use serde::{Deserialize, Deserializer};
use std::fmt::Display;

/// Longest name in characters: of a method, a claim, a plant and the like.
pub const NAME_LIMIT: usize = 200;

/// Whether a character is invisible or changes the position of others: controls, line ends, directions, and the
/// default-ignorable characters of Unicode.
pub fn is_unseen(c: char) -> bool {
    c.is_control()
        || matches!(c,
            '\u{ad}' | '\u{34f}' | '\u{61c}' | '\u{115f}' | '\u{1160}' | '\u{17b4}' | '\u{17b5}'
            | '\u{180b}'..='\u{180f}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{2800}' | '\u{3164}' | '\u{fe00}'..='\u{fe0f}'
            | '\u{feff}' | '\u{ffa0}' | '\u{fff0}'..='\u{fffb}' | '\u{fffe}' | '\u{ffff}'
            | '\u{1bca0}'..='\u{1bca3}' | '\u{1d173}'..='\u{1d17a}' | '\u{e0000}'..='\u{e0fff}')
}

/// Whether an invisible character is needed by words or emoji: a joiner between two characters beyond ASCII, or a
/// variation selector after one or in a keycap.
fn joins(before: Option<char>, c: char, after: Option<char>) -> bool {
    const EMOJI: char = '\u{fe0f}';
    const KEYCAP: char = '\u{20e3}';
    let shown = |c: char| !(c.is_ascii() || c.is_whitespace() || is_unseen(c));
    match c {
        '\u{200c}' | '\u{200d}' => before.is_some_and(|c| shown(c) || c == EMOJI) && after.is_some_and(shown),
        '\u{fe0e}' | EMOJI => before.is_some_and(shown) || after == Some(KEYCAP),
        _ => false,
    }
}

/// Returns the text with every invisible character replaced by what `replace` writes.
pub fn replace_unseen(text: &str, mut replace: impl FnMut(&mut String, char)) -> String {
    let mut shown = String::with_capacity(text.len());
    let mut characters = text.chars().peekable();
    let mut before = None;
    while let Some(c) = characters.next() {
        if is_unseen(c) && !joins(before, c, characters.peek().copied()) {
            replace(&mut shown, c);
            before = None;
        } else {
            shown.push(c);
            before = Some(c);
        }
    }
    shown
}

/// Returns the text on one line, as people may see it: invisible characters are written like `\n` or `\u{202e}`.
pub fn visible(text: impl Display) -> String {
    replace_unseen(&text.to_string(), |shown, c| {
        shown.extend(c.escape_default());
    })
}

/// Like [`visible`] for a text of several lines.
pub fn visible_lines(text: &str) -> String {
    replace_unseen(text, |shown, c| match c {
        '\n' => shown.push(c),
        c => shown.extend(c.escape_default()),
    })
}

/// The beginning of a long text, with the number of characters left out.
pub fn beginning(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        None => text.to_owned(),
        Some((end, _)) => {
            let more = text[end..].chars().count();
            format!("{}... ({more} more characters)", &text[..end])
        }
    }
}

/// Lists names, at most so many of them, and how many more there are.
pub fn listed(names: &[impl AsRef<str>], most: usize) -> String {
    let shown: Vec<&str> = names.iter().take(most).map(AsRef::as_ref).collect();
    match names.len() - shown.len() {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

/// The shortest form of a number that reads back to the same bits, with an exponent if it is large or small.
pub fn number(x: f64) -> String {
    if x == 0.0 || (1e-4..1e15).contains(&x.abs()) {
        x.to_string()
    } else {
        format!("{x:e}")
    }
}

/// A number with at most `digits` significant digits, without trailing zeros.
pub fn rounded(value: f64, digits: usize) -> String {
    let text = format!("{value:.*e}", digits.saturating_sub(1));
    number(text.parse().unwrap_or(value))
}

/// Reads a text, or the text of a number; without `json` a text alone.
pub(crate) fn text_or_number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    #[cfg(feature = "json")]
    return Ok(match serde_json::Value::deserialize(deserializer)? {
        serde_json::Value::String(text) => text,
        other => other.to_string(),
    });
    #[cfg(not(feature = "json"))]
    String::deserialize(deserializer)
}

/// Gives a setting in files the form of its [`Display`] and [`std::str::FromStr`]: read by a function of a
/// deserializer, of these types in a schema.
macro_rules! text_in_files {
    ($name:ident, $read:path, $types:tt) => {
        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_str(self)
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let text: String = $read(deserializer)?;
                text.parse().map_err(serde::de::Error::custom)
            }
        }

        #[cfg(feature = "json")]
        impl schemars::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
                schemars::json_schema!({ "type": $types })
            }
        }
    };
}
pub(crate) use text_in_files;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lists_say_how_many_names_are_left_out() {
        let many = ["a", "b", "c", "d", "e"];
        assert_eq!(
            [listed(&many, 3), listed(&many[..3], 3)],
            ["a, b, c and 2 more", "a, b, c"]
        );
    }

    #[test]
    fn what_is_not_seen_is_written_out() {
        for (text, shown) in [
            ("a\u{1b}[31mred\u{7}\0", "a\\u{1b}[31mred\\u{7}\\u{0}"),
            ("a\nb\r\tc\u{7f}\u{9b}", "a\\nb\\r\\tc\\u{7f}\\u{9b}"),
            (
                "\u{202e}txt\u{2066}\u{200f}\u{61c}",
                "\\u{202e}txt\\u{2066}\\u{200f}\\u{61c}",
            ),
            (
                "a\u{200b}b\u{feff}\u{ad}\u{2028}",
                "a\\u{200b}b\\u{feff}\\u{ad}\\u{2028}",
            ),
            // Joiners and selectors without anything to join.
            ("a\u{200d}b\u{fe0f}", "a\\u{200d}b\\u{fe0f}"),
            ("\u{5d0}\u{200d}\u{200d}\u{5d0}", "\u{5d0}\\u{200d}\\u{200d}\u{5d0}"),
        ] {
            assert_eq!(visible(text), shown);
        }
        // Hebrew, Persian with its zero-width non-joiner, a family, a heart, a keycap, accents.
        for text in [
            "\u{5e9}\u{5dc}\u{5d5}\u{5dd}",
            "\u{645}\u{6cc}\u{200c}\u{62e}\u{648}\u{627}\u{647}\u{645}",
            "\u{1f468}\u{200d}\u{1f469}\u{200d}\u{1f467}",
            "\u{2764}\u{fe0f}\u{200d}\u{1f525}",
            "1\u{fe0f}\u{20e3}",
            "R\u{e9}sum\u{65}\u{301} \u{221a}2 \\ '\"",
        ] {
            assert_eq!(visible(text), text);
        }
    }

    #[test]
    fn numbers_are_short_and_read_back_to_the_same_bits() {
        for value in [0.1 + 0.2, 5e-324, f64::MAX, -1.0 / 3.0, 1e15, -1e300, 0.0, 98.0] {
            assert_eq!(number(value).parse::<f64>().unwrap(), value);
            assert!(number(value).len() < 25);
        }
        assert_eq!([98.0, 0.5, -1e300].map(number), ["98", "0.5", "-1e300"]);
    }
}
