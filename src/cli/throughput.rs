//! `asobench throughput`: measures trials per second, of one fixed workload in relation to the machine's peak, or of a
//! study's cells.

mod arguments;
mod study;
mod w98;

use super::error::{Error, failed};
use crate::study::RunError;
use std::convert::Infallible;
use std::process::ExitCode;
use std::time::Instant;

pub(super) use arguments::Arguments;

pub(super) fn run_command(arguments: &Arguments) -> Result<ExitCode, Error> {
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

/// Trials per second of every repetition, ascending.
struct Rates(Vec<f64>);

impl Rates {
    /// Times repetitions of so many trials each.
    fn measure(repetitions: u16, trials: u64, mut once: impl FnMut() -> Result<(), Error>) -> Result<Self, Error> {
        let mut rates = Vec::new();
        for _ in 0..repetitions {
            let begin = Instant::now();
            once()?;
            rates.push(trials as f64 / begin.elapsed().as_secs_f64());
        }
        rates.sort_by(f64::total_cmp);
        Ok(Self(rates))
    }

    fn median(&self) -> f64 {
        let Self(rates) = self;
        f64::midpoint(rates[(rates.len() - 1) / 2], rates[rates.len() / 2])
    }

    /// The slowest and the fastest.
    fn ends(&self) -> [f64; 2] {
        [self.0[0], self.0[self.0.len() - 1]]
    }
}

/// Returns the error of a run that ended early.
fn ended(error: RunError<Infallible>) -> Error {
    match error {
        RunError::Interrupted { .. } => Error::Interrupted("interrupted".to_owned()),
        error => failed(error),
    }
}
