//! The arguments that the commands of the suite share.

use crate::cli::error::Error;
use crate::cli::execute::Overwrite;
use crate::cli::files::cannot_write;
use crate::cli::programs::Consent;
use crate::files::{self, Kind};
use crate::names::UnknownName;
use crate::suite::{Competitor, Division, Suite, SuiteError, Tier};
use std::path::{Path, PathBuf};

/// The file with the times of a run's folder.
pub(super) const TIMES: &str = "times.json";

/// A part of the suite.
#[derive(Clone, clap::Args)]
pub(super) struct Part {
    /// How much of it: quick (a minute), standard (an hour on two cores) or full
    #[arg(long, value_name = "TIER", default_value_t)]
    pub(super) tier: Tier,
    /// Knowledge of the methods: orders (na, nb, nk), structure (which polynomials), or open (nothing but the record);
    /// of editions 1 closed or open [default: orders, of editions 1 closed]
    #[arg(long = "contest", alias = "division", value_name = "CONTEST")]
    pub(super) division: Option<Division>,
    /// Edition of the suite, such as 1.0 [default: the current one, 2.0]
    #[arg(long, value_name = "E")]
    pub(super) edition: Option<String>,
    /// Only this system, study or scenario, such as P07 or P07-ar-500; may be repeated
    #[arg(long, value_name = "NAME", value_parser = system)]
    pub(super) only: Vec<String>,
    /// Only the first R trials of each scenario, such as those of the shipped results
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u64).range(1..))]
    pub(super) first: Option<u64>,
}

/// A name of the suite; the number of a system may stand alone or without its zero: 1, P1 and p01 are P01.
#[expect(clippy::unnecessary_wraps, reason = "clap asks for a result of a parser")]
fn system(given: &str) -> Result<String, std::convert::Infallible> {
    let number = given.strip_prefix(['P', 'p']).unwrap_or(given);
    let digits = number.len() <= 2 && number.bytes().all(|byte| byte.is_ascii_digit());
    let number = number.parse::<u8>().ok().filter(|_| digits);
    Ok(number.map_or_else(|| given.to_owned(), |number| format!("P{number:02}")))
}

impl Part {
    /// Makes this part of the suite.
    pub(super) fn suite(&self) -> Result<Suite, Error> {
        let mut suite = Suite::of(self.edition.as_deref(), self.division, self.tier, &self.only)?;
        suite.first = self.first;
        Ok(suite)
    }

    /// Returns the flags that choose it.
    pub(super) fn flags(&self) -> String {
        let mut flags = vec![format!("--tier {}", self.tier)];
        flags.extend(self.division.map(|of| format!("--contest {of}")));
        flags.extend(self.edition.iter().map(|edition| format!("--edition {edition}")));
        flags.extend(self.only.iter().map(|name| format!("--only {name}")));
        flags.extend(self.first.map(|first| format!("--first {first}")));
        flags.join(" ")
    }

    /// Returns the default folder of results.
    pub(super) fn folder(&self) -> String {
        let division = self.division.map(|of| of.to_string());
        let parts = [division, self.edition.clone(), Some(self.tier.to_string())];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        format!("results/suite-{}", parts.join("-"))
    }
}

/// How it is computed.
#[derive(Clone, clap::Args)]
pub(super) struct How {
    /// Folder of the results [default: results/suite-TIER, results/suite-open-TIER, of a newcomer with -NAME]
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Threads [default: one per processor]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
    #[command(flatten)]
    pub(super) overwrite: Overwrite,
    #[command(flatten)]
    pub(super) consent: Consent,
}

impl From<SuiteError> for Error {
    fn from(error: SuiteError) -> Self {
        Self::Input(format!("suite: {error}"))
    }
}

/// Writes a file into a folder, which is made if it is not there.
pub(super) fn write(folder: &Path, name: &str, text: &str) -> Result<(), Error> {
    files::make_folder(folder).map_err(|error| cannot_write(&error))?;
    let written = files::replace(&folder.join(name), Kind::Suite, text.as_bytes());
    written.map_err(|error| cannot_write(&error))
}

/// The competitors of a division with these names, all without names.
pub(super) fn competitors(division: Division, names: &[String]) -> Result<Vec<Competitor>, Error> {
    let all = Competitor::of(division);
    if names.is_empty() {
        return Ok(all);
    }
    let known: Vec<String> = all.iter().map(Competitor::name).collect();
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    for name in names {
        if name.contains(['/', '.']) {
            return Err(Error::Input(format!(
                "--method {name}: expected a name of asobench methods; a program is a file with [[methods]], a name \
                 and command = [\"python3\", \"my.py\"]: asobench suite FILE.toml"
            )));
        }
        if !known.contains(&name.as_str()) {
            let error = UnknownName::new("method", name, &known);
            return Err(Error::Input(format!("--method: {error}")));
        }
    }
    let chosen = all.into_iter().filter(|of| names.contains(&of.name()));
    Ok(chosen.collect())
}
