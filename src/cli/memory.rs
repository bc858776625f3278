//! How much memory is free, and whether the threads of a run fit into it. This is checked before any memory is taken,
//! because a failed allocation ends the program without a message.

use super::error::Error;
use crate::study::Experiment;
use std::ops::Range;

/// Refuses cells if the threads, each with the buffers of one cell's trials, do not fit into memory.
pub(super) fn fits(experiment: &Experiment, cells: Range<usize>, threads: usize) -> Result<(), Error> {
    let bytes = |cell| (experiment.thread_bytes(cell), cell);
    let (Some((needed, cell)), Some(free)) = (cells.map(bytes).max(), available()) else {
        return Ok(());
    };
    if threads as f64 * needed as f64 <= free {
        return Ok(());
    }
    let mib = |bytes: f64| (bytes / f64::from(1 << 20)).ceil();
    let on_each = match threads {
        1 => String::new(),
        _ => format!(" on each of {threads} threads"),
    };
    Err(Error::Input(format!(
        "a trial of cell {cell} needs {} MiB of memory{on_each}, and {} MiB are free; expected a \
         shorter horizon or window, or fewer threads",
        mib(needed as f64),
        mib(free)
    )))
}

/// Returns the bytes that this process can still allocate: what Linux has without swapping, within the limits of the
/// process and of its group. `None` if unknown.
pub(super) fn available() -> Option<f64> {
    let meminfo = file("/proc/meminfo");
    let free = meminfo.and_then(|text| kibibytes(&text, "MemAvailable:"));
    let limits = file("/proc/self/limits").and_then(|text| address_space(&text));
    let own = file("/proc/self/status").and_then(|text| kibibytes(&text, "VmSize:"));
    let number = |path: &str| file(path)?.trim().parse::<f64>().ok();
    let group = ["/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"].map(number);
    let rest = |limit: Option<f64>, taken: Option<f64>| Some((limit? - taken?).max(0.0));
    let all = [free, rest(limits, own), rest(group[0], group[1])];
    all.into_iter().flatten().reduce(f64::min)
}

/// Returns the bytes that the program and what it has made take now; 0 if unknown.
pub(super) fn taken() -> f64 {
    let taken = file("/proc/self/status").and_then(|text| kibibytes(&text, "VmRSS:"));
    taken.unwrap_or(0.0)
}

/// Reads a file of the kernel.
#[expect(clippy::disallowed_methods, reason = "such files are short")]
pub(super) fn file(path: &str) -> Option<String> {
    std::fs::read_to_string(path).ok()
}

/// Parses the bytes in a line such as `MemAvailable:  1234 kB`.
fn kibibytes(text: &str, name: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let number: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024.0 * number)
}

/// Parses the soft limit of the address space in `/proc/self/limits`; `None` if there is no limit.
fn address_space(text: &str) -> Option<f64> {
    let mut lines = text.lines();
    let line = lines.find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::file::ExperimentFile;

    #[test]
    fn what_linux_writes_is_read() {
        let text = "MemTotal:  24000000 kB\nMemAvailable:   12000000 kB\n";
        assert_eq!(kibibytes(text, "MemAvailable:"), Some(12_288_000_000.0));
        assert_eq!(kibibytes(text, "VmSize:"), None);
        let limits = "\
            Limit                     Soft Limit           Hard Limit           Units     \n\
            Max address space         409600000            unlimited            bytes     \n";
        assert_eq!(address_space(limits), Some(409_600_000.0));
        let limits = limits.replace("409600000", "unlimited");
        assert_eq!(address_space(&limits), None);
    }

    /// u and y of the record, its noise and truth: at least 8 (6 + n) K bytes by faer.
    #[test]
    fn memory_grows_with_what_is_asked_for() {
        let bytes = |settings: &str| {
            let text = format!("engine = \"faer\"\n[settings]\nwindow = 98\n{settings}");
            let experiment = Experiment::new(ExperimentFile::parse(&text).unwrap()).unwrap();
            assert!(fits(&experiment, 0..1, 1).is_ok());
            assert!(fits(&experiment, 0..1, usize::MAX).is_err());
            experiment.thread_bytes(0)
        };
        let short = bytes("horizon = 400");
        let long = bytes("horizon = 400000");
        assert!(short >= 8 * 12 * 400);
        assert!((8 * 12 * 400_000..2 * 8 * 12 * 400_000).contains(&long));
    }
}
