//! Runs a study in a folder, and says what came out of it.

use super::error::{Error, failed};
use super::files::cannot_write;
use super::output::{note, wrapped};
use super::progress;
use crate::files;
use crate::report::{Study, terminal};
use crate::study::file::{ExperimentFile, TrialRule};
use crate::study::{
    BlockError, Campaign, CampaignError, Event, Experiment, FolderError, MANIFEST, MethodChange, ResultsFolder,
    RunError, RunOptions, Summary, take_over,
};
use crate::text::{count, listed, visible};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Returns the text on what was computed and its results, and separately the verdicts: on one screen, or those of every
/// claim in full.
pub(super) fn results(
    path: &Path,
    file: &ExperimentFile,
    summary: &Summary,
    every_claim: bool,
) -> Result<(String, String), Error> {
    let cells = summary.cells.len();
    let trials: u64 = summary.cells.iter().map(|cell| cell.trials).sum();
    let fallbacks = match summary.cells.iter().map(|cell| cell.fallbacks).sum() {
        0_u64 => String::new(),
        some => format!("solves that needed pivoting (no effect on results): {some}\n"),
    };
    let study = Study::of_run(path, file, summary).map_err(failed)?;
    let verdicts = if every_claim {
        terminal::verdicts(&study)
    } else {
        terminal::short_verdicts(&study)
    };
    let gap = if verdicts.is_empty() { "" } else { "\n" };
    let done = [count(cells as u64, "cell"), count(trials, "trial"), failures(summary)];
    let done = done.join(", ");
    let text = format!(
        "{}{fallbacks}results in {}\n\n{}{gap}",
        wrapped(&done, "  "),
        visible(path.display()),
        terminal::overview(&study)
    );
    Ok((text, verdicts))
}

/// The flag of the folder, before a message about it.
pub(super) const OUT: &str = "--out ";
/// The most kinds of failures of an output in the line of a run.
const KINDS_SHOWN: usize = 10;

/// The most names of files that are left.
const NAMES_SHOWN: usize = 8;

/// Returns the number of failed estimates, by output and kind, as text.
fn failures(summary: &Summary) -> String {
    let mut by_output: Vec<(String, BTreeMap<&str, u64>)> = Vec::new();
    for output in summary.cells.iter().flat_map(|cell| &cell.outputs) {
        let label = output.label();
        let at = by_output.iter().position(|(known, _)| *known == label);
        let at = at.unwrap_or_else(|| {
            by_output.push((label, BTreeMap::new()));
            by_output.len() - 1
        });
        for (kind, count) in &output.outcomes.failures {
            *by_output[at].1.entry(kind).or_default() += count;
        }
    }
    let all: u64 = by_output.iter().flat_map(|(_, kinds)| kinds.values()).sum();
    let failed = by_output.iter().filter(|(_, kinds)| !kinds.is_empty());
    let failed = failed.map(|(label, kinds)| {
        let shown = kinds.iter().take(KINDS_SHOWN);
        let mut shown: Vec<String> = shown.map(|(kind, count)| format!("{kind} {count}")).collect();
        if let more @ 1.. = kinds.len().saturating_sub(KINDS_SHOWN) {
            let rest: u64 = kinds.values().skip(KINDS_SHOWN).sum();
            shown.push(format!("of {more} other kinds {rest}"));
        }
        format!("{}: {}", visible(label), shown.join(", "))
    });
    let failed = failed.collect::<Vec<_>>().join("; ");
    let gap = if failed.is_empty() { "" } else { ": " };
    format!("{all} estimates failed{gap}{failed}")
}

/// Whether results of another study may be replaced.
#[derive(Clone, Copy, clap::Args)]
pub(super) struct Overwrite {
    /// Replace results of another study, or of more trials, once the new ones are whole. Other files in the folder
    /// stay; one that is no folder of results is refused
    #[arg(long)]
    pub(super) overwrite: bool,
}

impl Overwrite {
    /// Refuses a folder that is none of results, before anything is started.
    pub(super) fn check(self, folder: &Path) -> Result<(), Error> {
        if !self.overwrite {
            return Ok(());
        }
        let checked = ResultsFolder::refuse_foreign(folder);
        checked.map_err(|error| refused(OUT, error.into()))
    }
}

