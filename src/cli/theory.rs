//! `asobench theory`: prints limits, asymptotic accuracy and Cramer-Rao bounds of an experiment file's cells.

use super::equation::in_lines;
use super::error::Error;
use super::groups;
use super::output::{Format, WIDTH, print, print_json};
use super::study_arguments::StudyArguments;
use crate::number::uncertain;
use crate::study::file::Key;
use crate::study::{Cell, Experiment, FoundTheory as Found};
use crate::text::visible;
use crate::theory::{Missing, SmoothMeasure, Theory};
use serde_json::{Map, Value, json};

/// Print the theory of an experiment file's cells as N grows: limits of biased estimates, sqrt(N)
/// times the rms of the errors, Cramer-Rao bounds
#[derive(clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    /// Form of the output: text or json
    #[arg(long, value_name = "FORMAT", default_value_t)]
    format: Format,
}

/// The quantiles of an error's distribution in the JSON output.
const QUANTILES: [(&str, f64); 3] = [("0.1", 0.1), ("0.5", 0.5), ("0.9", 0.9)];

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let folder = arguments.study.folder(None);
    let (experiment, _) = arguments.study.experiment(&folder)?;
    let cells = experiment.cells.iter().enumerate();
    match arguments.format {
        Format::Json => {
            let cells: Vec<Value> = cells
                .map(|(number, cell)| of_cell_as_json(&experiment, cell, experiment.theory(number)))
                .collect();
            print_json(&json!({ "cells": cells }))?;
        }
        Format::Text => {
            print(HEAD)?;
            // Limits do not depend on N, so cells that differ in it share a table.
            let mut tables = Vec::new();
            for (number, cell) in cells {
                let table = table(experiment.theory(number));
                groups::add(&mut tables, (differences(&experiment, cell), table), number);
            }
            for ((settings, table), cells) in tables {
                print(&(heading(&cells, &settings) + &table))?;
            }
        }
    }
    Ok(())
}

fn of_cell_as_json(experiment: &Experiment, cell: &Cell, found: &Found) -> Value {
    let settings = json!(cell.settings);
    match found {
        Err(why) => {
            let outputs = experiment.outputs().into_iter();
            let outputs: Vec<Value> = outputs.map(|of| of_output_as_json(&of.label(), None)).collect();
            let bounds = json!({ "shared": null, "separate": null });
            json!({ "settings": settings, "outputs": outputs, "bounds": bounds, "why": why.to_string() })
        }
        Ok(theory) => {
            let outputs = theory.outputs.iter();
            let outputs = outputs.map(|(label, of)| of_output_as_json(label, Some(of)));
            json!({
                "settings": cell.settings,
                "outputs": outputs.collect::<Vec<Value>>(),
                "bounds": {
                    "shared": of_bound_as_json(&theory.shared),
                    "separate": of_bound_as_json(&theory.separate),
                },
                "optimal_iv": of_bound_as_json(&theory.optimal_instruments),
            })
        }
    }
}

fn of_output_as_json(label: &str, theory: Option<&Result<Theory, Missing>>) -> Value {
    let mut entry = json!({ "output": label, "limit": null, "sqrt_n_rms": null, "trace": null });
    match theory {
        None => {}
        Some(Err(why)) => entry["why"] = json!(why.to_string()),
        Some(Ok(theory)) => {
            if !theory.is_consistent {
                let of = |theory: &Theory, measure| Some(theory.figure(measure)?.limit);
                entry["limit"] = json!(of_measures(theory, of));
            }
            for (key, value) in accuracy(theory) {
                entry[key] = value;
            }
        }
    }
    entry
}

fn of_bound_as_json(bound: &Result<Theory, Missing>) -> Value {
    match bound {
        Ok(theory) => Value::Object(accuracy(theory)),
        Err(_) => Value::Null,
    }
}

/// Returns a value of every measure. The error of the initial state has no rate sqrt(N), so it is null.
fn of_measures(theory: &Theory, of: impl Fn(&Theory, SmoothMeasure) -> Option<f64>) -> Value {
    let measures = SmoothMeasure::ALL.iter();
    let entries = measures.map(|measure| (measure.name().to_owned(), json!(of(theory, *measure))));
    let mut entries: Map<String, Value> = entries.collect();
    entries.insert("e_x0".to_owned(), Value::Null);
    Value::Object(entries)
}

