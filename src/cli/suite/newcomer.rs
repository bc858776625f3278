//! `asobench suite FILE`: a method of a user's file on the records of the suite, beside the methods whose results the
//! program carries.

use super::page::{self, Beside};
use super::part::{How, Part, wrong};
use super::run::compute;
use crate::cli::cluster::word;
use crate::cli::error::{Error, failed};
use crate::cli::output::note;
use crate::cli::programs::{self, Consent};
use crate::study::file::{ExperimentFile, MethodTable};
use crate::study::{Experiment, Trial};
use crate::suite::{Competitor, Suite, shipped};
use crate::text::{file_part, visible};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Records of the smoke test.
const RECORDS: u64 = 3;

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Experiment file whose one method takes part: an estimator with options, or a program
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    #[command(flatten)]
    part: Part,
    #[command(flatten)]
    how: How,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let Arguments { file, part, how } = arguments;
    let Some(path) = file else {
        return Err(Error::Input(
            "expected an experiment file, or run, list, show, scores, published, times, recorded"
                .to_owned(),
        ));
    };
    let suite = part.suite()?;
    let competitor = Competitor::Own(Box::new(method(path)?));
    let name = competitor.name();
    let mut methods = shipped(&suite).map_err(|error| page::refused(&error))?;
    if methods.iter().any(|of| of.method == name) {
        let message = format!(
            "'{}' is the name of a method of the suite; expected another 'name'",
            visible(&name)
        );
        return Err(Error::Input(format!("{}: {message}", path.display())));
    }
    smoke(&suite, &competitor, path, how)?;
    let default = || PathBuf::from(format!("{}-{}", part.folder(), file_part(&name)));
    let out = how.out.clone().unwrap_or_else(default);
    let own = compute(&suite, &[competitor], (how, Some(path)), &out)?;
    methods.splice(0..0, own);
    let beside = Beside {
        methods: &methods,
        newcomer: Some(&name),
        part,
        command: format!(
            "asobench suite {} {}{} --out {}",
            word(path),
            part.flags(),
            how.consent.flags(),
            word(&out)
        ),
    };
    page::write(&suite, &beside, &out)?;
    page::print_scores(&suite, &beside, &out)?;
    Ok(ExitCode::SUCCESS)
}

/// The one method of a file.
pub(super) fn method(path: &Path) -> Result<MethodTable, Error> {
    if let Some(lines) = of_program(path) {
        return Err(Error::Usage(lines));
    }
    let file = ExperimentFile::read(path).map_err(|error| Error::Input(error.to_string()))?;
    let of_file = |message: String| Error::Input(format!("{}: {message}", path.display()));
    let file = file.resolve().map_err(|error| of_file(error.to_string()))?;
    let count = file.methods.len();
    let mut methods = file.methods.into_iter();
    match (methods.next(), count) {
        (Some(method), 1) => Ok(method),
        _ => Err(of_file(format!(
            "methods: {count}; expected one, the newcomer"
        ))),
    }
}

/// The experiment file to write for a file that is a program itself: it names the program.
fn of_program(path: &Path) -> Option<Vec<String>> {
    const INTERPRETERS: [(&str, &str); 5] = [
        ("py", "python3"),
        ("m", "octave"),
        ("R", "Rscript"),
        ("jl", "julia"),
        ("sh", "sh"),
    ];
    let form = path.extension()?.to_str()?;
    let (_, interpreter) = INTERPRETERS
        .iter()
        .find(|(of, _)| of.eq_ignore_ascii_case(form))?;
    let file = visible(path.file_name()?.display());
    let name = visible(path.file_stem()?.display());
    Some(vec![
        format!(
            "{}: a program; expected an experiment file that names it, such as {name}.toml beside it:",
            visible(path.display())
        ),
        "title = \"My method\"".to_owned(),
        "[[methods]]".to_owned(),
        format!("name = {name:?}"),
        format!("command = [{interpreter:?}, {file:?}]"),
        format!("try: asobench test-method {name}.toml, then asobench suite {name}.toml"),
    ])
}

/// The experiment of a user's file, its programs started and told apart by their version.
pub(super) fn started(
    experiment: Experiment,
    path: &Path,
    consent: &Consent,
) -> Result<Experiment, Error> {
    let (file, introduced) = programs::introduced(experiment.file, path, consent)?;
    let experiment = Experiment::new(file).map_err(failed)?;
    programs::take_over(&experiment, introduced.as_ref());
    Ok(experiment)
}

/// Runs the method on a few records of the first study. At least one must leave a model.
fn smoke(suite: &Suite, competitor: &Competitor, path: &Path, how: &How) -> Result<(), Error> {
    let Some(study) = suite.studies.first() else {
        return Ok(());
    };
    let made = study.experiment(std::slice::from_ref(competitor), RECORDS);
    let (experiment, declined) = made.map_err(|error| wrong(&error))?;
    let Some(experiment) = experiment else {
        let reason = declined
            .into_iter()
            .next()
            .map_or_else(String::new, |(_, reason)| reason);
        return Err(Error::Input(format!("{}: {reason}", path.display())));
    };
    let experiment = started(experiment, path, &how.consent)?;
    let mut words: BTreeMap<String, u64> = BTreeMap::new();
    let mut trial = Trial::new(&experiment, &experiment.cells[0]).map_err(failed)?;
    for number in 0..RECORDS {
        for row in trial.run(number).map_err(failed)? {
            *words.entry(row.status().to_owned()).or_default() += 1;
        }
    }
    drop(trial);
    experiment.programs.iter().for_each(|program| program.end());
    let found: Vec<String> = words
        .iter()
        .map(|(word, count)| format!("{count} {word}"))
        .collect();
    let text = format!(
        "smoke test on {RECORDS} records of {}: {}",
        study.name,
        found.join(", ")
    );
    if !words.contains_key("ok") {
        return Err(Error::Failed(format!(
            "{text}; expected a model of at least one"
        )));
    }
    note(&text);
    Ok(())
}
