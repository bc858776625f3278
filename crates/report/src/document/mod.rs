//! The report: a page with figures and tables beside it.

mod along;
mod answer;
mod bound_grid;
mod bound_shares;
mod chosen;
mod coefficient_bias;
mod coefficient_coverage;
mod columns;
mod courses;
mod extremes;
mod figure;
mod figures;
mod judged;
mod layout;
pub(crate) mod lead;
mod medians;
mod method_times;
mod nested_loop;
pub(crate) mod paper;
mod passes;
mod simulated;
mod state_error;
mod tables;
#[cfg(test)]
pub(super) mod tests;
mod zip_plot;

use super::folder::Files;
use super::html::{Page, Section};
use super::results::Study;
use asobench_study::text::grouped;
pub use chosen::{Chosen, Kind, Mark, chosen_figure, held};
pub use courses::course_figures;
use extremes::LongTable;
use figure::Drawn;

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
    section.paragraph(&study.extent());
    on_step(&format!("figures of {}", study.name));
    judged::verdicts(section, study, files);
    section.paragraph(&answer::in_numbers(study));
    let mut figures = figures::figures(study).into_iter();
    let mut links = Vec::new();
    let of = |drawn: &Drawn| {
        let file = format!("{}.svg", drawn.name);
        let path = format!("figures/{}-{file}", study.name);
        (file, path)
    };
    // The main figure stays open.
    let main = figures.next();
    links.extend(main.map(|drawn| drawn.placed(section, files, of(&drawn))));
    let rest = |section: &mut Section| {
        links.extend(figures.map(|drawn| drawn.placed(section, files, of(&drawn))));
        on_step(&format!("tables of {}", study.name));
        numbers(section, study, files, &mut links);
        section.files(&links);
    };
    if study.judged.is_empty() {
        rest(section);
    } else {
        section.details("Pictures and tables of all measures", rest);
    }
    simulated::section(section, study);
    if study.unfinished {
        return;
    }
    section.heading("To run it again");
    let (command, folder) = study.command();
    section.code(&format!("{command}\nasobench report {folder}"));
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
        let title = format!("{}: {title}", study.title());
        let all = table.files(&stem, &title, paper::NAMES.contains(&name));
        links.extend(paper::links(&all, &study.name));
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
