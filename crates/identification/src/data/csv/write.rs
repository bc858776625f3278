//! Writes tables, whose texts are no formulas to a spreadsheet.

use crate::text::{number, visible, visible_lines};
use std::io::Write;

/// Writes a record with all digits, preceded by `comments`, one per line.
///
/// # Errors
/// If the writer fails.
pub fn write(to: impl Write, comments: &[String], u: &[f64], y: &[f64]) -> std::io::Result<()> {
    write_columns(to, comments, &[("u", u), ("y", y)])
}

/// Writes columns of one length under their names, after a column k.
///
/// # Errors
/// If the writer fails.
pub fn write_columns(mut to: impl Write, comments: &[String], columns: &[(&str, &[f64])]) -> std::io::Result<()> {
    for text in comments {
        writeln!(to, "{}", comment(text))?;
    }
    let names = columns.iter().map(|(name, _)| Cell::Text(name));
    writeln!(to, "{}", line(std::iter::once(Cell::Text("k")).chain(names)))?;
    for k in 0..columns.first().map_or(0, |(_, column)| column.len()) {
        let numbers = columns.iter().map(|(_, column)| column[k]);
        let numbers = std::iter::once(k as f64).chain(numbers);
        writeln!(to, "{}", line(numbers.map(Cell::Number)))?;
    }
    to.flush()
}

/// The content of a table's cell.
#[derive(Clone, Copy, Debug)]
pub enum Cell<'a> {
    /// A text.
    Text(&'a str),
    /// A number, written with all digits.
    Number(f64),
    /// The digits of a number, perhaps with its standard error in parentheses; never a formula.
    Rounded(&'a str),
}

/// Returns a comment line without its line end.
pub fn comment(text: &str) -> String {
    format!("# {}", visible(text))
}

/// Returns a line of a table without its line end, as in RFC 4180, with quotes around texts that need them.
///
/// No text is a formula to a spreadsheet: wherever a cell could begin, `=`, `+`, `-` and `@` get an apostrophe before
/// them. So does an apostrophe itself, so that removing one apostrophe restores the text.
pub fn line<'a>(cells: impl IntoIterator<Item = Cell<'a>>) -> String {
    let text = |cell: Cell<'_>| match cell {
        Cell::Number(value) => number(value),
        Cell::Rounded(digits) => digits.to_owned(),
        Cell::Text(text) => quoted(&no_formula(text)),
    };
    let cells: Vec<String> = cells.into_iter().map(text).collect();
    cells.join(",")
}

/// Returns a text with an apostrophe before every character that a spreadsheet could read as the start of a formula.
/// This can be at the beginning, or after a character that separates cells elsewhere (semicolon, line end), with or
/// without blanks and quotes between.
fn no_formula(text: &str) -> String {
    const SIGNS: &str = "=+-@\u{ff1d}\u{ff0b}\u{ff0d}\u{ff20}";
    if text == "-" {
        return text.to_owned();
    }
    let mut safe = String::with_capacity(text.len());
    let mut begins = true;
    for c in visible_lines(text).chars() {
        if begins && (SIGNS.contains(c) || c == '\'') {
            safe.push('\'');
        }
        let blank = c.is_whitespace() || c == '"';
        begins = matches!(c, ';' | '\n') || (begins && blank);
        safe.push(c);
    }
    safe
}

fn quoted(text: &str) -> String {
    if text.contains([',', ';', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No cell begins a formula, whatever separates cells, and removing one apostrophe restores the text.
    #[test]
    fn texts_are_no_formulas_and_numbers_stay_numbers() {
        for (text, cell) in [
            ("=1+2", "'=1+2"),
            ("=cmd|' /C calc'!A0", "'=cmd|' /C calc'!A0"),
            ("+1", "'+1"),
            ("-2+3", "'-2+3"),
            ("@SUM(A1)", "'@SUM(A1)"),
            (" =1", " '=1"),
            ("\"=1\"", "\"\"\"'=1\"\"\""),
            ("a;=1", "\"a;'=1\""),
            ("a\n=1", "\"a\n'=1\""),
            ("\t=1", "\\t=1"),
            ("\r=1", "\\r=1"),
            ("\u{ff1d}1", "'\u{ff1d}1"),
            ("\u{200b}=1", "\\u{200b}=1"),
            ("'=1", "''=1"),
            ("it's", "it's"),
            ("a=b, c-d", "\"a=b, c-d\""),
            ("-", "-"),
            ("iv(4)", "iv(4)"),
        ] {
            assert_eq!(line([Cell::Text(text)]), cell);
        }
        let numbers = [-1.5, 1e-300, -1e300].map(Cell::Number);
        assert_eq!(line(numbers), "-1.5,1e-300,-1e300");
        assert_eq!(comment("a\n1,2\u{1b}"), "# a\\n1,2\\u{1b}");
    }
}
