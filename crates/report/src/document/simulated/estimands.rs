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
        add(of(*measure), measure.name());
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

/// The estimand of a measure: its name, and what it is in a simulated trial.
fn of(measure: Measure) -> (&'static str, &'static str) {
    use Measure as M;
    match measure {
        M::Ea | M::EaPrinted => ("a", "the last row of the plant's matrix A, n numbers"),
        M::Eb | M::EbPrinted => ("b", "the plant's input vector, n numbers"),
        M::Eh | M::EhPrinted => ("h", "the numerator of the plant's transfer function, n numbers"),
        M::Ex0 | M::Ex0Printed => ("x(0)", "the state of the plant at the first sample"),
        M::ExMax | M::ExMaxPrinted | M::ExRms | M::ExRmsPrinted | M::RmsState => {
            ("state", "the plant's simulated state at every scored sample or time")
        }
        M::RmsState1
        | M::RmsState2
        | M::RmsState3
        | M::RmsState4
        | M::RmsState5
        | M::RmsState6
        | M::RmsState7
        | M::RmsState8 => ("components of the state", "x_1, x_2, ... over the scored time"),
        M::FedBackMax | M::FedBackRms => (
            "states fed back",
            "x(k) of the plant, from the sample at which the loop is closed",
        ),
        M::CourseEa | M::CourseEb | M::SettledA | M::SettledB => (
            "parameters over the samples seen",
            "a(k - 1) and b(k - 1) of the plant, at the points k of [course]",
        ),
        M::CourseEx | M::SettledX => (
            "state over the samples seen",
            "x(k) of the plant, at the points k of [course]",
        ),
        M::Distance => (
            "a and h",
            "the plant's coefficients, weighted by the information of the record",
        ),
        M::ImpulseResponse | M::ResponseDistance => ("impulse response", "that of the plant"),
        M::FreshFit => (
            "noise-free output",
            "that of the plant from rest, under an input of its own",
        ),
        M::FitAhead => ("measured output", "the record's own samples"),
        M::Theta | M::ThetaRms | M::Reaching | M::Settling => {
            ("theta", "x(0) - xi(0), the vector that the observers estimate")
        }
        M::SpectralRadius
        | M::Condition
        | M::InnovationsWhite
        | M::Change
        | M::Frozen
        | M::Adaptation
        | M::Excitation
        | M::MixedDisturbance
        | M::StepError
        | M::StepOrder => ("none", "descriptions of a trial, without a truth to compare with"),
    }
}
