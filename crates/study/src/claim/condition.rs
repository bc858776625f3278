//! Where a claim holds: settings that separate the cells where it holds from those where it does not.

use crate::design::file::Key;
use crate::outcome::place::{Place, axis_label, values, varying, words};
use asobench_identification::number::listed;

/// The largest number of items that a sentence lists.
const MOST: usize = 6;

/// Describes where the `good` cells are; cells are indices in `all`. It names a single setting, if its values separate
/// the good cells from all others: "with white noise". Otherwise it gives, for each combination of the other settings,
/// the good values of a numerical one: "from N = 98 on with eta = 2 %". A cell that is neither good nor bad is open;
/// nothing is said about it. `None` if few settings are not enough.
pub fn condition(all: &[Place], good: &[usize], bad: &[usize]) -> Option<String> {
    if good.is_empty() || bad.is_empty() {
        return None;
    }
    by_one_setting(all, good).or_else(|| by_combination(all, good))
}

/// Names a setting such that every cell with one of these values is good, and every good cell has one of them.
fn by_one_setting(all: &[Place], good: &[usize]) -> Option<String> {
    varying(all).into_iter().find_map(|key| {
        let values_where = |is_good: bool| {
            let cells = (0..all.len()).filter(|cell| good.contains(cell) == is_good);
            let cells: Vec<Place> = cells.map(|cell| all[cell].clone()).collect();
            values(&cells, key)
        };
        let (good, others) = (values_where(true), values_where(false));
        let tells = good.len() <= MOST && !good.iter().any(|value| others.contains(value));
        let texts: Vec<String> = good.iter().map(|value| words(key, value)).collect();
        tells.then(|| format!("with {}", listed(&texts)))
    })
}

/// Returns the numerical setting with the most values.
fn longest(all: &[Place]) -> Option<Key> {
    let is_number = |value: &String| value.parse::<f64>().is_ok();
    let keys = varying(all).into_iter().rev();
    let counted = keys.map(|key| (key, values(all, key)));
    let numeric = counted.filter(|(_, values)| values.iter().all(is_number));
    numeric.max_by_key(|(_, values)| values.len()).map(|(key, _)| key)
}

fn by_combination(all: &[Place], good: &[usize]) -> Option<String> {
    let along = longest(all)?;
    let mut others = varying(all);
    others.retain(|key| *key != along);
    // The ranges of the numerical setting, and the combinations of the others with each range.
    let mut ranges: Vec<(String, Vec<String>)> = Vec::new();
    let mut seen: Vec<String> = Vec::new();
    let mut complete = true;
    for place in all {
        let case = place.words(&others);
        if seen.contains(&case) {
            continue;
        }
        seen.push(case.clone());
        let Some(range) = range(all, along, &others, &case, good) else {
            complete = false;
            continue;
        };
        complete &= range.is_empty();
        let case = if others.len() > 1 { format!("({case})") } else { case };
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
        let cases = listed(cases);
        if cases.is_empty() {
            range
        } else {
            format!("{range} with {cases}")
        }
    };
    let texts: Vec<String> = ranges.iter().map(text).collect();
    let end = if complete { "" } else { "; nowhere else" };
    Some(format!("{}{end}", texts.join("; ")))
}

/// Returns the values of a setting at which the cells of one combination of the others are good: empty if all are,
/// `None` if none is.
fn range(all: &[Place], along: Key, others: &[Key], case: &str, good: &[usize]) -> Option<String> {
    let own: Vec<usize> = (0..all.len()).filter(|cell| all[*cell].words(others) == case).collect();
    let is_at = |cell: &usize, value: &str| all[*cell].value(along) == value;
    let mut values = values(all, along);
    values.retain(|value| own.iter().any(|cell| is_at(cell, value)));
    let is_good = |value: &String| {
        let mut cells = own.iter().filter(|cell| is_at(cell, value));
        cells.all(|cell| good.contains(cell))
    };
    let held: Vec<bool> = values.iter().map(is_good).collect();
    let texts: Vec<String> = values
        .iter()
        .zip(&held)
        .filter(|(_, held)| **held)
        .map(|(value, _)| words(along, value))
        .collect();
    let first = held.iter().position(|held| *held)?;
    let (count, all) = (texts.len(), values.len());
    Some(if count == all {
        String::new()
    } else if count > 1 && first + count == all {
        format!("from {} on", texts[0])
    } else if count > 1 && held[..count].iter().all(|held| *held) {
        format!("up to {}", texts[count - 1])
    } else {
        format!("at {}", listed(&texts))
    })
}
