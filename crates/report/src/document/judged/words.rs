//! The words and numbers that the tables and pictures of verdicts share.

use crate::document::answer::capital;
use asobench_study::claim::{Judged, JudgedCell, JudgedNumber, JudgedTest, Scale};
use asobench_study::text::rounded;

/// The levels at which the cells of a claim are compared, in words: "2.5 % / 24 (Holm's correction for 24 cells)".
pub(super) fn levels(claim: &Judged) -> String {
    let whole = format!("{} %", rounded(100.0 * claim.level, 6));
    // Every level is that of the claim over a whole number.
    let parts = |level: f64| (claim.level / level).round() as usize;
    let of = |says: &str| {
        let mut cells = claim.cells.iter().filter(|cell| cell.says == says);
        cells.find_map(|cell| cell.level).map(parts)
    };
    let over = |parts: usize| match parts {
        1 => whole.clone(),
        parts => format!("{whole} / {parts}"),
    };
    let names = [
        ("pass", "where a cell passes"),
        ("fail", "where it fails"),
        ("open", "where it is open"),
    ];
    let found: Vec<(&str, usize)> = names
        .iter()
        .filter_map(|(says, words)| Some((*words, of(says)?)))
        .collect();
    let count = claim.cells.len();
    let text = match found.as_slice() {
        [] => return whole,
        _ if count == 1 => return whole,
        // Certain in all cells: each by itself, or the last step of Holm's procedure.
        [(_, 1)] => return format!("{whole} (all cells are certain, so none is corrected)"),
        [(_, first), rest @ ..] if rest.iter().all(|(_, parts)| parts == first) => over(*first),
        all => {
            let all = all.iter().map(|(words, parts)| format!("{} {words}", over(*parts)));
            all.collect::<Vec<String>>().join(", ")
        }
    };
    format!("{text} (Holm's correction for {count} cells)")
}

/// The place of a cell in words.
pub(super) fn place(cell: &JudgedCell) -> &str {
    if cell.place.is_empty() {
        "in all trials"
    } else {
        &cell.place
    }
}

/// Makes a heading of a text: first letter in upper case, no comma at the end.
pub(super) fn heading(what: &str) -> String {
    capital(what.trim_end_matches(','))
}

/// Whether the numbers of a test are shares of trials.
pub(super) fn is_share(test: &JudgedTest) -> bool {
    test.scale == Scale::Share
}

/// The factor for the numbers of a test: shares are drawn, and written to tables, in per cent.
pub(super) fn unit(test: &JudgedTest) -> f64 {
    if is_share(test) { 100.0 } else { 1.0 }
}

/// Every number of a claim with its cell.
pub(super) fn numbers(claim: &Judged) -> impl Iterator<Item = (&JudgedCell, &JudgedNumber)> {
    let cells = claim.cells.iter();
    cells.flat_map(|cell| cell.numbers.iter().map(move |number| (cell, number)))
}
