//! `asobench methods`: prints the estimators with their options, from the registry.

use super::error::Error;
use super::estimate::estimator;
use super::output::{print, wrapped};
use crate::estimator::{EstimatorName, OptionEntry};
use serde_json::{Map, Value};

/// Columns of an option's name and default.
const COLUMNS: usize = 34;

/// The alternative to an estimator.
const PROGRAMS: &str = "instead of estimator, a program of your own in any language, with a name: \
    docs/protocol.md; asobench test-method FILE tests it";

/// Print the estimators with their options
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Only these, such as oe
    #[arg(value_name = "NAME", value_parser = estimator)]
    names: Vec<EstimatorName>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let names = match arguments.names.as_slice() {
        [] => EstimatorName::ALL,
        names => names,
    };
    let mut texts: Vec<String> = names.iter().copied().map(described).collect();
    if arguments.names.is_empty() {
        texts.push(filled("command: ", PROGRAMS, 2));
    }
    print(&texts.join("\n"))
}

/// Describes an estimator and its options.
pub(super) fn described(estimator: EstimatorName) -> String {
    let default = estimator.parse(Map::new());
    let records = if default.is_ok_and(|options| options.takes_runs()) {
        " Fits several records of a plant too, and the parts of one between gaps."
    } else {
        ""
    };
    let about = format!("{}{records}", estimator.about());
    let mut text = filled(&format!("{estimator}: "), &about, 2);
    for option in estimator.options() {
        let OptionEntry {
            key, about, default, ..
        } = option;
        let default = match default {
            Value::Null => String::new(),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let head = format!("  {:<31} ", format!("{key} = {default}").trim_end_matches(" = "));
        text.push_str(&filled(&head, about, COLUMNS));
    }
    text
}

/// A text beside its head; the further lines are indented.
pub(super) fn filled(head: &str, words: &str, indent: usize) -> String {
    let words: Vec<&str> = words.split_whitespace().collect();
    wrapped(&(head.to_owned() + &words.join(" ")), &" ".repeat(indent))
}
