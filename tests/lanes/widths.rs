//! Packs of any width give the bits of trials one by one.

use super::{Case, cases, empty, small, tested};
use asobench::lanes::Isa;
use asobench::study::{Experiment, Plan, Trials};
use std::ops::Range;

/// Runs ranges of trials one after the other on one pack's buffers.
fn run(experiment: &Experiment, isa: Isa, ranges: impl IntoIterator<Item = Range<u64>>) -> Trials {
    let plan = Plan::new(experiment, &experiment.cells[0]).expect("a covered cell");
    let mut pack = plan.pack(isa);
    let lanes = match isa {
        Isa::Avx512 => 8,
        Isa::Avx2 => 4,
        Isa::Portable => 1,
    };
    assert_eq!(pack.lanes(), lanes);
    let mut trials = empty(experiment);
    for range in ranges {
        pack.run_into(range, &mut trials);
    }
    trials
}

/// `from ... to - 1` in parts.
fn parts(from: u64, to: u64, size: u64) -> impl Iterator<Item = Range<u64>> {
    (from..to)
        .step_by(size as usize)
        .map(move |first| first..to.min(first + size))
}

/// Rows, parameters, curves and counts, from a row on.
fn assert_same(found: &Trials, expected: &Trials, from: usize, what: &str) {
    let outputs = expected.rows.outputs().len();
    let rows = expected.rows.iter().skip(from);
    assert_eq!(found.rows.len(), expected.rows.len() - from, "{what}");
    for (found, expected) in found.rows.iter().zip(rows) {
        assert!(found.same_bits(&expected), "{what}: {found:?} for {expected:?}");
    }
    let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<u64>>();
    for output in 0..outputs {
        let (found, expected) = (&found.rows.outputs()[output], &expected.rows.outputs()[output]);
        let columns = found.parameters().iter().zip(expected.parameters());
        for (found, expected) in columns {
            let expected = &expected[from / outputs..];
            assert_eq!(bits(found), bits(expected), "{what}: parameters");
        }
    }
}

/// How many trials have a failure, and how many of all have none.
fn failures(trials: &Trials, outputs: usize) -> (usize, usize) {
    let has_failed = |place: &usize| {
        let mut rows = (0..outputs).map(|output| trials.rows.row(*place, output));
        rows.any(|row| row.failure.is_some())
    };
    let failed = (0..trials.rows.trial_count()).filter(has_failed).count();
    (failed, trials.rows.trial_count() - failed)
}

/// The whole at once by one lane is what every other width and partition is compared with.
fn check(case: &Case, count: u64) -> (usize, usize) {
    let experiment = case.experiment();
    let outputs = experiment.outputs().len();
    let isas = tested();
    let expected = run(&experiment, Isa::Portable, parts(0, count, count));
    for isa in isas {
        let what = |how: &str| format!("{}, {isa}, {how}", case.name);
        let whole = |how: &str, found: &Trials| {
            assert_same(found, &expected, 0, &what(how));
            assert!(found.curves == expected.curves, "{}: curves", what(how));
            assert_eq!(found.fallbacks, expected.fallbacks, "{}: fallbacks", what(how));
        };
        whole("whole", &run(&experiment, isa, parts(0, count, count)));
        for size in [1, 3, 7, 13] {
            whole(
                &format!("{size} at a time"),
                &run(&experiment, isa, parts(0, count, size)),
            );
        }
        // The same buffers serve other trials first.
        let mut pack = Plan::new(&experiment, &experiment.cells[0]).expect("covered").pack(isa);
        pack.run_into(1000..1011, &mut empty(&experiment));
        let mut again = empty(&experiment);
        pack.run_into(0..count, &mut again);
        whole("used", &again);
        for from in [1, 5, 11] {
            let found = run(&experiment, isa, parts(from, count, count));
            assert_same(&found, &expected, from as usize * outputs, &what("from an odd trial"));
            let found = run(&experiment, isa, parts(from, count, 3));
            assert_same(
                &found,
                &expected,
                from as usize * outputs,
                &what("from an odd trial by three"),
            );
        }
    }
    failures(&expected, outputs)
}

#[test]
fn every_width_and_partition_gives_the_same_bits() {
    let count = if small() { 19 } else { 33 };
    let (mut failed, mut mixed) = (0, 0);
    for case in cases() {
        let (bad, good) = check(&case, count);
        failed += bad;
        mixed += usize::from(bad > 0 && good > 0);
        println!("{}: {bad} trials with a failure, {good} without", case.name);
    }
    // Failing lanes had neighbours that do not fail, and moved no bit of them.
    println!("{failed} trials with a failure, {mixed} cases with and without");
    assert!(mixed >= if small() { 1 } else { 5 }, "{mixed}");
}

/// Blocks of a run are what a trial gives alone, whatever the threads.
#[test]
fn numbers_of_trials_beyond_two_to_the_53() {
    let case = &cases()[1];
    let experiment = case.experiment();
    let from = (1 << 60) + 1;
    let expected = run(&experiment, Isa::Portable, parts(from, from + 9, 9));
    assert!(expected.rows.iter().any(|row| row.trial == from + 8));
    for isa in tested() {
        let found = run(&experiment, isa, parts(from, from + 9, 9));
        assert_same(&found, &expected, 0, isa.name());
    }
}
