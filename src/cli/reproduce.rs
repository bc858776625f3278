//! `asobench reproduce`: runs the papers' experiments, and prints which of their claims a typical realisation meets.

mod arguments;
mod bobtsov;
mod claims;
mod one_trial;

use super::error::{Error, bad_input, failed};
use super::execute::{execute, threads};
use super::output::show;
use super::{need, replay};
use crate::report::{Study, draw, verdict_table};
use crate::study::file::{ExperimentFile, TrialRule};
use crate::study::{CellSummary, Experiment, NIKOLOV2023, OutputShare, RunOptions, Summary};
use crate::text::{shell_word, visible};
use arguments::Paper;
use claims::{claims_json, lines};
use serde_json::{Value, json};
use std::path::Path;

pub(super) use arguments::Arguments;

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let path = arguments.folder();
    if arguments.replay.is_some() {
        if arguments.paper == Paper::Bobtsov {
            return Err(bad_input(
                "--replay: trials of Bobtsov et al. are replayed by asobench replay \
                FOLDER CELL:TRIAL",
            ));
        }
        return nikolov(arguments, path).map(|_| ());
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
        let studies = bobtsov::run(arguments, path)?;
        text.push(bobtsov::text(&studies, path));
        entries.extend(studies.iter().flat_map(claims_json));
    }
    show(arguments.format, || text.join("\n\n"), || entries)
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
            samples: false,
        };
        replay::show(&experiment, which, &options)?;
        return Ok(None);
    }
    let rule = TrialRule::Fixed(arguments.trials);
    let options = RunOptions {
        threads: threads(arguments.threads),
        fresh: true,
        overwrite: arguments.overwrites(),
        figures: &["fig1.svg", "fig2.svg", "fig3.svg"],
        ..RunOptions::default()
    };
    let cells = experiment.cells.iter();
    let first_trials: Result<Vec<_>, _> = cells.map(|cell| one_trial::first_trial(&experiment, cell)).collect();
    let first_trials = first_trials.map_err(failed)?;
    let figures = |summary: &Summary| {
        let drawn = (1..).zip(summary.cells.iter().zip(&first_trials));
        drawn
            .map(|(i, (cell, one))| (format!("fig{i}.svg"), draw(cell, one)))
            .collect()
    };
    need::ask(&experiment, &rule, options.threads, path, arguments.anyway)?;
    execute(path, &experiment, rule, options, figures)?;
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
