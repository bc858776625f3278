//! `check --pilot`: judges the claims of a file by a few trials that no run of it has, and foretells how many it needs.

use super::super::error::{Error, failed};
use super::super::need::{duration, span};
use super::super::{memory, progress};
use crate::claim::{Judged, Verdict, judge};
use crate::cli::output::{print, wrapped};
use crate::study::file::{ExperimentFile, Store, TrialRule};
use crate::study::{Event, Experiment, Look, Looks, Pilot, RunError, Spent, pilot_seed};
use crate::text::visible;

/// The fewest trials from which the number that decides a claim is foretold.
pub(super) const FEWEST: u64 = 20;

/// Refuses a pilot that the file does not allow.
pub(super) fn check(experiment: &Experiment, rule: &TrialRule, trials: u64) -> Result<(), Error> {
    let wrong = |message: String| Err(Error::Input(format!("--pilot {trials}: {message}")));
    let (_, most) = rule.extent();
    if experiment.file.claims.iter().all(|claim| claim.test.is_empty()) {
        return wrong("the file has no claim to judge; expected [[claims]]".to_owned());
    }
    if !experiment.programs.is_empty() {
        return wrong("methods are programs, which `check` does not start".to_owned());
    }
    if most < FEWEST {
        return wrong(format!("the file has {most} trials of a cell, fewer than a pilot"));
    }
    if !(FEWEST..=most).contains(&trials) {
        return wrong(format!("expected {FEWEST} to {most}, the file's trials"));
    }
    Ok(())
}

/// Runs the pilot and prints what it says of every claim.
pub(super) fn print_pilot(experiment: &Experiment, trials: u64, threads: usize) -> Result<(), Error> {
    let file = ExperimentFile {
        seed: pilot_seed(experiment.file.seed),
        store: Store::Summaries,
        needed: None,
        ..experiment.file.clone()
    };
    let experiment = Experiment::new(file).map_err(failed)?;
    memory::fits(&experiment, 0..experiment.cells.len(), threads)?;
    let pilot = simulated(&experiment, trials, threads)?;
    let mut text = wrapped(
        &format!(
            "pilot     {trials} trials of each cell, with random numbers that no run of the file has; they decide \
             nothing, and cost the claims none of their error rates"
        ),
        "          ",
    );
    // The study's first look decides, with more trials.
    let file = &experiment.file;
    let share = Looks::default().at(0, file, &file.trials).share;
    let look = Look {
        number: 1,
        share,
        next: share,
    };
    for claim in judge(file, &pilot.summary, &[], look) {
        text.push_str(&wrapped(&visible(said(&claim)), "    "));
        let more = format!("    {}", foretold(&claim, &pilot, trials, threads));
        text.push_str(&wrapped(&more, "    "));
    }
    print(&text)
}

/// Runs the trials, with a progress bar on a terminal.
fn simulated(experiment: &Experiment, trials: u64, threads: usize) -> Result<Pilot, Error> {
    let stop = progress::stop_flag()?;
    let mut display = progress::Display::new(experiment.cells.len());
    let cells = 0..experiment.cells.len();
    display.show(&Event::Planned {
        trials: cells.map(|cell| experiment.trials_of(cell, trials)).sum(),
        done: 0,
    });
    let on_block = |trials| {
        display.show(&Event::Block {
            trials,
            failures: 0,
            spent: Spent::default(),
        });
    };
    let pilot = Pilot::run(experiment, trials, threads, &stop, on_block);
    display.clear();
    match pilot {
        Ok(pilot) => Ok(pilot),
        Err(RunError::Interrupted { .. }) => Err(Error::Interrupted(
            "interrupted; a pilot leaves nothing behind".to_owned(),
        )),
        Err(other) => Err(failed(other)),
    }
}

/// The claim's line, which says that its verdict is the pilot's.
fn said(claim: &Judged) -> String {
    let begin = format!("{}  {}", claim.id, claim.verdict);
    let rest = claim.line.strip_prefix(&begin).unwrap_or_default();
    format!("{begin} in the pilot{rest}")
}

/// How many trials decide the claim, and how long they take.
fn foretold(claim: &Judged, pilot: &Pilot, trials: u64, threads: usize) -> String {
    if claim.verdict != Verdict::Undecided {
        return format!("{trials} trials were enough for the pilot.");
    }
    if claim.timed {
        return "A pilot measures no times.".to_owned();
    }
    let Some(needed) = claim.needed else {
        return "How many trials would decide it is not known.".to_owned();
    };
    let time = |trials| duration(pilot.seconds(trials, threads));
    let machine = format!("on {threads} threads of this machine");
    match (needed.from.map(time), needed.to.map(time)) {
        (Some(least), Some(most)) => {
            let time = span((least, most));
            format!("It would take {needed}: about {time} {machine}.")
        }
        (Some(least), None) => format!("It would take {needed} {least} or longer {machine}."),
        (None, _) => format!("It would take {needed}."),
    }
}
