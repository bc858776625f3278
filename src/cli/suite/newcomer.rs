//! `asobench suite FILE`: a method of a user's file on the records of the suite, beside the methods whose results the
//! program carries.

use super::page;
use super::part::{How, Part};
use super::run::compute;
use crate::cli::cluster::word;
use crate::cli::error::{Error, bad_file, bad_input, failed};
use crate::cli::output::note;
use crate::cli::programs::{self, Consent};
use crate::report::{SuitePage, about_loss};
use crate::study::file::{ExperimentFile, MethodTable};
use crate::study::{Experiment, Trial};
use crate::suite::{Competitor, Suite, SuiteStudy, shipped};
use crate::text::{file_part, visible};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The word for a run that left a model.
const OK: &str = "ok";
/// Faults of a program, and so many of them end the smoke test if nothing else has come.
const FAULTS: [&str; 3] = ["crashed", "malformed", "timeout"];
const MOST_FAULTS: usize = 2;
/// Studies that are named for a reason.
const SHOWN: usize = 4;

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

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let Arguments { file, part, how } = arguments;
    let Some(path) = file else {
        return Err(Error::Input(
            "expected an experiment file, or run, list, show, scores, published, times, recorded, export, add"
                .to_owned(),
        ));
    };
    let suite = part.suite()?;
    let competitor = Competitor::Own(Box::new(method(path)?));
    let name = competitor.name();
    let mut methods = shipped(&suite)?;
    if methods.iter().any(|of| of.method == name) {
        return Err(bad_file(path)(format!(
            "'{}' is the name of a method of the suite; expected another 'name'",
            visible(&name)
        )));
    }
    smoke(&suite, &competitor, path, &how.consent)?;
    let default = || PathBuf::from(format!("{}-{}", part.folder(), file_part(&name)));
    let out = how.out.clone().unwrap_or_else(default);
    let found = compute(&suite, &[competitor], (how, Some(path)), &out)?;
    methods.splice(0..0, found);
    let command = format!(
        "asobench suite {} {}{} --out {}",
        word(path),
        part.flags(),
        how.consent.flags(),
        word(&out)
    );
    let of = SuitePage {
        newcomer: Some(&name),
        ..SuitePage::new(&suite, &methods, &command)
    };
    page::conclude(of, part, &out)
}

/// The one method of a file.
pub(super) fn method(path: &Path) -> Result<MethodTable, Error> {
    if let Some(lines) = of_program(path) {
        return Err(Error::Usage(lines));
    }
    let file = ExperimentFile::read(path).map_err(bad_input)?;
    let file = file.resolve().map_err(bad_file(path))?;
    match &file.methods[..] {
        [method] => Ok(method.clone()),
        all => Err(bad_file(path)(format!(
            "methods: {}; expected one, the newcomer",
            all.len()
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
    let (_, interpreter) = INTERPRETERS.iter().find(|(of, _)| of.eq_ignore_ascii_case(form))?;
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

/// Runs the method on the first record of each study, a record in a message. One at least must leave a model; two
/// faults of a program without one end the test.
fn smoke(suite: &Suite, competitor: &Competitor, path: &Path, consent: &Consent) -> Result<(), Error> {
    let mut found: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    let mut at_work: Option<Experiment> = None;
    for study in &suite.studies {
        if !study.is_for(competitor) {
            continue;
        }
        let word = match study.experiment(std::slice::from_ref(competitor), 1)? {
            (None, declined) => declined
                .first()
                .map_or("declined".to_owned(), |(_, reason)| reason.clone()),
            (Some(experiment), _) => {
                let experiment = match &at_work {
                    None => programs::started(experiment, path, consent)?,
                    Some(before) => {
                        programs::take_over(&experiment, Some(before));
                        experiment
                    }
                };
                let word = first_record(study, &experiment)?;
                at_work = Some(experiment);
                word
            }
        };
        found.entry(word).or_default().push(&study.name);
        let faults = FAULTS.iter().filter_map(|word| found.get(*word));
        if !found.contains_key(OK) && faults.map(Vec::len).sum::<usize>() >= MOST_FAULTS {
            break;
        }
    }
    let count: usize = found.values().map(Vec::len).sum();
    let text = format!(
        "smoke test, the first record of {count} of {} studies: {}",
        suite.studies.len(),
        told(&found)
    );
    let is_faulty = FAULTS.iter().any(|word| found.contains_key(*word));
    for program in at_work.iter().flat_map(|of| &of.programs) {
        program.end();
        if is_faulty {
            for line in programs::printed(program, 0) {
                note(&line);
            }
        }
    }
    if !found.contains_key(OK) {
        return Err(Error::Failed(format!(
            "{}: {text}; expected a model of one at least",
            visible(path.display())
        )));
    }
    note(&text);
    Ok(())
}

/// Why the first record of a study is lost, or [`OK`].
fn first_record(study: &SuiteStudy, experiment: &Experiment) -> Result<String, Error> {
    let mut trial = Trial::new(experiment, &experiment.cells[0]).map_err(failed)?;
    let rows = trial.run(0).map_err(failed)?;
    let last = rows.last().and_then(|row| study.why_lost(row));
    Ok(last.unwrap_or(OK).to_owned())
}

/// The reasons with the studies, all but a few of them.
fn told(found: &BTreeMap<String, Vec<&str>>) -> String {
    let each = found.iter().map(|(word, studies)| {
        let count = studies.len();
        if word == OK {
            return format!("{count} ok");
        }
        let more = if count > SHOWN { ", ..." } else { "" };
        let names = studies[..count.min(SHOWN)].join(", ");
        let about = about_loss(word).map_or_else(String::new, |about| format!(": {about}"));
        format!("{count} {word} ({names}{more}{about})")
    });
    each.collect::<Vec<_>>().join(", ")
}
