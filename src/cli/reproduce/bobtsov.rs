//! The second part of `asobench reproduce`: the example of Bobtsov et al. (2023), and the claims of its studies.

use super::super::error::{Error, failed};
use super::super::files::cannot_write;
use super::arguments::Arguments;
use super::claims::lines;
use crate::cli::execute::{execute, threads};
use crate::cli::output::wrapped;
use crate::files;
use crate::report::{Study, course_figures, ends, example_table};
use crate::study::file::{ExperimentFile, TrialRule};
use crate::study::{BOBTSOV2023, Experiment, RunOptions};
use crate::text::visible;
use std::path::Path;

/// Refuses a folder in which the folders of the studies cannot be made, before the other paper's experiment runs.
pub(super) fn check(folder: &Path) -> Result<(), Error> {
    BOBTSOV2023.iter().try_for_each(|(name, ..)| {
        let there = files::subfolder(folder, name);
        there.map(|_| ()).map_err(|e| cannot_write(&e))
    })
}

/// Runs the studies, each in a folder with its name below `folder`.
pub(super) fn run(arguments: &Arguments, folder: &Path) -> Result<Vec<Study>, Error> {
    let mut studies = Vec::new();
    for (name, text, trials) in BOBTSOV2023 {
        let file = ExperimentFile {
            seed: arguments.seed,
            ..ExperimentFile::parse(text).map_err(failed)?
        };
        let rule = TrialRule::Fixed(trials);
        let experiment = Experiment::new(file).map_err(failed)?;
        let path = folder.join(name);
        let options = RunOptions {
            threads: threads(arguments.threads),
            fresh: true,
            overwrite: arguments.overwrites(),
            figures: &["theta.svg", "state-errors.svg", "state-errors-late.svg"],
            ..RunOptions::default()
        };
        execute(&path, &experiment, rule, options, course_figures)?;
        studies.push(Study::read(&path).map_err(failed)?);
    }
    Ok(studies)
}

/// Returns the table, and the verdicts on the claims.
pub(super) fn text(studies: &[Study], folder: &Path) -> String {
    let mut text = "Bobtsov et al. (2023): the example, delta = 0.3 sin t, t = 8 to 20 s\n\n".to_owned();
    if let Some(study) = studies.first() {
        let from = study
            .file
            .continuous
            .as_ref()
            .map_or(0.0, |continuous| continuous.scored_from);
        text.push_str(&example_table(&study.summary, from));
        text.push_str("proposed: ");
        text.push_str(&ends(&study.summary, "proposed").join("\n          "));
        text.push_str("\n\n");
    }
    text.push_str(&lines(studies));
    text.push('\n');
    let folder = folder.join("gpebo-figures");
    text.push_str(&wrapped(
        &format!(
            "The paper assumes |dbar| < 1. It prints no numbers of its Figs. 1 to 4; it says of \
        them that the proposed estimate is as fast as the gradient's and more exact. \
        kalman-bucy, recursive least squares on Eq. (9), is not in the paper. Figs. 1 to 4 as \
        theta.svg and state-errors.svg in {}",
            visible(folder.display())
        ),
        "",
    ));
    text
}
