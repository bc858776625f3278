//! A map of the shares of trials that satisfy nested bounds, over two sides of the grid. It shows where a method works,
//! nearly works or fails.

use super::figure::Drawn;
use super::layout::{only, x_key};
use crate::plot::{Heat, HeatCell};
use crate::results::{Study, axis_label, place};
use asobench_study::study::CellSummary;
use asobench_study::study::file::Key;
use std::collections::HashMap;

/// Largest number of cells of a map.
const MOST_CELLS: usize = 1000;

/// The map of a study whose cells have two bounds on one measure, the narrower one first. It shows per cent of the
/// trials of the last output: within the first bound, only within the second, and neither.
pub(super) fn bound_grid(study: &Study) -> Option<Drawn> {
    let output = study.labels().last()?;
    let [narrow, wide] = study.file.bounds.as_slice() else {
        return None;
    };
    let nested = narrow.measure == wide.measure && narrow.claim.is_none() && wide.claim.is_none();
    let few = study.summary.cells.len() <= MOST_CELLS;
    let x = x_key(study).filter(|_| few && nested && narrow.below < wide.below)?;
    let others: Vec<Key> = study.varying().into_iter().filter(|key| *key != x).collect();
    let (rows, cells) = grid(study, output, x, &others);
    let what = format!(
        "Per cent of the trials of {output}. Each cell has three numbers, from top to bottom: {} ({} {}); {} ({}) \
         only; neither.",
        narrow.label(),
        narrow.measure,
        narrow.text(),
        wide.label(),
        wide.text()
    );
    let heat = Heat {
        title: format!(
            "{}: per cent {}, {} only, neither",
            study.title(),
            narrow.label(),
            wide.label()
        ),
        description: what.clone(),
        column_label: axis_label(x),
        rows,
        columns: study.values(x).to_vec(),
        cells,
    };
    Some(Drawn {
        name: "map".to_owned(),
        picture: only(heat.drawing()),
        caption: what,
    })
}

/// Row names and rows, with a column for every value of `x`.
fn grid(study: &Study, output: &str, x: Key, others: &[Key]) -> (Vec<String>, Vec<Row>) {
    let columns = study.values(x).len();
    let (mut names, mut rows) = (Vec::new(), Vec::new());
    let mut places: HashMap<String, usize> = HashMap::new();
    for cell in &study.summary.cells {
        let row = *places.entry(row_name(cell, others)).or_insert_with_key(|name| {
            names.push(name.clone());
            rows.push(vec![None; columns]);
            rows.len() - 1
        });
        rows[row][study.place(cell, x)] = shares(cell, output);
    }
    (names, rows)
}

/// The cells of a row.
type Row = Vec<Option<HeatCell>>;

/// The settings that name a row. The frequency is left out for a disturbance that has none.
fn row_name(cell: &CellSummary, keys: &[Key]) -> String {
    let disturbance = cell.setting(Key::Disturbance);
    let timeless = matches!(disturbance.as_str(), "white" | "constant" | "ramp" | "none");
    let keys = keys.iter().copied().filter(|key| !(timeless && *key == Key::Frequency));
    place(cell, &keys.collect::<Vec<Key>>())
}

fn shares(cell: &CellSummary, output: &str) -> Option<HeatCell> {
    let met = |bound: usize| {
        let mut outputs = cell.bounds.get(bound)?.outputs.iter();
        let share = outputs.find(|found| found.output == output)?.met.share;
        share.is_finite().then_some(share)
    };
    let (narrow, wide) = (met(0)?, met(1)?);
    let shares = [narrow, wide - narrow, 1.0 - wide].map(|share| format!("{:.0}", 100.0 * share));
    Some(HeatCell {
        value: narrow,
        text: shares.join("\n"),
    })
}
