//! The arguments that name a study: an experiment file, and what replaces its keys.

use super::error::{Error, bad_file, bad_input};
use super::output::note;
use crate::study::file::{ExperimentFile, FileError, Needs, Store, TRIAL_LIMIT, TrialRule};
use crate::study::{Engine, Experiment, read_announced, read_manifest, same_trials, stored_designs};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

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
    pub(super) trials: Option<u64>,
    /// Set a key, such as eta=5 or methods.0.solver=lu; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) set: Vec<String>,
    /// The file's quick variant, of a minute or less
    #[arg(long)]
    pub(super) quick: bool,
    /// Seed instead of the file's; for results of another seed give another --out
    #[arg(long, value_name = "SEED")]
    pub(super) seed: Option<u64>,
    /// Only these methods (or observers) of the file, by label or estimator, such as oe; claims and
    /// comparisons that need others are left out. Several are separated by commas
    #[arg(long = "method", aliases = ["methods", "estimator"], value_name = "NAME")]
    pub(super) method: Vec<String>,
    /// The results that are kept, instead of the file's choice: summaries, or trials too
    #[arg(long, value_name = "WHAT")]
    pub(super) store: Option<Store>,
    /// Engine instead of the file's: auto, lanes or faer
    #[arg(long, value_name = "ENGINE")]
    pub(super) engine: Option<Engine>,
}

impl StudyArguments {
    /// Returns the study and its rule for the number of trials. Editing a claim requires no new run in `folder`.
    pub(super) fn experiment(&self, folder: &Path) -> Result<(Experiment, TrialRule), Error> {
        self.of_file(self.read()?, folder)
    }

    /// Reads the file and applies the arguments to it.
    pub(super) fn read(&self) -> Result<ExperimentFile, Error> {
        let in_file = bad_file(&self.file);
        let mut file = ExperimentFile::read(&self.file).map_err(bad_input)?;
        file.check_filters().map_err(&in_file)?;
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
        file.seed = self.seed.unwrap_or(file.seed);
        file.store = self.store.unwrap_or(file.store);
        if !self.method.is_empty() {
            let (chosen, left_out) = file
                .only(&self.method)
                .map_err(|e| Error::Input(format!("--method {e}")))?;
            file = chosen;
            if !left_out.is_empty() {
                note(&format!(
                    "--method: left out because they need other methods: {}",
                    left_out.join("; ")
                ));
            }
        }
        file.engine = self.engine.unwrap_or(file.engine);
        if let Some(trials) = self.trials {
            file.trials = TrialRule::Fixed(trials);
        }
        Ok(file)
    }

    /// Returns the study of a file that [`Self::read`] returned.
    pub(super) fn of_file(&self, file: ExperimentFile, folder: &Path) -> Result<(Experiment, TrialRule), Error> {
        let in_file = bad_file(&self.file);
        let rule = file.trials.clone();
        let there = as_stored(&file, folder);
        let experiment = there.map_or_else(|| Experiment::new(file).map_err(in_file), Ok)?;
        Ok((experiment, rule))
    }

    /// Returns the folder of the results: the given one, or results/NAME, with --quick results/NAME-quick.
    pub(super) fn folder(&self, out: Option<&Path>) -> PathBuf {
        let mut name = self.name();
        name.push(if self.quick { "-quick" } else { "" });
        out.map_or_else(|| Path::new("results").join(name), Path::to_owned)
    }

    /// Returns the file's name without folder and extension.
    pub(super) fn name(&self) -> OsString {
        self.file.file_stem().unwrap_or_default().to_owned()
    }
}

/// Returns the study with the needs of its claims as they were when the results in a folder were begun, or those that
/// are to replace others there, if these are results of it. Editing a claim then requires no new run.
fn as_stored(file: &ExperimentFile, folder: &Path) -> Option<Experiment> {
    stored_designs(folder).into_iter().find_map(|stored| {
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
    })
}

/// Marks the claims that did not exist when the results in a folder were made, or when those of a run that has not
/// ended were looked at. Results of another study are none of these trials.
pub(super) fn mark_added(file: &mut ExperimentFile, folder: &Path) {
    let seen = || {
        let announced = read_announced(folder).ok().flatten();
        announced.filter(|manifest| manifest["seen"] == true)
    };
    let manifest = read_manifest(folder).ok().flatten().or_else(seen);
    let stored = manifest.and_then(|manifest| ExperimentFile::from_json(&manifest["experiment"]).ok());
    let Some(stored) = stored.filter(|stored| same_trials(stored, file)) else {
        return;
    };
    for claim in &mut file.claims {
        let known = stored.claims.iter().find(|known| known.judges_as(claim));
        claim.added_after_run = known.is_none_or(|known| known.added_after_run);
    }
}
