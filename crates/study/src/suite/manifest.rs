//! `suite/suite.toml`: which systems, settings and sizes, in which tier; and the files that the program carries.

use crate::design::file::{Axis, Key};
use asobench_identification::names::{UnknownName, named_enum};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

include!(concat!(env!("OUT_DIR"), "/suite_files.rs"));

named_enum! {
    /// How much of the suite is run; each tier contains those before it.
    Tier, "tier" {
        /// A minute: what continuous integration runs (the default).
        Quick = "quick",
        /// A quarter of an hour on two cores.
        Standard = "standard",
        /// An evening, or a cluster.
        Full = "full",
    }
}

named_enum! {
    /// What methods are told.
    Division, "division" {
        /// The orders of the truth (the default).
        Closed = "closed",
        /// The delay and a largest order: methods choose.
        Open = "open",
    }
}

impl Division {
    /// Whether it is the closed one.
    #[expect(
        clippy::trivially_copy_pass_by_ref,
        reason = "serde asks with a reference"
    )]
    pub(super) fn is_closed(&self) -> bool {
        *self == Self::Closed
    }
}

impl Tier {
    /// Whether a run of this tier has what belongs to another.
    pub fn contains(self, other: Self) -> bool {
        let place = |tier: Self| Self::ALL.iter().position(|of| *of == tier);
        place(other) <= place(self)
    }
}

/// The manifest.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// The edition that was asked for, the newest if none was.
    #[serde(skip)]
    pub edition: String,
    /// All editions, the first one first. Each has the scenarios of those before it.
    pub editions: Vec<String>,
    /// The seed of all records.
    pub seed: u64,
    /// Trials of a scenario in each tier. The trials of a smaller tier are the first of a larger one.
    pub trials: BTreeMap<Tier, u64>,
    /// The studies.
    pub studies: Vec<StudyEntry>,
}

/// A system with its settings: an experiment with one scenario for each N.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyEntry {
    /// The system, a file of `suite/`.
    pub system: String,
    /// The part of its scenarios' names after the system's.
    pub variant: String,
    /// The smallest tier that has it.
    pub tier: Tier,
    /// The first edition that has it; the first of all if absent.
    #[serde(default)]
    pub since: Option<String>,
    /// The sizes N.
    pub window: Vec<usize>,
    /// Its difficulties, in the suite's words; colour, loop, delay and short records are added.
    #[serde(default)]
    pub hard: Vec<String>,
    /// Whether the system is one in continuous time, sampled behind a zero-order hold.
    #[serde(default)]
    pub sampled: bool,
    /// Its settings, besides those of the system's file.
    pub settings: BTreeMap<Key, Axis>,
}

/// The quantiles of d that are compared with those of the bound: a typical run and the worst decile.
pub const VALUES: [f64; 2] = [0.5, 0.9];

impl Manifest {
    /// Reads the manifest that the program carries.
    ///
    /// # Errors
    /// A fault in the manifest.
    pub fn read() -> Result<Self, String> {
        let read = toml::from_str(MANIFEST).map_err(|error| format!("suite/suite.toml: {error}"));
        let mut manifest: Self = read?;
        manifest.edition = manifest.editions.last().cloned().unwrap_or_default();
        Ok(manifest)
    }

    /// The place of an edition among all; `None` if there is no such one.
    pub(super) fn place_of(&self, edition: &str) -> Option<usize> {
        self.editions.iter().position(|of| of == edition)
    }

    /// Takes the manifest as it is in an edition. Later editions stay known, since their results serve an earlier one.
    ///
    /// # Errors
    /// If there is no such edition.
    pub fn of_edition(mut self, edition: &str) -> Result<Self, UnknownName> {
        let Some(place) = self.place_of(edition) else {
            return Err(UnknownName::new("edition", edition, &self.editions));
        };
        let mut studies = std::mem::take(&mut self.studies);
        studies.retain(|of| {
            let since = of.since.as_deref().map(|since| self.place_of(since));
            since.is_none_or(|since| since.is_some_and(|since| since <= place))
        });
        edition.clone_into(&mut self.edition);
        Ok(Self { studies, ..self })
    }

    /// Returns the number of trials of a scenario in a tier.
    pub fn trials_of(&self, tier: Tier) -> u64 {
        self.trials.get(&tier).copied().unwrap_or(0)
    }
}

/// The published tables.
pub(super) fn published() -> &'static str {
    PUBLISHED
}

/// The list of recorded data.
pub(super) fn records() -> &'static str {
    RECORDS
}

/// The shipped FIT of recorded data; empty without any.
pub(super) fn recorded() -> &'static str {
    RECORDED
}

/// The shipped times; empty without any.
pub(super) fn times() -> &'static str {
    TIMES
}

/// Returns the text of a system's file.
pub(super) fn system(name: &str) -> Option<&'static str> {
    let found = SYSTEMS.iter().find(|(of, _)| *of == name);
    found.map(|(_, text)| *text)
}

/// The names of the systems.
pub(super) fn systems() -> impl Iterator<Item = &'static str> {
    SYSTEMS.iter().map(|(name, _)| *name)
}

/// The shipped results of a division, one text for each method.
pub(super) fn results(division: Division) -> impl Iterator<Item = &'static str> {
    let all = match division {
        Division::Closed => RESULTS,
        Division::Open => OPEN_RESULTS,
    };
    all.iter().map(|(_, text)| *text)
}
