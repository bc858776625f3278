//! A study's coverage of printed standard errors: its counts against a count by hand, the same bits for any threads and
//! blocks, and where lanes may not run.

use asobench::study::file::{ExperimentFile, TrialRule};
use asobench::study::{Campaign, CellSummary, Experiment, RunOptions, Trial};
use std::path::Path;
use std::sync::atomic::AtomicBool;

const TRIALS: u64 = 120;

const STUDY: &str = r#"
trials = 120
measures = ["e_a"]
coverage = true
[settings]
plant = "mine"
noise = "white"
eta = 20
window = 60
x0 = 0
order = 2
[plants.mine]
A = [1, -1.5, 0.7]
B = [0, 1, 0.5]
[[methods]]
estimator = "arx"
[[methods]]
estimator = "iv"
report = [0, 4]
covariance = "coloured"
[[methods]]
estimator = "oe"
starts = 0
[[methods]]
estimator = "moesp"
block_rows = 5
"#;

/// `a_1, a_2, h_1, h_2` of A and B above, by the place of their parameter in (A or F, B).
const TRUTH: [(&str, f64); 4] = [("a_2", -1.5), ("a_1", 0.7), ("h_1", 1.0), ("h_2", 0.5)];

fn experiment() -> Experiment {
    Experiment::new(ExperimentFile::parse(STUDY).expect("a file")).expect("an experiment")
}

fn run(folder: &Path, threads: usize, block: u64) -> Vec<u8> {
    let options = RunOptions {
        threads,
        block: Some(block),
        ..RunOptions::default()
    };
    let stop = AtomicBool::new(false);
    Campaign::open(folder, &experiment(), TrialRule::Fixed(TRIALS), options)
        .and_then(|campaign| campaign.run(&stop, |_| (), |_| Vec::new()))
        .expect("a run");
    std::fs::read(folder.join("summary.json")).expect("results")
}

#[test]
fn counts_are_those_by_hand() {
    let experiment = experiment();
    let folder = tempfile::tempdir().expect("a folder");
    let summary = run(&folder.path().join("results"), 2, 50);
    let mut summary: serde_json::Value = serde_json::from_slice(&summary).expect("JSON");
    let cell: CellSummary = serde_json::from_value(summary["cells"][0].take()).expect("a cell");
    let mut counts = vec![[[0_u64; 2]; 4]; experiment.output_count()];
    let mut trial = Trial::new(&experiment, &experiment.cells[0]).expect("buffers");
    for number in 0..TRIALS {
        trial.run(number).expect("a trial");
        for (counts, (_, pass)) in counts.iter_mut().zip(trial.record().passes) {
            let errors = pass.model.standard_errors();
            let Some(errors) = errors.filter(|_| pass.failure.is_none()) else {
                continue;
            };
            let found: Vec<f64> = pass.model.parameters().collect();
            // Of the output-error model B comes first.
            let first = if pass.model.f.len() > 1 { 2 } else { 0 };
            for (i, (count, (_, truth))) in counts.iter_mut().zip(TRUTH).enumerate() {
                let place = (i + first) % 4;
                let distance = (found[place] - truth).abs();
                count[0] += 1;
                count[1] += u64::from(distance <= 1.959963984540054 * errors[place]);
            }
        }
    }
    for (output, counts) in cell.outputs.iter().zip(counts) {
        let label = output.label();
        if label == "moesp" {
            assert!(output.coverage.is_empty(), "it has no standard errors");
            continue;
        }
        assert_eq!(output.coverage.len(), 4, "{label}");
        for (name, coverage) in &output.coverage {
            let place = TRUTH.iter().position(|(other, _)| other == name);
            let [total, count] = counts[place.expect("a coefficient")];
            assert_eq!(
                (coverage.covered.count, coverage.covered.total),
                (count, total),
                "{label} {name}"
            );
        }
    }
    // White output noise biases least squares at this level, and nothing else.
    let of = |label: &str| &cell.output(label).expect("an output").coverage[0].1;
    assert!(of("ls").covered.high < 0.5 && of("oe").covered.low > 0.8);
    assert!(of("iv(4)").covered.low > 0.8);
    assert!(of("ls").bias_eliminated.low > 0.8);
}

#[test]
fn threads_and_blocks_move_no_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let bytes = |name: &str, threads, block| run(&folder.path().join(name), threads, block);
    assert_eq!(bytes("one", 1, TRIALS), bytes("three", 3, 7));
}

#[test]
fn lanes_are_not_taken_where_standard_errors_are_wanted() {
    let lanes = STUDY
        .replace("coverage = true", "coverage = true\nengine = \"lanes\"")
        .split("[[methods]]\nestimator = \"oe\"")
        .next()
        .expect("a text")
        .replace("[[methods]]\nestimator = \"arx\"\n", "");
    let error = ExperimentFile::parse(&lanes).and_then(Experiment::new);
    let error = error.err().expect("a refusal").to_string();
    assert!(error.contains("standard errors"), "{error}");
}
