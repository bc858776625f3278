//! The arguments of `asobench throughput`.

use crate::cli::output::Format;
use crate::study::Engine;
use std::path::PathBuf;

/// Time one fixed workload, W98 (n = 6, N = 98, K = 400, least squares and four IV passes,
/// observer), on each engine and number of threads, as a share of the machine's peak of fused
/// multiply-adds. With FILE: time the trials of an experiment file, all cells, outputs and
/// measures, and throw the results away: an upper limit of the speed of `run` on the file.
#[derive(clap::Args)]
pub(in crate::cli) struct Arguments {
    /// Experiment file to time instead of W98
    pub(super) file: Option<PathBuf>,
    /// Set a key of FILE, such as eta=5; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "file")]
    pub(super) set: Vec<String>,
    /// Trials in a repetition, with FILE of each cell [default: about a second's work; with FILE
    /// the file's]
    #[arg(
        long, value_name = "M", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u64).range(100..=1_000_000_000)
    )]
    pub(super) trials: Option<u64>,
    /// Numbers of threads, such as 1,2 [default: one, and one per processor]
    #[arg(
        long, value_name = "LIST", value_delimiter = ',',
        value_parser = clap::value_parser!(u16).range(1..=1024)
    )]
    pub(super) threads: Vec<u16>,
    /// Engines: lanes, faer or both [default: lanes,faer; with FILE the file's]
    #[arg(long, value_name = "LIST", value_delimiter = ',', conflicts_with = "file")]
    pub(super) engine: Vec<Engine>,
    /// Repetitions, of which the median is printed
    #[arg(
        long, value_name = "R", default_value_t = 5,
        value_parser = clap::value_parser!(u16).range(1..=1000)
    )]
    pub(super) repetitions: u16,
    /// Form of the output: text or json
    #[arg(long, value_name = "FORMAT", default_value_t)]
    pub(super) format: Format,
}
