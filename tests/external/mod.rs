//! Methods that are programs. The workers need Python; where there is none, these tests say so and pass.

mod agreement;
mod chaos;
mod consent;
mod kills;
mod paths;
mod shards;
mod test_method;

use asobench::study::file::ExperimentFile;
use asobench::study::{Experiment, Row, run};
use asobench::worker::Permit;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The folder of this package.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A TOML list of texts.
fn list(words: &[&str]) -> String {
    format!("{words:?}")
}

/// A study whose programs may run.
fn permitted(text: &str) -> Experiment {
    let experiment = Experiment::new(ExperimentFile::parse(text).unwrap()).unwrap();
    for program in &experiment.programs {
        program.permit(Permit {
            folder: PathBuf::from(root()),
            stop: Arc::new(AtomicBool::new(false)),
            guard: None,
            warn: |_| (),
        });
    }
    experiment
}

/// All rows of a study, by cell, trial and output.
fn rows(experiment: &Experiment, trials: u64, threads: usize) -> Vec<(usize, Row)> {
    let mut rows = Vec::new();
    run(experiment, trials, threads, &AtomicBool::new(false), |block| {
        rows.extend(block.rows.iter().map(|row| (block.span.cell, row)));
        Ok::<(), std::io::Error>(())
    })
    .unwrap();
    experiment.programs.iter().for_each(|program| program.end());
    rows.sort_by_key(|(cell, row)| (*cell, row.trial, row.output));
    rows
}
