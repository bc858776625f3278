//! `asobench reproduce`: the paper's experiment, and what a typical realisation meets of its bounds.

use super::error::{Error, failed};
use super::{Format, note, print, progress, replay};
use crate::report::{NIKOLOV2023, Summary, draw, verdict_table};
use crate::study::{
    Curves, Experiment, FolderError, ResultsFolder, RunError, StoreError, TrialTable, TrialWriter,
    run as run_study,
};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Where results go without `--out`; replaced at every run.
const DEFAULT_FOLDER: &str = "results/reproduce";

/// Simulate the experiment of Nikolov et al. (2023), claims C1 to C3, and print which of the printed
/// accuracy bounds a typical realisation meets.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Trials in each of the three cells
    #[arg(long, value_name = "M", default_value_t = 10_000, allow_negative_numbers = true, value_parser = clap::value_parser!(u64).range(1..=4_000_000_000))]
    pub(super) trials: u64,
    /// Seed of the random streams
    #[arg(
        long,
        value_name = "S",
        default_value_t = 2023,
        allow_negative_numbers = true
    )]
    pub(super) seed: u64,
    /// Threads [default: one per processor]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Folder of the results [default: results/reproduce, replaced at every run]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Compute one trial again and print every stage: C2:17, or the cell's number, 1:17
    #[arg(long, value_name = "CELL:TRIAL")]
    replay: Option<replay::Which>,
    /// With --replay: write that trial's k, u, y to a file for `asobench estimate`
    #[arg(long, value_name = "FILE.csv", requires = "replay")]
    pub(super) data: Option<PathBuf>,
    /// Form of the output: text or json
    #[arg(long, value_name = "FORMAT", default_value_t)]
    pub(super) format: Format,
}

impl Arguments {
    /// The folder of the results.
    pub(super) fn folder(&self) -> &Path {
        self.out.as_deref().unwrap_or(Path::new(DEFAULT_FOLDER))
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let experiment = Experiment::nikolov2023(arguments.seed);
    experiment.validate().map_err(failed)?;
    if let Some(which) = &arguments.replay {
        return replay::run(arguments, &experiment, which);
    }
    let folder = open_folder(arguments, &experiment)?;
    let (summary, path) = compute(arguments, &experiment, folder)?;
    match arguments.format {
        Format::Text => print(&report(arguments, &summary, &path))?,
        Format::Json => {
            let text = serde_json::to_string_pretty(&summary.bounds).map_err(failed)?;
            print(&format!("{text}\n"))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Opens the folder, refusing one of another design unless it is the default one.
fn open_folder(arguments: &Arguments, experiment: &Experiment) -> Result<ResultsFolder, Error> {
    let folder = ResultsFolder::open(arguments.folder()).map_err(|error| match error {
        FolderError::Io { path, source } => Error::Input(format!(
            "--out {}: cannot write there ({source})",
            path.display()
        )),
        other => Error::Input(format!("--out {other}")),
    })?;
    let replaces = if arguments.out.is_none() {
        folder.path().join("trials.parquet").exists()
    } else {
        folder
            .check_design(&experiment.describe())
            .map_err(|error| Error::Input(format!("--out {error}")))?
    };
    if replaces {
        note(&format!(
            "replacing the results in {}",
            folder.path().display()
        ));
    }
    Ok(folder)
}

/// Runs the study and writes every file; returns the summary and the folder.
fn compute(
    arguments: &Arguments,
    experiment: &Experiment,
    mut folder: ResultsFolder,
) -> Result<(Summary, PathBuf), Error> {
    let trials = folder.stage("trials.parquet");
    let curves = run_trials(arguments, experiment, &trials)?;
    let table = TrialTable::open(&trials).map_err(failed)?;
    let summary = Summary::of(
        &table,
        &experiment.cells,
        &curves,
        NIKOLOV2023,
        arguments.trials,
        arguments.seed,
    )
    .map_err(failed)?;
    for (i, cell) in summary.cells.iter().enumerate() {
        let svg = draw(&summary, cell).map_err(failed)?;
        let name = format!("fig{}.svg", i + 1);
        folder.write(&name, svg.as_bytes()).map_err(failed)?;
    }
    let mut write_json = |name, value: Value| {
        let text = serde_json::to_string_pretty(&value).map_err(failed)?;
        folder
            .write(name, format!("{text}\n").as_bytes())
            .map_err(failed)
    };
    write_json("summary.json", json!(summary))?;
    write_json("manifest.json", manifest(arguments, experiment))?;
    let path = folder.path().to_owned();
    folder.publish().map_err(failed)?;
    Ok((summary, path))
}

/// Runs every trial into the staged Parquet file; returns the curves of each cell.
fn run_trials(
    arguments: &Arguments,
    experiment: &Experiment,
    path: &Path,
) -> Result<Vec<Curves>, Error> {
    let threads = arguments.threads.map_or_else(
        || std::thread::available_parallelism().map_or(1, usize::from),
        usize::from,
    );
    let stop = progress::stop_flag()?;
    let bar = progress::bar(arguments.trials * experiment.cells.len() as u64);
    let mut writer = TrialWriter::create(path, experiment).map_err(failed)?;
    let ran = run_study(experiment, arguments.trials, threads, &stop, |block| {
        bar.inc(block.trials.end - block.trials.start);
        writer.write(&block)
    });
    bar.finish_and_clear();
    let curves = ran.map_err(|error: RunError<StoreError>| match error {
        RunError::Interrupted { .. } => Error::Interrupted(format!("{error}; nothing was written")),
        other => failed(other),
    })?;
    writer.finish().map_err(failed)?;
    Ok(curves)
}

/// What made the results: nothing of the host, the time or the threads.
fn manifest(arguments: &Arguments, experiment: &Experiment) -> Value {
    json!({
        "program": "asobench",
        "version": env!("CARGO_PKG_VERSION"),
        "git_revision": option_env!("ASOBENCH_GIT_REVISION"),
        "command": "reproduce",
        "trials": arguments.trials,
        "experiment": experiment.describe(),
    })
}

/// The table with its notes.
fn report(arguments: &Arguments, summary: &Summary, folder: &Path) -> String {
    let seed = arguments.seed;
    format!(
        "Nikolov et al. (2023): which printed bounds does a typical realisation meet?\n\n\
         {}\
         typical: the lower end of the 95 % Wilson interval of IV(4)'s share is above\n\
         1/2; not typical: its upper end is below 1/2. Digits in parentheses and after \u{b1}\n\
         are Monte-Carlo standard errors. Quantiles are over the trials that have the\n\
         figure, shares over all trials (a failed one meets no bound).\n\
         \"= 0\": below 100 eps times the condition number. e_a, e_b: relative errors of a\n\
         and b (state-space form); e_x: of the state, k >= N, dead-beat observer.\n\
         rms e_x < 0.01 stands for the paper's \"e_x(k) = 0.01\".\n\n\
         seed {seed}; results in {}\n\
         one trial again: asobench reproduce --seed {seed} --replay C2:0\n",
        verdict_table(summary),
        folder.display(),
    )
}
