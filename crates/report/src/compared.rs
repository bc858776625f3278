//! Two or more studies beside each other: what differs in their designs, and the same cells.

use crate::results::{Study, placed};
use crate::table::{CellText, Column, Table};
use asobench_identification::metric::{Estimate, Quantile};
use asobench_identification::number::uncertain;
use asobench_study::study::file::Key;
use asobench_study::study::{CellSummary, Measure};
use asobench_study::text::{visible, wrap};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Columns of a terminal, and of a number.
const WIDTH: usize = 80;
const NUMBER: usize = 16;
/// Longest value of a key that is shown whole.
const LONGEST: usize = 30;

/// Compares studies with the first one, as text: the keys in which their files differ, and the medians of a measure in
/// cells with the same settings, for outputs with the same label. A setting that has one value in each study, and
/// another one, is named and left out of the match. Without a measure the first is taken that all have.
/// The last column is the difference of the last median from the first in standard errors of independent medians;
/// studies with the same seed share their trials, and then it is too small.
///
/// # Errors
/// In words, if the studies have no such measure, or no cell in common.
pub fn compared(studies: &[Study], measure: Option<Measure>) -> Result<String, String> {
    let Some((first, others)) = studies.split_first() else {
        return Err("expected at least two folders".to_owned());
    };
    let mut text = designs(first, others);
    let has = |study: &Study, measure: &Measure| study.file.measures.contains(measure);
    let mut common = first.file.measures.iter().copied();
    let common = common.find(|of| others.iter().all(|other| has(other, of)));
    let measure = measure.or(common).ok_or("these studies have no measure in common")?;
    // Cells are matched without the settings that have one value in each study, and another one.
    let without = never_equal(studies, |count| count == 1);
    let rows = rows(first, others, measure, &without);
    let named = |keys: &[Key]| -> String {
        let keys = keys.iter().map(|key| in_studies(studies, *key));
        keys.collect::<Vec<_>>().join("; ")
    };
    if rows.is_empty() {
        return Err(match named(&never_equal(studies, |_| true)).as_str() {
            "" => format!("no cell with the same settings has {measure} in all of these studies"),
            differing => format!(
                "no cell with the same settings: {differing}; asobench run FILE --set KEY=VALUE runs a study with \
                 values of another"
            ),
        });
    }
    if !without.is_empty() {
        let without = named(&without);
        let line = format!("\nCells are matched without what differs in all of them: {without}");
        text.push_str(&wrap(&line, WIDTH, "  "));
    }
    let widths = rows.iter().map(|row| row.name.chars().count());
    let width = widths.max().unwrap_or(0);
    let width = width.clamp(8, WIDTH - 2 * NUMBER - 8);
    let mut columns = vec![Column::text("").width(width)];
    columns.extend(
        studies
            .iter()
            .map(|study| Column::number(beginning(&study.name, NUMBER), "").width(NUMBER)),
    );
    columns.push(Column::number("SEs", "").width(5));
    let table = Table::new("", columns);
    let head = table.text_head();
    text += &format!("\nMedian {measure} in cells with the same settings:\n\n{head}");
    for Row { name, medians } in rows {
        let (above, name) = if name.chars().count() > width {
            (name + "\n", String::new())
        } else {
            (String::new(), name)
        };
        let (from, to) = (medians[0], medians[medians.len() - 1]);
        let distance = (to.value - from.value) / from.mcse.hypot(to.mcse);
        let distance = if distance.is_finite() {
            format!("{distance:.1}")
        } else {
            "-".to_owned()
        };
        let numbers = medians.iter().map(|median| uncertain(median.value, median.mcse));
        let cells = std::iter::once(name).chain(numbers).chain([distance]);
        text += &(above + &table.text_row(&cells.map(CellText::text).collect::<Vec<_>>()));
    }
    Ok(visible_lines(&text))
}

fn visible_lines(text: &str) -> String {
    text.lines().map(|line| visible(line) + "\n").collect()
}

fn beginning(text: &str, most: usize) -> String {
    text.chars().take(most).collect()
}

/// The medians of one output in the cells that have the same settings.
struct Row {
    name: String,
    medians: Vec<Estimate>,
}

/// The values of a setting over the cells of a study.
fn values_of(study: &Study, key: Key) -> BTreeSet<String> {
    let cells = study.summary.cells.iter();
    let values = cells.filter_map(|cell| cell.settings.get(&key));
    values.map(ToString::to_string).collect()
}

/// The settings that two studies have and of which no value is common, where `which` takes their numbers of values.
fn never_equal(studies: &[Study], which: impl Fn(usize) -> bool) -> Vec<Key> {
    let Some((first, others)) = studies.split_first() else {
        return Vec::new();
    };
    let keys = Key::ALL.iter().copied();
    let differ = |key: &Key| {
        let own = values_of(first, *key);
        others.iter().any(|other| {
            let other = values_of(other, *key);
            let known = !own.is_empty() && !other.is_empty();
            known && own.is_disjoint(&other) && which(own.len()) && which(other.len())
        })
    };
    keys.filter(differ).collect()
}

