//! Few trials: no standard error before its formula means something, no rule that stops on one, no number that is not
//! there. And studies that ask for more memory than there is.

use super::{Place, stderr, stdout, succeeds};
use crate::common::table::Table;
use serde_json::Value;

fn json(place: &Place, name: &str) -> Value {
    let text = std::fs::read_to_string(place.path(name)).expect("a file");
    serde_json::from_str(&text).expect("JSON")
}

/// A median known to 1 % needs thousands of trials here; one value looks exact, since nothing scatters.
#[test]
fn a_rule_does_not_stop_before_there_is_an_error() {
    let place = Place::new();
    for statistic in ["median", "mean", "rmse"] {
        let text = format!(
            "[settings]\nwindow = 98\neta = 10\n[trials]\nuntil = \"e_a\"\noutput = \"iv(4)\"\n\
             statistic = \"{statistic}\"\nrelative_mcse = 0.01\nminimum = 1\nmaximum = 64"
        );
        place.write("rule.toml", text.as_bytes());
        succeeds(&place.run(&["run", "rule.toml", "--out", statistic]));
        let manifest = json(&place, &format!("{statistic}/manifest.json"));
        assert_eq!(manifest["trials"], 64, "{statistic}");
    }
    // Any error will do: the first step with one is 8 trials.
    let text = std::fs::read_to_string(place.path("rule.toml")).expect("a file");
    let text = text.replace("\"rmse\"", "\"median\"").replace("0.01", "1e9");
    place.write("any.toml", text.as_bytes());
    succeeds(&place.run(&["run", "any.toml", "--out", "any"]));
    assert_eq!(json(&place, "any/manifest.json")["trials"], 8);
}

/// Every number with the suffix "mcse" in a tree.
fn errors(value: &Value, found: &mut Vec<Value>) {
    match value {
        Value::Object(values) => {
            for (key, value) in values {
                if key == "mcse" {
                    found.push(value.clone());
                }
                errors(value, found);
            }
        }
        Value::Array(values) => values.iter().for_each(|value| errors(value, found)),
        _ => {}
    }
}

#[test]
fn one_trial_has_values_and_no_errors() {
    let place = Place::new();
    let output = place.run(&["reproduce", "--paper", "nikolov", "--trials", "1", "--out", "one"]);
    succeeds(&output);
    let text = stdout(&output);
    let (table, _) = text.split_once("typical: the lower end").expect("notes");
    // An output's name and the ends of Wilson's intervals have parentheses, errors would.
    let kept = ["iv(4)", "(<", "(>", "(2023)"].iter();
    let table = kept.fold(table.to_owned(), |table, line| table.replace(line, ""));
    assert!(table.contains("e_a     < 0.033  ls") && !table.contains('('), "{table}");

    let mut found = Vec::new();
    errors(&json(&place, "one/summary.json"), &mut found);
    assert!(found.len() > 100 && found.iter().all(Value::is_null));
    let table = Table::read(&place.path("one/summary.parquet"));
    for name in ["mean", "sd", "mse", "rmse", "trimmed", "q05", "q50", "q95"] {
        let column = table.column(&format!("{name}_mcse"));
        assert_eq!(column.null_count(), table.height(), "{name}");
    }
    let output = place.run(&["report", "one"]);
    succeeds(&output);
    let page = std::fs::read_to_string(place.path("one/report.html")).expect("a page");
    assert!(!page.contains("NaN"), "a number that is not there");
}

/// Too little memory under a limit is told in a line, not by the allocator.
#[cfg(target_os = "linux")]
#[test]
fn what_does_not_fit_into_memory_is_refused_in_a_line() {
    let place = Place::new();
    for (engine, horizon) in [("faer", 5_000_000), ("lanes", 1_000_000)] {
        let text = format!(
            "trials = 2\nengine = \"{engine}\"\nmeasures = [\"e_a\"]\n[settings]\nwindow = 98\n\
             horizon = {horizon}\neta = 5"
        );
        place.write("long.toml", text.as_bytes());
        for command in ["run long.toml --threads 2", "check long.toml"] {
            let limited = format!("ulimit -v 150000; exec '{}' {command}", super::PROGRAM);
            let mut shell = std::process::Command::new("sh");
            shell.args(["-c", &limited]).current_dir(place.path(""));
            let output = shell.output().expect("a shell");
            let message = stderr(&output);
            assert_eq!(output.status.code(), Some(2), "{command}: {message}");
            assert_eq!(message.lines().count(), 1, "{command}: {message}");
            let parts = ["asobench: ", "MiB of memory", "are free"];
            assert!(parts.iter().all(|part| message.contains(part)), "{message}");
        }
    }
}
