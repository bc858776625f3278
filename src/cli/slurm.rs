//! `asobench slurm`: writes job scripts of a study for Slurm.

use super::cluster::{parse_time, refused, script_of, slurm_time, word};
use super::error::{Error, failed};
use super::output::{note, print};
use super::plan::{SizeArguments, plan};
use super::programs::{Consent, folder_of};
use super::study_arguments::StudyArguments;
use super::template::filled;
use crate::files::{self, Kind};
use crate::study::cluster::ShardPlan;
use crate::text::{beginning, script_word, visible};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// Write a plan of a study, a job script of its shards and one that puts their results together,
/// for Slurm. The same command again plans the missing trials, or the next round if `trials`
/// is a rule.
#[derive(clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    #[command(flatten)]
    size: SizeArguments,
    /// Submit the jobs too
    #[arg(long)]
    submit: bool,
    /// Folder of plan, scripts, logs and shards, which all nodes share [default: NAME-slurm]
    #[arg(long, value_name = "DIR")]
    work: Option<PathBuf>,
    /// Folder of the results [default: results/NAME of NAME.toml]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    job: Job,
    /// TOML file with these: partition, account, time, mem, cpus-per-task, array-limit, and
    /// options, a list of more options of sbatch, such as "--constraint=avx512"; flags come first
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    consent: Consent,
}

/// The resources that a job asks of Slurm.
#[derive(clap::Args, Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
struct Job {
    /// Partition
    #[arg(long, value_name = "P")]
    partition: Option<String>,
    /// Account
    #[arg(long, value_name = "A")]
    account: Option<String>,
    /// Time limit of a job, such as 2h or 1-12:00:00
    #[arg(long, value_name = "T")]
    time: Option<String>,
    /// Memory of a job, such as 4G
    #[arg(long, value_name = "M")]
    mem: Option<String>,
    /// Processors of a shard, a thread on each [default: 1]
    #[arg(long, value_name = "C", value_parser = clap::value_parser!(u16).range(1..=1024))]
    cpus_per_task: Option<u16>,
    /// Shards that run at once, at most
    #[arg(long, value_name = "L", value_parser = clap::value_parser!(u32).range(1..))]
    array_limit: Option<u32>,
    #[arg(skip)]
    options: Vec<String>,
}

impl Job {
    /// Returns these options; missing ones come from a file.
    fn or(self, file: Self) -> Self {
        Self {
            partition: self.partition.or(file.partition),
            account: self.account.or(file.account),
            time: self.time.or(file.time),
            mem: self.mem.or(file.mem),
            cpus_per_task: self.cpus_per_task.or(file.cpus_per_task),
            array_limit: self.array_limit.or(file.array_limit),
            options: file.options,
        }
    }

    fn read(path: &Path) -> Result<Self, Error> {
        let wrong = |reason: &dyn std::fmt::Display| {
            let reason = reason.to_string();
            let lines: Vec<&str> = reason.lines().map(str::trim).collect();
            Error::Input(format!("--config {}: {}", path.display(), lines.join(" ")))
        };
        let text = files::read_named(path, Kind::Experiment).map_err(|e| wrong(&e))?;
        toml::from_str(&text).map_err(|e: toml::de::Error| wrong(&e.message()))
    }

    /// Returns the options of sbatch that both scripts share as their lines, and the time limit of a shard.
    fn check(&self) -> Result<(String, Option<Duration>), Error> {
        let time = self.time.as_deref().map(parse_time).transpose();
        let time = time.map_err(|error| Error::Input(format!("--time: {error}")))?;
        let mut lines = String::new();
        let known = [
            ("partition", &self.partition),
            ("account", &self.account),
            ("mem", &self.mem),
        ];
        for (name, value) in known {
            let Some(value) = value else { continue };
            let word = match &value[..] {
                "" => Err("expected a text, not empty".to_owned()),
                value => script_word(value),
            };
            let word = word.map_err(|error| Error::Input(format!("--{name}: {error}")))?;
            lines.extend(["#SBATCH --", name, "=", &word, "\n"]);
        }
        for option in &self.options {
            lines.extend(["#SBATCH ", &option_word(option)?, "\n"]);
        }
        Ok((lines, time))
    }
}