/// Returns the number of threads.
pub(super) fn threads(asked: Option<u16>) -> usize {
    asked.map_or_else(
        || std::thread::available_parallelism().map_or(1, usize::from),
        usize::from,
    )
}

/// A completed run of a study.
pub(super) struct Executed {
    pub(super) summary: Summary,
    /// The flag that a signal raises, for later work.
    pub(super) stop: Arc<AtomicBool>,
    /// Trials per second and where the time went, if trials were computed.
    pub(super) speed: Option<String>,
}

/// Runs a study in a folder, with a progress bar on a terminal. `figures` are written with the results.
pub(super) fn execute(
    path: &Path,
    experiment: &Experiment,
    rule: TrialRule,
    options: RunOptions,
    figures: impl Fn(&Summary) -> Vec<(String, String)>,
) -> Result<Executed, Error> {
    let stop = progress::stop_flag()?;
    let mut display = progress::Display::new(experiment.cells.len());
    let on_event = |event| display.show(&event);
    take_over(path, experiment, options, &stop, on_event, |change| note(&told(change)))
        .map_err(|error| ended(error, OUT, options))?;
    let campaign = Campaign::open(path, experiment, rule, options).map_err(|e| refused(OUT, e))?;
    match campaign.looks_elsewhere() {
        0 => {}
        looks => note(&format!(
            "{} at these claims in folders beside {} count",
            count(looks as u64, "look"),
            path.display()
        )),
    }
    let beside = campaign.replaced_beside().map_err(|e| refused(OUT, e))?;
    if let Some(beside) = beside.filter(|_| files::is_there(&path.join(MANIFEST))) {
        replaces(path, &beside);
    }
    let outcome = campaign.run(&stop, |event: Event| display.show(&event), figures);
    display.clear();
    let summary = outcome.map_err(|error| ended(error, "", options))?;
    Ok(Executed {
        summary,
        stop,
        speed: display.speed(),
    })
}

/// Says that results are replaced, and which files are not theirs.
pub(super) fn replaces(path: &Path, beside: &[String]) {
    let shown = visible(listed(beside, NAMES_SHOWN));
    let stays = match beside {
        [] => String::new(),
        _ => format!("; not of them, and left as it is: {shown}"),
    };
    let path = path.display();
    note(&format!(
        "replacing the results in {path} when the new ones are whole{stays}"
    ));
}

/// Says what other methods in the file mean for a folder of results.
fn told(change: &MethodChange) -> String {
    let again = "computed again, as a comparison, a claim or curves need trials that were not kept (store = \"trials\" \
                 keeps them)";
    let mut parts = vec![format!("the methods changed: {} kept", change.kept)];
    let lists = [
        ("computed", &change.added),
        (again, &change.again),
        ("removed from the results", &change.removed),
    ];
    for (what, names) in lists {
        if !names.is_empty() {
            parts.push(format!("{what}: {}", visible(names.join(", "))));
        }
    }
    parts.join("; ")
}

/// Returns the error of a run that ended early.
fn ended(error: CampaignError, flag: &str, options: RunOptions) -> Error {
    let left = if options.fresh {
        "nothing was written"
    } else {
        "the same command resumes"
    };
    match error {
        CampaignError::Run(RunError::Interrupted { done, total }) => {
            Error::Interrupted(format!("interrupted with {done} of {total} trials of this run; {left}"))
        }
        CampaignError::Stopped => Error::Interrupted(format!("{error}; {left}")),
        other => refused(flag, other),
    }
}

/// Returns an input error if the user can correct the cause, otherwise a failure.
pub(super) fn refused(flag: &str, error: CampaignError) -> Error {
    match error {
        CampaignError::Folder(FolderError::File(error)) | CampaignError::Block(BlockError::File(error))
            if error.foreign || !flag.is_empty() =>
        {
            cannot_write(&error)
        }
        CampaignError::Folder(FolderError::File(_))
        | CampaignError::Block(BlockError::File(_))
        | CampaignError::Store(_)
        | CampaignError::Run(_) => failed(error),
        CampaignError::Block(BlockError::Damaged { .. }) => {
            Error::Input(format!("{flag}{error}; --repair computes it again"))
        }
        _ => Error::Input(format!("{flag}{error}")),
    }
}
