//! Workers of plain least squares against `arx`.

use super::{list, permitted, root, rows};
use crate::common::{PYTHON, runs};
use asobench::study::Measure;

/// Every measure of every trial of two cells, W98 among them, as `arx` has it.
fn agrees(command: &[&str], batch: u64) {
    let command = list(command);
    let text = format!(
        "measures = [\"e_a\", \"e_b\", \"e_h\", \"e_x0\", \"e_x_max\", \"e_g\"]\n\
         [settings]\neta = 10\nwindow = [98, 218]\n[[methods]]\nestimator = \"arx\"\n\
         [[methods]]\nname = \"mine\"\nbatch = {batch}\ncommand = {command}\n"
    );
    let experiment = permitted(&text);
    let rows = rows(&experiment, 100, 2);
    assert_eq!(rows.len(), 2 * 100 * 2);
    for pair in rows.chunks(2) {
        let ((cell, arx), (_, mine)) = (&pair[0], &pair[1]);
        assert_eq!((arx.failure, mine.failure), (None, None));
        for measure in &experiment.file.measures {
            let (expected, found): (f64, f64) = (arx[*measure], mine[*measure]);
            assert!(
                (found - expected).abs() <= 1e-9 * expected.abs().max(1.0),
                "cell {cell}, trial {}, {measure}: {found} and {expected}",
                arx.trial
            );
        }
    }
    assert!(rows[0].1[Measure::Ea] > 0.0);
}

#[test]
fn python() {
    if runs(PYTHON) {
        agrees(&["python3", "examples/workers/least_squares.py"], 30);
    }
}

#[test]
fn numpy() {
    let python = std::env::var("ASOBENCH_TEST_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    if runs(&[&python, "-c", "import numpy"]) {
        agrees(&[&python, "examples/workers/least_squares_numpy.py"], 256);
    }
}

#[test]
fn octave() {
    if runs(&["octave-cli", "--eval", "1;"]) {
        agrees(
            &["octave-cli", "--no-gui", "-q", "examples/workers/least_squares.m"],
            256,
        );
    }
}

#[test]
fn r() {
    if runs(&["Rscript", "-e", "1"]) {
        agrees(&["Rscript", "examples/workers/least_squares.R"], 256);
    }
}

/// The same model as matrices in other coordinates: x0 = T (c A^i x0) comes from the worker or is estimated.
#[test]
fn matrices() {
    if runs(PYTHON) {
        let worker = root().join("tests/external/matrices.py");
        agrees(&["python3", &worker.display().to_string()], 64);
    }
}
