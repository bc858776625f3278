//! `asobench run`: runs a study from an experiment file in a folder, where it can be resumed.

use super::confirm::Confirmation;
use super::error::{Error, bad_input};
use super::execute::{Executed, Overwrite, execute, results, threads};
use super::files::cannot_write;
use super::output::{note, print_with_verdicts};
use super::programs::{self, Consent};
use super::study_arguments::{StudyArguments, mark_added};
use super::{memory, need, timing};
use crate::study::file::{ExperimentFile, TrialRule};
use crate::study::{Experiment, RunOptions};
use crate::text::{alike, visible};
use std::iter;
use std::path::{Path, PathBuf};

/// Run an experiment file. A run that was stopped or killed resumes with the same command; more
/// trials (--trials) extend it.
#[derive(clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    /// Further experiment files, run one after the other
    #[arg(value_name = "FILE")]
    more: Vec<PathBuf>,
    /// Folder of the results [default: results/NAME of NAME.toml]
    #[arg(long, alias = "output", short_alias = 'o', value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    confirmation: Confirmation,
    /// Threads [default: one per processor]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Trials in a block; blocks are computed and stored whole [default: half a second of work]
    #[arg(long, value_name = "B", value_parser = clap::value_parser!(u64).range(1..))]
    block: Option<u64>,
    /// Compute damaged block files again
    #[arg(long)]
    repair: bool,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    consent: Consent,
    /// Run it even if `check` expects too little memory or disk
    #[arg(long)]
    anyway: bool,
    /// Print the sentence of every claim, even where these fill more than a screen
    #[arg(long)]
    every_claim: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let study = &arguments.study;
    if arguments.more.is_empty() {
        return run_one(arguments, Prepared::read(arguments, study)?);
    }
    if arguments.out.is_some() {
        return Err(bad_input(
            "--out: one folder for several files; expected a single experiment file with it",
        ));
    }
    let more = arguments.more.iter().map(|file| StudyArguments {
        file: file.clone(),
        ..study.clone()
    });
    let studies: Vec<StudyArguments> = iter::once(study.clone()).chain(more).collect();
    let read = studies.iter().map(|study| Prepared::read(arguments, study));
    let mut prepared: Vec<Prepared<'_>> = read.collect::<Result<_, Error>>()?;
    #[allow(clippy::unnecessary_debug_formatting)] // Lossy names of two paths may be the same.
    let name = |path: &Path| path.to_str().map_or_else(|| format!("{path:?}"), str::to_owned);
    let names: Vec<String> = prepared.iter().map(|prepared| name(&prepared.path)).collect();
    if let Some([folder, _]) = alike(names.iter().map(String::as_str)) {
        return Err(Error::Input(format!(
            "two of these files would write to {folder}; expected different names"
        )));
    }
    // All files are checked before the first one runs.
    for of in &mut prepared {
        of.made = Some(of.study.of_file(of.file.clone(), &of.path)?);
    }
    for prepared in prepared {
        note(&format!("{}:", prepared.study.file.display()));
        run_one(arguments, prepared)?;
    }
    Ok(())
}

/// A file that was read, with the folder of its results.
struct Prepared<'a> {
    study: &'a StudyArguments,
    file: ExperimentFile,
    path: PathBuf,
    /// The study, if it was made.
    made: Option<(Experiment, TrialRule)>,
}

impl<'a> Prepared<'a> {
    fn read(arguments: &Arguments, study: &'a StudyArguments) -> Result<Self, Error> {
        if arguments.out.is_none() && study.name() == "-" {
            return Err(bad_input(
                "--out: expected a folder, because the experiment comes from standard input",
            ));
        }
        let confirmation = &arguments.confirmation;
        let sets_seed = |set: &String| set.split('=').next().is_some_and(|key| key.trim() == "seed");
        if confirmation.is_asked() && (study.seed.is_some() || study.set.iter().any(sets_seed)) {
            let seed = if study.seed.is_some() { "--seed" } else { "--set seed" };
            return Err(Error::Input(format!(
                "{seed}: --confirm sets the seed; expected --confirm SEED alone"
            )));
        }
        let file = confirmation.of(study.read()?, &study.file)?;
        Ok(Self {
            path: confirmation.folder(study, &file, arguments.out.as_deref()),
            study,
            file,
            made: None,
        })
    }
}

/// Runs one of the files.
fn run_one(arguments: &Arguments, prepared: Prepared<'_>) -> Result<(), Error> {
    let Prepared {
        study,
        file,
        path,
        made,
    } = prepared;
    arguments.overwrite.check(&path)?;
    let (file, introduced) = programs::introduced(file, &study.file, &arguments.consent)?;
    // The words of programs on themselves are a part of the study.
    let made = made.filter(|_| introduced.is_none());
    let (mut experiment, rule) = made.map_or_else(|| study.of_file(file, &path), Ok)?;
    programs::take_over(&experiment, introduced.as_ref());
    if !arguments.overwrite.overwrite {
        programs::same_versions(&experiment, &path)?;
    }
    mark_added(&mut experiment.file, &path);
    let options = RunOptions {
        threads: threads(arguments.threads),
        block: arguments.block,
        repair: arguments.repair,
        overwrite: arguments.overwrite.overwrite,
        // A part of the file's methods is no reason to remove the others.
        same_methods: !study.method.is_empty(),
        ..RunOptions::default()
    };
    memory::fits(&experiment, 0..experiment.cells.len(), options.threads)?;
    need::ask(&experiment, &rule, options.threads, &path, arguments.anyway)?;
    if experiment.file.timing {
        timing::check(&path).map_err(|e| cannot_write(&e))?;
    }
    let executed = execute(&path, &experiment, rule, options, |_| Vec::new());
    programs::conclude(&experiment, &path);
    let Executed { summary, stop, speed } = executed?;
    match speed {
        Some(speed) => note(&speed),
        None => nothing_computed(&experiment, &path),
    }
    if experiment.file.timing && timing::are_there(&experiment, &path).map_err(|e| cannot_write(&e))? {
        note(&format!(
            "times are there already; without {} they are measured again",
            path.join("timing").display()
        ));
    } else if experiment.file.timing {
        note("measuring times, one thread");
        for program in &experiment.programs {
            let name = visible(&program.name);
            note(&format!(
                "{name} is a program, and not timed here; asobench test-method times it"
            ));
        }
        timing::measure(&experiment, &path, &stop)?;
    }
    let (text, verdicts) = results(&path, &experiment.file, &summary, arguments.every_claim)?;
    print_with_verdicts(&text, &verdicts)
}

/// Says that all trials were there. A program that was edited is not seen unless it says another version.
fn nothing_computed(experiment: &Experiment, path: &Path) {
    let advice = match &experiment.programs[..] {
        [] => "",
        _ => "; if a program has changed since, give it another \"version\", or choose another --out",
    };
    let path = path.display();
    note(&format!("nothing to compute: all trials are in {path}{advice}"));
}
