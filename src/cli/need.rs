//! Compares what a run needs with what is available: memory, and room on disk.

use super::error::Error;
use super::memory;
use super::output::asked;
use crate::study::file::TrialRule;
use crate::study::{Done, Experiment, Forecast};
use std::path::Path;

/// The memory and disk space that are available, in bytes; `None` if unknown.
pub(super) struct Room {
    /// Memory that is available.
    pub(super) memory: Option<f64>,
    /// Room on the disk of a folder.
    pub(super) disk: Option<f64>,
}

impl Room {
    /// Returns the room for results in a folder, which need not exist.
    pub(super) fn of(folder: &Path) -> Self {
        Self {
            memory: memory::available(),
            disk: free_disk(folder),
        }
    }
}

/// The largest needs of a run, in bytes.
pub(super) struct Need {
    /// The memory beyond that of the program and the experiment.
    pub(super) memory: f64,
    /// Bytes still to be written.
    pub(super) disk: f64,
}

impl Need {
    /// Returns the needs of a run with so many trials of each cell, of which `done` are already stored.
    pub(super) fn of(forecast: &Forecast, trials: u64, threads: usize, done: Done) -> Self {
        let disk = forecast.disk(trials).of_run();
        Self {
            memory: forecast.memory(trials, threads),
            disk: (disk - done.bytes as f64).max(0.0),
        }
    }

    /// Returns in words what there is not enough of.
    pub(super) fn beyond(&self, room: &Room) -> Option<String> {
        let short = |need: f64, room: Option<f64>, what: &str| {
            let room = room.filter(|room| need > *room)?;
            Some(format!(
                "about {} of {what}, but {} are free",
                amount(need),
                amount(room)
            ))
        };
        let disk = short(self.disk, room.disk, "disk");
        let memory = short(self.memory, room.memory, "memory");
        let all: Vec<String> = disk.into_iter().chain(memory).collect();
        (!all.is_empty()).then(|| format!("needs {}", all.join(" and ")))
    }
}

/// Asks on a terminal before a run that cannot fit; elsewhere refuses it. Does neither if `anyway`.
pub(super) fn ask(
    experiment: &Experiment,
    rule: &TrialRule,
    threads: usize,
    folder: &Path,
    anyway: bool,
) -> Result<(), Error> {
    if anyway {
        return Ok(());
    }
    let done = crate::study::done(folder, experiment);
    let (_, most) = rule.extent();
    let forecast = Forecast::of_sizes(experiment, most);
    let need = Need::of(&forecast, most, threads, done);
    let Some(beyond) = need.beyond(&Room::of(folder)) else {
        return Ok(());
    };
    if asked(&format!("The run {beyond}. Run it all the same?"))? == Some(true) {
        return Ok(());
    }
    let folder = folder.display();
    Err(Error::Input(format!(
        "--out {folder}: the run {beyond}; --anyway runs it"
    )))
}

/// Returns the free space on the disk of a folder, or of its nearest existing parent.
#[cfg(unix)]
fn free_disk(folder: &Path) -> Option<f64> {
    let folder = std::path::absolute(folder).ok()?;
    let there = folder.ancestors().find(|path| path.is_dir())?;
    let disk = rustix::fs::statvfs(there).ok()?;
    // A file system without blocks, such as /proc, has no free space to report.
    (disk.f_blocks > 0).then_some(disk.f_bavail as f64 * disk.f_frsize as f64)
}

#[cfg(not(unix))]
fn free_disk(_: &Path) -> Option<f64> {
    None
}

/// Formats a number of bytes with a suitable unit.
pub(super) fn amount(bytes: f64) -> String {
    const UNITS: [&str; 5] = ["kB", "MB", "GB", "TB", "PB"];
    let mut value = bytes / 1e3;
    let mut units = UNITS.into_iter();
    let mut unit = units.next().unwrap_or_default();
    for larger in units {
        // A value that would be shown as 1000 is shown as 1.0 of the larger unit.
        if value.ceil() < 1000.0 {
            break;
        }
        (value, unit) = (value / 1e3, larger);
    }
    if value < 9.95 && unit != "kB" {
        format!("{value:.1} {unit}")
    } else {
        format!("{:.0} {unit}", value.ceil())
    }
}

/// Formats a time in a suitable unit.
pub(super) fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "a second".to_owned(),
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s if s < 172_800.0 => format!("{:.1} h", s / 3600.0),
        s => format!("{:.0} days", s / 86_400.0),
    }
}

/// Formats one text, or two different ones with "to" between them.
pub(super) fn span<T: std::fmt::Display + PartialEq>((least, most): (T, T)) -> String {
    if least == most {
        least.to_string()
    } else {
        format!("{least} to {most}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_have_two_or_three_digits() {
        for (bytes, text) in [
            (0.0, "0 kB"),
            (12_345.0, "13 kB"),
            (999_000.0, "999 kB"),
            (999_400.0, "1.0 MB"),
            (1.25e6, "1.2 MB"),
            (48.2e6, "49 MB"),
            (4.762e12, "4.8 TB"),
            (2e18, "2000 PB"),
        ] {
            assert_eq!(amount(bytes), text);
        }
    }

    #[test]
    fn what_is_short_is_told() {
        let need = Need { memory: 3e9, disk: 5e9 };
        let room = |memory, disk| Room { memory, disk };
        assert_eq!(need.beyond(&room(Some(4e9), Some(6e9))), None);
        assert_eq!(need.beyond(&room(None, None)), None);
        assert_eq!(
            need.beyond(&room(Some(2e9), Some(6e9))).as_deref(),
            Some("needs about 3.0 GB of memory, but 2.0 GB are free")
        );
        let both = need.beyond(&room(Some(2e9), Some(1e9))).unwrap();
        assert!(both.contains("5.0 GB of disk, but 1.0 GB") && both.contains(" and about 3.0 GB"));
    }
}
