//! `asobench replay` and `asobench reproduce --replay`: print every stage of one trial.

mod along;
mod course;
mod printed;
mod which;

use super::error::{Error, bad_file, bad_input, failed};
use super::files::{check_output, write_whole};
use super::memory;
use super::output::{Format, note, print};
use super::programs::{self, Consent};
use crate::data::{Realisation, csv};
use crate::files::Kind;
use crate::study::file::ExperimentFile;
use crate::study::{
    DiscreteCell, Experiment, FolderError, Row, Source, Trial, TrialRecord, Trials, Worker, read_results,
};
use crate::text::{number, shell_word, visible};
use crate::worker::ask_once;
use printed::{Replay, stored};
use std::path::PathBuf;

pub(super) use printed::Options;
pub(super) use which::Which;

/// Compute one trial of a results folder again and print every stage
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Folder of the results, as `asobench run` left it
    folder: PathBuf,
    /// Cell, by its claim or number, and trial: C2:17 or 1:17; cell=1:17 if 1 is also a claim
    #[arg(value_name = "CELL:TRIAL")]
    which: Which,
    /// Write that trial's k, u, y to a file for `asobench estimate`
    #[arg(long, aliases = ["out", "output"], short_alias = 'o', value_name = "FILE.csv")]
    data: Option<PathBuf>,
    /// Print the samples of every stage too, not their first ones alone
    #[arg(long, aliases = ["verbose", "full"])]
    samples: bool,
    #[command(flatten)]
    consent: Consent,
    /// Form of the output: text or json
    #[arg(long, value_name = "FORMAT", default_value_t)]
    format: Format,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let folder = &arguments.folder;
    let manifest = read_results(folder, |manifest| Ok::<_, FolderError>(manifest.clone()));
    let manifest = manifest.map_err(bad_input)?;
    let file = ExperimentFile::from_json(&manifest["experiment"]);
    let experiment = file
        .and_then(Experiment::new)
        .map_err(bad_file(&folder.join("manifest.json")))?;
    programs::permit_here(&experiment, folder, &arguments.consent)?;
    let command = format!(
        "asobench replay {} {}",
        shell_word(folder.display()),
        shell_word(&arguments.which)
    );
    let options = Options {
        flag: "",
        folder,
        command,
        data: arguments.data.as_deref(),
        format: arguments.format,
        samples: arguments.samples,
    };
    show(&experiment, &arguments.which, &options)
}

/// Replays a trial and prints it.
pub(super) fn show(experiment: &Experiment, which: &Which, options: &Options<'_>) -> Result<(), Error> {
    let index = which.cell(options.flag, experiment)?;
    check_output("--data", options.data, Kind::Record)?;
    let cell = &experiment.cells[index];
    let discrete = match &cell.source {
        Source::Discrete(of) => of,
        Source::Continuous(of) => return course::show(experiment, index, of, which.trial, options),
    };
    // The stages are computed by faer, the rows by the engine of the study.
    memory::fits(experiment, index..index + 1, 2)?;
    let mut trial = Trial::new(experiment, cell).map_err(failed)?;
    trial.keep_courses();
    trial.run(which.trial).map_err(failed)?;
    let record = trial.record();
    if let Some(path) = options.data {
        let comments = comments(discrete, record.realisation, &options.command);
        let data = record.realisation;
        write_whole("--data", path, Kind::Record, |to| {
            csv::write(to, &comments, &data.u, &data.y)
        })?;
        note(&format!("wrote {}", path.display()));
    }
    let mut trials = Trials::of_all_measures(experiment, cell);
    let mut worker = Worker::new(experiment, cell).map_err(failed)?;
    let ran = worker.run_into(which.trial..which.trial + 1, &mut trials);
    ran.map_err(failed)?;
    let rows: Vec<Row> = trials.rows.iter().collect();
    let record = TrialRecord { rows: &rows, ..record };
    let stored = stored(options.folder, experiment, index, &trials.rows);
    let mut replay = Replay::new(experiment, (index, discrete), which.trial, &record);
    replay.stages.extend(along::courses(experiment, &trial));
    replay.stored = stored;
    replay.may_differ = programs::not_deterministic(experiment)?;
    replay.print(options)?;
    match options.format {
        Format::Text => messages(experiment, discrete, which.trial),
        Format::Json => Ok(()),
    }
}

/// Prints the messages to each program for one trial, and its answers.
fn messages(experiment: &Experiment, cell: &DiscreteCell, trial: u64) -> Result<(), Error> {
    for program in &experiment.programs {
        let problem = cell.problem(cell.window);
        let (record, _) = cell.record_for_program(experiment.file.seed, trial);
        let told = match ask_once(program, &problem, &[record]).map_err(failed)? {
            Ok(answered) => format!("sent:\n{}answered:\n{}", answered.messages[0], answered.messages[1]),
            Err(wrong) => format!("sent alone, it is {wrong}\n"),
        };
        print(&format!("\nProgram {}, {told}", visible(&program.name)))?;
        program.end();
    }
    Ok(())
}

/// Returns the truth as comment lines of a CSV file.
fn comments(cell: &DiscreteCell, record: &Realisation, command: &str) -> Vec<String> {
    let truth = &record.truth;
    vec![
        command.to_owned(),
        format!(
            "order: {}; window: {}; eta: {} %",
            truth.a.len(),
            cell.window,
            number(cell.eta)
        ),
        format!("true a: {:?}", truth.a),
        format!("true b: {:?}", truth.b),
        format!("true h: {:?}", truth.h),
        format!("true x0: {:?}", truth.x0),
    ]
}
