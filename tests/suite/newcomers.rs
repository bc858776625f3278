//! The errors of newcomers: they are told before a long run, and with their reasons. The workers need Python; where
//! there is none, these tests say so and pass.

use super::root;
use crate::common::{PYTHON, asobench_in as asobench, done_in, runs, stderr, stdout};
use asobench::suite::{MethodResults, Stored};
use std::path::Path;
use std::time::{Duration, Instant};

/// The line of the worker that takes the orders of `hello`, and the one that estimates.
const ORDERS: &str = "na, nb, nk = hello[\"na\"], hello[\"nb\"], hello[\"nk\"]";
const ESTIMATES: &str = "found = [";

/// Writes a worker whose line is another one, with its experiment file. Returns false where there is no Python.
fn written(folder: &Path, line: &str, other: &str) -> bool {
    if !runs(PYTHON) {
        return false;
    }
    let worker = std::fs::read_to_string(root("examples/workers/least_squares.py")).unwrap();
    assert!(worker.contains(line));
    std::fs::write(folder.join("mine.py"), worker.replace(line, other)).unwrap();
    let study = "[[methods]]\nname = \"mine\"\ncommand = [\"python3\", \"mine.py\"]\n";
    std::fs::write(folder.join("mine.toml"), study).unwrap();
    true
}

fn results(folder: &Path) -> MethodResults {
    let text = std::fs::read_to_string(folder.join("out/methods/mine.json")).unwrap();
    MethodResults::parse(&text).unwrap()
}

/// A program that always raises is refused after two records, whatever its batch, with what it printed.
#[test]
fn a_program_that_raises_is_refused_at_once() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let raises = "raise RuntimeError(\"no idea of it\")\n        found = [";
    if !written(folder, ESTIMATES, raises) {
        return;
    }
    let begin = Instant::now();
    let refused = asobench(folder, &["suite", "mine.toml", "--allow-commands"]);
    let said = stderr(&refused);
    assert_eq!(refused.status.code(), Some(1), "{said}");
    assert!(said.contains("RuntimeError: no idea of it"), "{said}");
    assert!(said.contains("2 crashed"), "{said}");
    assert!(begin.elapsed() < Duration::from_mins(1));
    assert!(!folder.join("results").exists());
}

/// Models of a larger order than the program was told: refused, with the reason.
#[test]
fn a_larger_order_is_refused_with_its_reason() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let larger = "na, nb, nk = hello[\"na\"] + hello[\"nf\"] + 1, hello[\"nb\"] + 1, hello[\"nk\"]";
    if !written(folder, ORDERS, larger) {
        return;
    }
    let refused = asobench(folder, &["suite", "mine.toml", "--only", "P01", "--allow-commands"]);
    let said = stderr(&refused);
    assert_eq!(refused.status.code(), Some(1), "{said}");
    let reason = "a model of a larger order than the method was told";
    assert!(said.contains("other orders") && said.contains(reason), "{said}");
}

/// Larger orders in some scenarios alone: a warning before the run, and the reason on the terminal and on the page.
/// Each record is estimated once, and one of each study before.
#[test]
fn reasons_are_on_the_terminal_and_on_the_page() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let at_times = "na, nb, nk = hello[\"na\"] + 3 * hello[\"nf\"], hello[\"nb\"], hello[\"nk\"]\n        \
                    print(\"batch of\", m, flush=True)";
    if !written(folder, ORDERS, at_times) {
        return;
    }
    let part = [
        "--edition",
        "2.0",
        "--contest",
        "structure",
        "--only",
        "P01-ar",
        "--only",
        "P01-white",
        "--first",
        "5",
        "--threads",
        "1",
    ];
    let arguments = [&["suite", "mine.toml", "--out", "out", "--allow-commands"], &part[..]].concat();
    let done = done_in(folder, &arguments);
    let (shown, said) = (stdout(&done), stderr(&done));
    assert!(said.contains("1 other orders (P01-white"), "{said}");
    let results = results(folder);
    let wrong = results.scenarios.iter();
    let wrong: Vec<_> = wrong.filter(|of| of.name.starts_with("P01-white")).collect();
    assert!(!wrong.is_empty());
    let page = std::fs::read_to_string(folder.join("out/report.html")).unwrap();
    for of in wrong {
        assert_eq!(of.lost["other orders"], 5);
        let words = |text: &str| {
            text.lines()
                .any(|line| line.contains(&of.name) && line.contains("larger order"))
        };
        assert!(words(&shown) && words(&page), "{}: {shown}", of.name);
    }
    let mut estimated = 0;
    for study in std::fs::read_dir(folder.join("out/studies")).unwrap() {
        let log = std::fs::read_to_string(study.unwrap().path().join("workers.log")).unwrap();
        let batches = log.lines().filter_map(|line| line.strip_prefix("batch of "));
        estimated += batches.map(|of| of.parse::<usize>().unwrap()).sum::<usize>();
    }
    assert_eq!(estimated, 5 * results.scenarios.len());
}

/// One coefficient of B too few is a model with a zero there, wherever it is: never lost as of other orders.
#[test]
fn a_coefficient_too_few_is_a_zero() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let fewer = "na, nb, nk = hello[\"na\"] + hello[\"nf\"], max(1, hello[\"nb\"] - 1), hello[\"nk\"]";
    if !written(folder, ORDERS, fewer) {
        return;
    }
    let arguments = [
        "suite",
        "mine.toml",
        "--tier",
        "standard",
        "--first",
        "2",
        "--only",
        "P01-ar",
        "--only",
        "P06",
        "--out",
        "out",
        "--allow-commands",
    ];
    done_in(folder, &arguments);
    let results = results(folder);
    assert!(results.scenarios.iter().all(|of| of.lost.is_empty()), "{results:?}");
}