/// Returns an option of sbatch as a word of a script.
fn option_word(option: &str) -> Result<String, Error> {
    let name = option.split('=').next().unwrap_or_default();
    let name = name.strip_prefix("--").unwrap_or_default();
    let known = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if name.is_empty() || !name.chars().all(known) {
        return Err(Error::Input(format!(
            "options: '{}'; expected an option of sbatch in one word, such as --constraint=avx512",
            visible(beginning(option, 200))
        )));
    }
    script_word(option).map_err(|error| Error::Input(format!("options: {error}")))
}

/// Returns names and paths by their places in the scripts, as words of the shell.
fn places(name: &str, file: &Path, plan: &Path, out: &Path) -> Result<Vec<(&'static str, String)>, Error> {
    let plan = std::path::absolute(plan).map_err(failed)?;
    let folder = plan.parent().unwrap_or(Path::new("/"));
    // In the name of a log sbatch takes these for patterns.
    if folder.to_string_lossy().contains(['\\', '%']) {
        return Err(Error::Input(format!(
            "slurm: '{}'; expected a path without \\ and %, in which Slurm writes logs",
            visible(folder.display())
        )));
    }
    let path = |name, path: &Path| Ok::<_, Error>((name, path_word(path)?));
    Ok(vec![
        ("name", script_word(name).map_err(Error::Input)?),
        path("program", &std::env::current_exe().map_err(failed)?)?,
        path("folder", folder)?,
        path("plan", &plan)?,
        path("script", &script_of(&plan))?,
        path("shards", &ShardPlan::default_folder(&plan))?,
        path("out", &std::path::absolute(out).map_err(failed)?)?,
        // Where programs run.
        path("home", &folder_of(file)?)?,
    ])
}

/// Returns a path as a word of a script.
fn path_word(path: &Path) -> Result<String, Error> {
    let text = path.to_str().ok_or_else(|| not_utf8(path))?;
    script_word(text).map_err(|error| Error::Input(format!("slurm: {error}")))
}

/// Returns the error of a path that cannot be in a script.
fn not_utf8(path: &Path) -> Error {
    Error::Input(format!(
        "slurm: '{}'; expected a path in UTF-8, for a job script",
        visible(path.display())
    ))
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let name = arguments.study.name();
    let name = name.to_str().ok_or_else(|| not_utf8(Path::new(&name)))?;
    if name == "-" || name.chars().any(|c| c.is_control() || c.is_whitespace()) {
        let message = "expected an experiment file whose name has no blanks, because the job gets the same name";
        return Err(Error::Input(format!("'{name}': {message}")));
    }
    let file = arguments.config.as_deref().map(Job::read).transpose()?;
    let job = arguments.job.clone().or(file.unwrap_or_default());
    let (lines, time) = job.check()?;
    let default = || PathBuf::from(format!("{name}-slurm"));
    let work = arguments.work.clone().unwrap_or_else(default);
    let path = work.join(format!("{name}.plan.json"));
    let out = arguments.study.folder(arguments.out.as_deref());
    let mut places = places(name, &arguments.study.file, &path, &out)?;
    files::make_folder(&work).map_err(refused)?;
    files::make_folder(&work.join("logs")).map_err(refused)?;
    let size = SizeArguments {
        // A shard that ends well before the limit is not interrupted and run again.
        target_time: arguments.size.target_time.or(time.map(|limit| limit / 2)),
        shards: arguments.size.shards,
    };
    let cpus = job.cpus_per_task.unwrap_or(1);
    let study = (&arguments.study, &arguments.consent);
    let planned = plan(study, &size, usize::from(cpus), &path, &[])?;
    let home = places.pop().filter(|_| !planned.allow.is_empty());
    let home = home.map(|(_, home)| format!("cd {home} && "));
    let line = |time| format!("#SBATCH --time={}\n", slurm_time(time));
    // Leaves time to finish and write the blocks under way. A block takes about five seconds at most, unless one trial
    // takes longer.
    let limit = |time: Duration| {
        let notice = Duration::from_mins(1).min(time / 4);
        format!(" --time-limit {}", slurm_time(time.saturating_sub(notice)))
    };
    places.extend([
        ("cpus", cpus.to_string()),
        ("options", lines),
        ("time", time.map(line).unwrap_or_default()),
        ("limit", time.map(limit).unwrap_or_default()),
        ("allow", planned.allow.to_owned()),
        ("at", home.unwrap_or_default()),
    ]);
    let (script, merge_script) = (script_of(&path), work.join(format!("{name}-merge.sbatch")));
    write(&script, &filled(include_str!("slurm/shards.sbatch"), &places))?;
    write(&merge_script, &filled(include_str!("slurm/merge.sbatch"), &places))?;
    let limit = job.array_limit.map(|limit| format!("%{limit}")).unwrap_or_default();
    let array = match planned.plan.shards.len() {
        0 => None,
        count => Some(format!("1-{count}{limit}")),
    };
    print(&planned.text(&path))?;
    submit(arguments.submit, array, (&script, &merge_script))?;
    print(&format!("progress: asobench status {}\n", word(&path)))
}