fn accuracy(theory: &Theory) -> Map<String, Value> {
    let rms = |theory: &Theory, measure| Some(theory.figure(measure)?.sqrt_n_rms);
    let quantiles = QUANTILES.map(|(name, p)| {
        let of = |theory: &Theory, measure| Some(theory.figure(measure)?.quantile(p));
        (name.to_owned(), of_measures(theory, of))
    });
    let quantiles = Map::from_iter(quantiles);
    Map::from_iter([
        ("sqrt_n_rms".to_owned(), of_measures(theory, rms)),
        ("trace".to_owned(), json!(theory.trace)),
        ("sqrt_n_quantiles".to_owned(), Value::Object(quantiles)),
    ])
}

const HEAD: &str = "\
As N grows: the limit of e_a where an estimate is biased, then sqrt(N) times the
rms of its errors about the limit and the median of e_a, and the trace of N cov.

";

/// Columns of an output's label.
const LABEL: usize = 24;

/// Cells with one table, and their settings.
fn heading(cells: &[usize], settings: &[String]) -> String {
    let is_range = cells.windows(2).all(|pair| pair[1] == pair[0] + 1);
    let text = match cells {
        [cell] => format!("cell {cell}"),
        [first, .., last] if is_range => format!("cells {first} to {last}"),
        _ => {
            let numbers: Vec<String> = cells.iter().map(ToString::to_string).collect();
            format!("cells {}", numbers.join(", "))
        }
    };
    let words = settings.iter().map(|word| format!("  {}", visible(word)));
    let lines = in_lines(words, WIDTH, text.len(), 3);
    format!("{text}{lines}\n")
}

/// A table of 80 columns.
fn table(found: &Found) -> String {
    let theory = match found {
        Err(why) => return format!("  no theory: {why}\n\n"),
        Ok(theory) => theory,
    };
    let bounds = [
        ("optimal IV", &theory.optimal_instruments),
        ("bound: shared", &theory.shared),
        ("bound: separate", &theory.separate),
    ];
    let outputs = theory.outputs.iter().map(|(label, theory)| (label.as_str(), theory));
    let lines = outputs.chain(bounds).map(|(label, theory)| line(label, theory));
    let head = row(
        "output",
        &["limit", "e_a", "median", "e_b", "e_h", "trace"].map(str::to_owned),
    );
    format!("{head}{}\n", lines.collect::<String>())
}

/// Returns a line with a label and text beside it. A long label gets its own line.
fn beside(label: &str, rest: &str) -> String {
    let label = visible(label);
    if label.chars().count() > LABEL {
        format!("  {label}\n  {:LABEL$}{rest}\n", "")
    } else {
        format!("  {label:<LABEL$}{rest}\n")
    }
}

fn row(label: &str, values: &[String; 6]) -> String {
    let values: Vec<String> = values.iter().map(|value| format!(" {value:>8}")).collect();
    beside(label, &values.concat())
}

fn line(label: &str, theory: &Result<Theory, Missing>) -> String {
    let theory = match theory {
        Err(why) => return beside(label, &format!("  {why}")),
        Ok(theory) => theory,
    };
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| uncertain(v, 0.0));
    let rms = |measure| number(theory.figure(measure).map(|figure| figure.sqrt_n_rms));
    let of_a = theory.figure(SmoothMeasure::Ea);
    let limit = of_a.filter(|_| !theory.is_consistent).map(|a| a.limit);
    let values = [
        number(limit),
        rms(SmoothMeasure::Ea),
        number(of_a.map(|a| a.quantile(0.5))),
        rms(SmoothMeasure::Eb),
        rms(SmoothMeasure::Eh),
        number(Some(theory.trace)),
    ];
    row(label, &values)
}

/// The settings that vary, but the window, on which no limit depends: "noise = white".
fn differences(experiment: &Experiment, cell: &Cell) -> Vec<String> {
    let keys = Key::ALL.iter();
    let others = keys.filter(|key| ![Key::Window, Key::L].contains(key));
    let varying = others.filter(|key| {
        let mut cells = experiment.cells.iter().map(|cell| cell.settings.get(key));
        let first = cells.next();
        cells.any(|value| Some(value) != first)
    });
    let words = varying.filter_map(|key| Some(format!("{key} = {}", cell.settings.get(key)?)));
    words.collect()
}
