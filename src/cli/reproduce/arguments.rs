//! The arguments of `asobench reproduce`.

use crate::cli::error::{Error, failed};
use crate::cli::execute::{Overwrite, execute, threads};
use crate::cli::output::Format;
use crate::cli::replay;
use crate::names::named_enum;
use crate::report::Study;
use crate::study::file::{TRIAL_LIMIT, TrialRule};
use crate::study::{Engine, Experiment, RunOptions, Summary};
use std::path::{Path, PathBuf};

named_enum! {
    /// The paper whose experiment is run.
    Paper, "paper" {
        /// Both.
        All = "all",
        /// Nikolov et al. (2023).
        Nikolov = "nikolov",
        /// Bobtsov et al. (2023).
        Bobtsov = "bobtsov",
    }
}

/// The default folder of the results; replaced at every run.
pub(super) const DEFAULT_FOLDER: &str = "results/reproduce";

/// Simulate the experiments of Nikolov et al. (2023), claims C1 to C3, and of Bobtsov et al.
/// (2023), claims B1 to B3, and print which of them a typical realisation meets.
#[derive(clap::Args)]
pub(in crate::cli) struct Arguments {
    /// Whose experiment: all, nikolov or bobtsov
    #[arg(long, value_name = "PAPER", default_value_t)]
    pub(super) paper: Paper,
    /// Trials in each of the three cells of Nikolov et al.; those of Bobtsov et al. have their
    /// own numbers
    #[arg(
        long, value_name = "M", default_value_t = 10_000, allow_negative_numbers = true,
        value_parser = clap::value_parser!(u64).range(1..=TRIAL_LIMIT)
    )]
    pub(super) trials: u64,
    /// Seed of the random streams
    #[arg(long, value_name = "S", default_value_t = 2023, allow_negative_numbers = true)]
    pub(super) seed: u64,
    /// Threads [default: one per processor]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
    /// The engine that computes the trials: auto, lanes or faer
    #[arg(long, value_name = "ENGINE", default_value_t)]
    pub(super) engine: Engine,
    /// Folder of the results [default: results/reproduce, replaced at every run]
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    #[command(flatten)]
    pub(super) overwrite: Overwrite,
    /// Run it even if `check` expects too little memory or disk
    #[arg(long)]
    pub(super) anyway: bool,
    /// Compute one trial again and print every stage: C2:17, or the cell's number, 1:17
    #[arg(long, value_name = "CELL:TRIAL")]
    pub(super) replay: Option<replay::Which>,
    /// With --replay: write that trial's k, u, y to a file for `asobench estimate`
    #[arg(long, value_name = "FILE.csv", requires = "replay")]
    pub(super) data: Option<PathBuf>,
    /// Form of the output: text or json
    #[arg(long, value_name = "FORMAT", default_value_t)]
    pub(super) format: Format,
}

impl Arguments {
    /// Returns the folder of the results.
    pub(super) fn folder(&self) -> &Path {
        self.out.as_deref().unwrap_or(Path::new(DEFAULT_FOLDER))
    }

    /// Runs a paper's study anew in a folder, with figures of these names.
    pub(super) fn study(
        &self,
        path: &Path,
        experiment: &Experiment,
        rule: TrialRule,
        names: &'static [&'static str],
        figures: impl Fn(&Summary) -> Vec<(String, String)>,
    ) -> Result<Study, Error> {
        let options = RunOptions {
            threads: threads(self.threads),
            fresh: true,
            overwrite: self.out.is_none() || self.overwrite.overwrite,
            figures: names,
            ..RunOptions::default()
        };
        execute(path, experiment, rule, options, figures)?;
        Study::read(path).map_err(failed)
    }
}
