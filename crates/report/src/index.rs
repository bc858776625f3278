//! Look-ups that a report needs often, computed once: the values of every setting, and the value of each cell.

use asobench_study::study::file::{Key, StudyKind};
use asobench_study::study::{OutputSummary, Summary};
use std::collections::{BTreeMap, HashMap};

/// The values of one setting over the cells of a study.
#[derive(Clone, Debug)]
pub(super) struct Values {
    /// Sorted by size if all are numbers, otherwise in order of appearance.
    pub(super) names: Vec<String>,
    /// The values as numbers, if all of them are numbers.
    pub(super) numbers: Option<Vec<f64>>,
    /// For every cell the index of its value; empty if all cells have the same value.
    of_cell: Vec<u32>,
}

impl Values {
    fn new(summary: &Summary, key: Key) -> Self {
        let mut places: HashMap<String, u32> = HashMap::new();
        let mut names = Vec::new();
        let mut of_cell: Vec<u32> = Vec::with_capacity(summary.cells.len());
        for cell in &summary.cells {
            let next = names.len() as u32;
            let place = *places.entry(cell.setting(key)).or_insert_with_key(|name| {
                names.push(name.clone());
                next
            });
            of_cell.push(place);
        }
        let numeric = summary.cells.iter().all(|cell| cell.is_number(key));
        let numbers: Option<Vec<f64>> = names.iter().map(|name| name.parse().ok()).collect();
        let mut values = Self {
            names,
            numbers: numbers.filter(|_| numeric),
            of_cell,
        };
        values.sort();
        if values.names.len() < 2 {
            values.of_cell = Vec::new();
        }
        values
    }

    /// Sorts numbers by size.
    fn sort(&mut self) {
        let Some(numbers) = &self.numbers else {
            return;
        };
        let mut order: Vec<usize> = (0..numbers.len()).collect();
        order.sort_by(|a, b| numbers[*a].total_cmp(&numbers[*b]));
        let mut place = vec![0; order.len()];
        for (to, from) in order.iter().enumerate() {
            place[*from] = to as u32;
        }
        for of_cell in &mut self.of_cell {
            *of_cell = place[*of_cell as usize];
        }
        self.numbers = Some(order.iter().map(|from| numbers[*from]).collect());
        self.names = order.iter().map(|from| self.names[*from].clone()).collect();
    }

    /// The index of a cell's value among the names.
    pub(super) fn place(&self, cell: usize) -> usize {
        self.of_cell.get(cell).map_or(0, |place| *place as usize)
    }

    /// Whether the value of another setting determines the value of this one.
    fn follows(&self, from: &Self) -> bool {
        let mut seen: Vec<Option<u32>> = vec![None; from.names.len()];
        let cells = self.of_cell.iter().enumerate();
        cells.into_iter().all(|(cell, value)| {
            let known = &mut seen[from.place(cell)];
            *known.get_or_insert(*value) == *value
        })
    }
}

/// The values of all settings, the settings that vary, and the outputs' labels.
#[derive(Clone, Debug)]
pub(super) struct Index {
    /// Of every setting.
    pub(super) values: BTreeMap<Key, Values>,
    /// The settings that distinguish cells, without those determined by another one.
    pub(super) varying: Vec<Key>,
    /// The label of every output, in order.
    pub(super) labels: Vec<String>,
    /// The index of every output by its label, the same in every cell.
    pub(super) outputs: HashMap<String, usize>,
    /// Whether any cell has noise.
    pub(super) noisy: bool,
}

impl Index {
    /// Builds the index of a summary. All cells must have the outputs of the first one.
    pub(super) fn new(summary: &Summary, kind: StudyKind) -> Self {
        let values = Key::ALL.iter().map(|key| (*key, Values::new(summary, *key)));
        let values: BTreeMap<Key, Values> = values.collect();
        let first = summary.cells.first();
        let labels: Vec<String> =
            first.map_or_else(Vec::new, |cell| cell.outputs.iter().map(OutputSummary::label).collect());
        let outputs = labels.iter().cloned().zip(0..).collect();
        Self {
            varying: varying(&values, kind),
            values,
            labels,
            outputs,
            noisy: summary.cells.iter().any(|cell| cell.eta > 0.0),
        }
    }
}

fn varying(values: &BTreeMap<Key, Values>, kind: StudyKind) -> Vec<Key> {
    let mut kept: Vec<Key> = Vec::new();
    for key in Key::telling().filter(|key| key.is_of(kind)) {
        let own = &values[&key];
        let follows = kept.iter().any(|other| own.follows(&values[other]));
        if own.names.len() > 1 && !follows {
            kept.push(key);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use asobench_study::study::file::ExperimentFile;
    use asobench_study::study::{CellPart, CellTally, Experiment};

    fn index(toml: &str) -> (Index, Summary) {
        let experiment = Experiment::new(ExperimentFile::parse(toml).unwrap()).unwrap();
        let cells = (0..experiment.cells.len()).map(|cell| CellPart::new(&experiment, cell, &CellTally::default()));
        let summary = Summary::new(&experiment, cells.collect());
        (Index::new(&summary, StudyKind::Discrete), summary)
    }

    #[test]
    fn every_cell_has_the_place_of_its_value() {
        let (index, summary) = index("[settings]\neta = [10, 2, 1]\nnoise = [\"white\", \"ar\"]\nwindow = [98, 18]\n");
        assert_eq!(index.values[&Key::Eta].names, ["1", "2", "10"]);
        assert_eq!(index.values[&Key::Eta].numbers, Some(vec![1.0, 2.0, 10.0]));
        assert_eq!(index.values[&Key::Noise].names, ["white", "ar"]);
        assert_eq!(index.values[&Key::Noise].numbers, None);
        assert_eq!(index.values[&Key::Amplitude].names.len(), 1);
        for cell in &summary.cells {
            for key in Key::ALL {
                let place = index.values[key].place(cell.cell);
                assert_eq!(index.values[key].names[place], cell.setting(*key), "{key}");
            }
        }
        assert!(index.noisy);
    }

    #[test]
    fn what_follows_from_another_setting_does_not_vary() {
        let zipped = "[settings]\neta = [1, 2, 3]\nnoise = [\"ar\", \"white\"]\nwindow = [98, 18]\n\
                      [[exclude]]\neta = [1, 3]\nnoise = \"white\"\n\
                      [[exclude]]\neta = 2\nnoise = \"ar\"\n";
        let (index, _) = index(zipped);
        assert_eq!(index.varying, [Key::Window, Key::Eta]);
    }
}
