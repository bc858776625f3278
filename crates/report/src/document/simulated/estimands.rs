//! Estimands: the truths that the measures of a study compare estimates with.

use super::mechanisms::{is_of_truth, settings};
use super::part::{Part, Row, row};
use crate::results::Study;
use asobench_study::study::Measure;

pub(super) fn part(study: &Study) -> Part {
    let file = &study.file;
    let mut rows: Vec<Row> = Vec::new();
    let mut add = |(term, truth): (&str, &str), by: &str| match rows.iter_mut().find(|(known, _)| known == term) {
        Some((_, value)) => value.push_str(&format!(", {by}")),
        None => rows.push(row(term, format!("{truth}. Measured by: {by}"))),
    };
    for measure in &file.measures {
        if let Some(estimand) = of(*measure) {
            add(estimand, measure.name());
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
pub(super) fn of(measure: Measure) -> Option<(&'static str, &'static str)> {
    ESTIMANDS.lines().find_map(|line| {
        let (estimand, measures) = line.rsplit_once(" | ")?;
        measures.split(' ').find(|name| *name == measure.name())?;
        estimand.split_once(" | ")
    })
}
