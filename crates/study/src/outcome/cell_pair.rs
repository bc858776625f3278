//! Two cells that claims compare, trial by trial.

use crate::design::Experiment;
use crate::design::file::{SeriesTable, Settings, partners};
use crate::outcome::tally::CellSeries;
use asobench_identification::metric::{Paired, PairedStatistics, Sketch};
use serde::{Deserialize, Serialize};

/// One output in two cells that differ in a setting, on the same trials.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CellPair {
    /// The comparison that was asked for.
    #[serde(rename = "of")]
    pub table: SeriesTable,
    /// The cell in the denominator.
    pub from: usize,
    /// The other cell.
    pub to: usize,
    /// The measure in `to` over that in `from`.
    pub ratio: PairedStatistics,
    /// The distribution of this ratio; older versions did not keep it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ratios: Option<Sketch>,
}

/// Returns every pair of cells that claims compare, over the trials that both have.
pub(crate) fn cell_pairs<'s>(experiment: &Experiment, series: impl Fn(usize) -> &'s CellSeries) -> Vec<CellPair> {
    let file = &experiment.file;
    let settings: Vec<&Settings> = experiment.cells.iter().map(|cell| &cell.settings).collect();
    let values = |cell: usize, table: &SeriesTable| {
        let mut kept = experiment.series_of(&experiment.cells[cell]);
        let output = experiment.output("output", &table.output).ok()?;
        let place = kept.position(|kept| kept == (output, table.measure))?;
        series(cell).get(place)
    };
    let tables = file.needed.iter().flat_map(|needed| &needed.series);
    let found = tables.flat_map(|table| {
        let pairs = partners(file, &settings, table.axis, [&table.from, &table.to]);
        pairs.into_iter().map(move |pair| (table, pair))
    });
    let paired = found.filter_map(|(table, [from, to])| {
        let (first, second) = (values(to, table)?, values(from, table)?);
        // One trial of a cell without randomness stands for all.
        let sure = |cell: usize| experiment.cells[cell].is_deterministic();
        let trials = match (sure(to), sure(from)) {
            (true, false) => second.len(),
            (false, true) => first.len(),
            _ => first.len().min(second.len()),
        };
        let [first, second] = [first, second].map(|values| values.iter().copied().map(Some).cycle());
        let both = first.zip(second).take(trials);
        let paired = Paired::from_pairs(both);
        Some(CellPair {
            table: table.clone(),
            from,
            to,
            ratio: paired.statistics(table.measure.worse()),
            ratios: Some(paired.ratio().clone()),
        })
    });
    paired.collect()
}
