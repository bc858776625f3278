//! `run --confirm`: judges the claims of a file by trials that nobody has seen when the claims were written.

use super::error::{Error, bad_file};
use super::study_arguments::StudyArguments;
use crate::names::UnknownName;
use crate::study::file::ExperimentFile;
use std::path::{Path, PathBuf};

/// The step from the file's seed to that of fresh trials, if none is given.
const STEP: u64 = 1_000_000_000;

/// Whether claims are confirmed, and which.
#[derive(clap::Args)]
pub(super) struct Confirmation {
    /// Judge the claims by fresh trials: those of another seed, in a folder of their own [default: the file's seed plus
    /// 1000000000; results/NAME-confirm-SEED]
    #[expect(clippy::option_option, reason = "absent, without a seed, or with one")]
    #[arg(long, value_name = "SEED", num_args = 0..=1, allow_negative_numbers = true)]
    confirm: Option<Option<u64>>,
    /// With --confirm: the claims that are judged, by their ids [default: all]
    #[arg(long, value_name = "ID,ID", value_delimiter = ',', requires = "confirm")]
    claims: Vec<String>,
}

impl Confirmation {
    /// Whether claims are confirmed.
    pub(super) fn is_asked(&self) -> bool {
        self.confirm.is_some()
    }

    /// Returns the file with the seed of the confirmation and its claims; the file itself if nothing is confirmed.
    pub(super) fn of(&self, file: ExperimentFile, path: &Path) -> Result<ExperimentFile, Error> {
        let Some(asked) = self.confirm else {
            return Ok(file);
        };
        let derived = file.seed.wrapping_add(STEP);
        let seed = asked.unwrap_or(derived);
        let wrong = bad_file(path);
        if seed == file.seed || Some(seed) == file.confirms {
            return Err(wrong(format!(
                "--confirm {seed}: the file's own trials; expected another seed, such as {derived}"
            )));
        }
        let mut confirming = ExperimentFile {
            seed,
            confirms: Some(file.seed),
            ..file
        };
        let ids = confirming.claims.iter().filter(|claim| !claim.test.is_empty());
        let ids: Vec<&str> = ids.map(|claim| claim.id.as_str()).collect();
        if ids.is_empty() {
            return Err(wrong("--confirm: the file has no claim with a test".to_owned()));
        }
        if let Some(unknown) = self.claims.iter().find(|id| !ids.contains(&id.as_str())) {
            let unknown = UnknownName::new("claim", unknown, &ids);
            return Err(wrong(format!("--claims: {unknown}")));
        }
        if !self.claims.is_empty() {
            confirming.claims.retain(|claim| self.claims.contains(&claim.id));
        }
        Ok(confirming)
    }

    /// Returns the folder of the results: the given one, or that of the study, with the seed if it is a confirmation.
    pub(super) fn folder(&self, study: &StudyArguments, file: &ExperimentFile, out: Option<&Path>) -> PathBuf {
        if !self.is_asked() || out.is_some() {
            return study.folder(out);
        }
        let mut folder = study.folder(None).into_os_string();
        folder.push(format!("-confirm-{}", file.seed));
        folder.into()
    }
}
