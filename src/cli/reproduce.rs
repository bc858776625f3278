//! `asobench reproduce`: runs the papers' experiments, and prints which of their claims a typical realisation meets.

mod bobtsov;
mod one_trial;

use super::error::{Error, failed};
use super::run::{execute, threads};
use super::{Format, need, print, print_json, replay};
use crate::claim::{Judged, JudgedNumber};
use crate::names::named_enum;
use crate::report::{Study, draw, verdict_table};
use crate::study::file::{ExperimentFile, TRIAL_LIMIT, TrialRule};
use crate::study::{
    CellSummary, Engine, Experiment, NIKOLOV2023, OutputShare, RunOptions, Summary,
};
use crate::text::{shell_word, visible};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The default folder of the results; replaced at every run.
const DEFAULT_FOLDER: &str = "results/reproduce";

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

/// Simulate the experiments of Nikolov et al. (2023), claims C1 to C3, and of Bobtsov et al.
/// (2023), claims B1 to B3, and print which of them a typical realisation meets.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Whose experiment: all, nikolov or bobtsov
    #[arg(long, value_name = "PAPER", default_value_t)]
    paper: Paper,
    /// Trials in each of the three cells of Nikolov et al.; those of Bobtsov et al. have their
    /// own numbers
    #[arg(
        long, value_name = "M", default_value_t = 10_000, allow_negative_numbers = true,
        value_parser = clap::value_parser!(u64).range(1..=TRIAL_LIMIT)
    )]
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
    /// What computes the trials: auto, lanes or faer
    #[arg(long, value_name = "ENGINE", default_value_t)]
    engine: Engine,
    /// Folder of the results [default: results/reproduce, replaced at every run]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Run it even if `check` expects too little memory or disk
    #[arg(long)]
    anyway: bool,
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
    /// Returns the folder of the results.
    pub(super) fn folder(&self) -> &Path {
        self.out.as_deref().unwrap_or(Path::new(DEFAULT_FOLDER))
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let path = arguments.folder();
    if arguments.replay.is_some() {
        if arguments.paper == Paper::Bobtsov {
            let message = "--replay: trials of Bobtsov et al. are replayed by asobench replay \
                FOLDER CELL:TRIAL";
            return Err(Error::Input(message.to_owned()));
        }
        return nikolov(arguments, path).map(|_| ExitCode::SUCCESS);
    }
    if arguments.paper != Paper::Nikolov {
        bobtsov::check(path)?;
    }
    let mut text = Vec::new();
    let mut entries = Vec::new();
    if arguments.paper != Paper::Bobtsov
        && let Some(study) = nikolov(arguments, path)?
    {
        text.push(report(arguments, &study));
        entries.extend(json(&study.summary));
        entries.extend(claims_json(&study));
    }
    if arguments.paper != Paper::Nikolov {
        let bobtsov = bobtsov::Bobtsov::run(arguments, path)?;
        text.push(bobtsov.text(path));
        entries.extend(bobtsov.json());
    }
    match arguments.format {
        Format::Text => print(&text.join("\n\n"))?,
        Format::Json => print_json(&entries)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Runs the first paper's experiment, or replays a trial of it.
fn nikolov(arguments: &Arguments, path: &Path) -> Result<Option<Study>, Error> {
    let file = ExperimentFile {
        seed: arguments.seed,
        engine: arguments.engine,
        ..ExperimentFile::parse(NIKOLOV2023).map_err(failed)?
    };
    let experiment = Experiment::new(file).map_err(failed)?;
    if let Some(which) = &arguments.replay {
        let options = replay::Options {
            flag: "--replay: ",
            folder: arguments.folder(),
            command: format!(
                "asobench reproduce --seed {} --replay {}",
                arguments.seed,
                shell_word(which)
            ),
            data: arguments.data.as_deref(),
            format: arguments.format,
        };
        replay::show(&experiment, which, &options)?;
        return Ok(None);
    }
    let rule = TrialRule::Fixed(arguments.trials);
    let options = RunOptions {
        threads: threads(arguments.threads),
        fresh: true,
        replace: arguments.out.is_none(),
        figures: &["fig1.svg", "fig2.svg", "fig3.svg"],
        ..RunOptions::default()
    };
    let cells = experiment.cells.iter();
    let first_trials: Result<Vec<_>, _> = cells
        .map(|cell| one_trial::first_trial(&experiment, cell))
        .collect();
    let first_trials = first_trials.map_err(failed)?;
    let figures = |summary: &Summary| {
        let drawn = (1..).zip(summary.cells.iter().zip(&first_trials));
        drawn
            .map(|(i, (cell, one))| (format!("fig{i}.svg"), draw(cell, one)))
            .collect()
    };
    need::ask(&experiment, &rule, options.threads, path, arguments.anyway)?;
    execute(path, "--out ", &experiment, rule, options, figures)?;
    Study::read(path).map(Some).map_err(failed)
}

/// Returns every bound with the shares of its first and last output.
fn json(summary: &Summary) -> Vec<Value> {
    let of_cell = |cell: &CellSummary| -> Vec<Value> {
        let output = |share: &OutputShare, measure| {
            let output = cell.output(&share.output)?;
            Some(json!({
                "estimator": output.estimator,
                "pass": output.pass,
                "quantiles": output.measures.get(&measure),
                "met": share.met,
            }))
        };
        let bounds = cell.bounds.iter().map(|summary| {
            let bound = &summary.bound;
            let ends = [summary.outputs.first(), summary.outputs.last()];
            let ends = ends.map(|share| share.and_then(|share| output(share, bound.measure)));
            json!({
                "claim": cell.claim,
                "figure": bound.measure,
                "label": bound.label(),
                "bound": bound.text(),
                "value": bound.below,
                "rounding": bound.rounding,
                "estimators": ends,
                "verdict": summary.verdict,
            })
        });
        bounds.collect()
    };
    summary.cells.iter().flat_map(of_cell).collect()
}

/// Returns the table with its notes.
fn report(arguments: &Arguments, study: &Study) -> String {
    let seed = arguments.seed;
    format!(
        "Nikolov et al. (2023): which printed bounds does a typical realisation meet?\n\n\
         {}\
         typical: the lower end of the 95 % Wilson interval of iv(4)'s share is above\n\
         1/2; not typical: its upper end is below 1/2. Digits in parentheses and after \u{b1}\n\
         are Monte-Carlo standard errors. Quantiles and shares are over all trials: a\n\
         failed one ranks last and meets no bound.\n\
         \"= 0\": below 100 eps times the condition number, and below 1e-6. e_a, e_b:\n\
         relative errors of a and b (state-space form); e_x: of the state, k >= N,\n\
         dead-beat observer.\n\
         rms e_x < 0.01 stands for the paper's \"e_x(k) = 0.01\".\n\n{}\n\
         seed {seed}; results in {}\n\
         one trial again: asobench reproduce --seed {seed} --replay C2:0\n",
        verdict_table(&study.summary),
        lines(std::slice::from_ref(study)),
        visible(arguments.folder().display()),
    )
}

/// Returns the verdicts on all claims of some studies, one paragraph each, and how many claims each study tested.
fn lines(studies: &[Study]) -> String {
    let claims = studies.iter().flat_map(|study| &study.judged);
    let claims = claims.map(|claim| wrapped(&visible(&claim.line), "    "));
    let tested = studies.iter().filter_map(|study| {
        let name = match studies {
            [_] => String::new(),
            _ => format!("{}: ", study.name),
        };
        Some(wrapped(&format!("{name}{}", study.tested()?), ""))
    });
    claims.chain(tested).collect()
}

/// Returns the claims of a study with their numbers.
fn claims_json(study: &Study) -> Vec<Value> {
    let claim = |claim: &Judged| {
        let numbers = claim.cells.iter().flat_map(|cell| {
            let named = |number: &JudgedNumber| {
                let name = format!("{}: {}", number.what, cell.place);
                json!({ "name": name, "value": number.value, "mcse": number.error })
            };
            cell.numbers.iter().map(named)
        });
        json!({
            "claim": claim.id,
            "text": claim.text,
            "verdict": claim.verdict.name(),
            "because": claim.line,
            "numbers": numbers.collect::<Vec<Value>>(),
        })
    };
    study.judged.iter().map(claim).collect()
}

/// Wraps a paragraph at 80 columns; all lines after the first begin with `indent`.
fn wrapped(text: &str, indent: &str) -> String {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let last = lines.len() - 1;
        let line = &mut lines[last];
        if line.trim().is_empty() {
            line.push_str(word);
        } else if line.chars().count() + 1 + word.chars().count() <= 80 {
            line.push(' ');
            line.push_str(word);
        } else {
            lines.push(format!("{indent}{word}"));
        }
    }
    lines.push(String::new());
    lines.join("\n")
}
