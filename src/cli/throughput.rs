//! `asobench throughput`: measures trials per second, of one fixed workload in relation to the machine's peak, or of a
//! study's cells.

mod arguments;
mod rates;
mod study;
mod w98;

use super::error::Error;

pub(super) use arguments::Arguments;

pub(super) fn run_command(arguments: &Arguments) -> Result<(), Error> {
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let mut threads: Vec<usize> = arguments.threads.iter().map(|t| usize::from(*t)).collect();
    if threads.is_empty() {
        threads = vec![1, processors];
        threads.dedup();
    }
    if let Some(path) = &arguments.file {
        return study::time(path, arguments, &threads);
    }
    w98::time_engines(arguments, &threads, processors)
}
