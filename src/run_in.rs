//! The library's entry point: takes an experiment, returns its results and writes a report.

use crate::files::PathError;
use crate::report::{ResultsError, Study, prepare_report, report, write_report};
use crate::study::{Campaign, CampaignError, Experiment, RunOptions};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Why there are no results.
#[derive(Debug, thiserror::Error)]
pub enum RunInError {
    /// The run ended early.
    #[error(transparent)]
    Run(#[from] CampaignError),
    /// The results cannot be read again.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// The report cannot be written.
    #[error(transparent)]
    Report(#[from] PathError),
}

/// Runs an experiment in a folder on all processors, with as many trials as its file says, and writes `report.html`
/// beside the results. Resumes from stored trials of the same design.
///
/// # Errors
/// [`RunInError`].
///
/// # Panics
/// With the panic of an estimator.
pub fn run_in(experiment: &Experiment, folder: &Path) -> Result<Study, RunInError> {
    let options = RunOptions {
        threads: std::thread::available_parallelism().map_or(1, usize::from),
        ..RunOptions::default()
    };
    let rule = experiment.file.trials.clone();
    Campaign::open(folder, experiment, rule, options)?.run(&AtomicBool::new(false), |_| (), |_| Vec::new())?;
    let study = Study::read(folder)?;
    prepare_report(folder)?;
    let studies = [study];
    write_report(folder, &report(&studies, &mut |_| ()))?;
    let [study] = studies;
    Ok(study)
}
