//! Who is counted, from rows whose statistics are known by hand.

use crate::design::file::experiment_file::ExperimentFile;
use crate::outcome::outcomes::{LISTED, REASONS};
use crate::outcome::row::Row;
use crate::outcome::summary::CellSummary;
use crate::outcome::tally::*;
use asobench_identification::estimator::Output;
use asobench_identification::estimator::{FailureKind, Reason};

/// Five trials of `ls`: the errors 1, 2 and 3, a failed trial, and an unstable model with the small error 0.5. The
/// model of the failed trial is unstable too, and its row has a number, which does not count. `arx` has the error 1
/// always.
fn summary() -> CellSummary {
    let file = "trials = 5\nmeasures = ['e_a']\ncompare = [['ls', 'arx']]\n\
                [settings]\nwindow = 98\n[[methods]]\nestimator = 'ls'\n[[methods]]\nestimator = 'arx'\n\
                [[bounds]]\nmeasure = 'e_a'\nbelow = 0.75\n";
    let experiment = Experiment::new(ExperimentFile::parse(file).unwrap()).unwrap();
    let cell = &experiment.cells[0];
    let mut trials = Trials::new(&experiment, cell);
    let labels: Vec<String> = experiment.outputs().iter().map(Output::label).collect();
    assert_eq!(labels, ["ls", "arx"]);
    for (trial, error) in (0..).zip([1.0, 2.0, 3.0, 0.1, 0.5]) {
        let mut row = Row::new(trial, 0);
        row[Measure::Ea] = error;
        row.failure = (trial == 3).then(|| FailureKind::Singular.into());
        row.unstable = Some(trial >= 3);
        row.unstable_so_far = trial >= 3;
        trials.rows.push(&row, &[]);
        let mut other = Row::new(trial, 1);
        other[Measure::Ea] = 1.0;
        other.unstable = Some(false);
        trials.rows.push(&other, &[]);
    }
    let tally = CellTally::from_trials(&experiment, cell, &mut trials);
    CellSummary::new(&experiment, 0, &tally)
}

/// The numbers are within the width of a bin.
fn near(value: f64, truth: f64) {
    assert!((value / truth - 1.0).abs() < 1e-3, "{value} {truth}");
}

#[test]
fn failed_trials_rank_last_and_unstable_ones_by_their_measure() {
    let summary = summary();
    let ls = summary.output("ls").unwrap();
    // Shares: trial 3 failed and is unstable, trial 4 is unstable. So 2 are lost.
    let counts = (ls.failed.count, ls.unstable.count, ls.outcomes.lost);
    assert_eq!(counts, (1, 2, 2));
    assert_eq!(ls.outcomes.lost_trials(), (2, true));
    // Quantiles of 0.5, 1, 2, 3, last. With lost trials last, the median would be 3 and the lower quartile 2.
    let found = ls.measures[&Measure::Ea];
    near(found.q25.value, 1.0);
    near(found.q50.value, 2.0);
    near(found.q75.value, 3.0);
    assert!(found.q95.lost && !found.q75.lost);
    // Of the four trials with a measure: 0.5, 1, 2, 3.
    near(found.conditional.unwrap().q50.value, 1.5);
    near(found.mean.value, 6.5 / 4.0);
}

#[test]
fn ratios_and_bounds_follow_the_same_definition() {
    let summary = summary();
    // Ratios 0.5, 1, 2, 3, infinite. With lost trials last, the median would be 3.
    let pair = &summary.comparisons[0].measures[&Measure::Ea];
    near(pair.median_ratio.value, 2.0);
    assert!(pair.ratio_q95.lost);
    assert_eq!((pair.both, pair.only_second, pair.neither), (4, 1, 0));
    // The unstable model wins, the failed trial loses, and trial 0 is a tie.
    let smaller = pair.share_smaller;
    assert_eq!((smaller.count, smaller.total, pair.ties), (1, 4, 1));
    // Below 0.75 is the unstable model alone; the number of the failed trial does not count.
    let met = summary.bounds[0].outputs[0].met;
    assert_eq!((met.count, met.total), (1, 5));
}

/// A program may give each trial a reason of its own: as many are counted as one may read, the same ones in whatever
/// order the trials are merged, and no trial is lost.
#[test]
fn reasons_are_counted_up_to_a_limit() {
    let part = |trials: Range<u64>| {
        let mut part = Outcomes::default();
        for trial in trials {
            let reason = Reason::new(&format!("no minimum near {}", (trial * 7919) % 1009));
            part.add_failure(FailureKind::External(reason).name(), trial);
            part.trials += 1;
        }
        part.add_failure("declined", 9999);
        part
    };
    let parts: Vec<Outcomes> = (0..10).map(|i| part(100 * i..100 * (i + 1))).collect();
    let merged = |order: &[usize]| {
        let mut all = Outcomes::default();
        for i in order {
            all.merge(&parts[*i]);
        }
        all
    };
    let forwards = merged(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
    assert_eq!(forwards, merged(&[9, 3, 5, 1, 0, 2, 4, 8, 6, 7]));
    assert_eq!(forwards.failures.len(), REASONS + 2);
    assert_eq!(forwards.failed(), 1010);
    assert_eq!(forwards.failures["declined"], 10);
    let others = FailureKind::External(Reason::others());
    assert_eq!(forwards.failures[others.name()], 1000 - REASONS as u64);
    assert_eq!(forwards.failed_trials[others.name()].len(), LISTED);
    assert!(forwards.failed_trials[others.name()].is_sorted());
    // The whole at once.
    let mut once = part(0..1000);
    once.failures.remove("declined");
    let mut same = forwards.clone();
    same.failures.remove("declined");
    assert_eq!(once.failures, same.failures);
    once.failed_trials.remove("declined");
    same.failed_trials.remove("declined");
    assert_eq!(once.failed_trials, same.failed_trials);
}
