//! The trials of a study that failed, as text: by cell, output and kind.

use crate::results::{Study, placed};
use asobench_identification::names::UnknownName;
use asobench_study::study::{CellSummary, OutputSummary};
use asobench_study::text::{folded, grouped, visible, wrap};

/// Columns of a terminal.
const WIDTH: usize = 80;

/// Lists the failures of a study, the most frequent first, each with its first trials and the command that shows the
/// first of them. `method`: only outputs with this label, or of this method.
///
/// # Errors
/// [`UnknownName`] if no output has that name.
pub fn failures(study: &Study, method: Option<&str>) -> Result<String, UnknownName> {
    let is_asked = |output: &OutputSummary| {
        method.is_none_or(|name| {
            [&output.label(), &output.estimator]
                .iter()
                .any(|own| folded(own) == folded(name))
        })
    };
    let all = study.all_outputs().filter(|of| is_asked(of.1));
    let all: Vec<(&CellSummary, &OutputSummary)> = all.collect();
    if let (Some(name), true) = (method, all.is_empty()) {
        return Err(UnknownName::new("output", name, study.labels()));
    }
    let mut found: Vec<(u64, String)> = Vec::new();
    for (cell, output) in &all {
        for (kind, count) in &output.outcomes.failures {
            let trials = output.outcomes.failed_trials.get(kind).map_or(&[][..], Vec::as_slice);
            found.push((*count, one(study, cell, output, (kind, *count, trials))));
        }
    }
    found.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    let unstable: u64 = all.iter().map(|(_, output)| output.outcomes.unstable).sum();
    let trials: u64 = all.iter().map(|(_, output)| output.outcomes.trials).sum();
    let mut text = match found.len() {
        0 => format!("No failure among {} estimates.\n", grouped(trials)),
        _ => found.into_iter().map(|(_, text)| text).collect(),
    };
    if unstable > 0 {
        let (unstable, trials) = (grouped(unstable), grouped(trials));
        let line = format!("Besides, {unstable} of {trials} models are unstable; such a model keeps its measures.");
        text.push_str(&(wrap(&line, WIDTH, "  ")));
    }
    Ok(text)
}

/// Describes the failures of one kind of an output in a cell.
fn one(
    study: &Study,
    cell: &CellSummary,
    output: &OutputSummary,
    (kind, count, trials): (&str, u64, &[u64]),
) -> String {
    let at = placed(cell, &study.varying(), |place| format!("{place}, "));
    let listed: Vec<String> = trials.iter().map(u64::to_string).collect();
    let more = if count > trials.len() as u64 { ", ..." } else { "" };
    let head = format!(
        "{at}{}: {kind} in {} of {} trials: {}{more}",
        output.label(),
        grouped(count),
        grouped(output.outcomes.trials),
        listed.join(", ")
    );
    let command = trials.first().map_or_else(String::new, |first| {
        format!("  {}\n", visible(study.replay_command(cell.cell, *first)))
    });
    wrap(&visible(head), WIDTH, "    ") + &command
}
