//! Shared parts of the commands for studies over many machines.

use super::error::{Error, bad_input, failed};
use super::execute;
use super::output::note;
use crate::files::is_there;
use crate::study::cluster::{ClusterError, Collection, ShardPlan, Status};
use crate::study::{BlockError, CampaignError, Experiment, RunError};
use crate::text::shell_word;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The largest number of lines about rejected or missing items.
pub(super) const LINES: usize = 20;

/// Returns an input error if the user can correct the cause, otherwise a failure.
pub(super) fn refused(error: impl Into<ClusterError>) -> Error {
    match error.into() {
        ClusterError::File(error) | ClusterError::Block(BlockError::File(error))
            if error.foreign || error.source.kind() == std::io::ErrorKind::NotFound =>
        {
            bad_input(error)
        }
        ClusterError::Run(RunError::Interrupted { .. }) | ClusterError::Campaign(CampaignError::Stopped) => {
            Error::Interrupted("interrupted; nothing was written".to_owned())
        }
        // These commands compute no trials, so they have no --repair.
        ClusterError::Campaign(CampaignError::Block(error @ BlockError::Damaged { .. })) => {
            let advice = "remove this file, then its trials are taken or computed again";
            Error::Input(format!("--out {error}; {advice}"))
        }
        ClusterError::Campaign(error) => execute::refused(execute::OUT, error),
        error @ (ClusterError::File(_) | ClusterError::Block(_) | ClusterError::Run(_)) => failed(error),
        error => bad_input(error),
    }
}

/// Returns the job script of a plan, which `slurm` writes beside it.
pub(super) fn script_of(plan: &Path) -> PathBuf {
    let mut name = ShardPlan::name_of(plan);
    name.push(".sbatch");
    plan.with_file_name(name)
}

/// Returns a path as a word of a command.
pub(super) fn word(path: &Path) -> String {
    shell_word(path.display())
}

/// Collects what is in the folders of a command, or if none are given in the plan's default one, and says what was
/// found and not used. With `may_lack` the default folder need not exist yet.
pub(super) fn collected(
    (plan, given): (&Path, &[PathBuf]),
    experiment: &Experiment,
    verify: bool,
    may_lack: bool,
) -> Result<Collection, Error> {
    let default = [ShardPlan::default_folder(plan)];
    let mut folders = if given.is_empty() { &default } else { given };
    if may_lack && folders == default && !is_there(&default[0]) {
        folders = &[];
    }
    let found = Collection::from_folders(folders, experiment, verify).map_err(refused)?;
    for line in found.refused.iter().take(LINES) {
        note(line);
    }
    if let Some(more @ 1..) = found.refused.len().checked_sub(LINES) {
        note(&format!("{more} more, not taken"));
    }
    Ok(found)
}

/// Returns the lines that say how to compute what is missing: as a job if the plan has a job script.
pub(super) fn again(path: &Path, plan: &ShardPlan, status: &Status) -> String {
    let (script, plan_word) = (script_of(path), word(path));
    let unplanned = match status.unplanned {
        0 => String::new(),
        trials => format!(
            "{trials} trials are in no shard of this plan; plan again: asobench plan {plan_word} --out {plan_word}\n"
        ),
    };
    let array = status.array();
    let first = array.split([',', '-']).next().unwrap_or_default();
    let again = match (first, is_there(&script)) {
        ("", _) => String::new(),
        (_, true) => format!("run again: sbatch --array={array} {}\n", word(&script)),
        (_, false) => format!(
            "run again: shards {array}, such as: asobench shard {plan_word} {first}/{}\n",
            plan.shards.len()
        ),
    };
    unplanned + &again
}

/// Parses a time as people and Slurm write it: 90s, 30m, 2h, 1d, 1:30:00, 1-12:00:00.
pub(super) fn parse_time(text: &str) -> Result<Duration, String> {
    let number = |text: &str| {
        let digits = !text.is_empty() && text.len() <= 9 && text.bytes().all(|b| b.is_ascii_digit());
        text.parse::<u64>().ok().filter(|_| digits)
    };
    let seconds = || {
        for (unit, seconds) in [("s", 1), ("m", 60), ("h", 3600), ("d", 86_400)] {
            if let Some(count) = text.strip_suffix(unit) {
                return Some(number(count)? * seconds);
            }
        }
        let (days, rest) = match text.split_once('-') {
            Some((days, rest)) => (Some(number(days)?), rest),
            None => (None, text),
        };
        let parts: Option<Vec<u64>> = rest.split(':').map(number).collect();
        let of_day = match (days, &parts?[..]) {
            (_, [h, m, s]) => h * 3600 + m * 60 + s,
            (Some(_), [h, m]) => h * 3600 + m * 60,
            (Some(_), [h]) => h * 3600,
            (None, [m, s]) => m * 60 + s,
            _ => return None,
        };
        Some(days.unwrap_or(0) * 86_400 + of_day)
    };
    let seconds = seconds().filter(|seconds| *seconds > 0);
    let wrong = || "expected a time such as 90s, 30m, 2h, 12:00:00 or 1-12:00:00".to_owned();
    seconds.map(Duration::from_secs).ok_or_else(wrong)
}

/// Formats a time as Slurm does.
pub(super) fn slurm_time(time: Duration) -> String {
    let seconds = time.as_secs();
    let (days, rest) = (seconds / 86_400, seconds % 86_400);
    let clock = format!("{:02}:{:02}:{:02}", rest / 3600, rest / 60 % 60, rest % 60);
    if days > 0 { format!("{days}-{clock}") } else { clock }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The forms of --time in sbatch(1), except a bare number. That means minutes there, but would be ambiguous here.
    #[test]
    fn times_are_those_of_slurm() {
        for (text, seconds) in [
            ("90s", 90),
            ("30m", 1800),
            ("2h", 7200),
            ("1d", 86_400),
            ("10:30", 630),
            ("01:30:00", 5400),
            ("1-12", 129_600),
            ("1-12:30", 131_400),
            ("1-12:00:01", 129_601),
        ] {
            assert_eq!(parse_time(text), Ok(Duration::from_secs(seconds)), "{text}");
        }
        for text in [
            "",
            "90",
            "0s",
            "-1h",
            "1.5h",
            "h",
            "1:2:3:4",
            "1-",
            "99999999999h",
            "1-1:1:1:1",
        ] {
            assert!(parse_time(text).is_err(), "{text}");
        }
        for seconds in [1, 59, 3600, 86_399, 86_400, 129_601] {
            let time = Duration::from_secs(seconds);
            assert_eq!(parse_time(&slurm_time(time)), Ok(time));
        }
    }
}
