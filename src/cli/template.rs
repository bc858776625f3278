//! Templates of the files that the program writes: job scripts, experiment files.

/// Fills the places `{name}` of a template. The values are not searched again; other braces have no such names.
pub(super) fn filled(template: &str, places: &[(&str, String)]) -> String {
    let mut text = String::new();
    for part in template.split_inclusive('}') {
        let at = part.rfind('{').map(|at| part.split_at(at));
        let value = at.and_then(|(before, place)| {
            let name = place.trim_matches(['{', '}']);
            let (_, value) = places.iter().find(|(known, _)| *known == name)?;
            Some([before, value])
        });
        text.extend(value.map_or_else(|| vec![part], |parts| parts.to_vec()));
    }
    text
}
