//! `asobench run`: runs a study from an experiment file in a folder, where it can be resumed.

use super::confirm::Confirmation;
use super::error::{Error, failed};
use super::files::cannot_write;
use super::programs::{self, Consent};
use super::{memory, need, note, print_with_verdicts, progress, timing};
use crate::claim;
use crate::files;
use crate::report::{Study, terminal};
use crate::study::file::{ExperimentFile, FileError, Needs, TRIAL_LIMIT, TrialRule};
use crate::study::{
    BlockError, Campaign, CampaignError, Engine, Event, Experiment, FolderError, RunError,
    RunOptions, Summary, read_manifest, stored_design,
};
use crate::text::{alike, visible, wrap};
use std::collections::BTreeMap;
use std::iter;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Columns in a line.
const WIDTH: usize = 80;

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
    #[arg(long, value_name = "DIR")]
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
    consent: Consent,
    /// Run it even if `check` expects too little memory or disk
    #[arg(long)]
    anyway: bool,
}

/// Which study.
#[derive(Clone, clap::Args)]
pub(super) struct StudyArguments {
    /// Experiment file, such as experiments/window.toml, or - for standard input
    pub(super) file: PathBuf,
    /// Trials in each cell instead of the file's
    #[arg(
        long, value_name = "M", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u64).range(1..=TRIAL_LIMIT)
    )]
    trials: Option<u64>,
    /// Set a key, such as eta=5 or methods.0.solver=lu; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The file's quick variant, of a minute or less
    #[arg(long)]
    quick: bool,
    /// Engine instead of the file's: auto, lanes or faer
    #[arg(long, value_name = "ENGINE")]
    engine: Option<Engine>,
}

impl StudyArguments {
    /// Returns the study and its rule for the number of trials. Editing a claim requires no new run in `folder`.
    pub(super) fn experiment(&self, folder: &Path) -> Result<(Experiment, TrialRule), Error> {
        self.of_file(self.read()?, folder)
    }

    /// Reads the file and applies the arguments to it.
    pub(super) fn read(&self) -> Result<ExperimentFile, Error> {
        let input = |error: &dyn std::fmt::Display| Error::Input(error.to_string());
        let in_file = |error: FileError| Error::Input(format!("{}: {error}", self.file.display()));
        let mut file = ExperimentFile::read(&self.file).map_err(|e| input(&e))?;
        file.check_filters().map_err(in_file)?;
        if self.quick {
            if file.quick.is_none() {
                let message = "the file has no such table, but --quick needs it; expected [quick] with trials";
                return Err(in_file(FileError::key("quick", message)));
            }
            file = file.quick();
        }
        for assignment in &self.set {
            file = file
                .set(assignment)
                .and_then(|file| file.with_samples(&self.file))
                .map_err(|e| Error::Input(format!("--set {e}")))?;
        }
        if let Some(engine) = self.engine {
            file.engine = engine;
        }
        if let Some(trials) = self.trials {
            file.trials = TrialRule::Fixed(trials);
        }
        Ok(file)
    }

    /// Returns the study of a file that [`Self::read`] returned.
    pub(super) fn of_file(
        &self,
        file: ExperimentFile,
        folder: &Path,
    ) -> Result<(Experiment, TrialRule), Error> {
        let in_file = |error: FileError| Error::Input(format!("{}: {error}", self.file.display()));
        let rule = file.trials.clone();
        let there = as_stored(&file, folder);
        let experiment = there.map_or_else(|| Experiment::new(file).map_err(in_file), Ok)?;
        Ok((experiment, rule))
    }

    /// Returns the folder of the results: the given one, or results/NAME, with --quick results/NAME-quick.
    pub(super) fn folder(&self, out: Option<&Path>) -> PathBuf {
        let quick = if self.quick { "-quick" } else { "" };
        let default = || Path::new("results").join(format!("{}{quick}", self.name()));
        out.map_or_else(default, Path::to_owned)
    }

    /// Returns the file's name without folder and extension.
    pub(super) fn name(&self) -> String {
        let stem = self.file.file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    }
}

/// Returns the study with the needs of its claims as they were when the results in a folder were begun, if these are
/// results of it. Editing a claim then requires no new run.
fn as_stored(file: &ExperimentFile, folder: &Path) -> Option<Experiment> {
    let stored = stored_design(folder)?;
    let needed = match stored.get("needed") {
        Some(needed) => serde_json::from_value(needed.clone()).ok()?,
        None => Needs::default(),
    };
    let file = ExperimentFile {
        needed: Some(needed),
        ..file.clone()
    };
    let experiment = Experiment::new(file).ok()?;
    (experiment.design() == stored).then_some(experiment)
}

