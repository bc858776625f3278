//! A worker that goes wrong in trials whose seeds say so.

use super::{list, permitted, root, rows};
use crate::common::{PYTHON, runs};
use asobench::estimator::FailureKind;
use asobench::worker::seed_of;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::{Duration, Instant};

/// Of so many seeds each wrong thing has one.
const PERIOD: u64 = 96;
const TRIALS: u64 = 192;

/// How many things it does, wrong or odd.
const KINDS: u64 = 40;
/// Of ten thousand trials each of them has about ten.
pub const LONG_PERIOD: u64 = 997;

/// The failure of a seed by the worker's text, as docs/protocol.md types it.
fn expected(seed: u64, period: u64) -> &'static str {
    match seed % period {
        1 | 5 | 15 | 24 | 25 | 38 => "timeout",
        2 | 4 | 16 | 17 | 28 => "crashed",
        6 => "non-finite",
        7 | 8 | 13 | 20..=23 | 31 | 33 | 36 | 37 => "malformed",
        10 => "declined",
        11 => "external: no luck? ?b?",
        _ => "ok",
    }
}

/// A study of the worker, with seconds for a message; calm where the period is 0.
pub fn study(file: &Path, period: u64, timeout: u64) -> String {
    let worker = root().join("tests/external/chaos.py");
    let command = list(&[
        "python3",
        &worker.display().to_string(),
        &period.to_string(),
        &file.display().to_string(),
    ]);
    format!(
        "seed = 5\nmeasures = [\"e_a\"]\n[settings]\neta = 10\nwindow = 18\n[[methods]]\nname = \"chaos\"\n\
         timeout = {timeout}\nbatch = 16\ncommand = {command}\n"
    )
}

/// Whether a process of the worker still runs: its number may be another's by now. A zombie has no command.
fn is_alive(process: &str) -> bool {
    let command = std::fs::read_to_string(format!("/proc/{process}/cmdline")).unwrap_or_default();
    command.contains("chaos.py") || command == "sleep\u{0}1000\u{0}"
}

/// Waits a moment for all processes of the worker to be gone.
pub fn all_gone(file: &Path) {
    let numbers = std::fs::read_to_string(file).unwrap();
    assert!(numbers.lines().count() > 20);
    let begin = Instant::now();
    loop {
        let left: Vec<&str> = numbers.lines().filter(|number| is_alive(number)).collect();
        if left.is_empty() {
            return;
        }
        assert!(begin.elapsed() < Duration::from_secs(5), "still there: {left:?}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn exactly_the_guilty_trials_are_typed() {
    if !runs(PYTHON) {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let processes = place.path().join("processes");
    let experiment = permitted(&study(&processes, PERIOD, 1));
    let found = rows(&experiment, TRIALS, 12);
    assert_eq!(found.len() as u64, TRIALS);
    let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
    for (_, row) in &found {
        let seed = seed_of(5, row.trial);
        assert_eq!(
            row.status(),
            expected(seed, PERIOD),
            "trial {} {}",
            row.trial,
            seed % PERIOD
        );
        *counts.entry(row.status()).or_default() += 1;
    }
    // Every kind was there.
    let kinds = FailureKind::OF_PROGRAMS.iter();
    for name in kinds.map(FailureKind::name).chain(["non-finite"]) {
        assert!(counts[name] > 0, "{counts:?}");
    }
    all_gone(&processes);
    let log = experiment.programs[0].log.text().unwrap();
    assert!(log.len() < 1 << 18, "{}", log.len());
    // Any trial alone, in its batch again.
    let again = permitted(&study(&processes, PERIOD, 1));
    let few = rows(&again, 20, 2);
    assert!(few.iter().zip(&found).all(|((_, a), (_, b))| a.same_bits(b)));
}

/// Exactly the guilty ones of ten thousand trials are typed, all others have the numbers of a run without faults.
#[test]
#[ignore = "takes minutes: cargo test --release --test it external:: -- --ignored"]
fn of_ten_thousand_trials_the_others_are_undisturbed() {
    const TRIALS: u64 = 10_000;
    let place = tempfile::tempdir().unwrap();
    let processes = place.path().join("processes");
    let of = |period, threads| {
        let experiment = permitted(&study(&processes, period, 5));
        rows(&experiment, TRIALS, threads)
    };
    let (calm, found) = (of(0, 2), of(LONG_PERIOD, 16));
    assert_eq!((calm.len(), found.len()), (TRIALS as usize, TRIALS as usize));
    let mut seen = BTreeSet::new();
    for ((_, calm), (_, found)) in calm.iter().zip(&found) {
        let seed = seed_of(5, found.trial);
        let (kind, expected) = (seed % LONG_PERIOD, expected(seed, LONG_PERIOD));
        seen.extend((kind < KINDS).then_some(kind));
        assert_eq!(found.status(), expected, "trial {}, kind {kind}", found.trial);
        assert!(expected != "ok" || found.same_bits(calm), "trial {}", found.trial);
    }
    assert_eq!(seen.len() as u64, KINDS, "{seen:?}");
    all_gone(&processes);
}

/// An answer that comes before its question was read is none, whatever number it has.
#[test]
fn an_early_answer_is_not_taken() {
    const TRIALS: u64 = 12;
    if !runs(PYTHON) {
        return;
    }
    let worker = root().join("tests/external/early.py").display().to_string();
    let found = |arguments: &[&str]| {
        let command = list(&[&["python3", &worker], arguments].concat());
        let study = format!(
            "measures = [\"e_a\"]\n[settings]\neta = 10\nwindow = 18\n[[methods]]\nname = \"early\"\nbatch = 4\n\
             command = {command}\n"
        );
        rows(&permitted(&study), TRIALS, 1)
    };
    let (calm, early) = (found(&[]), found(&["early"]));
    assert_eq!(calm.len() as u64, TRIALS);
    for ((_, calm), (_, early)) in calm.iter().zip(&early) {
        assert_eq!(early.status(), "ok", "trial {}", early.trial);
        assert!(early.same_bits(calm), "trial {}", early.trial);
    }
}
