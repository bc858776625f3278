//! The results of a study in sentences with numbers.

use super::layout::x_key;
use super::lead::lead_figures;
use crate::results::{Study, place, words};
use asobench_identification::metric::Quantile;
use asobench_identification::number::uncertain;
use asobench_study::study::file::Key;
use asobench_study::study::{Better, CellSummary, Measure};
use std::collections::BTreeMap;

/// All sentences.
pub(super) fn in_numbers(study: &Study) -> String {
    let (Some(measure), Some(output)) = (lead_figures(study).first().copied(), study.main_output())
    else {
        return "No output has a measure in any cell.".to_owned();
    };
    let mut text = format!("In numbers: {}", extremes(study, measure, &output));
    text.push_str(&best(study, measure, &output));
    text.push_str(&paired(study, measure));
    text.push_str(&failures(study));
    text
}

fn text(median: Quantile) -> String {
    uncertain(median.value, median.mcse)
}

/// The smallest and the largest median over the cells.
fn extremes(study: &Study, measure: Measure, output: &str) -> String {
    let keys = study.varying();
    let mut cells: Vec<(&CellSummary, Quantile)> = study
        .summary
        .cells
        .iter()
        .filter_map(|cell| Some((cell, study.statistics(cell, output, measure)?.q50)))
        .collect();
    cells.retain(|(_, median)| median.value.is_finite());
    cells.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
    let name = measure.label();
    match cells.as_slice() {
        [] => format!("{output} has no {name} in any cell."),
        [(_, median)] => format!("the median {name} of {output} is {}.", text(*median)),
        [(low, least), .., (high, most)] => format!(
            "the median {name} of {output} is from {} ({}) to {} ({}).",
            text(*least),
            place(low, &keys),
            text(*most),
            place(high, &keys)
        ),
    }
}

/// The value on the main axis at which the measure is best, over the combinations of the other settings.
fn best(study: &Study, measure: Measure, output: &str) -> String {
    if measure.entry().better == Better::Neither {
        return String::new();
    }
    let Some(key) = x_key(study).filter(|key| *key != Key::Claim && study.values(*key).len() > 2)
    else {
        return String::new();
    };
    let others: Vec<Key> = study
        .varying()
        .into_iter()
        .filter(|other| *other != key)
        .collect();
    let mut groups: BTreeMap<Vec<usize>, Vec<&CellSummary>> = BTreeMap::new();
    for cell in &study.summary.cells {
        let group = others.iter().map(|key| study.place(cell, *key));
        groups.entry(group.collect()).or_default().push(cell);
    }
    let mut wins = vec![0; study.values(key).len()];
    for cells in groups.values() {
        let defined = cells
            .iter()
            .filter_map(|cell| {
                let statistics = study.statistics(cell, output, measure)?;
                Some((cell, statistics.q50.value))
            })
            .filter(|(_, x)| x.is_finite());
        let compared = |a: f64, b: f64| match measure.entry().better {
            Better::Larger => b.total_cmp(&a),
            _ => a.total_cmp(&b),
        };
        if let Some((cell, _)) = defined.min_by(|a, b| compared(a.1, b.1)) {
            wins[study.place(cell, key)] += 1;
        }
    }
    let total: usize = wins.iter().sum();
    let most = study.values(key).iter().zip(wins);
    let most = most.max_by_key(|(_, count)| *count);
    let most = most.filter(|(_, count)| *count > 0);
    most.map_or_else(String::new, |(value, count)| {
        let settings = if total == 1 {
            String::new()
        } else {
            format!(" in {count} of {total} combinations of the other settings")
        };
        format!(" It is best at {}{settings}.", words(key, value))
    })
}

/// The results of the comparisons on the same trials.
fn paired(study: &Study, measure: Measure) -> String {
    let mut text = String::new();
    for [first, second] in study.file.compare.iter().take(3) {
        let pairs = study
            .summary
            .cells
            .iter()
            .flat_map(|cell| &cell.comparisons);
        let compared = pairs.filter(|pair| pair.first == *first && pair.second == *second);
        let ratios: Vec<Quantile> = compared
            .filter_map(|pair| Some(pair.measures.get(&measure)?.median_ratio))
            .filter(|ratio| ratio.value.is_finite())
            .collect();
        let (better, worse) = ratios.iter().fold((0, 0), |(better, worse), ratio| {
            let (low, high) = ratio.interval();
            (
                better + usize::from(high < 1.0),
                worse + usize::from(low > 1.0),
            )
        });
        if !ratios.is_empty() {
            text.push_str(&format!(
                " On the same trials the {} of {} is smaller than that of {} in {better} of {} \
                cells and larger in {worse}, by the 95 % interval of the median ratio.",
                measure.label(),
                first,
                second,
                ratios.len()
            ));
        }
    }
    text
}

/// The cell with the most failed trials.
fn failures(study: &Study) -> String {
    let keys = study.varying();
    let outputs = study.all_outputs();
    let most = outputs.max_by(|a, b| a.1.failed.share.total_cmp(&b.1.failed.share));
    match most.filter(|(_, output)| output.failed.count > 0) {
        Some((cell, output)) => format!(
            " Most failures: {} in {}{}.",
            output.label(),
            crate::verdict_table::share(output.failed),
            if keys.is_empty() {
                String::new()
            } else {
                format!(" ({})", place(cell, &keys))
            }
        ),
        None => String::new(),
    }
}
