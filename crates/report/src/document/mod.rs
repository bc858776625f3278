//! The report: a page with figures and tables beside it.

mod answer;
mod bound_grid;
mod bound_shares;
mod coefficient_bias;
mod coefficient_coverage;
mod courses;
mod extremes;
mod figures;
mod judged;
mod layout;
mod method_times;
mod paper;
mod passes;
mod simulated;
mod state_error;
mod tables;
#[cfg(test)]
pub(super) mod tests;

use super::html::{Page, Section};
use super::results::Study;
use asobench_study::study::Measure;
use asobench_study::text::grouped;
pub use courses::course_figures;
use extremes::LongTable;
use figures::Drawn;
use std::collections::HashMap;

/// The files of a report: name relative to its folder, content.
pub type Files = Vec<(String, String)>;

/// Largest number of outputs in a figure.
const OUTPUTS: usize = 8;

/// The outputs that figures and the page's tables show, with their places in the palette. If there are many, these are
/// the outputs named by claims and the last pass of every other estimator.
pub(super) fn lead_outputs(study: &Study) -> Vec<(usize, String)> {
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
    for output in outputs
        .iter()
        .filter(|output| claimed.contains(&output.label()))
    {
        last.remove(output.estimator.as_str());
    }
    let kept = outputs.iter().filter(|output| {
        few || claimed.contains(&output.label())
            || last.get(output.estimator.as_str()) == Some(&output.pass)
    });
    let kept = kept
        .take(OUTPUTS)
        .map(asobench_study::study::OutputSummary::label);
    kept.enumerate().collect()
}

/// The measures that the study is about, at most three, in a fixed order. Those missing in many cells come last.
fn lead_figures(study: &Study) -> Vec<Measure> {
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
    let mut found: Vec<(usize, Measure)> = Vec::new();
    let others = study
        .file
        .measures
        .iter()
        .copied()
        .filter(|measure| !ORDER.contains(measure));
    for measure in ORDER
        .into_iter()
        .filter(|measure| study.file.measures.contains(measure))
        .chain(others)
    {
        let count = defined(measure);
        if count > 0 {
            found.push((count, measure));
        }
    }
    let most = found.iter().map(|(count, _)| *count).max().unwrap_or(0);
    // A measure that is defined less than half as often as the most frequent one comes after the others.
    found.sort_by_key(|(count, _)| 2 * count < most);
    found
        .into_iter()
        .map(|(_, measure)| measure)
        .take(3)
        .collect()
}

/// Makes a report of studies with different names; calls `on_step` with the name of each step.
pub fn report(studies: &[Study], on_step: &mut dyn FnMut(&str)) -> Files {
    let mut files = Files::new();
    let mut page =
        Page::new("asobench report: what is claimed, and what a typical realisation shows");
    page.introduction(|section| introduction(section, studies));
    if judged::are_there(studies) {
        let [lines, numbers] = ["claims.md", "tables/claims.csv"];
        files.push((lines.to_owned(), judged::markdown(studies)));
        files.push((numbers.to_owned(), judged::csv(studies)));
        page.section("verdicts", "Verdicts", |section| {
            judged::overview(section, studies);
            let what = "claims.csv: every number behind a verdict";
            let mut links = vec![
                (lines.to_owned(), lines.to_owned()),
                (what.to_owned(), numbers.to_owned()),
            ];
            for (path, content) in judged::for_paper(studies) {
                links.push((paper::label(&path, ""), path.clone()));
                files.push((path, content));
            }
            section.files(&links);
        });
    }
    for study in studies {
        page.section(&study.name, study.title(), |section| {
            experiment(section, study, &mut files, on_step);
        });
    }
    files.push((
        asobench_study::files::SIMULATED.to_owned(),
        simulated::markdown(studies),
    ));
    files.push(("report.html".to_owned(), page.html()));
    files
}

fn introduction(section: &mut Section, studies: &[Study]) {
    section.paragraph(
        "Every number comes from simulated trials and has its Monte-Carlo standard error, if \
        there are enough trials for one: 0.0879(5) is 0.0879 with standard error 0.0005. A claim \
        holds or fails only if that is certain at its level, which is 2.5 % unless the file sets \
        another.",
    );
    let trials: u64 = studies.iter().map(Study::trials).sum();
    let mut pairs = vec![
        ("program", format!("asobench {}", env!("CARGO_PKG_VERSION"))),
        ("experiments", studies.len().to_string()),
        ("trials", grouped(trials)),
    ];
    let mut revisions: Vec<&str> = studies
        .iter()
        .filter_map(|study| study.revision.as_deref())
        .collect();
    revisions.sort_unstable();
    revisions.dedup();
    if !revisions.is_empty() {
        let short: Vec<&str> = revisions
            .iter()
            .map(|revision| revision.get(..10).unwrap_or(revision))
            .collect();
        pairs.push(("source of the results", short.join(", ")));
    }
    section.settings(&pairs);
}

