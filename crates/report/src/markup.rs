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

/// The element names of a well-formed document in order of opening, or a description of the fault.
#[cfg(test)]
pub(super) fn elements(xml: &str) -> Result<Vec<String>, String> {
    let (mut open, mut seen) = (Vec::new(), Vec::new());
    let mut rest = xml;
    while let Some(start) = rest.find('<') {
        check_text(&rest[..start])?;
        let end = rest[start..].find('>').ok_or("a tag without end")? + start;
        let tag = &rest[start + 1..end];
        rest = &rest[end + 1..];
        if tag.contains('<') {
            return Err(format!("'<' inside the tag {tag}"));
        }
        if let Some(name) = tag.strip_prefix('/') {
            if open.pop().as_deref() != Some(name) {
                return Err(format!("</{name}> closes nothing"));
            }
            continue;
        }
        let body = tag.strip_suffix('/').unwrap_or(tag);
        let (name, attributes) = body.split_once(' ').unwrap_or((body, ""));
        check_attributes(attributes)?;
        seen.push(name.to_owned());
        if !tag.ends_with('/') {
            open.push(name.to_owned());
        }
    }
    check_text(rest)?;
    match open.last() {
        Some(name) => Err(format!("<{name}> stays open")),
        None => Ok(seen),
    }
}

#[cfg(test)]
fn check_text(text: &str) -> Result<(), String> {
    for part in text.split('&').skip(1) {
        let entity = part.split(';').next().unwrap_or_default();
        if !["amp", "lt", "gt", "quot", "#39"].contains(&entity) {
            return Err(format!("a bare '&' before '{part}'"));
        }
    }
    Ok(())
}

#[cfg(test)]
fn check_attributes(attributes: &str) -> Result<(), String> {
    let mut rest = attributes.trim();
    let mut names = Vec::new();
    while !rest.is_empty() {
        let (name, after) = rest.split_once("=\"").ok_or(format!("no value: {rest}"))?;
        let (value, after) = after.split_once('"').ok_or(format!("no quote: {rest}"))?;
        check_text(value)?;
        if names.contains(&name) || name.contains(' ') {
            return Err(format!("attribute '{name}'"));
        }
        names.push(name);
        rest = after.trim_start();
    }
    Ok(())
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

    #[test]
    fn the_check_itself_refuses_what_is_not_well_formed() {
        assert_eq!(elements("<a b=\"c\"><d/>x &amp; y</a>").unwrap(), ["a", "d"]);
        for bad in [
            "<a>",
            "<a></b>",
            "<a>&</a>",
            "<a b=c/>",
            "<a b=\"1\" b=\"2\"/>",
            "<a",
            "</a>",
            "<a b=\"<\"/>",
        ] {
            assert!(elements(bad).is_err(), "{bad}");
        }
    }
}