/// A setting with its values in each study.
fn in_studies(studies: &[Study], key: Key) -> String {
    let values = studies.iter().map(|study| {
        let mut values: Vec<String> = values_of(study, key).into_iter().collect();
        let number = |value: &String| value.parse().unwrap_or(f64::NAN);
        values.sort_by(|a, b| number(a).total_cmp(&number(b)));
        format!("{} in {}", values.join(", "), study.name)
    });
    format!("{key} is {}", values.collect::<Vec<_>>().join(", "))
}

fn rows(first: &Study, others: &[Study], measure: Measure, without: &[Key]) -> Vec<Row> {
    // Every setting but those that a study has and another has not.
    let others_cells = || others.iter().flat_map(|study| &study.summary.cells);
    let mut common: BTreeSet<Key> = others_cells().flat_map(|cell| cell.settings.keys().copied()).collect();
    common.retain(|key| !without.contains(key));
    common.retain(|key| others_cells().all(|cell| cell.settings.contains_key(key)));
    let settings = |cell: &CellSummary| -> BTreeMap<Key, String> {
        let settings = cell.settings.iter();
        let settings = settings.filter(|(key, _)| common.contains(key));
        settings.map(|(key, value)| (*key, value.to_string())).collect()
    };
    // Of cells that differ only in other settings the first one.
    let by_settings = |study: &Study| -> BTreeMap<BTreeMap<Key, String>, usize> {
        let cells = study.summary.cells.iter().enumerate().rev();
        cells.map(|(i, cell)| (settings(cell), i)).collect()
    };
    let places: Vec<_> = others.iter().map(by_settings).collect();
    let keys = first.varying();
    let mut rows = Vec::new();
    for cell in &first.summary.cells {
        let wanted = settings(cell);
        let same = others.iter().zip(&places).map(|(study, places)| {
            let place = places.get(&wanted)?;
            Some(&study.summary.cells[*place])
        });
        let Some(same) = same.collect::<Option<Vec<&CellSummary>>>() else {
            continue;
        };
        for label in first.labels() {
            let of = |(study, cell): (&Study, &CellSummary)| -> Option<Estimate> {
                let Quantile { value, mcse, .. } = study.statistics(cell, label, measure)?.q50;
                Some(Estimate { value, mcse })
            };
            let others = others.iter().zip(same.iter().copied());
            let medians = std::iter::once((first, cell)).chain(others).map(of);
            let Some(medians) = medians.collect::<Option<Vec<Estimate>>>() else {
                continue;
            };
            let name = placed(cell, &keys, |place| format!("{place}, ")) + label;
            rows.push(Row { name, medians });
        }
    }
    rows
}

/// The keys in which the files of studies differ from the first one's.
fn designs(first: &Study, others: &[Study]) -> String {
    let leaves = |study: &Study| -> BTreeMap<String, String> {
        let mut all = BTreeMap::new();
        let file = serde_json::to_value(&study.file).unwrap_or_default();
        flatten("", &file, &mut all);
        all
    };
    let own = leaves(first);
    let mut text = String::new();
    for study in others {
        let other = leaves(study);
        let keys = own.keys().chain(other.keys()).collect::<BTreeSet<_>>();
        let differing: Vec<String> = keys
            .into_iter()
            .filter(|key| own.get(*key) != other.get(*key))
            .map(|key| {
                let [a, b] =
                    [&own, &other].map(|of| of.get(key).map_or("not there".to_owned(), |text| shortened(text)));
                format!("  {key}: {a} -> {b}")
            })
            .collect();
        if differing.is_empty() {
            text.push_str(&format!("{} and {}: the same experiment.\n", first.name, study.name));
            continue;
        }
        text.push_str(&format!(
            "{} -> {}, where their experiments differ:\n",
            first.name, study.name
        ));
        for line in differing {
            text.push_str(&(wrap(&line, WIDTH, "    ")));
        }
    }
    text
}

fn shortened(text: &str) -> String {
    if text.chars().count() <= LONGEST {
        text.to_owned()
    } else {
        beginning(text, LONGEST - 4) + " ..."
    }
}

/// Lists the leaves of a structure by their paths. A list of plain values is a leaf.
fn flatten(path: &str, value: &Value, to: &mut BTreeMap<String, String>) {
    let below = |key: &str| {
        if path.is_empty() {
            key.to_owned()
        } else {
            format!("{path}.{key}")
        }
    };
    match value {
        Value::Object(all) => all.iter().for_each(|(key, value)| flatten(&below(key), value, to)),
        Value::Array(all) if all.iter().any(|value| value.is_object() || value.is_array()) => {
            all.iter()
                .enumerate()
                .for_each(|(i, value)| flatten(&below(&i.to_string()), value, to));
        }
        Value::Null => {}
        other => {
            to.insert(path.to_owned(), other.to_string());
        }
    }
}
