//! Text inside XML and HTML.

use asobench_study::text::visible_lines;
use std::fmt::Write as _;

/// Escapes a text as content or attribute value of XML or HTML. Characters that are invisible or change the direction
/// of others are written like `\u{202e}`.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in visible_lines(text).chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c => escaped.push(c),
        }
    }
    escaped
}

/// Encodes the target of a link, `#id` or a path relative to the page, as the value of `href`.
pub(super) fn address(target: &str) -> String {
    let (mark, rest) = match target.strip_prefix('#') {
        Some(id) => ("#", id),
        None => ("", target),
    };
    let mut address = mark.to_owned();
    for c in rest.chars() {
        if c.is_alphanumeric() || "-_.~/".contains(c) {
            address.push(c);
        } else {
            let mut bytes = [0; 4];
            for byte in c.encode_utf8(&mut bytes).bytes() {
                // Writing to a string cannot fail.
                let _ = write!(address, "%{byte:02X}");
            }
        }
    }
    address
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_is_escaped() {
        assert_eq!(
            escape("a<b> & \"c\" 'd'\u{0}\u{202e}\n"),
            "a&lt;b&gt; &amp; &quot;c&quot; &#39;d&#39;\\u{0}\\u{202e}\n"
        );
    }

    #[test]
    fn links_lead_to_what_is_meant() {
        for (target, address) in [
            ("#c-2", "#c-2"),
            ("tables/a#b?c-x.csv", "tables/a%23b%3Fc-x.csv"),
            ("tables/50 %\"&<'.csv", "tables/50%20%25%22%26%3C%27.csv"),
            (
                "tables/\u{5e9}\u{5dc}\u{202e}.csv",
                "tables/\u{5e9}\u{5dc}%E2%80%AE.csv",
            ),
            ("javascript:x", "javascript%3Ax"),
        ] {
            assert_eq!(super::address(target), address);
        }
    }
}
