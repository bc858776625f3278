//! The report: a page with figures and tables beside it.

pub(crate) mod answer;
mod beside;
mod bound_grid;
mod bound_shares;
mod chosen;
mod coefficients;
pub(crate) mod columns;
mod extremes;
mod figure;
mod figures;
mod judged;
mod layout;
pub(crate) mod lead;
mod medians;
mod method_times;
mod nested_loop;
mod over_time;
pub(crate) mod paper;
mod passes;
mod simulated;
mod tables;
#[cfg(test)]
pub(super) mod tests;
mod zip_plot;

use super::folder::Files;
use super::html::{Page, Section};
use super::results::Study;
use asobench_study::text::grouped;
use beside::Beside;
pub use chosen::{Chosen, Kind, Mark, chosen_figure, held};
use extremes::LongTable;
pub use over_time::course_figures;

/// Makes a report of studies with different names; calls `on_step` with the name of each step.
pub fn report(studies: &[Study], on_step: &mut dyn FnMut(&str)) -> Files {
    let mut files = Files::new();
    let mut page = Page::new(match studies {
        [study] => study.title().to_owned(),
        _ => format!("{} studies: their answers and claims", studies.len()),
    });
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
        let heading = match studies {
            [_] => "Results",
            _ => study.title(),
        };
        page.section(&study.name, heading, |section| {
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
    let mut revisions: Vec<&str> = studies.iter().filter_map(|study| study.revision.as_deref()).collect();
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
fn experiment(section: &mut Section, study: &Study, files: &mut Files, on_step: &mut dyn FnMut(&str)) {
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
    let mut beside = Beside::new(study, files);
    answer(section, study, &mut beside);
    judged::verdicts(section, study, beside.files);
    let mut figures = figures::figures(study).into_iter();
    // The main figure stays open.
    if let Some(drawn) = figures.next() {
        beside.figure(section, &drawn, (&drawn.name, &drawn.name));
    }
    let rest = |section: &mut Section| {
        for drawn in figures {
            beside.figure(section, &drawn, (&drawn.name, &drawn.name));
        }
        on_step(&format!("tables of {}", study.name));
        numbers(section, study, &mut beside);
        section.files(&beside.links);
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
    section.heading("How to cite this");
    section.paragraph(&study.citation());
}

/// The answer in sentences, with the medians of the first measure and the lost trials in tables as papers have them:
/// a row for each cell, a column for each method. The tables of the other first measures are files only.
fn answer(section: &mut Section, study: &Study, beside: &mut Beside<'_>) {
    section.heading("The answer");
    for text in answer::in_numbers(study) {
        section.paragraph(&text);
    }
    let measures = lead::lead_figures(study).into_iter();
    let medians = measures.map(|of| (of.name(), format!("median {of}"), answer::medians(study, of)));
    let lost = std::iter::once(("lost", "lost trials".to_owned(), answer::lost_table(study)));
    for (i, (name, what, table)) in medians.chain(lost).enumerate() {
        let Some(mut table) = table else { continue };
        beside.table(&mut table, name, &format!("{}: {what}", study.title()), true);
        let (file, count) = (format!("{name}.csv below"), table.count());
        match (i == 0 || name == "lost", count <= ROWS) {
            (true, true) => table.show(section, &file),
            (true, false) => {
                let summary = format!("{}: {count} cells", answer::capital(&what));
                section.details(&summary, |section| table.show(section, &file));
            }
            (false, _) => {}
        }
    }
}

/// A longer table is hidden until a click.
const ROWS: usize = 24;

fn numbers(section: &mut Section, study: &Study, beside: &mut Beside<'_>) {
    let mut file = |name: &str, title: &str, table: &mut LongTable| {
        let title = format!("{}: {title}", study.title());
        beside.table(table, name, &title, paper::NAMES.contains(&name));
    };
    file("results", "Results", &mut tables::everything(study));
    let shown = [
        ("overview", "Medians, RMSE, failures", Some(tables::overview(study))),
        ("coverage", "Coverage of the 95 % intervals", tables::coverage(study)),
        ("slopes", "Slopes", tables::slopes(study)),
        ("bounds", "Bounds", tables::bounds(study)),
        (
            "comparisons",
            "Comparisons on the same trials",
            tables::comparisons(study),
        ),
        ("times", "Times", tables::times(study)),
        ("failures", "Failures by kind", tables::failures(study)),
        ("failed-trials", "Failed trials", tables::failed_trials(study)),
    ];
    for (name, title, table) in shown {
        let Some(mut table) = table else {
            if name == "failures" {
                section.paragraph("No trial failed.");
            }
            continue;
        };
        file(name, title, &mut table);
        let (file, count) = (format!("{name}.csv below"), table.count());
        if count <= ROWS {
            section.heading(title);
            table.show(section, &file);
        } else {
            section.details(&format!("{title}: {count} rows"), |section| {
                table.show(section, &file);
            });
        }
    }
}