/// Writes a script, unless the user's own file is there.
fn write(path: &Path, text: &str) -> Result<(), Error> {
    if files::is_there(path) {
        let there = files::read_named(path, Kind::Script).map_err(failed)?;
        if there != text {
            let path = path.display();
            note(&format!(
                "{path}: kept, although this command would write a different one; remove it to renew it"
            ));
        }
        return Ok(());
    }
    files::create(path, text.as_bytes()).map_err(|error| Error::Failed(format!("{}: {error}", path.display())))
}

/// Prints the commands, or runs them.
fn submit(now: bool, array: Option<String>, scripts: (&Path, &Path)) -> Result<(), Error> {
    let (script, merge) = scripts;
    if !now {
        let merge = word(merge);
        return print(&match array {
            Some(array) => format!(
                "submit: sbatch --array={array} {}\nthen:   sbatch --dependency=afterany:JOB \
                 {merge}   (JOB: the number that the first prints)\n",
                word(script)
            ),
            None => format!("submit: sbatch {merge}\n"),
        });
    }
    let mut after = Vec::new();
    if let Some(array) = array {
        let id = sbatch(&[format!("--array={array}")], script)?;
        print(&format!("submitted: job {id}, --array={array}\n"))?;
        after.push(format!("--dependency=afterany:{id}"));
    }
    let id = sbatch(&after, merge)?;
    print(&format!("submitted: job {id}, {}\n", word(merge)))
}

/// Submits a script and returns the job's number.
fn sbatch(options: &[String], script: &Path) -> Result<String, Error> {
    // An absolute path begins with no dash.
    let place = std::path::absolute(script).map_err(failed)?;
    let mut command = Command::new("sbatch");
    command.arg("--parsable").args(options).arg(place);
    let wrong = |reason: &str| Error::Failed(format!("sbatch {}: {reason}", script.display()));
    let output = command.output().map_err(|error| wrong(&error.to_string()))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        let lines: Vec<&str> = said.lines().map(str::trim).collect();
        return Err(wrong(&lines.join(" ")));
    }
    let said = String::from_utf8_lossy(&output.stdout);
    // The answer is JOB or JOB;CLUSTER.
    let id = said.trim().split(';').next().unwrap_or_default();
    if id.is_empty() || !id.bytes().all(|b| b.is_ascii_digit()) {
        return Err(wrong("it printed no job number"));
    }
    Ok(id.to_owned())
}
