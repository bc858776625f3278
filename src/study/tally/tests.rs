//! Who is counted, from rows whose statistics are known by hand.

use super::*;
use crate::estimator::Output;
use crate::study::CellSummary;
use crate::study::file::ExperimentFile;
use crate::study::row::Row;

/// Five trials of `ls`: the errors 1, 2 and 3, a failed trial, and an unstable model with the small error 0.5. The model
/// of the failed trial is unstable too, and its row has a number, which does not count. `arx` has the error 1 always.
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
