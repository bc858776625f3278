//! The outputs and measures that a study is about: figures and tables of the page begin with them.

use crate::plot::distinct;
use crate::results::Study;
use asobench_study::study::file::ClaimTable;
use asobench_study::study::{Measure, OutputSummary};
use std::collections::HashMap;

/// Largest number of outputs in a figure.
pub(super) const OUTPUTS: usize = 8;

/// Measures in the table that a run ends with.
const AT_THE_END: usize = 3;

/// The measures in the table that a run ends with.
pub(crate) fn shown_at_the_end(study: &Study) -> Vec<Measure> {
    let mut all = measures(study);
    all.truncate(AT_THE_END);
    all
}

/// The measures of the study, beginning with those that its claims use.
pub(crate) fn measures(study: &Study) -> Vec<Measure> {
    let tests = study.file.claims.iter().flat_map(ClaimTable::all_tests);
    let claimed = tests.flat_map(|test| test.measures());
    let all = claimed.chain(study.file.measures.iter().copied());
    distinct(all.filter(|measure| study.file.measures.contains(measure)))
}

/// The outputs that figures and the page's tables show, with their places in the palette. If there are many, these are
/// the outputs named by claims and the last pass of every other estimator.
pub(crate) fn lead_outputs(study: &Study) -> Vec<(usize, String)> {
    let Some(cell) = study.summary.cells.first() else {
        return Vec::new();
    };
    let outputs = &cell.outputs;
    let few = outputs.len() <= 3;
    let claimed = study.claimed();
    let mut last: HashMap<&str, usize> = HashMap::new();
    for output in outputs {
        last.insert(&output.estimator, output.pass);
    }
    for output in outputs.iter().filter(|output| claimed.contains(&output.label())) {
        last.remove(output.estimator.as_str());
    }
    let kept = outputs.iter().filter(|output| {
        few || claimed.contains(&output.label()) || last.get(output.estimator.as_str()) == Some(&output.pass)
    });
    let kept = kept.take(OUTPUTS).map(OutputSummary::label);
    kept.enumerate().collect()
}

/// The measures that the study is about, at most three, in a fixed order. Those missing in many cells come last.
pub(super) fn lead_figures(study: &Study) -> Vec<Measure> {
    const ORDER: [Measure; 11] = [
        Measure::Ea,
        Measure::Eb,
        Measure::ExMax,
        Measure::ImpulseResponse,
        Measure::FreshFit,
        Measure::Eh,
        Measure::ExRms,
        Measure::Ex0,
        Measure::RmsState,
        Measure::ThetaRms,
        Measure::Theta,
    ];
    let outputs = lead_outputs(study);
    let defined = |measure: Measure| {
        let cells = study.summary.cells.iter();
        let statistics = cells.flat_map(|cell| {
            let outputs = outputs.iter();
            outputs.filter_map(move |(_, label)| study.statistics(cell, label, measure))
        });
        let medians = statistics.map(|statistics| statistics.q50.value);
        medians.filter(|median| median.is_finite()).count()
    };
    let asked = &study.file.measures;
    let known = ORDER.into_iter().filter(|measure| asked.contains(measure));
    let others = asked.iter().copied().filter(|measure| !ORDER.contains(measure));
    let found = known.chain(others).map(|measure| (defined(measure), measure));
    let mut found: Vec<(usize, Measure)> = found.filter(|(count, _)| *count > 0).collect();
    let most = found.iter().map(|(count, _)| *count).max().unwrap_or(0);
    // A measure that is defined less than half as often as the most frequent one comes after the others.
    found.sort_by_key(|(count, _)| 2 * count < most);
    found.into_iter().map(|(_, measure)| measure).take(3).collect()
}
