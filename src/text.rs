//! Text from users, such as names, titles and paths: how it is shown, and which names are equal.

use std::fmt::{Display, Write as _};

/// Longest name in characters: of a method, a claim, a plant and the like.
pub(crate) const NAME_LIMIT: usize = 200;

/// Whether a character is invisible or changes the position of others: controls, line ends, directions, and the
/// default-ignorable characters of Unicode.
fn is_unseen(c: char) -> bool {
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
        '\u{200c}' | '\u{200d}' => {
            before.is_some_and(|c| shown(c) || c == EMOJI) && after.is_some_and(shown)
        }
        '\u{fe0e}' | EMOJI => before.is_some_and(shown) || after == Some(KEYCAP),
        _ => false,
    }
}

/// Returns the text with every invisible character replaced by what `replace` writes.
fn replace_unseen(text: &str, mut replace: impl FnMut(&mut String, char)) -> String {
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
pub(crate) fn visible(text: impl Display) -> String {
    replace_unseen(&text.to_string(), |shown, c| {
        shown.extend(c.escape_default());
    })
}

/// Like [`visible`] for a text of several lines.
pub(crate) fn visible_lines(text: &str) -> String {
    replace_unseen(text, |shown, c| match c {
        '\n' => shown.push(c),
        c => shown.extend(c.escape_default()),
    })
}

/// Returns JSON without invisible characters in its strings; between them are only blanks and line ends.
pub(crate) fn visible_json(json: &str) -> String {
    replace_unseen(json, |shown, c| match c {
        '\n' => shown.push(c),
        c => {
            for unit in c.encode_utf16(&mut [0; 2]) {
                // Writing to a string cannot fail.
                let _ = write!(shown, "\\u{unit:04x}");
            }
        }
    })
}

/// The beginning of a long text, with the number of characters left out.
pub(crate) fn beginning(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        None => text.to_owned(),
        Some((end, _)) => {
            let more = text[end..].chars().count();
            format!("{}... ({more} more characters)", &text[..end])
        }
    }
}

/// Whether a character means itself in every shell.
fn is_plain(c: char) -> bool {
    c.is_alphanumeric() || "/._-+,@%:=".contains(c)
}

