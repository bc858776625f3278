//! Where a claim holds, as a sentence.

use crate::report::results::Study;
use crate::study::CellSummary;
use crate::study::place::Place;

/// " It holds with white noise.": see [`crate::claim::condition`].
pub(super) fn condition(study: &Study, good: &[&CellSummary], bad: &[&CellSummary]) -> String {
    if good.is_empty() || bad.is_empty() {
        return String::new();
    }
    let all: Vec<Place> = study.summary.cells.iter().map(CellSummary::place).collect();
    let of =
        |cells: &[&CellSummary]| -> Vec<usize> { cells.iter().map(|cell| cell.cell).collect() };
    crate::claim::condition(&all, &of(good), &of(bad)).map_or_else(
        || " No few settings tell where it holds.".to_owned(),
        |at| format!(" It holds {at}."),
    )
}
