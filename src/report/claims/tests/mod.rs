//! Rules of claims on made-up results.

mod nikolov;
mod observers;

use super::*;
use crate::estimator::Output;
use crate::metric::{Paired, PairedStatistics, Share, Slope, Statistics};
use crate::report::index::Index;
use crate::report::results::Time;
use crate::report::shipped::Shipped;
use crate::study::file::{ExperimentFile, Key, Scalar, Settings, SlopeTable};
use crate::study::{
    CellSummary, ComparisonSummary, Experiment, Measure, OutputShare, OutputSummary, SlopeSummary,
    Summary,
};
use std::path::PathBuf;

/// A study of a file with made-up results: every measure of every output of every cell is 1(0.001).
fn study(name: &str, toml: &str) -> Study {
    let experiment = Experiment::new(ExperimentFile::parse(toml).unwrap()).unwrap();
    let tallies = vec![crate::study::CellTally::default(); experiment.cells.len()];
    let mut cells: Vec<CellSummary> = tallies
        .iter()
        .enumerate()
        .map(|(i, tally)| CellSummary::of(&experiment, i, tally))
        .collect();
    for cell in &mut cells {
        cell.trials = 1000;
        cell.outputs = experiment
            .outputs()
            .iter()
            .map(|output| OutputSummary {
                estimator: output.estimator.clone(),
                pass: output.pass,
                outcomes: crate::study::Outcomes {
                    trials: 1000,
                    ..Default::default()
                },
                failed: Share::new(0, 1000),
                unstable: Share::new(0, 1000),
                measures: experiment
                    .file
                    .measures
                    .iter()
                    .map(|measure| (*measure, statistics(1.0)))
                    .collect(),
                parameters: Vec::new(),
            })
            .collect();
    }
    let labels: Vec<String> = experiment.outputs().iter().map(Output::label).collect();
    for bound in cells.iter_mut().flat_map(|cell| &mut cell.bounds) {
        let share = |label: &String| OutputShare {
            output: label.clone(),
            met: Share::new(30, 1000),
        };
        bound.outputs = labels.iter().map(share).collect();
    }
    let summary = Summary::of(&experiment, cells, &[]);
    Study {
        judged: Vec::new(),
        name: name.to_owned(),
        shipped: Shipped::named(name),
        folder: PathBuf::from(name),
        version: String::new(),
        revision: None,
        index: Index::of(&summary, experiment.file.continuous.is_some()),
        summary,
        file: experiment.file,
        times: Vec::new(),
    }
}

fn quantile(value: f64) -> Quantile {
    Quantile {
        value,
        mcse: 0.001 * value.abs(),
    }
}

fn statistics(median: f64) -> Statistics {
    let [q05, q25, q50, q75, q95] =
        [0.5, 0.8, 1.0, 1.3, 2.0].map(|factor| quantile(factor * median));
    Statistics {
        count: 1000,
        undefined: 0,
        q05,
        q25,
        q50,
        q75,
        q95,
        dominated: false,
        ..crate::metric::Sample::default().statistics()
    }
}

fn set(study: &mut Study, wanted: &[(Key, &str)], label: &str, measure: Measure, median: f64) {
    for cell in &mut study.summary.cells {
        if wanted
            .iter()
            .all(|(key, value)| cell.setting(*key) == *value)
        {
            for output in &mut cell.outputs {
                if output.label() == label {
                    output.measures.insert(measure, statistics(median));
                }
            }
        }
    }
}

fn verdict_of(studies: &[Study], id: &str) -> (Verdict, String) {
    let found = claims(studies)
        .into_iter()
        .find(|claim| claim.id == id)
        .unwrap();
    (found.verdict, found.because)
}

/// A paired comparison with a given median ratio.
fn paired(first: &str, second: &str, ratio: f64) -> ComparisonSummary {
    let of: PairedStatistics = Paired::default().statistics();
    ComparisonSummary {
        first: first.to_owned(),
        second: second.to_owned(),
        measures: [(
            Measure::Ea,
            PairedStatistics {
                median_ratio: quantile(ratio),
                ..of
            },
        )]
        .into(),
    }
}

/// A number of too few trials has no standard error: its ratio is told, and says nothing.
#[test]
fn a_ratio_without_error_is_open() {
    let bare = |value: f64| Quantile {
        value,
        mcse: f64::NAN,
    };
    for value in [0.1, 1.0, 7.0] {
        let ratios = [
            Ratio::paired(bare(value)),
            Ratio::of(bare(value), quantile(1.0)),
            Ratio::of(quantile(value), bare(1.0)),
        ];
        for ratio in ratios {
            let ratio = ratio.expect("a value");
            assert_eq!((ratio.value, ratio.standing()), (value, Standing::Open));
            assert!(!ratio.text().contains('('), "{}", ratio.text());
        }
    }
}

#[test]
fn what_was_not_run_is_undecided_and_says_so() {
    let all = claims(&[]);
    assert_eq!(all.len(), 22);
    for claim in all {
        assert_eq!(claim.verdict, Verdict::Undecided, "{}", claim.id);
        assert!(
            claim.because.starts_with("Not run: needs the experiment"),
            "{}",
            claim.because
        );
    }
    // A study of the right name that holds nothing of use: never a panic.
    for name in [
        "nikolov2023",
        "window",
        "convergence",
        "solvers",
        "closed-loop",
        "initial-state",
        "observer-poles",
        "errata",
        "c2-c3",
        "gpebo-figures",
        "gpebo-noise",
        "gpebo-amplitude",
        "observer-comparison",
    ] {
        for claim in claims(&[study(name, "[settings]\neta = 1")]) {
            assert!(
                claim.because.ends_with('.'),
                "{}: {}",
                claim.id,
                claim.because
            );
        }
    }
}