/// A path or another word of a command, quoted if a shell would misread it.
pub(crate) fn shell_word(word: impl Display) -> String {
    let word = word.to_string();
    if !word.is_empty() && word.chars().all(is_plain) {
        return word;
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// A word of a job script: for the shell that runs it and for `sbatch`, which reads `#SBATCH` lines by rules of its
/// own. Both take a character after a backslash as it is, but for `sbatch` a blank ends a word unless it is quoted. A
/// job script has no text from elsewhere but through here.
///
/// # Errors
/// If the word has a character that could end a line, or that is not seen.
pub(crate) fn script_word(word: &str) -> Result<String, String> {
    if visible(word) != word {
        let shown = visible(beginning(word, 200));
        return Err(format!(
            "'{shown}'; expected a text without control characters or invisible ones, for a job script"
        ));
    }
    if word.is_empty() {
        return Ok("''".to_owned());
    }
    let escaped = word.chars().map(|c| match c {
        ' ' => "' '".to_owned(),
        c if is_plain(c) => c.to_string(),
        c => format!("\\{c}"),
    });
    Ok(escaped.collect())
}

/// A word of a command for people who judge it: blanks and backslashes have a backslash before them, other white space
/// and what is not seen is written out. Of a long word the beginning, with the number of characters that are left out.
pub(crate) fn judged_word(word: &str, most: usize) -> String {
    let mut shown = String::new();
    let mut count = 0;
    let mut left_out = 0;
    for c in word.chars() {
        let part = match c {
            ' ' | '\\' => format!("\\{c}"),
            c if c.is_whitespace() || is_unseen(c) => c.escape_default().to_string(),
            c => c.to_string(),
        };
        count += part.chars().count();
        if count > most {
            left_out += 1;
        } else {
            shown.push_str(&part);
        }
    }
    match left_out {
        0 if word.is_empty() => "''".to_owned(),
        0 => shown,
        _ => format!("{shown}... {left_out} characters"),
    }
}

/// The part of a name that distinguishes it: without case, number and kind of blanks, and invisible characters.
pub(crate) fn folded(name: &str) -> String {
    let seen = |c: &char| c.is_whitespace() || !is_unseen(*c);
    let seen: String = name.chars().filter(seen).collect();
    let words: Vec<&str> = seen.split_whitespace().collect();
    let joined = words.join(" ");
    let upper = joined.chars().flat_map(char::to_uppercase);
    upper.flat_map(char::to_lowercase).collect()
}

/// Returns the first name that equals an earlier one when folded, with that earlier name first.
pub(crate) fn alike<'a>(names: impl IntoIterator<Item = &'a str>) -> Option<[&'a str; 2]> {
    let mut seen = std::collections::BTreeMap::new();
    for name in names {
        if let Some(before) = seen.insert(folded(name), name) {
            return Some([before, name]);
        }
    }
    None
}

/// Describes the fault of a name that a user gave; `None` if there is none.
pub(crate) fn name_fault(name: &str) -> Option<String> {
    let shown = beginning(&visible(name), 60);
    let expected = if name.trim().is_empty() {
        "a name, not empty"
    } else if name.chars().nth(NAME_LIMIT).is_some() {
        return Some(format!(
            "'{shown}'; expected at most {NAME_LIMIT} characters"
        ));
    } else if visible(name) != name {
        "a name without invisible characters"
    } else if name.trim() != name {
        "a name without blanks at its ends"
    } else {
        return None;
    };
    Some(format!("'{shown}'; expected {expected}"))
}

/// Wraps a paragraph to lines of at most `width` columns, each with a line end. All but the first begin with `indent`.
/// A word longer than a line is cut.
pub(crate) fn wrap(text: &str, width: usize, indent: &str) -> String {
    let count = |text: &str| text.chars().count();
    let mut lines: Vec<String> = Vec::new();
    let mut line = String::new();
    let mut is_empty = true;
    for word in text.split(' ') {
        let mut word = word.to_owned();
        if !is_empty && count(&line) + 1 + count(&word) > width {
            lines.push(std::mem::replace(&mut line, indent.to_owned()));
            is_empty = true;
        }
        if !is_empty {
            line.push(' ');
        }
        while count(&line) + count(&word) > width {
            let room = width - count(&line);
            let rest = word.chars().skip(room).collect();
            line.extend(word.chars().take(room));
            lines.push(std::mem::replace(&mut line, indent.to_owned()));
            word = rest;
        }
        line.push_str(&word);
        is_empty = false;
    }
    lines.push(line);
    lines
        .iter()
        .map(|line| line.trim_end().to_owned() + "\n")
        .collect()
}

/// The shortest form of a number that reads back to the same bits, with an exponent if it is large or small.
pub(crate) fn number(x: f64) -> String {
    if x == 0.0 || (1e-4..1e15).contains(&x.abs()) {
        x.to_string()
    } else {
        format!("{x:e}")
    }
}

/// Returns a whole number with a comma between groups of three digits: "12,000".
pub(crate) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A number with at most `digits` significant digits, without trailing zeros.
pub fn rounded(value: f64, digits: usize) -> String {
    let text = format!("{value:.*e}", digits.saturating_sub(1));
    number(text.parse().unwrap_or(value))
}

#[cfg(test)]
mod tests {
    use super::*;

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
            (
                "\u{5d0}\u{200d}\u{200d}\u{5d0}",
                "\u{5d0}\\u{200d}\\u{200d}\u{5d0}",
            ),
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
    fn names_that_look_alike_are_alike() {
        for (name, other) in [
            ("C2", "c2"),
            ("a b", "a \u{a0} b"),
            ("a", " a\t"),
            ("a", "a\u{200b}"),
            ("\u{5d0}\u{5d1}", "\u{5d0}\u{200d}\u{5d1}"),
            ("stra\u{df}e", "STRASSE"),
        ] {
            assert_eq!(folded(name), folded(other), "{name} {other}");
            assert_eq!(alike(["x", name, other]), Some([name, other]));
        }
        assert_eq!(alike(["a b", "ab", "a-b"]), None);
    }

    #[test]
    fn names_have_nothing_unseen_and_an_end() {
        let long = "x".repeat(NAME_LIMIT + 1);
        for name in ["", " ", "a\n", "a ", "\u{202e}a", "a\u{200b}b", &long] {
            assert!(name_fault(name).is_some(), "{name:?}");
        }
        let message = name_fault(&"x".repeat(10_000)).unwrap();
        assert!(
            message.contains("9940 more") && message.contains("at most 200"),
            "{message}"
        );
        for name in [
            "iv",
            "=cmd|x",
            "\u{5e9}\u{5dc}",
            "\u{1f468}\u{200d}\u{1f469}",
            &long[1..],
        ] {
            assert_eq!(name_fault(name), None, "{name:?}");
        }
    }

    #[test]
    fn words_of_commands_stay_words() {
        assert_eq!(shell_word("results/a-1"), "results/a-1");
        assert_eq!(shell_word("a b;c"), "'a b;c'");
        assert_eq!(shell_word("it's $(x)"), "'it'\\''s $(x)'");
        assert_eq!(shell_word(""), "''");
    }

    #[test]
    fn words_of_scripts_are_seen() {
        for (word, written) in [
            ("/a/b-1", "/a/b-1"),
            ("a b;c", "a' 'b\\;c"),
            ("it's \"$(x)\"", "it\\'s' '\\\"\\$\\(x\\)\\\""),
            ("a#b\\c", "a\\#b\\\\c"),
            ("", "''"),
        ] {
            assert_eq!(script_word(word).as_deref(), Ok(written));
        }
        for word in [
            "a\nb",
            "a\rb",
            "a\tb",
            "\u{1b}[2J",
            "a\0",
            "a\u{85}b",
            "\u{202e}a",
            "a\u{2028}b",
        ] {
            assert!(script_word(word).is_err(), "{word:?}");
        }
    }

    #[test]
    fn judged_words_hide_nothing() {
        assert_eq!(judged_word("import os", 40), "import\\ os");
        assert_eq!(
            judged_word("a\u{3000}b\u{a0}\t", 40),
            "a\\u{3000}b\\u{a0}\\t"
        );
        assert_eq!(judged_word("", 40), "''");
        let padded = format!("rm{}-rf", " ".repeat(3144));
        assert_eq!(judged_word(&padded, 6), "rm\\ \\ ... 3145 characters");
    }

    #[test]
    fn numbers_are_short_and_read_back_to_the_same_bits() {
        for value in [
            0.1 + 0.2,
            5e-324,
            f64::MAX,
            -1.0 / 3.0,
            1e15,
            -1e300,
            0.0,
            98.0,
        ] {
            assert_eq!(number(value).parse::<f64>().unwrap(), value);
            assert!(number(value).len() < 25);
        }
        assert_eq!([98.0, 0.5, -1e300].map(number), ["98", "0.5", "-1e300"]);
    }
}
