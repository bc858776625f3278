//! The report as a page with figures and tables beside it.

mod answer;
mod courses;
mod extremes;
mod figures;
mod judged;
mod layout;
mod map;
mod tables;
#[cfg(test)]
pub(super) mod tests;
mod traces;

use super::claims::Claim;
use super::html::{CellText, Column, Page, Section, Table, Verdict, markdown_text};
use super::results::{Study, shown};
use super::shipped::Shipped;
use crate::study::Measure;
use crate::study::file::Key;
use crate::text::visible;
pub use courses::course_figures;
use extremes::LongTable;
use figures::Drawn;
use std::collections::HashMap;
use std::fmt::Write;

/// The files of a report: name relative to its folder, content.
pub type Files = Vec<(String, String)>;

/// Most outputs that a picture shows.
const OUTPUTS: usize = 8;

/// The outputs that figures and the page's tables show, with their place in the palette: all if they are few, else
/// the fourth pass (the last where there is no fourth) of every estimator.
pub(super) fn lead_outputs(study: &Study) -> Vec<(usize, String)> {
    let Some(cell) = study.summary.cells.first() else {
        return Vec::new();
    };
    let outputs = &cell.outputs;
    let few = outputs.len() <= 3;
    // The fourth pass of each estimator, or the last one.
    let mut last: HashMap<&str, usize> = HashMap::new();
    for of in outputs {
        let known = last.entry(&of.estimator).or_insert(of.pass);
        if of.pass == 4 || *known != 4 && of.pass > *known {
            *known = of.pass;
        }
    }
    let kept = outputs
        .iter()
        .filter(|of| few || last.get(of.estimator.as_str()) == Some(&of.pass));
    let kept = kept.take(OUTPUTS).map(crate::study::OutputSummary::label);
    kept.enumerate().collect()
}

/// The figures of merit that the study is about, at most three: those that most cells have, errors of a first.
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
        let of = cells.flat_map(|cell| {
            let outputs = outputs.iter();
            outputs.filter_map(move |(_, label)| study.statistics(cell, label, measure))
        });
        of.filter(|of| of.q50.value.is_finite()).count()
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
    // A measure that half of the cells lack stands behind the others.
    found.sort_by_key(|(count, _)| 2 * count < most);
    found
        .into_iter()
        .map(|(_, measure)| measure)
        .take(3)
        .collect()
}

/// Makes a report of studies whose names differ; `on_step` hears what comes next.
pub fn report(studies: &[Study], claims: &[Claim], on_step: &mut dyn FnMut(&str)) -> Files {
    let mut files = Files::new();
    let mut page =
        Page::new("asobench report: what is claimed, and what a typical realisation shows");
    page.introduction(|section| introduction(section, studies));
    let own = studies.iter().any(|study| !study.judged.is_empty());
    if own || claims.iter().any(Claim::is_judged) {
        page.section("verdicts", "Verdicts", |section| {
            judged::overview(section, studies);
            verdicts(section, claims, studies, &mut files);
        });
        files.push(("claims.md".to_owned(), markdown(claims, studies)));
    }
    let mut order: Vec<&Study> = studies.iter().collect();
    order.sort_by_key(|study| Shipped::place(study.shipped));
    for study in order {
        page.section(&study.name, study.title(), |section| {
            experiment(section, study, claims, &mut files, on_step);
        });
    }
    files.push(("report.html".to_owned(), page.html()));
    files
}

