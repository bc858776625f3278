//! Text inside XML and HTML.

/// Text as content or attribute value of XML or HTML. A control character that XML forbids becomes U+FFFD.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\t' | '\n' | '\r' => escaped.push(character),
            '\u{fffe}' | '\u{ffff}' => escaped.push('\u{fffd}'),
            c if c.is_control() => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

/// The names of the elements of a well-formed document in order of opening, or what is wrong with it.
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
            escape("a<b> & \"c\" 'd'\u{0}"),
            "a&lt;b&gt; &amp; &quot;c&quot; &#39;d&#39;\u{fffd}"
        );
    }

    #[test]
    fn the_check_itself_refuses_what_is_not_well_formed() {
        assert_eq!(
            elements("<a b=\"c\"><d/>x &amp; y</a>").unwrap(),
            ["a", "d"]
        );
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
