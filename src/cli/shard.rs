//! `asobench shard`: computes one shard of a plan.

use super::cluster::{parse_time, refused, word};
use super::error::{Error, failed};
use super::execute::threads;
use super::exit_code::AGAIN;
use super::output::{note, print};
use super::programs::{self, Consent};
use super::{memory, progress};
use crate::study::RunError;
use crate::study::cluster::{ClusterError, Process, ShardOptions, ShardPlan, compute_shard, shard_folder};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Compute one shard of a plan, in a folder of this process's own. Blocks that earlier processes
/// left are not computed again. Stopped by SIGTERM or --time-limit it ends with exit code 75: run it
/// again.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The plan, as `asobench plan` writes it
    plan: PathBuf,
    /// The shard, such as 3 or 3/12, from 1 [default: SLURM_ARRAY_TASK_ID]
    #[arg(value_name = "I/S")]
    shard: Option<String>,
    /// Folder of the results of all shards, on a file system that the machines share [default:
    /// NAME-shards beside the plan]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Threads [default: SLURM_CPUS_PER_TASK, else as many processors as this process may use]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Stop after so long, such as 90s, 30m or 2h
    #[arg(long, value_name = "T", value_parser = parse_time)]
    time_limit: Option<Duration>,
    /// Trials in a block; blocks are computed and stored whole [default: half a second of work]
    #[arg(long, value_name = "B", value_parser = clap::value_parser!(u64).range(1..))]
    block: Option<u64>,
    #[command(flatten)]
    consent: Consent,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let path = &arguments.plan;
    let (plan, experiment) = ShardPlan::read(path).map_err(refused)?;
    let index = index(arguments.shard.as_deref(), plan.shards.len(), path)?;
    programs::permit_here(&experiment, path, &arguments.consent)?;
    let options = ShardOptions {
        threads: allocated(arguments.threads),
        block: arguments.block,
    };
    for part in &plan.shards[index] {
        memory::fits(&experiment, part.cell..part.cell + 1, options.threads)?;
    }
    let default = || ShardPlan::default_folder(path);
    let folder = arguments.out.clone().unwrap_or_else(default);
    // The job goes back into the queue.
    progress::exit_with(AGAIN);
    let stop = progress::stop_flag()?;
    if let Some(limit) = arguments.time_limit {
        stop_after(limit, &stop)?;
    }
    let mut display = progress::Display::new(plan.shards[index].len());
    let done = compute_shard(
        &plan,
        &experiment,
        index,
        &folder,
        (options, &this_process()),
        &stop,
        |event| display.show(&event),
        note,
    );
    display.clear();
    programs::conclude(&experiment, &shard_folder(&folder, index));
    let total = plan.shards.len();
    let number = index + 1;
    match done {
        Ok(()) => {
            if let Some(speed) = display.speed() {
                note(&speed);
            }
            print(&format!(
                "shard {number} of {total}: all {} trials are there, in {}\n",
                plan.trials_of_shard(index),
                word(&shard_folder(&folder, index))
            ))
        }
        Err(ClusterError::Run(RunError::Interrupted { .. })) => {
            let out = arguments.out.as_ref();
            let out = out.map_or_else(String::new, |out| format!(" --out {}", word(out)));
            let allow = arguments.consent.flags();
            Err(Error::Again(format!(
                "stopped, run again: asobench shard {} {number}/{total}{out}{allow}",
                word(path)
            )))
        }
        Err(error) => Err(refused(error)),
    }
}

/// Returns the index of the shard, from 0. The total comes from the plan alone: a job that is resubmitted for some of
/// its tasks has another number of tasks.
fn index(given: Option<&str>, shards: usize, plan: &Path) -> Result<usize, Error> {
    const TASK: &str = "SLURM_ARRAY_TASK_ID";
    let (flag, text) = match (given, std::env::var(TASK)) {
        (Some(given), _) => ("", given.to_owned()),
        (None, Ok(task)) => (TASK, task),
        (None, Err(_)) => {
            return Err(Error::Input(format!(
                "expected a shard's number, such as 3/{shards}, or {TASK}"
            )));
        }
    };
    let (number, total) = match text.split_once('/') {
        Some((number, total)) => (number, total.parse()),
        None => (&text[..], Ok(shards)),
    };
    let what = match number.parse::<usize>() {
        _ if total != Ok(shards) => "not the plan's number of shards",
        Ok(number) if (1..=shards).contains(&number) => return Ok(number - 1),
        Ok(_) => "no such shard",
        Err(_) => "not a shard's number",
    };
    let (space, plan) = (if flag.is_empty() { "" } else { " " }, plan.display());
    Err(Error::Input(format!(
        "{flag}{space}'{text}': {what}; {plan} has the shards 1 to {shards}"
    )))
}

/// Returns the number of threads: as asked for, as the job has, or as this process may use by its group and affinity.
fn allocated(asked: Option<u16>) -> usize {
    let of_job = || std::env::var("SLURM_CPUS_PER_TASK").ok()?.parse().ok();
    threads(asked.or_else(|| of_job().filter(|count| (1..=1024).contains(count))))
}

/// Raises the flag after some time.
fn stop_after(limit: Duration, stop: &Arc<AtomicBool>) -> Result<(), Error> {
    let stop = Arc::clone(stop);
    let waiting = std::thread::Builder::new().spawn(move || {
        std::thread::sleep(limit);
        stop.store(true, Ordering::Relaxed);
    });
    waiting.map(|_| ()).map_err(failed)
}

/// Describes this process. Slurm's name of the node comes first, because a machine can have several names.
fn this_process() -> Process {
    let of_kernel = || memory::file("/proc/sys/kernel/hostname");
    let host = std::env::var("SLURMD_NODENAME").ok().or_else(of_kernel);
    let host = host.or_else(|| std::env::var("HOSTNAME").ok());
    let host = host.filter(|host| !host.trim().is_empty());
    let host: String = host.as_deref().unwrap_or("host").trim().chars().take(60).collect();
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '.' || c == '_';
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    Process {
        host: host.replace(|c| !plain(c), "_"),
        pid: std::process::id(),
        begin: since.map_or(0, |time| time.as_secs()),
        job: std::env::var("SLURM_JOB_ID").ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shard_is_one_of_the_plan() {
        let plan = Path::new("a.plan.json");
        let index_of = |text| index(Some(text), 12, plan).map_err(|error| error.to_string());
        assert_eq!(index_of("1"), Ok(0));
        assert_eq!(index_of("12/12"), Ok(11));
        for (text, part) in [
            ("0", "no such shard"),
            ("13", "no such shard"),
            ("3/7", "not the plan's number"),
            ("x", "not a shard's number"),
            ("", "not a shard's number"),
            ("-1", "not a shard's number"),
        ] {
            let error = index_of(text).unwrap_err();
            assert!(error.contains(part) && error.contains("1 to 12"), "{error}");
        }
    }
}
