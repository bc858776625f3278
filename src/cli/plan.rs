//! `asobench plan`: decides which shard of a study computes which trials.

use super::cluster::{collected, parse_time, refused, word};
use super::error::{Error, bad_input, failed};
use super::execute::threads;
use super::need::duration;
use super::output::print;
use super::programs::{self, Consent};
use super::progress;
use super::study_arguments::StudyArguments;
use crate::study::cluster::{ShardPlan, next_targets};
use crate::study::file::TrialRule;
use crate::study::{Experiment, Forecast, Span};
use crate::text::count;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Plan a study in shards for many machines, balanced by a short timing. The same command again
/// plans the missing trials, or the next round if `trials` is a rule.
#[derive(clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    #[command(flatten)]
    size: SizeArguments,
    /// Threads that a shard will have, for --target-time
    #[arg(
        long, value_name = "T", default_value_t = 1,
        value_parser = clap::value_parser!(u16).range(1..=1024)
    )]
    threads: u16,
    /// The plan [default: NAME.plan.json of NAME.toml]
    #[arg(long, value_name = "PLAN")]
    out: Option<PathBuf>,
    /// Folders with blocks that need not be computed again [default: NAME-shards beside the plan]
    #[arg(long, value_name = "DIR", num_args = 1..)]
    from: Vec<PathBuf>,
    #[command(flatten)]
    consent: Consent,
}

/// The largest number of shards that a plan is asked for.
const MOST_SHARDS: i64 = 1_000_000;

/// How many shards.
#[derive(clap::Args)]
pub(super) struct SizeArguments {
    /// Approximate number of shards
    #[arg(
        long, value_name = "S", conflicts_with = "target_time",
        value_parser = clap::value_parser!(u32).range(1..=MOST_SHARDS)
    )]
    pub(super) shards: Option<u32>,
    /// Time that a shard should take, such as 90s, 30m, 2h or 1-12:00:00 [default: 1h]
    #[arg(long, value_name = "T", value_parser = parse_time)]
    pub(super) target_time: Option<Duration>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let mut name = PathBuf::from(arguments.study.name());
    if name.extension().is_some_and(|form| form == "plan") {
        name.set_extension("");
    }
    let path = match &arguments.out {
        Some(out) => out.clone(),
        None if name == Path::new("-") => {
            return Err(bad_input(
                "--out: expected a plan's name, because the experiment comes from standard input",
            ));
        }
        None => name.with_added_extension("plan.json"),
    };
    let planned = plan(
        (&arguments.study, &arguments.consent),
        &arguments.size,
        usize::from(arguments.threads),
        &path,
        &arguments.from,
    )?;
    let count = planned.plan.shards.len();
    let out = word(&Path::new("results").join(&name));
    let plan = word(&path);
    let allow = planned.allow;
    let shard = match count {
        0 => String::new(),
        _ => format!("each shard: asobench shard {plan} I/{count}{allow}, I = 1 to {count}\n"),
    };
    let text = planned.text(&path);
    let text = format!("{text}{shard}then: asobench merge {plan} --out {out}\n");
    print(&text)
}

/// A plan that was written.
pub(super) struct Planned {
    pub(super) plan: ShardPlan,
    /// Trials that are missing.
    missing: u64,
    /// " --allow-commands" if methods are programs: every shard needs it.
    pub(super) allow: &'static str,
}

impl Planned {
    /// Returns a description of the plan.
    pub(super) fn text(&self, path: &Path) -> String {
        let trials: u64 = self.plan.trials.iter().sum();
        let cells = self.plan.trials.len();
        let size = match self.plan.shards.len() {
            0 => "nothing is missing".to_owned(),
            shards => format!(
                "{}, each about {} on one thread of this machine",
                count(shards as u64, "shard"),
                duration(self.plan.seconds)
            ),
        };
        format!(
            "{}, {}, {} of them missing\n{}: {size}\n",
            count(cells as u64, "cell"),
            count(trials, "trial"),
            self.missing,
            word(path)
        )
    }
}

/// Plans the missing trials of a study, and writes the plan.
pub(super) fn plan(
    (study, consent): (&StudyArguments, &Consent),
    size: &SizeArguments,
    threads_of_shard: usize,
    path: &Path,
    from: &[PathBuf],
) -> Result<Planned, Error> {
    let results = study.folder(None);
    let (file, introduced) = programs::introduced(study.read()?, &study.file, consent)?;
    let (experiment, rule) = study.of_file(file, &results)?;
    programs::take_over(&experiment, introduced.as_ref());
    let (trials, missing) = wanted(&experiment, &rule, path, from)?;
    let (_, most) = rule.extent();
    let seconds = if missing.is_empty() {
        0.0
    } else {
        let forecast = Forecast::measure(&experiment, most).map_err(failed)?;
        forecast.seconds_of(&missing)
    };
    experiment.programs.iter().for_each(|program| program.end());
    let target = size.target_time.unwrap_or(Duration::from_hours(1));
    let by_time = (seconds / threads_of_shard as f64 / target.as_secs_f64()).ceil();
    if size.shards.is_none() && by_time > MOST_SHARDS as f64 {
        return Err(Error::Input(format!(
            "--target-time: {by_time} shards of {}; expected a time for which at most {MOST_SHARDS} are enough, or \
             --shards",
            duration(target.as_secs_f64())
        )));
    }
    let shards = size.shards.map_or(by_time as usize, |count| count as usize);
    let plan = ShardPlan::new(&experiment, trials, &missing, seconds, shards.max(1));
    plan.write(path).map_err(refused)?;
    let missing = missing.iter().map(Span::len).sum();
    let allow = match &experiment.programs[..] {
        [] => "",
        _ => " --allow-commands",
    };
    Ok(Planned { plan, missing, allow })
}

/// Returns the number of trials of each cell, and the trials that are missing.
fn wanted(
    experiment: &Experiment,
    rule: &TrialRule,
    path: &Path,
    from: &[PathBuf],
) -> Result<(Vec<u64>, Vec<Span>), Error> {
    let found = collected((path, from), experiment, true, true)?;
    let stop = progress::stop_flag()?;
    next_targets(experiment, rule, &found, (threads(None), &stop)).map_err(refused)
}
