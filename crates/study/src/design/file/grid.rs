//! The grid: the product of all axes, with zipped axes moving together and some cells left out.

use crate::design::file::{Axis, ExperimentFile, FileError, Key, Scalar, wrong};
use std::collections::BTreeMap;

/// The settings of one cell.
pub type Settings = BTreeMap<Key, Scalar>;

/// The largest number of cells in a grid.
pub const CELL_LIMIT: u128 = 100_000;

/// Axes that move together: at step i each key has its i-th value.
type Dimension = Vec<(Key, Vec<Scalar>)>;

/// Returns all cells, with the axes in the order of [`Key`], the first one slowest. A zipped group has the position of
/// its first key.
///
/// # Errors
/// If the grid is too large or empty, or `zip` is wrong.
pub fn cells(
    settings: &BTreeMap<Key, Axis>,
    zip: &[Vec<Key>],
    exclude: &[BTreeMap<Key, Axis>],
) -> Result<Vec<Settings>, FileError> {
    let dimensions = dimensions(settings, zip)?;
    let size = dimensions
        .iter()
        .fold(1_u128, |size, d| size.saturating_mul(length(d) as u128));
    if size > CELL_LIMIT {
        return wrong(
            "settings",
            format!("a grid of {size} cells; expected at most {CELL_LIMIT}"),
        );
    }
    let exclude: Vec<Conditions> = exclude.iter().map(conditions).collect();
    let mut cells = Vec::new();
    for index in 0..size as usize {
        let cell = cell(&dimensions, index);
        if !exclude.iter().any(|conditions| matches(&cell, conditions)) {
            cells.push(cell);
        }
    }
    if cells.is_empty() {
        return wrong("exclude", "no cell of the grid is left");
    }
    Ok(cells)
}

fn length(dimension: &Dimension) -> usize {
    dimension.first().map_or(1, |(_, values)| values.len())
}

fn dimensions(settings: &BTreeMap<Key, Axis>, zip: &[Vec<Key>]) -> Result<Vec<Dimension>, FileError> {
    let mut dimensions: Vec<Dimension> = Vec::new();
    let mut zipped: BTreeMap<Key, usize> = BTreeMap::new();
    for (i, group) in zip.iter().enumerate() {
        for key in group {
            if zipped.insert(*key, i).is_some() {
                return wrong("zip", format!("'{key}' is given twice"));
            }
            if !settings.contains_key(key) {
                let message = format!("'{key}' has no list in [settings]");
                return wrong("zip", message);
            }
        }
    }
    let mut of_group: BTreeMap<usize, usize> = BTreeMap::new();
    for (key, axis) in settings {
        let values = axis.values(key.entry().count);
        let Some(group) = zipped.get(key) else {
            dimensions.push(vec![(*key, values)]);
            continue;
        };
        let at = *of_group.entry(*group).or_insert_with(|| {
            dimensions.push(Vec::new());
            dimensions.len() - 1
        });
        let dimension = &mut dimensions[at];
        if let Some((other, others)) = dimension.first().filter(|(_, o)| o.len() != values.len()) {
            let message = format!(
                "'{other}' has {} values and '{key}' {}; expected equally many",
                others.len(),
                values.len()
            );
            return wrong("zip", message);
        }
        dimension.push((*key, values));
    }
    Ok(dimensions)
}

fn cell(dimensions: &[Dimension], mut index: usize) -> Settings {
    let mut cell = Settings::new();
    for dimension in dimensions.iter().rev() {
        let step = index % length(dimension);
        index /= length(dimension);
        let values = dimension.iter().map(|(key, values)| (*key, values[step].clone()));
        cell.extend(values);
    }
    cell
}

