//! Where a claim holds: the settings that tell the cells where it holds from those where it does not.

use super::listed;
use crate::report::results::{Study, axis_label, place, words};
use crate::study::CellSummary;
use crate::study::file::Key;

/// The most items that a sentence lists.
const MOST: usize = 6;

/// The one setting whose values tell `good` from `bad` cells, or else, for each combination of the others, the values
/// of a numerical one where it holds. A cell that is in neither is open: nothing is said to hold there.
pub(super) fn condition(study: &Study, good: &[&CellSummary], bad: &[&CellSummary]) -> String {
    if good.is_empty() || bad.is_empty() {
        return String::new();
    }
    one(study, good, bad)
        .or_else(|| each(study, good))
        .unwrap_or_else(|| " No few settings tell where it holds.".to_owned())
}

fn one(study: &Study, good: &[&CellSummary], bad: &[&CellSummary]) -> Option<String> {
    study.varying().into_iter().find_map(|key| {
        let values = |cells: &[&CellSummary]| crate::report::results::distinct(cells, key);
        let (good, bad) = (values(good), values(bad));
        let tells = good.len() <= MOST && !good.iter().any(|value| bad.contains(value));
        let texts: Vec<String> = good.iter().map(|value| words(key, value)).collect();
        tells.then(|| format!(" It holds with {}.", listed(&texts)))
    })
}

/// The numerical setting with the most values.
fn longest(study: &Study) -> Option<Key> {
    let mut keys = study.varying();
    keys.retain(|key| study.is_numeric(*key));
    let most = keys
        .iter()
        .rev()
        .max_by_key(|key| study.values(**key).len());
    most.copied()
}

fn each(study: &Study, good: &[&CellSummary]) -> Option<String> {
    let along = longest(study)?;
    let others: Vec<Key> = study.varying();
    let others: Vec<Key> = others.into_iter().filter(|key| *key != along).collect();
    // The ranges of the numerical setting, and which combinations of the others have each.
    let mut ranges: Vec<(String, Vec<String>)> = Vec::new();
    let mut seen: Vec<String> = Vec::new();
    let mut complete = true;
    for cell in &study.summary.cells {
        let case = place(cell, &others);
        if seen.contains(&case) {
            continue;
        }
        seen.push(case.clone());
        let Some(range) = range(study, along, &others, &case, good) else {
            complete = false;
            continue;
        };
        complete &= range.is_empty();
        let case = if others.len() > 1 {
            format!("({case})")
        } else {
            case
        };
        match ranges.iter_mut().find(|(known, _)| *known == range) {
            Some((_, cases)) => cases.push(case),
            None => ranges.push((range, vec![case])),
        }
    }
    if ranges.iter().map(|(_, cases)| cases.len()).sum::<usize>() > MOST {
        return None;
    }
    let name = axis_label(along);
    let name = name.split(',').next().unwrap_or_default();
    let text = |(range, cases): &(String, Vec<String>)| {
        let range = if range.is_empty() {
            format!("at every {name}")
        } else {
            range.clone()
        };
        format!("{range} with {}", listed(cases))
    };
    let texts: Vec<String> = ranges.iter().map(text).collect();
    let end = if complete { "" } else { "; nowhere else" };
    Some(format!(" It holds {}{end}.", texts.join("; ")))
}

/// The values of a setting with which cells of one combination of the others are good: empty where it is all of
/// them, none where there is no such value.
fn range(
    study: &Study,
    along: Key,
    others: &[Key],
    case: &str,
    good: &[&CellSummary],
) -> Option<String> {
    let of = |cell: &&CellSummary| place(cell, others) == case;
    let cells: Vec<&CellSummary> = study.summary.cells.iter().filter(of).collect();
    let is_good = |value: &String| {
        let mut cells = cells.iter().filter(|cell| cell.setting(along) == *value);
        cells.all(|cell| good.iter().any(|other| other.cell == cell.cell))
    };
    let mut values = study.values(along).to_vec();
    values.retain(|value| cells.iter().any(|cell| cell.setting(along) == *value));
    let held: Vec<bool> = values.iter().map(is_good).collect();
    let texts = || -> Vec<String> {
        let held = values.iter().zip(&held).filter(|(_, held)| **held);
        held.map(|(value, _)| words(along, value)).collect()
    };
    let (first, count) = (
        held.iter().position(|held| *held)?,
        held.iter().filter(|held| **held).count(),
    );
    let all = values.len();
    Some(if count == all {
        String::new()
    } else if count > 1 && first + count == all {
        format!("from {} on", texts()[0])
    } else if count > 1 && held[..count].iter().all(|held| *held) {
        format!("up to {}", texts()[count - 1])
    } else {
        format!("at {}", listed(&texts()))
    })
}
