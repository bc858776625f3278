//! A study's simulation, from the experiment file in its manifest, in the order of Morris, White and Crowther, Using
//! simulation studies to evaluate statistical methods, Statistics in Medicine 38 (2019) 2074-2102: aims,
//! data-generating mechanisms, estimands, methods, performance measures.

mod mechanisms;
mod performance;
mod words;

use crate::html::{CellText, Column, Section, Table, markdown_text};
use crate::results::Study;
use asobench_identification::estimator::EstimatorName;
use asobench_study::files::SIMULATED_TITLE;
use asobench_study::study::Measure;
use asobench_study::study::file::MethodTable;
use mechanisms::{is_of_methods, is_of_truth, settings};
use serde_json::{Map, Value};
use words::{Part, Row, at_most, listed, pairs, row, table};

const ORDER: &str = "In the order of Morris, White and Crowther (2019). Names are those of the keys in the experiment \
    file, in parentheses units; `asobench explain NAME` says more of each.";

fn parts(study: &Study) -> [Part; 5] {
    [
        aims(study),
        mechanisms::part(study),
        estimands(study),
        methods(study),
        performance::part(study),
    ]
}

/// Adds the description to the section of a study. Defaults are hidden until a click.
pub(super) fn section(section: &mut Section, study: &Study) {
    section.heading("What was simulated");
    section.paragraph(ORDER);
    for part in parts(study) {
        section.subheading(part.heading);
        section.settings(&part.rows);
        if !part.defaults.is_empty() {
            let summary = format!("Defaults: {}", part.defaults.len());
            section.details(&summary, |section| section.settings(&part.defaults));
        }
    }
}

/// The description of every study as Markdown, a table for each part; defaults come last.
pub(super) fn markdown(studies: &[Study]) -> String {
    let mut text = format!("{SIMULATED_TITLE}\n{ORDER} Defaults come last.\n");
    for study in studies {
        text.push_str(&format!("\n## {}\n", markdown_text(study.title())));
        for part in parts(study) {
            let mut table = Table::new("", ["term", "value"].map(Column::text).to_vec());
            let defaults = part.defaults.into_iter();
            let defaults = defaults.map(|(term, value)| (term, format!("{value}; default")));
            for (term, value) in part.rows.into_iter().chain(defaults) {
                table.row([term, value].map(CellText::text));
            }
            text.push_str(&format!("\n### {}\n\n{}", part.heading, table.markdown()));
        }
    }
    text
}

/// Aims: the question, the hypothesis and the claims.
fn aims(study: &Study) -> Part {
    let file = &study.file;
    let given = [
        ("title", &file.title),
        ("question", &file.question),
        ("hypothesis", &file.hypothesis),
    ];
    let mut rows: Vec<Row> = given
        .into_iter()
        .filter(|(_, text)| !text.is_empty())
        .map(|(term, text)| row(term, text))
        .collect();
    let claims = file.claims.iter().map(|claim| {
        let mut text = if claim.text.is_empty() {
            "without words".to_owned()
        } else {
            claim.text.clone()
        };
        text.push_str(&format!(" (source: {})", claim.source));
        if claim.added_after_run {
            text.push_str(" Added or changed after the run.");
        }
        row(format!("claim {}", claim.id), text)
    });
    rows.extend(at_most(claims.collect()));
    if rows.is_empty() {
        rows.push(row("aims", "the file states none"));
    }
    Part::new("Aims", rows, Vec::new())
}

/// Estimands: the truths that the measures of a study compare estimates with.
fn estimands(study: &Study) -> Part {
    let file = &study.file;
    let mut rows: Vec<Row> = Vec::new();
    let mut add = |(term, truth): (&str, &str), by: &str| match rows.iter_mut().find(|(known, _)| known == term) {
        Some((_, value)) => value.push_str(&format!(", {by}")),
        None => rows.push(row(term, format!("{truth}. Measured by: {by}"))),
    };
    for measure in &file.measures {
        if let Some(truth) = estimand(*measure) {
            add(truth, measure.name());
        }
    }
    if file.parameters || file.coverage {
        add(
            ("each coefficient", "the true a_i and h_i of the plant"),
            "its signed error",
        );
    }
    let (given, defaults) = settings(study, is_of_truth);
    rows.extend(given);
    Part::new("Estimands", rows, defaults)
}

/// The estimands: of each a line with its name, what it is in a simulated trial, and the measures of it.
const ESTIMANDS: &str = include_str!("estimands.txt");

/// The estimand of a measure: its name, and what it is in a simulated trial.
fn estimand(measure: Measure) -> Option<(&'static str, &'static str)> {
    ESTIMANDS.lines().find_map(|line| {
        let (estimand, measures) = line.rsplit_once(" | ")?;
        measures.split(' ').find(|name| *name == measure.name())?;
        estimand.split_once(" | ")
    })
}

/// Methods with their settings as resolved.
fn methods(study: &Study) -> Part {
    let file = &study.file;
    let methods = file.methods.iter().map(|of| row(of.output_name(1), method(of)));
    let mut rows: Vec<Row> = at_most(methods.collect());
    let observers = file.observers.iter();
    let observers = observers.map(|of| row(of.label(), table(of, &["name"])));
    rows.extend(at_most(observers.collect()));
    let labels = listed(study.labels().iter().cloned(), " \u{b7} ");
    rows.push(row(
        "outputs",
        format!("{labels} (a method and its pass, or an observer)"),
    ));
    let (given, defaults) = settings(study, is_of_methods);
    rows.extend(given);
    Part::new("Methods", rows, defaults)
}

/// A method: what differs from the defaults of its estimator, then the defaults.
fn method(method: &MethodTable) -> String {
    let Ok(Value::Object(mut options)) = serde_json::to_value(method) else {
        return String::new();
    };
    options.shift_remove("name");
    let estimator = options.get("estimator").and_then(Value::as_str);
    let estimator = estimator.and_then(|name| name.parse::<EstimatorName>().ok());
    let entries = estimator.map(EstimatorName::options).unwrap_or_default();
    let is_default = |key: &str, value: &Value| {
        let mut entries = entries.iter();
        entries.any(|entry| entry.key == key && entry.default == *value)
    };
    let split: (Map<_, _>, Map<_, _>) = options.into_iter().partition(|(key, value)| !is_default(key, value));
    let (given, defaults) = split;
    let mut text = pairs(given.iter());
    if !defaults.is_empty() {
        text.push_str(&format!("; defaults: {}", pairs(defaults.iter())));
    }
    text
}

#[cfg(test)]
mod tests;
