//! A worker that goes wrong in trials whose seeds say so.

use super::{list, permitted, root, rows, runs};
use asobench::estimator::FailureKind;
use asobench::worker::seed_of;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Of so many seeds each wrong thing has one.
const PERIOD: u64 = 96;
const TRIALS: u64 = 192;

/// What the worker's text says of a seed, as docs/protocol.md types it.
fn expected(seed: u64) -> &'static str {
    match seed % PERIOD {
        1 | 5 | 15 => "timeout",
        2 | 4 | 16 | 17 => "crashed",
        6 => "non-finite",
        7 | 8 | 13 | 20..=23 => "malformed",
        10 => "declined",
        11 => "external: no luck? ?b?",
        _ => "ok",
    }
}

fn study(file: &str) -> String {
    let worker = root().join("tests/external/chaos.py");
    let command = list(&[
        "python3",
        &worker.display().to_string(),
        &PERIOD.to_string(),
        file,
    ]);
    format!(
        "seed = 5\nmeasures = [\"e_a\"]\n[settings]\neta = 10\nwindow = 18\n[[methods]]\nname = \"chaos\"\n\
         timeout = 1\nbatch = 16\ncommand = {command}\n"
    )
}

/// Whether a process still runs: a zombie, which only waits for its parent, does not.
fn is_alive(process: &str) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    let state = status.rsplit(')').next().unwrap_or_default().trim();
    !state.is_empty() && !state.starts_with('Z')
}

/// Waits a moment for all processes of the worker to be gone.
fn all_gone(file: &std::path::Path) {
    let numbers = std::fs::read_to_string(file).unwrap();
    assert!(numbers.lines().count() > 20);
    let begin = Instant::now();
    loop {
        let left: Vec<&str> = numbers.lines().filter(|number| is_alive(number)).collect();
        if left.is_empty() {
            return;
        }
        assert!(
            begin.elapsed() < Duration::from_secs(5),
            "still there: {left:?}"
        );
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn exactly_the_guilty_trials_are_typed() {
    if !runs(&["python3", "-c", "1"]) {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let processes = place.path().join("processes");
    let experiment = permitted(&study(&processes.display().to_string()));
    let found = rows(&experiment, TRIALS, 8);
    assert_eq!(found.len() as u64, TRIALS);
    let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
    for (_, row) in &found {
        let seed = seed_of(5, row.trial);
        assert_eq!(
            row.status(),
            expected(seed),
            "trial {} {}",
            row.trial,
            seed % PERIOD
        );
        *counts.entry(row.status()).or_default() += 1;
    }
    // Every kind was there.
    let kinds = FailureKind::OF_PROGRAMS.iter();
    for name in kinds.map(|kind| kind.name()).chain(["non-finite"]) {
        assert!(counts[name] > 0, "{counts:?}");
    }
    all_gone(&processes);
    let log = experiment.programs[0].log.text().unwrap();
    assert!(log.len() < 1 << 18, "{}", log.len());
    // Any trial alone, in its batch again.
    let again = permitted(&study(&processes.display().to_string()));
    let few = rows(&again, 20, 1);
    assert!(
        few.iter()
            .zip(&found)
            .all(|((_, a), (_, b))| a.same_bits(b))
    );
}