fn introduction(section: &mut Section, studies: &[Study]) {
    section.paragraph(
        "Every number is made of simulated trials and has its Monte-Carlo standard error, where there are enough trials for one: 0.0879(5) is 0.0879 with standard error 0.0005. A claim holds or does not only where a 95 % interval excludes the alternative.",
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

/// "12,000".
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

fn verdicts(section: &mut Section, all: &[Claim], studies: &[Study], files: &mut Files) {
    // The verdict stands early: on a narrow screen the end of a row is out of sight.
    let columns = ["claim", "verdict", "what it says", "experiment"]
        .map(Column::text)
        .to_vec();
    let row = |claim: &Claim| {
        let of = studies.iter().find(|study| study.name == claim.experiment);
        let experiment = of.map_or_else(
            || CellText::text(&claim.experiment),
            |study| CellText::text(study.title()).link(format!("#{}", study.name)),
        );
        [
            CellText::text(claim.id),
            CellText::verdict(claim.verdict),
            CellText::text(claim.text),
            experiment,
        ]
    };
    for (letter, caption, heading) in [
        (
            'C',
            "The claims of Nikolov et al. with what the results say.",
            "Why",
        ),
        (
            'B',
            "The claims of Bobtsov et al. (GPEBO) with what the results say.",
            "Why",
        ),
        ('K', "A law of observers that results must obey.", "Why"),
        (
            'E',
            "Readings of the errata: does the reading make no difference?",
            "Why, reading by reading",
        ),
    ] {
        let claims: Vec<&Claim> = all
            .iter()
            .filter(|claim| claim.id.starts_with(letter) && claim.is_judged())
            .collect();
        if claims.is_empty() {
            continue;
        }
        let mut table = Table::new(caption, columns.clone());
        for claim in &claims {
            table.row(row(claim));
        }
        section.table(&table);
        let why =
            |claim: &Claim| format!("{}, {}: {}", claim.id, claim.verdict.name(), claim.because);
        let why: Vec<String> = claims.into_iter().map(why).collect();
        if letter == 'E' {
            section.details(heading, |section| section.list(&why));
        } else {
            section.heading(heading);
            section.list(&why);
        }
    }
    let mut numbers = Table::new(
        "",
        vec![
            Column::text("claim"),
            Column::text("number"),
            Column::number("value", ""),
            Column::number("MCSE", ""),
        ],
    );
    for claim in all {
        for number in &claim.numbers {
            let value = |x: f64| CellText::number("", x);
            numbers.row([
                CellText::text(claim.id),
                CellText::text(number.name.clone()),
                value(number.value),
                value(number.mcse),
            ]);
        }
    }
    files.push(("tables/claims.csv".to_owned(), numbers.csv()));
    section.files(&[
        ("claims.md", "claims.md"),
        (
            "claims.csv: every number behind a verdict",
            "tables/claims.csv",
        ),
    ]);
}

/// The section of one study.
fn experiment(
    section: &mut Section,
    study: &Study,
    claims: &[Claim],
    files: &mut Files,
    on_step: &mut dyn FnMut(&str),
) {
    let summary = &study.summary;
    if !summary.question.is_empty() {
        section.question(&summary.question);
    }
    if !summary.hypothesis.is_empty() {
        section.paragraph(&format!("Hypothesis: {}", summary.hypothesis));
    }
    let own: Vec<&Claim> = claims
        .iter()
        .filter(|claim| claim.experiment == study.name)
        .collect();
    for claim in claims {
        for (_, sentence) in claim.parts.iter().filter(|(name, _)| *name == study.name) {
            section.answer(claim.verdict, &format!("{}: {sentence}", claim.id));
        }
    }
    let named = own.iter().filter(|claim| !claim.id.starts_with('E'));
    for claim in named {
        section.answer(claim.verdict, &format!("{}: {}", claim.id, claim.because));
    }
    for claim in own.iter().filter(|claim| claim.id.starts_with('E')) {
        section.answer(
            claim.verdict,
            &format!("{}: {} {}", claim.id, claim.text, claim.because),
        );
    }
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
    settings(section, study);
    section.heading("To run it again");
    let (command, folder) = study.command();
    section.code(&format!("{command}\nasobench report {folder}"));
}

/// What the study says of its measures, whatever is claimed.
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

/// More rows than this are seen after a click only.
const ROWS: usize = 24;

fn numbers(
    section: &mut Section,
    study: &Study,
    files: &mut Files,
    links: &mut Vec<(String, String)>,
) {
    let mut file = |name: &str, table: &mut LongTable| {
        let path = format!("tables/{}-{name}.csv", study.name);
        files.push((path.clone(), table.take_csv()));
        links.push((format!("{name}.csv"), path));
    };
    file("results", &mut tables::everything(study));
    let shown = [
        (
            "overview",
            "Medians, RMSE, failures",
            Some(tables::overview(study)),
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
    ];
    for (name, title, table) in shown {
        let Some(mut table) = table else {
            if name == "failures" {
                section.paragraph("No trial failed.");
            }
            continue;
        };
        file(name, &mut table);
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

/// Values of a setting, and methods, that a page lists.
const MOST: usize = 40;

fn settings(section: &mut Section, study: &Study) {
    let varying = study.varying();
    section.details("Settings and methods", |section| {
        let mut pairs: Vec<(String, String)> = Vec::new();
        for key in Key::ALL.iter().filter(|key| **key != Key::L) {
            let values = study.values(*key);
            let text = listed(values);
            if !text.is_empty() && (varying.contains(key) || values.len() == 1) {
                pairs.push((key.name().replace('_', " "), text));
            }
        }
        let trials: Vec<u64> = study.summary.cells.iter().map(|cell| cell.trials).collect();
        let [least, most] =
            [trials.iter().min(), trials.iter().max()].map(|x| grouped(x.copied().unwrap_or(0)));
        let trials = if least == most {
            least
        } else {
            format!("{least} to {most}")
        };
        pairs.extend([
            ("cells".to_owned(), study.summary.cells.len().to_string()),
            ("trials in a cell".to_owned(), trials),
            ("seed".to_owned(), study.summary.seed.to_string()),
            ("version".to_owned(), study.version.clone()),
        ]);
        section.settings(&pairs);
        let methods = study
            .file
            .methods
            .iter()
            .map(|of| method(&of.output_name(1), of));
        let observers = study
            .file
            .observers
            .iter()
            .map(|of| method(&of.label(), of));
        let mut all: Vec<String> = methods.chain(observers).collect();
        if all.len() > MOST {
            let left = all.len() - MOST;
            all.truncate(MOST);
            all.push(format!("{left} more, in manifest.json"));
        }
        section.list(&all);
    });
}

/// Values with dots between them; of many the first and the last.
fn listed(values: &[String]) -> String {
    const DOT: &str = " \u{b7} ";
    if values.len() <= MOST {
        return values.join(DOT);
    }
    let (first, last) = (&values[..MOST / 2], &values[values.len() - MOST / 2..]);
    format!(
        "{}{DOT}...{DOT}{} ({} values)",
        first.join(DOT),
        last.join(DOT),
        values.len()
    )
}

/// A method or an observer with its options.
fn method(name: &str, table: &impl serde::Serialize) -> String {
    let mut text = format!("`{name}`");
    if let Ok(serde_json::Value::Object(options)) = serde_json::to_value(table) {
        let shown = options
            .iter()
            .filter(|(key, _)| *key != "name" && *key != "report");
        let words = shown.map(|(key, value)| {
            let value = value
                .as_str()
                .map_or_else(|| value.to_string(), str::to_owned);
            format!("{} {value}", key.replace('_', " "))
        });
        let words: Vec<String> = words.collect();
        text.push_str(&format!(": {}", words.join(", ")));
    }
    text
}

/// The verdict table and the sentence behind each, for documents.
fn markdown(claims: &[Claim], studies: &[Study]) -> String {
    let columns = ["claim", "what it says", "verdict", "experiment"]
        .map(Column::text)
        .to_vec();
    let mut table = Table::new("", columns);
    let (judged, others): (Vec<&Claim>, Vec<&Claim>) =
        claims.iter().partition(|claim| claim.is_judged());
    for claim in &judged {
        table.row([
            CellText::text(claim.id),
            CellText::text(claim.text),
            CellText::verdict(claim.verdict),
            CellText::text(&claim.experiment),
        ]);
    }
    let mut text = format!("# Verdicts\n\n{}\n", table.markdown());
    if !others.is_empty() {
        let ids: Vec<&str> = others.iter().map(|claim| claim.id).collect();
        let _ = writeln!(
            text,
            "No experiment in this report speaks to {}.\n",
            ids.join(", ")
        );
    }
    for claim in studies.iter().flat_map(|study| &study.judged) {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{}\n", markdown_text(&claim.line));
    }
    for claim in judged {
        let verdict: Verdict = claim.verdict;
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "**{}: {}.** {}\n",
            claim.id,
            verdict.name(),
            visible(&claim.because)
        );
    }
    text.truncate(text.trim_end().len());
    text.push('\n');
    text
}
