//! Aims: what is asked, expected and claimed.

use super::part::{Part, Row, at_most, row};
use crate::results::Study;

pub(super) fn part(study: &Study) -> Part {
    let file = &study.file;
    let given = [
        ("title", &file.title),
        ("question", &file.question),
        ("hypothesis", &file.hypothesis),
    ];
    let mut rows: Vec<Row> = given
        .into_iter()
        .filter(|(_, text)| !text.is_empty())
        .map(|(term, text)| row(term, text))
        .collect();
    let claims = file.claims.iter().map(|claim| {
        let mut text = if claim.text.is_empty() {
            "without words".to_owned()
        } else {
            claim.text.clone()
        };
        text.push_str(&format!(" (source: {})", claim.source));
        if claim.added_after_run {
            text.push_str(" Added or changed after the run.");
        }
        row(format!("claim {}", claim.id), text)
    });
    rows.extend(at_most(claims.collect()));
    if rows.is_empty() {
        rows.push(row("aims", "the file states none"));
    }
    Part::new("Aims", rows, Vec::new())
}
