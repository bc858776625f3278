//! The results of a run that has not ended: of the trials that are there.

use crate::design::Experiment;
use crate::design::file::ExperimentFile;
use crate::outcome::stored_results::read_announced;
use crate::outcome::summary::Summary;
use crate::run::campaign::{Campaign, RunOptions};
use crate::run::event::CampaignError;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Returns the experiment of a run in a folder that has not ended, and the summary of the trials that are there, marked
/// as partial; `None` if there is no such run. The folder keeps that they were looked at: claims that are written now
/// come after that.
///
/// # Errors
/// [`CampaignError`], also if the run is under way.
pub fn partial_results(
    folder: &Path,
    threads: usize,
    stop: &AtomicBool,
) -> Result<Option<(ExperimentFile, Summary)>, CampaignError> {
    let Some(announced) = read_announced(folder)? else {
        return Ok(None);
    };
    let file = ExperimentFile::from_json(&announced["experiment"])?;
    let experiment = Experiment::new(file)?;
    let options = RunOptions {
        threads,
        ..RunOptions::default()
    };
    let rule = experiment.file.trials.clone();
    let campaign = Campaign::open(folder, &experiment, rule, options)?;
    let summary = campaign.looked_at(announced, stop)?;
    Ok(Some((experiment.file, summary)))
}