/// Marks the claims that did not exist when the results in a folder were made.
pub(super) fn mark_added(file: &mut ExperimentFile, folder: &Path) {
    let manifest = read_manifest(folder).ok().flatten();
    let stored =
        manifest.and_then(|manifest| ExperimentFile::from_json(&manifest["experiment"]).ok());
    let Some(stored) = stored else { return };
    for claim in &mut file.claims {
        let known = stored.claims.iter().find(|known| known.judges_as(claim));
        claim.added_after_run = known.is_none_or(|known| known.added_after_run);
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let study = &arguments.study;
    if arguments.more.is_empty() {
        return run_one(arguments, study);
    }
    if arguments.out.is_some() {
        let message =
            "--out: one folder for several files; expected a single experiment file with it";
        return Err(Error::Input(message.to_owned()));
    }
    let more = arguments.more.iter().map(|file| StudyArguments {
        file: file.clone(),
        ..study.clone()
    });
    let studies: Vec<StudyArguments> = iter::once(study.clone()).chain(more).collect();
    let files: Result<Vec<ExperimentFile>, Error> =
        studies.iter().map(|study| file(arguments, study)).collect();
    let files = files?;
    let folder = |(study, file)| arguments.confirmation.folder(study, file, None);
    let folders: Vec<PathBuf> = studies.iter().zip(&files).map(folder).collect();
    let names: Vec<String> = folders
        .iter()
        .map(|folder| folder.display().to_string())
        .collect();
    if let Some([folder, _]) = alike(names.iter().map(String::as_str)) {
        let message =
            format!("two of these files would write to {folder}; expected different names");
        return Err(Error::Input(message));
    }
    // All files are checked before the first one runs.
    for ((study, folder), file) in studies.iter().zip(&folders).zip(files) {
        study.of_file(file, folder)?;
    }
    for study in &studies {
        note(&format!("{}:", study.file.display()));
        run_one(arguments, study)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns one of the files, with another seed if its claims are confirmed.
fn file(arguments: &Arguments, study: &StudyArguments) -> Result<ExperimentFile, Error> {
    let sets_seed = |set: &String| {
        set.split('=')
            .next()
            .is_some_and(|key| key.trim() == "seed")
    };
    if arguments.confirmation.is_asked() && study.set.iter().any(sets_seed) {
        let message = "--set seed: --confirm sets the seed; expected --confirm SEED alone";
        return Err(Error::Input(message.to_owned()));
    }
    arguments.confirmation.of(study.read()?, &study.file)
}

/// Runs one of the files.
fn run_one(arguments: &Arguments, study: &StudyArguments) -> Result<ExitCode, Error> {
    if arguments.out.is_none() && study.name() == "-" {
        let message = "--out: expected a folder, because the experiment comes from standard input";
        return Err(Error::Input(message.to_owned()));
    }
    let file = file(arguments, study)?;
    let out = arguments.out.as_deref();
    let path = arguments.confirmation.folder(study, &file, out);
    let (file, introduced) = programs::introduced(file, &study.file, arguments.consent)?;
    let (mut experiment, rule) = study.of_file(file, &path)?;
    programs::take_over(&experiment, introduced.as_ref());
    programs::same_versions(&experiment, &path)?;
    mark_added(&mut experiment.file, &path);
    let options = RunOptions {
        threads: threads(arguments.threads),
        block: arguments.block,
        repair: arguments.repair,
        ..RunOptions::default()
    };
    memory::fits(&experiment, 0..experiment.cells.len(), options.threads)?;
    need::ask(&experiment, &rule, options.threads, &path, arguments.anyway)?;
    if experiment.file.timing {
        timing::check(&path).map_err(|e| cannot_write(&e))?;
    }
    let executed = execute(&path, "--out ", &experiment, rule, options, |_| Vec::new());
    programs::conclude(&experiment, &path);
    let Executed {
        summary,
        stop,
        speed,
    } = executed?;
    match speed {
        Some(speed) => note(&speed),
        None => nothing_computed(&experiment, &path),
    }
    if experiment.file.timing
        && timing::are_there(&experiment, &path).map_err(|e| cannot_write(&e))?
    {
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
    let (text, verdicts) = results(&path, &summary)?;
    print_with_verdicts(&text, &verdicts)?;
    Ok(ExitCode::SUCCESS)
}

/// Says that all trials were there. A program that was edited is not seen unless it says another version.
fn nothing_computed(experiment: &Experiment, path: &Path) {
    let path = path.display();
    if experiment.programs.is_empty() {
        note(&format!("nothing to compute: all trials are in {path}"));
    } else {
        note(&format!(
            "nothing to compute: all trials are in {path}; if a program has changed since, give it another \
             \"version\", or choose another --out"
        ));
    }
}

/// Returns the text on what was computed and its results, and separately the verdicts.
pub(super) fn results(path: &Path, summary: &Summary) -> Result<(String, String), Error> {
    let cells = summary.cells.len();
    let trials: u64 = summary.cells.iter().map(|cell| cell.trials).sum();
    let fallbacks: u64 = summary.cells.iter().map(|cell| cell.fallbacks).sum();
    let fallbacks = match fallbacks {
        0 => String::new(),
        some => format!("solves that needed pivoting (no effect on results): {some}\n"),
    };
    let study = Study::read(path).map_err(failed)?;
    let verdicts = terminal::verdicts(&study);
    let gap = if verdicts.is_empty() { "" } else { "\n" };
    let done = format!("{cells} cells, {trials} trials, {}", failures(summary));
    let text = format!(
        "{}{fallbacks}results in {}\n\n{}{gap}",
        wrap(&done, WIDTH, "  "),
        visible(path.display()),
        terminal::overview(&study)
    );
    Ok((text, verdicts))
}

/// The most kinds of failures of an output in the line of a run.
const KINDS_SHOWN: usize = 10;

/// Returns the number of failed estimates, by output and kind, as text.
fn failures(summary: &Summary) -> String {
    let mut by_output: Vec<(String, BTreeMap<&str, u64>)> = Vec::new();
    for output in summary.cells.iter().flat_map(|cell| &cell.outputs) {
        let label = output.label();
        let at = by_output.iter().position(|(known, _)| *known == label);
        let at = at.unwrap_or_else(|| {
            by_output.push((label, BTreeMap::new()));
            by_output.len() - 1
        });
        for (kind, count) in &output.outcomes.failures {
            *by_output[at].1.entry(kind).or_default() += count;
        }
    }
    let all: u64 = by_output.iter().flat_map(|(_, kinds)| kinds.values()).sum();
    let failed = by_output.iter().filter(|(_, kinds)| !kinds.is_empty());
    let failed = failed.map(|(label, kinds)| {
        let shown = kinds.iter().take(KINDS_SHOWN);
        let mut shown: Vec<String> = shown
            .map(|(kind, count)| format!("{kind} {count}"))
            .collect();
        if let more @ 1.. = kinds.len().saturating_sub(KINDS_SHOWN) {
            let rest: u64 = kinds.values().skip(KINDS_SHOWN).sum();
            shown.push(format!("of {more} other kinds {rest}"));
        }
        format!("{}: {}", visible(label), shown.join(", "))
    });
    let failed = failed.collect::<Vec<_>>().join("; ");
    let gap = if failed.is_empty() { "" } else { ": " };
    format!("{all} estimates failed{gap}{failed}")
}

/// Returns the number of threads.
pub(super) fn threads(asked: Option<u16>) -> usize {
    asked.map_or_else(
        || std::thread::available_parallelism().map_or(1, usize::from),
        usize::from,
    )
}

/// A completed run of a study.
pub(super) struct Executed {
    pub(super) summary: Summary,
    /// The flag that a signal raises, for later work.
    pub(super) stop: Arc<AtomicBool>,
    /// Trials per second and where the time went, if trials were computed.
    pub(super) speed: Option<String>,
}

/// Runs a study in a folder, with a progress bar on a terminal. `figures` are written with the results.
pub(super) fn execute(
    path: &Path,
    flag: &str,
    experiment: &Experiment,
    rule: TrialRule,
    options: RunOptions,
    figures: impl Fn(&Summary) -> Vec<(String, String)>,
) -> Result<Executed, Error> {
    let replaces = options.fresh && files::is_there(&path.join("trials.parquet"));
    let campaign = Campaign::open(path, experiment, rule, options).map_err(|e| refused(flag, e))?;
    if replaces {
        note(&format!("replacing the results in {}", path.display()));
    }
    let stop = progress::stop_flag()?;
    let mut display = progress::Display::new(experiment.cells.len());
    let is_decided = |summary: &Summary, look| claim::decides(&experiment.file, summary, look);
    let outcome = campaign.run(
        &stop,
        |event: Event| display.show(&event),
        is_decided,
        figures,
    );
    display.clear();
    let left = if options.fresh {
        "nothing was written"
    } else {
        "the same command resumes"
    };
    match outcome {
        Ok(summary) => Ok(Executed {
            summary,
            stop,
            speed: display.speed(),
        }),
        Err(CampaignError::Run(RunError::Interrupted { done, total })) => Err(Error::Interrupted(
            format!("interrupted with {done} of {total} trials of this run; {left}"),
        )),
        Err(error @ CampaignError::Stopped) => Err(Error::Interrupted(format!("{error}; {left}"))),
        Err(other) => Err(refused("", other)),
    }
}

/// Returns an input error if the user can correct the cause, otherwise a failure.
pub(super) fn refused(flag: &str, error: CampaignError) -> Error {
    match error {
        CampaignError::Folder(FolderError::File(error))
        | CampaignError::Block(BlockError::File(error))
            if error.foreign || !flag.is_empty() =>
        {
            cannot_write(&error)
        }
        CampaignError::Folder(FolderError::File(_))
        | CampaignError::Block(BlockError::File(_))
        | CampaignError::Store(_)
        | CampaignError::Run(_) => failed(error),
        CampaignError::Block(BlockError::Damaged { .. }) => {
            Error::Input(format!("{flag}{error}; --repair computes it again"))
        }
        _ => Error::Input(format!("{flag}{error}")),
    }
}