/// "20 trials in each of 22 cells."
fn extent(study: &Study) -> String {
    let trials = || study.summary.cells.iter().map(|cell| cell.trials);
    let (least, most) = (trials().min().unwrap_or(0), trials().max().unwrap_or(0));
    let mut text = grouped(least);
    if least < most {
        text += &format!(" to {}", grouped(most));
    }
    let cells = study.summary.cells.len();
    match (most, cells) {
        (1, 1) => "One trial of one cell.".to_owned(),
        (_, 1) => format!("{text} trials of one cell."),
        (1, _) => format!("One trial in each of {} cells.", grouped(cells as u64)),
        _ => format!("{text} trials in each of {} cells.", grouped(cells as u64)),
    }
}

/// The section of one study.
fn experiment(
    section: &mut Section,
    study: &Study,
    files: &mut Files,
    on_step: &mut dyn FnMut(&str),
) {
    let summary = &study.summary;
    if let Some(line) = study.partial_line() {
        section.paragraph(&line);
    }
    if !summary.question.is_empty() {
        section.question(&summary.question);
    }
    if !summary.hypothesis.is_empty() {
        section.paragraph(&format!("Hypothesis: {}", summary.hypothesis));
    }
    section.paragraph(&extent(study));
    on_step(&format!("figures of {}", study.name));
    judged::verdicts(section, study, files);
    section.paragraph(&answer::in_numbers(study));
    if study.judged.is_empty() {
        measures(section, study, files, on_step);
    } else {
        section.details("Pictures and tables of all measures", |section| {
            measures(section, study, files, on_step);
        });
    }
    simulated::section(section, study);
    section.heading("To run it again");
    let (command, folder) = study.command();
    section.code(&format!("{command}\nasobench report {folder}"));
}

/// The section on the measures, independent of claims.
fn measures(
    section: &mut Section,
    study: &Study,
    files: &mut Files,
    on_step: &mut dyn FnMut(&str),
) {
    let mut links = Vec::new();
    for Drawn { name, svg, caption } in figures::figures(study) {
        section.figure(&svg, &caption);
        let path = format!("figures/{}-{name}.svg", study.name);
        links.push((format!("{name}.svg"), path.clone()));
        files.push((path, svg));
    }
    on_step(&format!("tables of {}", study.name));
    numbers(section, study, files, &mut links);
    section.files(&links);
}

/// A longer table is hidden until a click.
const ROWS: usize = 24;

fn numbers(
    section: &mut Section,
    study: &Study,
    files: &mut Files,
    links: &mut Vec<(String, String)>,
) {
    let mut file = |name: &str, title: &str, table: &mut LongTable| {
        let stem = format!("{}-{name}", study.name);
        let mut all = vec![(format!("tables/{stem}.csv"), table.take_csv())];
        if let Some(table) = table.for_paper().filter(|_| paper::NAMES.contains(&name)) {
            all.extend(paper::files(
                &stem,
                &format!("{}: {title}", study.title()),
                table,
            ));
        }
        links.extend(
            all.iter()
                .map(|(path, _)| (paper::label(path, &study.name), path.clone())),
        );
        files.extend(all);
    };
    file("results", "Results", &mut tables::everything(study));
    let shown = [
        (
            "overview",
            "Medians, RMSE, failures",
            Some(tables::overview(study)),
        ),
        (
            "coverage",
            "Coverage of the 95 % intervals",
            tables::coverage(study),
        ),
        ("slopes", "Slopes", tables::slopes(study)),
        ("bounds", "Bounds", tables::bounds(study)),
        (
            "comparisons",
            "Comparisons on the same trials",
            tables::comparisons(study),
        ),
        ("times", "Times", tables::times(study)),
        ("failures", "Failures by kind", tables::failures(study)),
        (
            "failed-trials",
            "Failed trials",
            tables::failed_trials(study),
        ),
    ];
    for (name, title, table) in shown {
        let Some(mut table) = table else {
            if name == "failures" {
                section.paragraph("No trial failed.");
            }
            continue;
        };
        file(name, title, &mut table);
        let count = table.count();
        let (table, note) = table.shown(&format!("{name}.csv below"));
        if count <= ROWS {
            section.heading(title);
            section.table(&table);
        } else {
            section.details(&format!("{title}: {count} rows"), |section| {
                if let Some(note) = &note {
                    section.paragraph(note);
                }
                section.table(&table);
            });
        }
    }
}
