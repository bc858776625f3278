//! Whether a text is well-formed XML.

/// The element names of a well-formed document in order of opening, or a description of the fault.
pub(crate) fn elements(xml: &str) -> Result<Vec<String>, String> {
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

fn check_text(text: &str) -> Result<(), String> {
    for part in text.split('&').skip(1) {
        let entity = part.split(';').next().unwrap_or_default();
        if !["amp", "lt", "gt", "quot", "#39"].contains(&entity) {
            return Err(format!("a bare '&' before '{part}'"));
        }
    }
    Ok(())
}

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