/// Returns the pairs of cells, as indices, that differ only in one setting and those zipped with it. Its value is
/// `from` in the first cell and `to` in the second.
pub fn partners(file: &ExperimentFile, cells: &[&Settings], axis: Key, [from, to]: [&Scalar; 2]) -> Vec<[usize; 2]> {
    let group = file.zip.iter().find(|group| group.contains(&axis));
    let moves = |key: &Key| *key == axis || group.is_some_and(|group| group.contains(key));
    let others = |cell: &Settings| -> Vec<String> {
        let others = cell.iter().filter(|(key, _)| !moves(key));
        others.map(|(key, value)| format!("{key} = {value:?}")).collect()
    };
    let with = |value: &Scalar| {
        let cells = cells.iter().enumerate();
        let found = cells.filter(|(_, cell)| cell.get(&axis) == Some(value));
        found.map(|(index, cell)| (others(cell), index)).collect::<Vec<_>>()
    };
    let first: BTreeMap<Vec<String>, usize> = with(from).into_iter().rev().collect();
    let second = with(to).into_iter();
    second
        .filter_map(|(others, index)| Some([*first.get(&others)?, index]))
        .collect()
}

/// The values that some settings may have.
pub type Conditions = BTreeMap<Key, Vec<Scalar>>;

/// Returns the conditions of a table, with ranges written out.
pub fn conditions(table: &BTreeMap<Key, Axis>) -> Conditions {
    let values = |(key, axis): (&Key, &Axis)| (*key, axis.values(key.entry().count));
    table.iter().map(values).collect()
}

/// Whether a cell has one of the values of every condition.
pub fn matches(cell: &Settings, conditions: &Conditions) -> bool {
    conditions.iter().all(|(key, values)| {
        let value = cell.get(key);
        value.is_some_and(|value| values.contains(value))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(json: &str) -> BTreeMap<Key, Axis> {
        serde_json::from_str(json).unwrap()
    }

    fn text(cells: &[Settings]) -> Vec<String> {
        let value = |cell: &Settings| cell.values().map(Scalar::to_string).collect::<Vec<_>>();
        cells.iter().map(|cell| value(cell).join(" ")).collect()
    }

    #[test]
    fn the_first_key_is_slowest_and_zipped_keys_move_together() {
        let all = settings(r#"{"window": [18, 98], "eta": [1, 2], "noise": ["ar", "white"]}"#);
        let product = cells(&all, &[], &[]).unwrap();
        assert_eq!(product.len(), 8);
        assert_eq!(text(&product)[..3], ["ar 1 18", "ar 1 98", "ar 2 18"]);
        let zipped = cells(&all, &[vec![Key::Window, Key::Eta]], &[]).unwrap();
        assert_eq!(text(&zipped), ["ar 1 18", "ar 2 98", "white 1 18", "white 2 98"]);
        let without = [settings(r#"{"noise": "white", "eta": [1, 3]}"#)];
        let left = cells(&all, &[vec![Key::Window, Key::Eta]], &without).unwrap();
        assert_eq!(text(&left), ["ar 1 18", "ar 2 98", "white 2 98"]);
    }

    #[test]
    fn contradictions_are_refused() {
        let refused = |json: &str, zip: &[Vec<Key>], part: &str| {
            let error = cells(&settings(json), zip, &[]).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        };
        let eta_window = [vec![Key::Eta, Key::Window]];
        refused(r#"{"eta": [1, 2], "window": [1, 2, 3]}"#, &eta_window, "equally many");
        refused(r#"{"eta": [1, 2]}"#, &eta_window, "no list");
        refused(r#"{"eta": [1, 2]}"#, &[vec![Key::Eta, Key::Eta]], "is given twice");
        let thousand = r#"{"linspace": [1, 1000, 1000]}"#;
        let large = format!(r#"{{"eta": {thousand}, "amplitude": {thousand}, "x0": {thousand}}}"#);
        refused(&large, &[], "a grid of 1000000000 cells");
        let all = [settings(r#"{"eta": 1}"#)];
        assert!(cells(&settings(r#"{"eta": 1}"#), &[], &all).is_err());
    }
}
