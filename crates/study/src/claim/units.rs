//! The cells to which a claim applies.

use crate::claim::statistics::Members;
use crate::design::file::{
    ClaimTable, ClaimTest, Conditions, ExperimentFile, Key, Settings, TestKind, TestUnit, conditions, matches, partners,
};
use crate::outcome::place::Place;
use crate::outcome::summary::{CellSummary, Summary};

/// A unit that is judged by itself: a cell, two cells, or a family.
pub(crate) struct Unit {
    pub(crate) members: Members,
    pub(crate) place: Place,
}

impl Members {
    /// Returns the cells' indices.
    pub(crate) fn cells(&self) -> Vec<usize> {
        match self {
            Self::Cell(cell) => vec![*cell],
            Self::Pair(from, to) => vec![*from, *to],
            Self::Family(cells) => cells.clone(),
        }
    }
}

/// Returns the units of a claim. Any of its tests determines them.
///
/// # Errors
/// In words, if the results do not have them.
pub(crate) fn units(
    claim: &ClaimTable,
    test: &ClaimTest,
    file: &ExperimentFile,
    summary: &Summary,
) -> Result<Vec<Unit>, String> {
    let wanted = conditions(&claim.cells);
    match (test.unit(), &test.kind) {
        (TestUnit::Pair(axis, ..), _) => Ok(pairs(&wanted, axis, test, file, summary)),
        (TestUnit::Family(over, _), TestKind::Slope(slope)) => {
            let slopes = summary.slopes.iter();
            let found = slopes.filter(|kept| kept.table == *slope && kept.output == test.output);
            let mut found = found.peekable();
            if found.peek().is_none() {
                return Err(format!(
                    "the run did not keep the slope of {} over {over} of '{}'; a new run of the \
                    file keeps what its claims need",
                    slope.measure, test.output
                ));
            }
            Ok(found.filter_map(|kept| family(&wanted, &kept.cells, summary)).collect())
        }
        _ => {
            let cells = summary.cells.iter().enumerate();
            let unit = |(index, cell): (usize, &CellSummary)| Unit {
                members: Members::Cell(index),
                place: cell.place(),
            };
            Ok(cells
                .filter(|(_, cell)| matches(&cell.settings, &wanted))
                .map(unit)
                .collect())
        }
    }
}

/// Returns the pairs of cells that differ only in one setting and those zipped with it.
fn pairs(wanted: &Conditions, axis: Key, test: &ClaimTest, file: &ExperimentFile, summary: &Summary) -> Vec<Unit> {
    let settings: Vec<&Settings> = summary.cells.iter().map(|cell| &cell.settings).collect();
    let mut found = Vec::new();
    for (from, to) in test.unit().steps(&file.settings) {
        for [first, second] in partners(file, &settings, axis, [&from, &to]) {
            if matches(settings[second], wanted) {
                found.push(Unit {
                    members: Members::Pair(first, second),
                    place: summary.cells[second].place(),
                });
            }
        }
    }
    found
}

/// Returns a family, if all its cells are wanted, with the settings that they share.
pub(crate) fn family(wanted: &Conditions, cells: &[usize], summary: &Summary) -> Option<Unit> {
    let members: Option<Vec<&CellSummary>> = cells.iter().map(|cell| summary.cells.get(*cell)).collect();
    let members = members.filter(|all| all.iter().all(|cell| matches(&cell.settings, wanted)))?;
    let first = members.first()?.place();
    let differs = |key: &Key| members.iter().any(|cell| cell.place().value(*key) != first.value(*key));
    let differing: Vec<Key> = Key::ALL.iter().copied().filter(differs).collect();
    Some(Unit {
        members: Members::Family(cells.to_vec()),
        place: first.without(&differing),
    })
}
