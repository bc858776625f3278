//! Words of users, such as names, titles and paths: which are equal, and how commands and scripts take them.

pub use asobench_identification::text::{
    NAME_LIMIT, beginning, is_unseen, listed, number, replace_unseen, rounded, visible, visible_lines,
};
use std::fmt::{Display, Write as _};
use xxhash_rust::xxh3::xxh3_128;

/// How many characters of a long name are in the name of a file.
const FILE_PART: usize = 100;

/// Returns JSON without invisible characters in its strings; between them are only blanks and line ends.
pub fn visible_json(json: &str) -> String {
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

/// A number with what is counted: "1 cell", "2 cells".
pub fn count(number: u64, of: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {of}{plural}")
}

/// Whether a character means itself in every shell.
fn is_plain(c: char) -> bool {
    c.is_alphanumeric() || "/._-+,@%:=".contains(c)
}

/// A path or another word of a command, quoted if a shell would misread it.
pub fn shell_word(word: impl Display) -> String {
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
pub fn script_word(word: &str) -> Result<String, String> {
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
pub fn judged_word(word: &str, most: usize) -> String {
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

/// A name that anyone gave as a part of a file's name: other characters than letters and digits of ASCII and `-_.` as
/// `~` and their bytes in hexadecimal digits, also a dot at the beginning. Of a long name the beginning and a checksum.
/// Names that differ stay different.
pub fn file_part(name: &str) -> String {
    let plain =
        |(at, byte): &(usize, u8)| byte.is_ascii_alphanumeric() || b"-_".contains(byte) || (*byte == b'.' && *at > 0);
    let bytes = name.bytes().enumerate();
    let escaped = bytes.map(|each| match each {
        each if plain(&each) => char::from(each.1).to_string(),
        (_, byte) => format!("~{byte:02x}"),
    });
    let escaped: String = escaped.collect();
    match escaped.get(..FILE_PART) {
        Some(beginning) => format!("{beginning}~-{:032x}", xxh3_128(name.as_bytes())),
        None => escaped,
    }
}

/// The part of a name that distinguishes it: without case, number and kind of blanks, and invisible characters.
pub fn folded(name: &str) -> String {
    let seen = |c: &char| c.is_whitespace() || !is_unseen(*c);
    let seen: String = name.chars().filter(seen).collect();
    let words: Vec<&str> = seen.split_whitespace().collect();
    let joined = words.join(" ");
    let upper = joined.chars().flat_map(char::to_uppercase);
    upper.flat_map(char::to_lowercase).collect()
}

/// Returns the first name that equals an earlier one when folded, with that earlier name first.
pub fn alike<'a>(names: impl IntoIterator<Item = &'a str>) -> Option<[&'a str; 2]> {
    let mut seen = std::collections::BTreeMap::new();
    for name in names {
        if let Some(before) = seen.insert(folded(name), name) {
            return Some([before, name]);
        }
    }
    None
}

/// Describes the fault of a name that a user gave; `None` if there is none.
pub fn name_fault(name: &str) -> Option<String> {
    let shown = beginning(&visible(name), 60);
    let expected = if name.trim().is_empty() {
        "a name, not empty"
    } else if name.chars().nth(NAME_LIMIT).is_some() {
        return Some(format!("'{shown}'; expected at most {NAME_LIMIT} characters"));
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
pub fn wrap(text: &str, width: usize, indent: &str) -> String {
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
    lines.iter().map(|line| line.trim_end().to_owned() + "\n").collect()
}

/// Returns a whole number with a comma between groups of three digits: "12,000".
pub fn grouped(number: u64) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;
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
    fn names_are_parts_of_file_names() {
        let (long, longer) = ("\u{e4}".repeat(200), "\u{e4}".repeat(201));
        let names = [
            "iv", "a.b_c-1", "", ".", "..", "../x", "a/b", "a-b", "a~2fb", "[a]*", "a b", "\u{e4}", "a\0", &long,
            &longer,
        ];
        let parts: Vec<String> = names.iter().map(|name| file_part(name)).collect();
        assert_eq!(parts[..7], ["iv", "a.b_c-1", "", "~2e", "~2e.", "~2e.~2fx", "a~2fb"]);
        for (i, part) in parts.iter().enumerate() {
            assert!(part.len() <= 200 && !part.starts_with('.') && !part.contains(['/', '\0', '*']));
            assert_eq!(parts.iter().position(|other| other == part), Some(i), "{part}");
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
        assert_eq!(judged_word("a\u{3000}b\u{a0}\t", 40), "a\\u{3000}b\\u{a0}\\t");
        assert_eq!(judged_word("", 40), "''");
        let padded = format!("rm{}-rf", " ".repeat(3144));
        assert_eq!(judged_word(&padded, 6), "rm\\ \\ ... 3145 characters");
    }
}
